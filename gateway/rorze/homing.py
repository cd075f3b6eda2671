"""How a body searches its origin, and how far its last search went (RC-420 manual 13.5, 13.6.2)."""

from pydantic import BaseModel, Field

from gateway.rorze.bodies import Body
from gateway.rorze.power import Homed
from gateway.rorze.settings import known, read_values, scaled
from gateway.rorze.settings_document import HomingSettings
from gateway.rorze.settings_table import SETTINGS
from gateway.rorze.units import Scaled
from protocols.rorze.origin import GetHomingDistance


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
