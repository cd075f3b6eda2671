"""The records of long work: found by what the work is done to, and cancelled where it is under way."""

from collections.abc import Callable
from typing import Any

from gateway.core.operation import Rows, Wait, names_in, taking
from gateway.core.rights import Right
from gateway.core.works import Jobs
from gateway.door.names import NAMES
from gateway.plant import Plant

Find = Callable[..., tuple[Jobs[Any], str]]
"""Finds the works by the plant and what the path names, and what their work is done to."""


def list_records(
    rows: Rows,
    path: str,
    model: Any,
    find: Find,
    *,
    one: str,
    names: tuple[str, str],
    cancelled: str,
    right: Right = Right.SETUP,
    **told: Any,
) -> None:
    """List how a record is found, `one` as people call it, and how the work under way is cancelled.

    `path` is such as `/bodies/{body_id}/backups`, `names` are those of both operations, `right` is that to
    cancel, and `told` what else its row says.
    """
    record_id = f"{path.rpartition('/')[2][:-1]}_id"
    about = {name: NAMES[name] for name in names_in(path)}

    async def get(plant: Plant, wait: float | None = None, **values: Any) -> Any:
        wanted = values.pop(record_id)
        works, subject = find(plant, **values)
        return await works.get(subject, wanted, wait or 0.0)

    async def cancel(plant: Plant, **values: Any) -> Any:
        works, subject = find(plant, **values)
        return await works.cancel(subject)

    rows.add(
        "GET",
        f"{path}/{{{record_id}}}",
        Right.VIEW,
        taking(get, plant=Plant, **about, **{record_id: str}, wait=Wait),
        name=names[0],
        description=f"Get {one}, at once or when it is over; `current` is the one under way, or the last.",
        result=model,
    )
    rows.add(
        "DELETE",
        f"{path}/current",
        right,
        taking(cancel, plant=Plant, **about),
        name=names[1],
        description=cancelled,
        result=model,
        **told,
    )
