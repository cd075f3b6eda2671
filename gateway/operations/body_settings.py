"""What a body stores beside positions and programs: speed parameter sets, acceleration patterns, settings."""

from collections.abc import Mapping
from typing import Final, Literal

from gateway.core.errors import InvalidRequest
from gateway.core.records import RequestModel
from gateway.core.rights import Right
from gateway.operations.caller import needs
from gateway.plant import Plant
from gateway.rorze import curves, encoders, homing, patterns, settings, speed_sets
from gateway.rorze.bodies import Body
from gateway.rorze.changes import Expectation
from gateway.rorze.curves import CurveDraft, SpeedCurve
from gateway.rorze.encoders import Encoder, Resolution, ResolutionRequest
from gateway.rorze.family import Rorze
from gateway.rorze.homing import Homing
from gateway.rorze.patterns import ChangedPattern, Pattern, PatternChange, PatternValues
from gateway.rorze.settings import BodySettings, ChangedSettings, Document
from gateway.rorze.settings_document import BodySettingsChange, EncoderChange, HomingChange
from gateway.rorze.speed_sets import ChangedSpeedSet, SpeedSet, SpeedSetChange, SpeedSetValues
from gateway.rorze.units import Unit, to_pulses

DOCUMENTS: Final[Mapping[type[RequestModel], Document]] = {
    BodySettingsChange: settings.read_settings,
    HomingChange: homing.read_homing,
    EncoderChange: encoders.read_encoder,
}
"""What was read before it is changed so."""


@needs(Right.VIEW)
async def read_speed_sets(plant: Plant, body_id: str, first: int, last: int) -> list[SpeedSet]:
    """Read speed parameter sets; errors as of `speed_sets.read_set`."""
    return await speed_sets.read_sets(_body(plant, body_id), _range(first, last))


@needs(Right.VIEW)
async def read_speed_set(plant: Plant, body_id: str, number: int) -> SpeedSet:
    """Read a speed parameter set; errors as of `speed_sets.read_set`."""
    return await speed_sets.read_set(_body(plant, body_id), number)


@needs(Right.SETUP)
async def change_speed_set(
    plant: Plant,
    body_id: str,
    number: int,
    wanted: SpeedSetValues | SpeedSetChange,
    expects: Expectation | None,
    *,
    flash: bool,
) -> ChangedSpeedSet:
    """Change a speed parameter set; errors as of `changes.change`."""
    return await speed_sets.change_set(_body(plant, body_id), number, wanted, expects, flash=flash)


@needs(Right.VIEW)
async def read_patterns(plant: Plant, body_id: str, first: int, last: int) -> list[Pattern]:
    """Read acceleration patterns; errors as of `patterns.read_pattern`."""
    return await patterns.read_patterns(_body(plant, body_id), _range(first, last))


@needs(Right.VIEW)
async def read_pattern(plant: Plant, body_id: str, number: int) -> Pattern:
    """Read an acceleration pattern; errors as of `patterns.read_pattern`."""
    return await patterns.read_pattern(_body(plant, body_id), number)


@needs(Right.SETUP)
async def change_pattern(
    plant: Plant,
    body_id: str,
    number: int,
    wanted: PatternValues | PatternChange,
    expects: Expectation | None,
    *,
    flash: bool,
) -> ChangedPattern:
    """Change an acceleration pattern; errors as of `patterns.change_pattern`."""
    return await patterns.change_pattern(_body(plant, body_id), number, wanted, expects, flash=flash)


@needs(Right.VIEW)
async def curve(
    plant: Plant,
    body_id: str,
    number: int,
    distance: float,
    unit: Unit,
    speed: Literal["high", "low"],
    points: int,
    draft: CurveDraft | None = None,
) -> SpeedCurve:
    """Work out the speed curve of a move; errors as of `curves.curve_of`."""
    body = _body(plant, body_id)
    return await curves.curve_of(body, number, to_pulses(distance, unit, body.scale), speed, points, draft)


@needs(Right.VIEW)
async def read_settings(plant: Plant, body_id: str) -> BodySettings:
    """Read all settings; errors as of `settings.read_settings`."""
    return await settings.read_settings(_body(plant, body_id))


@needs(Right.VIEW)
async def read_encoder(plant: Plant, body_id: str) -> Encoder:
    """Read the encoder and its set-up; errors as of `encoders.read_encoder`."""
    return await encoders.read_encoder(_body(plant, body_id))


@needs(Right.SETUP)
async def set_resolution(
    plant: Plant, body_id: str, wanted: ResolutionRequest, expects: Expectation | None, *, flash: bool
) -> Resolution:
    """Set the encoder up by what a turn is; errors as of `encoders.set_resolution`."""
    return await encoders.set_resolution(_body(plant, body_id), wanted, expects, flash=flash)


@needs(Right.VIEW)
async def read_homing(plant: Plant, body_id: str) -> Homing:
    """Read the set-up of homing; errors as of `homing.read_homing`."""
    return await homing.read_homing(_body(plant, body_id))


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
