"""What a body stores beside positions and programs: speed parameter sets, acceleration patterns, settings."""

from collections.abc import Mapping
from typing import Final, Literal

from gateway.core.errors import InvalidRequest
from gateway.core.records import RequestModel
from gateway.core.rights import Right
from gateway.operations.caller import needs
from gateway.operations.of_bodies import of_body
from gateway.plant import Plant
from gateway.rorze import curves, encoders, homing, patterns, settings, speed_sets
from gateway.rorze.bodies import Body
from gateway.rorze.changes import Expectation
from gateway.rorze.curves import CurveDraft, SpeedCurve
from gateway.rorze.family import Rorze
from gateway.rorze.patterns import Pattern
from gateway.rorze.settings import ChangedSettings, Document
from gateway.rorze.settings_document import BodySettingsChange, EncoderChange, HomingChange
from gateway.rorze.speed_sets import SpeedSet
from gateway.rorze.units import Unit, to_pulses

DOCUMENTS: Final[Mapping[type[RequestModel], Document]] = {
    BodySettingsChange: settings.read_settings,
    HomingChange: homing.read_homing,
    EncoderChange: encoders.read_encoder,
}
"""What was read before it is changed so."""


read_speed_set: Final = of_body(Right.VIEW, speed_sets.read_set)
change_speed_set: Final = of_body(Right.SETUP, speed_sets.change_set)
read_pattern: Final = of_body(Right.VIEW, patterns.read_pattern)
change_pattern: Final = of_body(Right.SETUP, patterns.change_pattern)
read_settings: Final = of_body(Right.VIEW, settings.read_settings)
read_encoder: Final = of_body(Right.VIEW, encoders.read_encoder)
set_resolution: Final = of_body(Right.SETUP, encoders.set_resolution)
read_homing: Final = of_body(Right.VIEW, homing.read_homing)


@needs(Right.VIEW)
async def read_speed_sets(plant: Plant, body_id: str, first: int, last: int) -> list[SpeedSet]:
    """Read speed parameter sets; errors as of `speed_sets.read_set`."""
    return await speed_sets.read_sets(_body(plant, body_id), _range(first, last))


@needs(Right.VIEW)
async def read_patterns(plant: Plant, body_id: str, first: int, last: int) -> list[Pattern]:
    """Read acceleration patterns; errors as of `patterns.read_pattern`."""
    return await patterns.read_patterns(_body(plant, body_id), _range(first, last))


@needs(Right.VIEW)
async def curve(
    plant: Plant,
    body_id: str,
    number: int,
    distance: float,
    unit: Unit,
    speed: Literal["high", "low"],
    points: int,
) -> SpeedCurve:
    """Work out the speed curve of a move; errors as of `curves.curve_of`."""
    body = _body(plant, body_id)
    return await curves.curve_of(body, number, to_pulses(distance, unit, body.scale), speed, points)


@needs(Right.VIEW)
async def draft_curve(plant: Plant, body_id: str, number: int, draft: CurveDraft) -> SpeedCurve:
    """Work out the speed curve of a move with a pattern that is not set; errors as of `curves.curve_of`."""
    body = _body(plant, body_id)
    pulses = draft.distance.pulses(body.scale)
    return await curves.curve_of(body, number, pulses, draft.speed, draft.points, draft)


@needs(Right.SETUP)
async def change_settings(
    plant: Plant,
    body_id: str,
    wanted: BodySettingsChange | HomingChange | EncoderChange,
    expects: Expectation | None,
    *,
    flash: bool,
) -> ChangedSettings:
    """Change settings; errors as of `settings.change_settings`."""
    document = next(read for kind, read in DOCUMENTS.items() if isinstance(wanted, kind))
    return await settings.change_settings(_body(plant, body_id), wanted, document, expects, flash=flash)


def _body(plant: Plant, body_id: str) -> Body:
    return plant.family(Rorze).body(body_id)


def _range(first: int, last: int) -> range:
    if last < first:
        raise InvalidRequest(f"last: it is less than first, {first}; nothing was sent.")
    return range(first, last + 1)
