"""Operations carried out for their callers: rights and leases first, then what the path leads to."""

import logging
from collections.abc import Callable, Mapping, Sequence
from contextlib import AsyncExitStack
from datetime import UTC, datetime
from functools import cache, partial
from typing import Any, Final

from pydantic_core import to_json

from gateway.access import principal
from gateway.core.aside import aside
from gateway.core.family import Registered
from gateway.core.operation import EXPECTS, KEYED, Expectation, Operation, names_in
from gateway.core.origin import ORIGIN
from gateway.core.rights import Right
from gateway.core.supervisor import do_each, twice
from gateway.core.targets import Looked, Target
from gateway.door.caller import require
from gateway.door.names import COLLECTIONS
from gateway.families import registered
from gateway.plant import Plant
from protocols.table import Effect
from transports.recorder import clocks

__all__ = ["aside", "carry_out", "require_right", "twice"]

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
    before = ORIGIN.set(ORIGIN.get())
    try:
        _admit(plant, operation, values)
        do_each("the record of a request", partial(_note, plant, operation, values))
        taken = {name: values[name] for name in operation.parameters if name in values}
        if (request := operation.request_name) is not None and request in values:
            taken[request] = values[request]
        for name, find in _finders(operation):
            taken[name] = find(plant, values)
        if operation.expects:
            taken[EXPECTS] = expects
        if operation.keyed:
            taken[KEYED] = keyed
        async with AsyncExitStack() as looking:
            if operation.effect in (
                Effect.READ,
                Effect.SETTING,
            ):  # before a change it is looked what there is
                for thing in taken.values():
                    if isinstance(thing, Looked):
                        await looking.enter_async_context(thing.looking())
            return await operation.run(**taken)
    finally:
        ORIGIN.reset(before)


def _note(plant: Plant, operation: Operation, values: Mapping[str, Any]) -> None:
    """Keep what is asked of the lines for recordings; what only an administrator may ask is not among it."""
    concerns_lines = operation.effect is not Effect.READ or operation.path.startswith(_OF_LINES)
    if operation.right is Right.ADMIN or not concerns_lines or operation.path.startswith(_OF_RECORDINGS):
        return
    at_ns, monotonic_ns = clocks()
    origin = ORIGIN.get()
    if (origin.caller or "").startswith(_BY_ITSELF):
        return
    told = {
        "at": datetime.fromtimestamp(at_ns / 1e9, UTC),
        "monotonic_ns": monotonic_ns,
        "operation": operation.name,
        "values": values,
        "caller": origin.caller,
        "request_id": origin.request_id,
    }
    text = to_json(told, exclude_none=False, fallback=str)
    if len(text) <= LONGEST_NOTED:
        plant.requests.append((at_ns, monotonic_ns, text.decode()))


def require_right(plant: Plant, operation: Operation, values: Mapping[str, Any]) -> None:
    """Refuse a caller without the right, whatever else is asked.

    :raises NotPermitted: the role or the scope does not allow it.
    """
    _admit(plant, operation, values, leased=False)


def _admit(plant: Plant, operation: Operation, values: Mapping[str, Any], *, leased: bool = True) -> None:
    """Refuse a caller without the right, or without the lease that it takes."""
    if operation.any_scope:
        plant.territory.require_right(principal.current(), operation.right)
    elif operation.right is not Right.OPEN:
        named = _named(operation, values)
        require(
            plant,
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
    return getattr(request, "validate_only", False) or getattr(request, "dry_run", False)


@cache
def _finders(operation: Operation) -> tuple[tuple[str, Finder], ...]:
    """The functions that find the values an operation is provided with.

    :raises TypeError: no function finds a value of that type.
    """
    ids = [name for name in names_in(operation.path) if name not in operation.parameters]
    provided = {name: kind for name, kind in operation.provided.items() if name not in (EXPECTS, KEYED)}
    return tuple((name, _finder(kind, operation.path, ids)) for name, kind in provided.items())


def _finder(kind: type, path: str, ids: list[str]) -> Finder:
    if kind is Target:
        about = path[: path.index("}", path.index(f"{{{ids[-1]}}}")) + 1]
        return lambda plant, values: plant.target(about.format(**values))
    if kind is Plant:
        return lambda plant, _: plant
    if issubclass(kind, Registered):
        return lambda plant, _: plant.family(kind)
    for owner in registered():
        if kind in owner.things:
            find = owner.things[kind]
            return lambda plant, values: find(plant.family(owner), *(values[name] for name in ids))
    raise TypeError(f"Nobody finds a {kind.__name__} by a path")
