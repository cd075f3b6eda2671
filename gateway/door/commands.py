"""Every row of the command tables as an operation, with its own types, for whatever it is addressed to."""

from functools import cache, partial
from inspect import getdoc
from typing import Any, Final

from gateway.core.family import Family, Place, Row
from gateway.core.operation import Operation, Wait, names_in, operation, taking
from gateway.core.origin import current
from gateway.core.rights import RIGHT_OF
from gateway.door.doing import do
from gateway.door.names import NAMES
from gateway.door.results import GroupMove, GroupReply, StopResult
from gateway.plant import Plant

AXES_OF_THE_DEMO: Final = 3
"""The manual's robot has more."""


@cache
def rows_of(family: type[Family]) -> list[Operation]:
    """All rows of a family, by what they are addressed to."""
    return [_operation(family, place, row) for place, row in family.commands]


def _operation(family: type[Family], place: Place, row: Row) -> Operation:
    waits = row.starts_motion() and row not in family.sessions

    async def send(plant: Plant, command: Any, wait: float | None = None, **names: object) -> Any:
        return await do(plant, current(), place.path.format(**names), command, wait or 0.0)

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
        request_optional=row.may_be_empty() and not any(it.is_required() for it in row.model_fields.values()),
        code=row.code,
        example=partial(_example, family, row),
        **_results(family, place, row),
    )


def _results(family: type[Family], place: Place, row: Row) -> dict[str, Any]:
    """What a row answers."""
    if row in family.sessions:
        return {"result": family.sessions[row], "opens": True}
    if row.starts_motion():
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
    command = row.read(row.example[0].partition(row.code)[2].lstrip() if row.code else row.example[0])
    return {
        name: value[:AXES_OF_THE_DEMO] if isinstance(value, list) else value
        for name, value in command.model_dump(mode="json", exclude_none=True).items()
    }


def describe(family: type[Family], row: Row) -> str:
    """The row's documentation: what the manual's page says, in few words."""
    japanese, english = row.titles()
    more = (getdoc(row) or "").partition("\n")[2].strip()
    return "\n\n".join(part for part in (f"{japanese}: {english}.", more, *family.facts(row)) if part)
