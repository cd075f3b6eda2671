"""The door of a plant with no front end: its operations asked by name, as data."""

from collections.abc import AsyncIterator, Mapping
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, Final

from pydantic import BaseModel, ValidationError
from pydantic_core import from_json, to_jsonable_python

from gateway.access.credentials import Credentials
from gateway.access.errors import NotAuthenticated
from gateway.access.keys import DAY_S, KeyPolicy, KeyStore
from gateway.access.principal import EVERYBODY, Principal, asking
from gateway.config import Config, Server
from gateway.config_file import ConfigFile
from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.journal.opening import open_journal
from gateway.core.leases import LeaseTokens
from gateway.core.operation import Operation, PlainText, Written, adapter_of
from gateway.core.origin import Origin, acting, new_request_id
from gateway.core.rights import Right
from gateway.core.targets import Result
from gateway.door.calls import carry_out, require_right
from gateway.door.documents import expectation
from gateway.door.names import NAMES
from gateway.door.results import told
from gateway.door.table import operations
from gateway.memory import make_sense
from gateway.plant import Plant
from gateway.security.log import Keeping, SecurityLog
from protocols.wording import sentence, unknown

__all__ = ["Config", "Door", "Plant", "Server", "opened", "policy_of"]

CALLER: Final = "door"


class Door:
    """The operations of a plant, for callers with keys; for everybody, where the configuration is open."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._operations = {operation.name: operation for operation in operations()}

    async def call(
        self,
        name: str,
        arguments: Mapping[str, Any] | None = None,
        request: Any = None,
        key: str | None = None,
    ) -> Any:
        """Carry out an operation, and give what it answers, as JSON data.

        `arguments` are those of path and query, `request` is JSON data.

        :raises NotFound: there is no such operation.
        :raises InvalidRequest: an argument or the request is not valid, or HTTP alone serves it.
        :raises GatewayError: as of the operation.
        """
        operation = self._operations.get(name)
        if operation is None:
            raise NotFound(f"There is no operation {name!a} ({unknown(name, self._operations)}).")
        if operation.http_only is not None:
            raise InvalidRequest(f"{name} is served by HTTP alone: {operation.http_only}.")
        who = self._caller(key) if operation.right is not Right.OPEN else EVERYBODY
        with asking(who), acting(Origin(f"{who.name} ({CALLER})", new_request_id())):
            require_right(self._plant, operation, arguments or {})  # before anything is told of the request
            values = _values(operation, arguments or {}, request)
            expects = expectation(values.get(operation.request_name or "")) if operation.expects else None
            return _data(operation, await carry_out(self._plant, operation, values, expects))

    def _caller(self, key: str | None) -> Principal:
        if self._plant.config.access.mode == "open":
            return EVERYBODY
        grant = None if key is None else self._plant.access.credentials.verify(key)
        if grant is None:
            raise NotAuthenticated("The key is not good, or there is none; nothing was sent.")
        return grant.principal


@asynccontextmanager
async def opened(config: Path, data: Path) -> AsyncIterator[Door]:
    """Open the plant of a configuration file, with its journal, names and keys in a data directory.

    The directory is made if there is none.

    :raises ConfigError: the file cannot be read, or is no configuration.
    :raises InUse, TooNew: the journal belongs to another gateway.
    """
    plant = _built(config, data)
    await plant.start()
    try:
        yield Door(plant)
    finally:
        await plant.close()


def _built(config: Path, data: Path) -> Plant:
    file = ConfigFile(config)
    wanted = file.load()
    data.mkdir(mode=0o700, parents=True, exist_ok=True)
    security = SecurityLog(data, Keeping(wanted.security.keep_days, wanted.security.refusals_per_minute))
    plant = Plant(
        wanted,
        file=file,
        journal=open_journal(data, make_sense),
        lease_tokens=LeaseTokens(data),
        security=security,
    )
    plant.names.keep_in(data)
    if wanted.access.mode == "keys":
        store = KeyStore(data)
        store.adopt(policy_of(wanted))
        plant.access.credentials = Credentials(store)
    return plant


def policy_of(config: Config) -> KeyPolicy:
    """Rules for keys: their lifetime, and the approval that they take."""
    access = config.access
    return KeyPolicy(
        lifetime_s=access.key_lifetime_d * DAY_S or None,
        warning_s=access.key_warning_d * DAY_S,
        four_eyes=access.four_eyes,
    )


def _values(operation: Operation, arguments: Mapping[str, Any], request: Any) -> dict[str, Any]:
    """Read what an operation takes.

    :raises InvalidRequest: something is missing, unknown, or not of its kind; nothing was sent.
    """
    kinds = {name: NAMES.get(name, str) for name in operation.named}
    kinds |= {name: parameter.annotation for name, parameter in operation.parameters.items()}
    for name in arguments:
        if name not in kinds:
            raise InvalidRequest(f"{name}: there is none ({unknown(name, kinds)}); nothing was sent.")
    values = {name: _valid(name, kinds[name], value) for name, value in arguments.items()}
    for name in kinds.keys() - values.keys():
        if not operation.may_leave_out(name):
            raise InvalidRequest(f"{name}: it is missing; nothing was sent.")
    if operation.request_name is None:
        if request:
            raise InvalidRequest("It takes no request; nothing was sent.")
    elif request is not None or not operation.request_optional:
        values[operation.request_name] = _valid("request", operation.request, request)
    return values


def _valid(name: str, kind: Any, given: Any) -> Any:
    try:
        return adapter_of(kind).validate_python(given)
    except ValidationError as error:
        first = error.errors()[0]
        place = ".".join(str(part) for part in first["loc"]) or name
        raise InvalidRequest(f"{place}: {sentence(first)}; nothing was sent.") from None


def _data(operation: Operation, result: Any) -> Any:
    if isinstance(result, Written):
        return from_json(result.json)
    if isinstance(result, PlainText):
        return result.content
    if isinstance(result, Result):
        result = told(result, operation.path)
    if isinstance(result, BaseModel):
        return result.model_dump(mode="json", exclude_unset=operation.named_only)
    return to_jsonable_python(result)
