"""Each method and each value of the plant's nodes has the verdict of the operation that it stands for."""

import asyncio
from collections import Counter
from collections.abc import Iterator
from itertools import product
from pathlib import Path
from typing import Any, Final

import pytest
from asyncua import ua

from api.app import Application, create_app
from bridges.common.callers import Caller, Callers
from bridges.common.mirror import Mirror
from bridges.common.state import Figures
from bridges.opcua.certificates import Trusted
from bridges.opcua.events import Events
from bridges.opcua.locks import Locks
from bridges.opcua.methods import Commands, PlantMethods
from bridges.opcua.nodes import Space
from bridges.opcua.plant import Plant
from bridges.opcua.sessions import Guest, sign_in
from bridges.opcua.stack import PlantListener, PlantServer, Session, quiet_library
from gateway.access.roles import Role
from gateway.core.rights import Right
from tests.api.access.guarded import Keys
from tests.api.access.test_matrix import IN, OUT, PASSED, Probing, Row, asked
from tests.api.whole_plant import whole_plant
from tests.bridges.inside import DoorsInside

Codes = ua.StatusCodes
Scope = tuple[str, ...] | None
ALARM: Final = "a-1"
ALARMS: Final = (
    ("line.down", "/lines/arm"),
    ("body.offline", "/bodies/arm.3F"),
    ("robot.offline", "/robots/r1"),
    ("gateway.security.trouble", "/gateway"),
)
SAID: Final = {PASSED: "let in", 403: "refused"}
STATUSES: Final = {PASSED: Codes.BadInvalidState, 403: Codes.BadUserAccessDenied}
"""Status over OPC UA by the status over HTTP, where nothing is carried out behind the door."""
GIVEN: Final[dict[str, tuple[Any, ...]]] = {
    "StartMove": ("key", "relative", 1.0, "", 0.0, 0.0),
    "Home": ("key", 0.0),
    "Jog": ("key", "cw", 0.0, 0.0),
    "Heartbeat": ("1",),
    "StopJog": ("1",),
    "InitLock": ("",),
}
OF_BODY: Final = {
    "StartMove": "POST /moves",
    "Home": "POST /moves",
    "Stop": "POST /stop",
    "Jog": "POST /jogs",
    "Heartbeat": "POST /jogs/1/heartbeat",
    "StopJog": "POST /jogs/1/stop",
}
OF_LOCK: Final = {
    "InitLock": "POST /leases",
    "RenewLock": "POST /leases/1/renew",
    "ExitLock": "DELETE /leases/1",
    "BreakLock": "DELETE /leases/1",
}


