"""Every row of the command tables as an operation, with its own types, for whatever it is addressed to."""

from collections.abc import Iterator
from functools import cache, partial
from inspect import getdoc
from typing import Any, Final

from gateway.core.family import Family, Row, TargetKind
from gateway.core.move_record import MoveRecord
from gateway.core.operation import Operation, Wait, names_in, operation, taking
from gateway.core.origin import current
from gateway.core.rights import RIGHT_OF, Right
from gateway.core.targets import Stopped, Target
from gateway.door import moving, stopping
from gateway.door.doing import do_admitted
from gateway.door.names import NAMES
from gateway.door.results import GroupMove, GroupReply, StopResult
from gateway.door.stops import SLOWLY, StopRequest
from gateway.plant import Plant

AXES_OF_THE_DEMO: Final = 3
"""The manual's robot has more."""


NEWEST: Final = 100


@cache
def rows_of(family: type[Family]) -> list[Operation]:
    """All rows of a family, by what they are addressed to; then moves and stops that it lists no rows for."""
    listed = [_operation(family, place, row) for place, row in family.commands]
    others = {place.path: place for place, _ in family.commands if not place.listed}
    return [*listed, *(operation for place in others.values() for operation in _moves_and_stop(place))]


def _moves_and_stop(place: TargetKind) -> Iterator[Operation]:
    what, moves = place.path.split("/")[1], f"{place.path}/moves"
    yield operation(what, "GET", moves, Right.VIEW, _list_moves, name=f"list_moves_of_{what}")
    yield operation(
        what,
        "GET",
        f"{moves}/{{move_id}}",
        *(Right.VIEW, _get_move),
        name=f"get_move_of_{what}",
        result=place.move,
    )
    yield operation(
        what, "POST", f"{place.path}/stop", Right.STOP, _stop, name=f"stop_one_of_{what}", result=StopResult
    )


async def _list_moves(target: Target) -> dict[str, list[Any]]:
    """List the newest moves, newest first."""
    return {"moves": moving.newest(target, NEWEST)}


async def _get_move(target: Target, move_id: str, *, wait: Wait = None) -> MoveRecord:
    """Get a move, at once or when it is over."""
    return await moving.get(target, move_id, wait or 0.0)


async def _stop(plant: Plant, target: Target, stop: StopRequest = SLOWLY) -> Stopped:
    """Stop it by software: what waits is cancelled, and the stop goes out first."""
    return await stopping.stop(plant, current(), target.path, stop.mode)


def _operation(family: type[Family], place: TargetKind, row: Row) -> Operation:
    waits = row.starts_motion and row not in family.sessions

    async def send(plant: Plant, command: Any, wait: float | None = None, **names: object) -> Any:
        return await do_admitted(plant, place.path.format(**names), command, wait or 0.0)

    names = {name: NAMES.get(name, str) for name in names_in(place.path)}
    taken = {"plant": Plant, **names, "command": row, **({"wait": Wait} if waits else {})}
    return operation(
        place.tag,
        "POST",
        f"{place.path}/commands/{row.name()}",
        RIGHT_OF[row.effect],
        taking(send, **taken),
        name=f"send_{row.name().replace('-', '_')}{place.suffix}",
        title=row.titles()[1].capitalize(),
        description=describe(family, row),
        effect=row.effect,
        request_optional=row.may_be_empty()
        and not any(field.is_required() for field in row.model_fields.values()),
        code=row.code,
        example=partial(_example, family, row),
        **_results(family, place, row),
    )


def _results(family: type[Family], place: TargetKind, row: Row) -> dict[str, Any]:
    """The result of a row, as arguments of its operation: an open session, a move, a stop or a reply."""
    if row in family.sessions:
        return {"result": family.sessions[row], "opens": True}
    if row.starts_motion:
        return {"result": GroupMove if place.members else place.move, "moves": True}
    if row in family.stop_modes:
        return {"result": StopResult}
    if place.members:
        return {"result": GroupReply}
    return {"result": family.answer_model(row), "dated": family.is_dated(row)}


def _example(family: type[Family], row: Row) -> dict[str, Any] | None:
    """The first example of the row's manual, as a request."""
    if not row.model_fields or not row.example or row in family.never_alone:
        return None
    return {
        name: value[:AXES_OF_THE_DEMO] if isinstance(value, list) else value
        for name, value in row.of_example().model_dump(mode="json", exclude_none=True).items()
    }


def describe(family: type[Family], row: Row) -> str:
    """The row's documentation: what the manual's page says, in few words."""
    japanese, english = row.titles()
    more = (getdoc(row) or "").partition("\n")[2].strip()
    return "\n\n".join(part for part in (f"{japanese}: {english}.", more, *family.facts(row)) if part)
