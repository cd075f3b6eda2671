"""Operations carried out for their callers: rights and leases first, then what the path leads to."""

import logging
from collections.abc import Callable, Mapping, Sequence
from functools import cache, partial
from typing import Any, Final, NamedTuple

from pydantic_core import to_json

from gateway.access import principal
from gateway.access.territory import PlantAccess
from gateway.core.aside import aside
from gateway.core.events import EventHub
from gateway.core.family import Registered
from gateway.core.operation import EXPECTS, KEYED, Expectation, Operation, names_in
from gateway.core.origin import ORIGIN
from gateway.core.rights import Right
from gateway.core.supervisor import do_each, do_in_turn
from gateway.core.targets import Looked, Target
from gateway.door.caller import require
from gateway.door.names import COLLECTIONS
from gateway.families import registered
from gateway.plant import Plant
from protocols.table import Effect
from transports.recorder import clocks

__all__ = ["aside", "carry_out", "do_each", "require_right"]

_OF_LINES: Final = ("/lines", *COLLECTIONS)
_BY_ITSELF: Final = "gateway"
_OF_RECORDINGS: Final = ("/recordings", "/tickets")
log = logging.getLogger(__name__)

LONGEST_NOTED: Final = 4096
"""A longer request, such as an upload, is not kept to be recorded."""
Finder = Callable[[Plant, Mapping[str, str]], Any]


async def carry_out(
    plant: Plant,
    operation: Operation,
    values: Mapping[str, Any],
    expects: Expectation | None = None,
    *,
    keyed: bool = False,
) -> Any:
    """Do what a caller asks for, in that caller's name; `values` are those of path, query and request.

    `expects` refuses a present state that the caller does not know, where the operation can be bound to one.
    `keyed` says that the caller relies on its being carried out once, where the operation wants to know that.

    :raises NotPermitted: the role or the scope does not allow it; nothing was sent.
    :raises LeaseRefused: another caller has a lease there; nothing was sent.
    :raises GatewayError: it was not carried out, or that cannot be known; the error says which.
    """
    carried = partial(_carried_out, plant, operation, values, expects, keyed=keyed)
    if operation.right is not Right.STOP:
        return await carried()
    return (await do_in_turn("a stop", carried)).or_raise()[0]  # it may be sent as often as one likes


async def _carried_out(
    plant: Plant,
    operation: Operation,
    values: Mapping[str, Any],
    expects: Expectation | None,
    *,
    keyed: bool,
) -> Any:
    way = _way_of(operation)
    before = ORIGIN.set(ORIGIN.get())
    try:
        _admit(plant, operation, values)
        if way.is_noted:
            do_each("the record of a request", partial(_note, plant, operation, values))
        taken = {name: values[name] for name in way.given if name in values}
        found = {name: find(plant, values) for name, find in way.finders}
        taken |= found
        if operation.expects:
            taken[EXPECTS] = expects
        if operation.keyed:
            taken[KEYED] = keyed
        looked = [value for value in found.values() if isinstance(value, Looked)] if way.looks else []
        return await (_looking(operation, taken, looked) if looked else operation.run(**taken))
    finally:
        ORIGIN.reset(before)


async def _looking(operation: Operation, taken: Mapping[str, Any], things: Sequence[Looked]) -> Any:
    """Run an operation, and leave no trace of its questions at these controllers."""
    async with things[0].looking():
        if len(things) > 1:
            return await _looking(operation, taken, things[1:])
        return await operation.run(**taken)


def _note(plant: Plant, operation: Operation, values: Mapping[str, Any]) -> None:
    """Keep a request that concerns lines, to be recorded."""
    origin = ORIGIN.get()
    if (origin.caller or "").startswith(_BY_ITSELF):
        return
    told = {
        "operation": operation.name,
        "values": values,
        "caller": origin.caller,
        "request_id": origin.request_id,
    }
    text = to_json(told, exclude_none=False, fallback=str)
    if len(text) <= LONGEST_NOTED:
        plant.history.requests.append((*clocks(), text.decode()))