class Served:
    """The nodes of the whole plant, without a network."""

    def __init__(self, keys: Keys, folder: Path) -> None:
        self._keys = keys
        plant = self._plant = whole_plant()
        self.app = create_app(plant, keys.credentials)
        self.probing = create_app(plant, keys.credentials)
        self.probing.access = Probing(plant)
        self.server = PlantServer(self._nobody, Trusted(folder / "trusted", folder / "rejected"))
        listener = PlantListener(self.server, ("127.0.0.1", 0), "urn:test", "test")
        self.listener, self.space = listener, Space(listener)
        commands = Commands(Figures())
        gateway = DoorsInside(self.app).open(keys.of("viewer"))
        self.mirror = Mirror(gateway)
        self.locks = Locks(self.space, commands, gateway)
        self.methods = PlantMethods(self.space, commands, self.locks)
        self.events = Events(self.space, self.server, commands)
        self.server.address_of = self.space.address_of

    async def _nobody(self, *_: Any) -> Guest:
        raise AssertionError

    async def make(self) -> None:
        for line in self._plant.ports().values():  # they are never started
            line._loop = asyncio.get_running_loop()
        quiet_library()
        await self.listener.init()
        await self.space.load()
        self.methods.of_plant()
        self.events.load()
        self.events._add_condition(f"alarm.{ALARM}", "line.down", "arm")
        await self.mirror._read_all()
        await Plant(self.space, self.mirror, self.methods, 10.0).update(list(self.mirror.documents))
        self.locks._ids = dict.fromkeys(self.locks._names, "1")

    async def session_of(self, role: Role, scope: Scope) -> Session:
        """A session of a key, whose calls reach the door and nothing behind it."""
        key = self._keys.of(role, *scope or ())
        name = "-".join((role, *(scope or ()))).replace("/", "-")
        session: Session = self.server.create_session("client", external=True)
        session.guest = await sign_in(Callers(DoorsInside(self.app), {}), name, key, ())
        session.guest.caller = Caller(DoorsInside(self.probing), lambda: key)
        session.guest.leases = dict.fromkeys(self.locks._names, ("1", "1"))
        return session

    def nodes(self, class_: ua.NodeClass) -> Iterator[ua.NodeId]:
        aspace = self.server.aspace
        for node in list(aspace.keys()):
            of = aspace[node].attributes[ua.AttributeIds.NodeClass].value.Value.Value
            if node.NamespaceIndex == self.space.own and of == class_:
                yield node

    def operations(self, name: str) -> list[str]:
        """The operations that a method stands for, as the API names them."""
        object_, _, method = name.rpartition(".")
        if object_.endswith(".Lock"):
            return [OF_LOCK[method]]
        documents = self.mirror.documents
        if not object_:
            return ["POST /stop"]
        if f"/lines/{object_}" in documents:
            return [f"POST /bodies/{it}/stop" for it in documents[f"/lines/{object_}"]["bodies"]]
        verb, _, rest = OF_BODY[method].partition(" ")
        if f"/bodies/{object_}" in documents:
            return [f"{verb} /bodies/{object_}{rest}"]
        robot, *unit = object_.split(".")
        inside = f"/units/{unit[0]}" if unit and not rest.startswith("/jogs") else ""
        return [f"{verb} /robots/{robot}{inside}{rest}"]

    def values(self) -> dict[str, list[ua.NodeId]]:
        """The variables of the plant, by the operation that reads the same."""
        found: dict[str, list[ua.NodeId]] = {}
        for node in self.nodes(ua.NodeClass.Variable):
            address = self.space.address_of(node)
            for kind in ("bodies", "robots"):
                if address and f"/{kind}/{address}" in self.mirror.documents:
                    found.setdefault(f"GET /{kind}/{address}", []).append(node)
        return found

    def raise_alarms(self) -> list[Any]:
        for cause, subject in ALARMS:
            self._plant.alarms.find(cause, subject, reason="x", detail="x", stopped=[], status=[])
        return [it.model_dump(mode="json") for it in self._plant.alarms.standing()]


async def by_http(app: Application, operation: str, headers: dict[str, str]) -> int:
    method, _, path = operation.partition(" ")
    return await asked(app, Row(method, path, Right.VIEW, "any"), headers)


def arguments(object_: str, method: str) -> list[ua.Variant]:
    given = GIVEN.get(method, ())
    if method == "StartMove" and object_.count(".") == 1 and object_.startswith("r"):
        given = ("key", "position", *given[2:])  # what a unit as a whole does
    types = {str: ua.VariantType.String, float: ua.VariantType.Double}
    return [ua.Variant(it, types[type(it)]) for it in given]


async def called(served: Served, session: Session, method: ua.NodeId) -> int:
    object_, _, name = str(method.Identifier).rpartition(".")
    request = ua.CallMethodRequest(
        ObjectId=served.space.id(object_) if object_ else served.space.device_set,
        MethodId=method,
        InputArguments=arguments(object_, name),
    )
    return int((await session.call([request]))[0].StatusCode.value)


