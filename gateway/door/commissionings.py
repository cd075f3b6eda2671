"""Commissionings: which assumptions about real hardware hold on a line."""

from functools import partial
from typing import Final

from pydantic import Field

from gateway.commissionings import Commissioning
from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.operation import Rows, Wait
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.door.configuration import AT_ONCE, Reloaded, ReloadRequest, with_settings
from gateway.plant import Plant
from protocols.wording import as_given

ROWS: Final = Rows("configuration")


class CommissioningRequest(RequestModel, json_schema_extra=example(line_id="line1")):
    """The line to commission."""

    line_id: str = Field(min_length=1, max_length=32, description="A line of the configuration.")


@ROWS.post("/commissionings", Right.ADMIN, over="The commissioning is over.")
async def start_commissioning(
    plant: Plant, wanted: CommissioningRequest, *, wait: Wait = None
) -> Commissioning:
    """Try which assumptions about real hardware hold on a line, by questions alone.

    Nothing may move on the line, and meanwhile it is down for all other requests; a stop ends it at once.
    Assumptions that take a setting or a motion are tried by `motion-gateway commission LINE --config FILE`
    only.
    """
    plant.admission.require()
    record = plant.commission(wanted.line_id)
    await plant.works.commissionings.wait(record, wait or 0.0)
    return record


@ROWS.get("/commissionings/{commissioning_id}", Right.ADMIN, whole_plant=True)
async def get_commissioning(plant: Plant, commissioning_id: str, *, wait: Wait = None) -> Commissioning:
    """Get a commissioning with its report, at once or when it is over."""
    record = _find(plant, commissioning_id)
    await plant.works.commissionings.wait(record, wait or 0.0)
    return record


@ROWS.delete("/commissionings/{commissioning_id}", Right.ADMIN, whole_plant=True)
async def cancel_commissioning(plant: Plant, commissioning_id: str) -> Commissioning:
    """Cancel a commissioning: nothing more is asked, and the line serves again."""
    record = _find(plant, commissioning_id)
    plant.works.commissionings.break_off(record)
    await plant.works.commissionings.wait(record, float("inf"))
    return record


@ROWS.post("/commissionings/{commissioning_id}/settings", Right.ADMIN, whole_plant=True)
async def apply_commissioning(
    plant: Plant, commissioning_id: str, wanted: ReloadRequest = AT_ONCE
) -> Reloaded:
    """Write the settings that a commissioning proposes into the configuration file, and serve the line so."""
    record = _find(plant, commissioning_id)
    settings = record.proposed()
    if not settings:
        raise InvalidRequest(
            f"Commissioning {record.id} proposes no settings; nothing was changed.", "Look at its report."
        )
    return await with_settings(plant, record.line_id, settings, dry_run=wanted.dry_run)


def _find(plant: Plant, record_id: str) -> Commissioning:
    """Find a record by its id alone.

    :raises NotFound: there is none, or it is no longer kept.
    """
    found = map(partial(plant.works.commissionings.find, record_id=record_id), plant.ports())
    for record in found:
        if record is not None:
            return record
    raise NotFound(f"There is no commissioning {as_given(record_id)}, or it is no longer kept.")