def require_right(plant: Plant, operation: Operation, values: Mapping[str, Any]) -> None:
    """Refuse a caller without the right, whatever else is asked.

    :raises NotPermitted: the role or the scope does not allow it.
    """
    _admit(plant, operation, values, leased=False)


def _admit(plant: Plant, operation: Operation, values: Mapping[str, Any], *, leased: bool = True) -> None:
    """Refuse a caller without the right, or without the lease that it takes."""
    if operation.any_scope:
        plant.access.territory.require_right(principal.current(), operation.right)
    elif operation.right is not Right.OPEN:
        named = _named(operation, values)
        require(
            plant.access,
            operation.right,
            *named,
            leased=leased and operation.leased and not _only_asks(operation, values),
        )


def _named(operation: Operation, values: Mapping[str, Any]) -> Sequence[str]:
    """Names of the parts that a request is about, from its path or a part of its query."""
    about = operation.target
    if about is None:
        return ()
    if about in operation.named:
        return (str(values.get(about, "")),)
    listed = values.get(about)
    return [part.strip() for part in listed.split(",")] if listed else ()


def _only_asks(operation: Operation, values: Mapping[str, Any]) -> bool:
    """True if the request is to be checked or planned only, not carried out."""
    request = values.get(operation.request_name or "")
    return request is not None and any(getattr(request, trial) for trial in _trials_of(request.__class__))


@cache
def _trials_of(request: type) -> Sequence[str]:
    """The members of a request that ask for a trial; to look for what a model does not have takes long."""
    members = getattr(request, "model_fields", ())
    return [name for name in ("validate_only", "dry_run") if name in members]


class _Way(NamedTuple):
    """The ways in which an operation comes by its arguments, worked out once."""

    given: Sequence[str]
    """The names of what a caller gives."""
    finders: Sequence[tuple[str, Finder]]
    """The functions that find the values it is provided with."""
    looks: bool
    """True if it may ask a controller that keeps a trace of that, as changes do before they begin."""
    is_noted: bool
    """True if requests for it are kept to be recorded; those of administrators alone are not."""


@cache
def _way_of(operation: Operation) -> _Way:
    """Work the ways of an operation out.

    :raises TypeError: no function finds a value of that type.
    """
    ids = [name for name in names_in(operation.path) if name not in operation.parameters]
    provided = {name: kind for name, kind in operation.provided.items() if name not in (EXPECTS, KEYED)}
    request = () if operation.request_name is None else (operation.request_name,)
    concerns_lines = operation.effect is not Effect.READ or operation.path.startswith(_OF_LINES)
    return _Way(
        given=(*operation.parameters, *request),
        finders=[(name, _finder(kind, operation.path, ids)) for name, kind in provided.items()],
        looks=operation.effect in (Effect.READ, Effect.SETTING),
        is_noted=concerns_lines
        and operation.right is not Right.ADMIN
        and not operation.path.startswith(_OF_RECORDINGS),
    )


_PARTS: Final[Mapping[type, Callable[[Plant], Any]]] = {
    Plant: lambda plant: plant,
    PlantAccess: lambda plant: plant.access,
    EventHub: lambda plant: plant.events,
}
"""Parts of the plant that an operation may take alone, so that it is read with few files."""


def _finder(kind: type, path: str, ids: list[str]) -> Finder:
    if kind is Target:
        about = path[: path.index("}", path.index(f"{{{ids[-1]}}}")) + 1]
        return lambda plant, values: plant.target(about.format(**values))
    if kind in _PARTS:
        part = _PARTS[kind]
        return lambda plant, _: part(plant)
    if issubclass(kind, Registered):
        return lambda plant, _: plant.family(kind)
    for owner in registered():
        if kind in owner.things:
            find = owner.things[kind]
            return lambda plant, values: find(plant.family(owner), *(values[name] for name in ids))
    raise TypeError(f"Nobody finds a {kind.__name__} by a path")
