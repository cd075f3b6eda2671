"""How a body searches its origin, and how far its last search went (RC-420 manual 13.5, 13.6.2)."""

from typing import Final

from pydantic import BaseModel, Field

from gateway.core.operation import Expectation, Rows
from gateway.core.rights import Right
from gateway.rorze.bodies import Body
from gateway.rorze.changes import Flash
from gateway.rorze.power import Homed
from gateway.rorze.settings import ChangedSettings, change_settings, known, read_values, scaled
from gateway.rorze.settings_document import HomingChange, HomingSettings
from gateway.rorze.settings_table import SETTINGS
from gateway.rorze.units import Scaled
from protocols.rorze.origin import GetHomingDistance

ROWS: Final = Rows("body settings")


class LastHoming(BaseModel):
    """What became of the last search."""

    homed: Homed
    distance: int = Field(description="Pulses from its end back to its start (0PD); 0 after power-on.")
    in_unit: Scaled | None


class Homing(BaseModel):
    """How a body searches its origin."""

    body_id: str
    settings: HomingSettings = Field(description="In RAM; the speeds are those of the standard set.")
    in_unit: dict[str, Scaled] = Field(
        description="Those in pulses, in the body's unit, by their names; empty without a scale."
    )
    overrun: int = Field(description="Pulses to overrun the sensor: the offset times the factor.")
    last: LastHoming


async def read_homing(body: Body) -> Homing:
    """Ask a body how it searches its origin, and how far its last search went.

    :raises GatewayError: it was not read.
    """
    values, _ = await read_values(body, {name: SETTINGS[name] for name in HomingSettings.model_fields})
    distance, _ = await body.ask(GetHomingDistance())
    return Homing(
        body_id=body.address,
        settings=HomingSettings.model_validate(known(values)),
        in_unit=dict(scaled(body, values)),
        overrun=values["origin_offset"] * values["overrun_factor"],
        last=LastHoming(
            homed=body.power.homed, distance=distance.pulses, in_unit=Scaled.of(distance.pulses, body.scale)
        ),
    )


@ROWS.get("/bodies/{body_id}/homing", tagged=True)
async def get_homing(body: Body) -> Homing:
    """Ask a body how it searches its origin, and how far its last search went (0PD)."""
    return await read_homing(body)


@ROWS.patch("/bodies/{body_id}/homing", Right.SETUP, named_only=True)
async def change_homing(
    body: Body, change: HomingChange, *, flash: Flash = False, expects: Expectation | None
) -> ChangedSettings:
    """Set what differs of the set-up of homing, and read it back; refused while the motor moves."""
    return await change_settings(body, change, read_homing, expects, flash=flash)
