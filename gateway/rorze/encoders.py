"""The encoder of a body: what it counts, and how it is set up (RC-420 manual 13.7)."""

from typing import Annotated, Final, Literal

from pydantic import Field

from gateway.core.errors import InvalidRequest
from gateway.core.move_record import CountedIn
from gateway.core.operation import Expectation, Rows
from gateway.core.records import AnswerModel, RequestModel, example
from gateway.core.rights import Right
from gateway.rorze.asked_body import AskedBody, counted_in
from gateway.rorze.changes import Flash, read
from gateway.rorze.settings import (
    MODE,
    ChangedSettings,
    change_settings,
    known,
    read_values,
    scaled,
    unavailable_in,
)
from gateway.rorze.settings_table import SETTINGS, EncoderChange, EncoderSettings
from gateway.rorze.units import Scaled
from protocols.rorze.encoder import GetEncoderStallError
from protocols.rorze.position import GetEncoderCount, GetEncoderPosition, GetPosition
from protocols.rorze.row import ModeName

ROWS: Final = Rows("body settings")
Multiplier = Literal["double", "quadruple"]
EDGES = {"double": 2, "quadruple": 4}
"""Counts for each line (RC-420 manual 13.7.3)."""
LEAST_RATIO, LARGEST_RATIO = 1.0, 99_999.99


class EncoderCounts(AnswerModel):
    """Where the encoder is."""

    counted_in: CountedIn = Field(description="Unit of positions and amounts of this body.")
    position: int = Field(description="Position that the body tells, in `counted_in` (6PD).")
    position_in_unit: Scaled | None
    count: int = Field(description="The encoder's count (6ED).")
    count_in_pulses: int = Field(description="Encoder's count in pulses: the count times the ratio (6MD).")
    difference: int | None = Field(
        description="Pulses put out beyond what the encoder has seen; null in encoder mode, where only the "
        "encoder is told."
    )
    stalled: bool = Field(description="True if the encoder has found a step-out that stands (PRD).")


class Encoder(AnswerModel):
    """The encoder of a body, and its set-up."""

    body_id: str
    operating_mode: ModeName
    settings: EncoderSettings = Field(description="Settings in RAM.")
    in_unit: dict[str, Scaled] = Field(description="Settings in pulses, in the body's unit, by their names.")
    unavailable: dict[str, str] = Field(description="Settings that cannot be read now, and why.")
    last: EncoderCounts = Field(description="Counts at the last reading.")


class ResolutionRequest(
    RequestModel, json_schema_extra=example(motor_steps_per_turn=1_000, encoder_lines_per_turn=100)
):
    """A turn of the shaft, in steps of the motor and in lines of the encoder."""

    motor_steps_per_turn: Annotated[int, Field(ge=1, le=100_000_000)] = Field(
        description="Pulses that turn the motor once."
    )
    encoder_lines_per_turn: Annotated[int, Field(ge=1, le=10_000_000)] = Field(
        description="Lines of the encoder, before any multiplication."
    )
    multiplier: Multiplier | None = Field(
        default=None,
        description="Multiplier; left out: quadruple, or double where the ratio would be below 1.",
    )
    dry_run: bool = Field(default=False, description="Only say what would be set.")


class Resolution(AnswerModel):
    """The encoder's settings that follow from motor and encoder."""

    body_id: str
    encoder_multiplier: Multiplier = Field(description="PAS.")
    encoder_ratio: float = Field(description="PBS: motor pulses for each count, rounded to two decimals.")
    counts_per_turn: int
    drift_per_turn: float = Field(
        description="Pulses by which motor and encoder come apart in each turn, because of the rounding."
    )
    changed: ChangedSettings | None = Field(
        description="Settings as they were read back; null after a dry run."
    )


async def read_encoder(body: AskedBody) -> Encoder:
    """Ask a body for its encoder: what it counts, and how it is set up.

    :raises GatewayError: it was not read.
    """
    mode: ModeName = await read(body, SETTINGS[MODE].item)
    names = {name: SETTINGS[name] for name in EncoderSettings.model_fields}
    unavailable = unavailable_in(mode, names)
    values, moving = await read_values(
        body, {name: setting for name, setting in names.items() if name not in unavailable}
    )
    return Encoder(
        body_id=body.address,
        operating_mode=mode,
        settings=EncoderSettings.model_validate(known(values)),
        in_unit=dict(scaled(body, values)),
        unavailable=unavailable | moving,
        last=await _counts(body, mode),
    )


