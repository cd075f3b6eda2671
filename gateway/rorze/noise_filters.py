"""The noise filters of a body's inputs and sensors as one document (RC-420 manual 13.9, DCS, DCD)."""

from typing import Annotated, Final

from pydantic import BaseModel, Field

from gateway.core.operation import Expectation, Rows
from gateway.core.records import SentBack, example
from gateway.core.rights import Right
from gateway.rorze.asked_body import AskedBody
from gateway.rorze.changes import Flash
from gateway.rorze.settings import ChangedSettings, change_settings, read_values
from gateway.rorze.settings_document import FilteredInput, Sensor
from gateway.rorze.settings_table import SETTINGS

ROWS: Final = Rows("body settings")
NAME: Final = "noise_filters"
Filters = dict[FilteredInput | Sensor, Annotated[int, Field(ge=1, le=99)]]


class NoiseFilters(BaseModel):
    """How long the level of an input or a sensor has to be another before it counts as changed."""

    body_id: str
    noise_filters: Filters = Field(
        description="By input or sensor: equal samples, one each ms, that make a change of level."
    )


class NoiseFiltersChange(SentBack, json_schema_extra=example(noise_filters={"d3": 5})):
    """Noise filters to be set; those that are not named stay as they are."""

    read_only = frozenset(("body_id",))

    noise_filters: Filters = Field(min_length=1, description="By input or sensor; in samples.")


async def read_filters(body: AskedBody) -> NoiseFilters:
    """Ask a body for all of its noise filters.

    :raises GatewayError: they were not read.
    """
    values, _ = await read_values(body, {NAME: SETTINGS[NAME]})
    return NoiseFilters(body_id=body.address, noise_filters=values[NAME])


@ROWS.get("/bodies/{body_id}/noise-filters", tagged=True)
async def get_noise_filters(body: AskedBody) -> NoiseFilters:
    """Ask a body for the noise filters of its inputs and sensors, one by one (DCD)."""
    return await read_filters(body)


@ROWS.patch("/bodies/{body_id}/noise-filters", Right.SETUP, named_only=True)
async def change_noise_filters(
    body: AskedBody, change: NoiseFiltersChange, *, flash: Flash = False, expects: Expectation | None
) -> ChangedSettings:
    """Set those of the named noise filters that differ (DCS), and read each back; refused while it moves."""
    return await change_settings(body, change, read_filters, expects, flash=flash)