async def reset(served: Served, session: Session) -> int:
    method = ua.NodeId(ua.ObjectIds.AlarmConditionType_Reset)
    request = ua.CallMethodRequest(ObjectId=served.space.id(f"alarm.{ALARM}"), MethodId=method)
    return int((await session.call([request]))[0].StatusCode.value)


async def read(session: Session, nodes: list[ua.NodeId]) -> set[int]:
    items = [ua.ReadValueId(NodeId=it, AttributeId=ua.AttributeIds.Value) for it in nodes]
    values = await session.read(ua.ReadParameters(MaxAge=1e6, NodesToRead=items))
    refused = {it.StatusCode.value == Codes.BadUserAccessDenied for it in values}
    return {403 if it else PASSED for it in refused}


@pytest.mark.timeout(900)
@pytest.mark.parametrize(
    "most", [pytest.param(1, marks=pytest.mark.long), pytest.param(None, marks=pytest.mark.prove)]
)
def test_the_verdict_is_that_of_http_for_every_method_value_role_and_scope(
    most: int | None, tmp_path: Path
) -> None:
    keys = Keys(tmp_path)
    served = Served(keys, tmp_path)
    differ: list[str] = []
    verdicts: Counter[str] = Counter()
    abouts = ("body", "line", "robot")
    scopes = dict.fromkeys(it for about in abouts for it in (*IN[about][:most], *OUT[about][:most]))

    def compare(what: str, who: tuple[Role, Scope], by_http: int, by_opcua: object, same: object) -> None:
        verdicts[SAID[by_http]] += 1
        if by_opcua != same:
            differ.append(f"{what}: {who}: {by_http} over HTTP, {by_opcua} over OPC UA")

    async def run() -> None:
        await served.make()
        methods = list(served.nodes(ua.NodeClass.Method))
        values = served.values()
        verdicts["methods"], verdicts["values"] = len(methods) + 1, sum(map(len, values.values()))
        for role, scope in product(Role, (None, *scopes)):
            session, headers = await served.session_of(role, scope), keys.header(role, *scope or ())
            for method in methods:
                name = str(method.Identifier)
                each = {await by_http(served.probing, it, headers) for it in served.operations(name)}
                (told,) = each
                status = await called(served, session, method)
                compare(name, (role, scope), told, status, STATUSES[told])
            told = await by_http(served.probing, f"POST /alarms/{ALARM}/reset", headers)
            compare("Reset", (role, scope), told, await reset(served, session), STATUSES[told])
            for operation, nodes in values.items():
                told = await by_http(served.probing, operation, headers)
                compare(operation, (role, scope), told, await read(session, nodes), {told})

    asyncio.run(run())
    assert differ == []
    assert verdicts["let in"] > 100 < verdicts["refused"]
    print(f"{verdicts['let in'] + verdicts['refused']} verdicts: {dict(verdicts)}")


def test_an_alarm_is_told_to_those_who_may_read_it(tmp_path: Path) -> None:
    keys = Keys(tmp_path)
    served = Served(keys, tmp_path)
    seen: dict[tuple[str, Scope], tuple[bool, bool]] = {}

    async def run() -> None:
        await served.make()
        alarms = served.raise_alarms()
        assert len(alarms) == len(ALARMS)
        for scope in (None, ("arm",), ("arm.3F",), ("arm.01",), ("leg",), ("r1",)):
            session = await served.session_of(Role.VIEWER, scope)
            assert session.guest
            reader = Caller(DoorsInside(served.app), lambda: keys.of("viewer", *scope or ()))  # noqa: B023
            for alarm in alarms:
                by_http = await reader.ask("GET", f"/alarms/{alarm['id']}")
                told = served.events._condition("alarm.x", alarm, stands=True)
                seen[alarm["cause"], scope] = by_http.is_success, session.guest.sees(told.address)

    asyncio.run(run())
    assert [cell for cell, (by_http, by_opcua) in seen.items() if by_http != by_opcua] == []
    assert len({by_http for by_http, _ in seen.values()}) == 2