async def _counts(body: AskedBody, mode: ModeName) -> EncoderCounts:
    position, _ = await body.ask(GetPosition())
    count, _ = await body.ask(GetEncoderCount())
    pulses, _ = await body.ask(GetEncoderPosition())
    error, _ = await body.ask(GetEncoderStallError())
    return EncoderCounts(
        counted_in=counted_in(mode),
        position=position.pulses,
        position_in_unit=Scaled.of(position.pulses, body.scale),
        count=count.count,
        count_in_pulses=pulses.pulses,
        difference=None if mode == "encoder" else position.pulses - pulses.pulses,
        stalled=bool(error.stalled),
    )


async def set_resolution(
    body: AskedBody, wanted: ResolutionRequest, expects: Expectation | None, *, flash: bool
) -> Resolution:
    """Set multiplier and ratio by what a turn is (PAS, PBS); errors as of `change_settings`.

    :raises InvalidRequest: no ratio of the controller's comes of it; nothing was sent.
    """
    multiplier, ratio, exact = resolution_of(wanted)
    changed = None
    if not wanted.dry_run:
        change = EncoderChange(encoder_multiplier=multiplier, encoder_ratio=ratio)
        changed = await change_settings(body, change, read_encoder, expects, flash=flash)
    counts = wanted.encoder_lines_per_turn * EDGES[multiplier]
    return Resolution(
        body_id=body.address,
        encoder_multiplier=multiplier,
        encoder_ratio=ratio,
        counts_per_turn=counts,
        drift_per_turn=round((ratio - exact) * counts, 6),
        changed=changed,
    )


def resolution_of(wanted: ResolutionRequest) -> tuple[Multiplier, float, float]:
    """Multiplier, the ratio that PBS takes, and the exact one (RC-420 manual 13.7.2).

    The ratio is the pulses of a turn over the counts of a turn, and these are the lines times the multiplier.

    :raises InvalidRequest: PBS takes no such ratio.
    """
    choices: tuple[Multiplier, ...] = (wanted.multiplier,) if wanted.multiplier else ("quadruple", "double")
    for multiplier in choices:
        exact = wanted.motor_steps_per_turn / (wanted.encoder_lines_per_turn * EDGES[multiplier])
        if LEAST_RATIO <= round(exact, 2) <= LARGEST_RATIO:
            return multiplier, round(exact, 2), exact
    raise InvalidRequest(
        f"The ratio would be {exact:g} motor pulses for each encoder count, and PBS takes {LEAST_RATIO:g} to "
        f"{LARGEST_RATIO}; nothing was sent.",
        "Take finer motor steps, or an encoder with fewer lines."
        if exact < LEAST_RATIO
        else "Take an encoder with more lines.",
    )


@ROWS.get("/bodies/{body_id}/encoder", tagged=True)
async def get_encoder(body: AskedBody) -> Encoder:
    """Ask a body what its encoder counts (6ED, 6MD), and how it is set up (RC-420 manual 13.7)."""
    return await read_encoder(body)


@ROWS.patch("/bodies/{body_id}/encoder", Right.SETUP, named_only=True)
async def change_encoder(
    body: AskedBody, change: EncoderChange, *, flash: Flash = False, expects: Expectation | None
) -> ChangedSettings:
    """Set what differs of the set-up of the encoder, and read it back; refused while the motor moves."""
    return await change_settings(body, change, read_encoder, expects, flash=flash)


@ROWS.put("/bodies/{body_id}/encoder/resolution", Right.SETUP, named_only=True)
async def set_encoder_resolution(
    body: AskedBody, resolution: ResolutionRequest, *, flash: Flash = False, expects: Expectation | None
) -> Resolution:
    """Set multiplier and ratio (PAS, PBS) by what a turn is to motor and encoder (RC-420 manual 13.7.2)."""
    return await set_resolution(body, resolution, expects, flash=flash)
