"""The record of a SCARA robot's move, and of one that is only planned."""

from typing import Final, Literal

from pydantic import Field

from gateway.core.move_record import MoveRecord, MoveStatus
from gateway.core.records import Record
from gateway.rorze.samples import BodySamples
from protocols.rorze.scara import FingerPlace

ScaraMoveKind = Literal["line", "path", "offset", "extend", "retract", "rotate", "finger", "align"]


DECIMALS: Final = 9
"""Decimals that are told: near the origin a nanometre decides where the base stands."""


class Micrometres(Record):
    """A coordinate."""

    value: float
    unit: Literal["um"] = "um"


class Millidegrees(Record):
    """An angle, counterclockwise from X."""

    value: float
    unit: Literal["mdeg"] = "mdeg"


class ScaraPlace(Record):
    """Where the finger ends, and where it points (RC-420 manual 13.10.8)."""

    x: Micrometres
    y: Micrometres
    angle: Millidegrees = Field(
        description="Angle between finger and X axis, above -180 and up to 180 degrees."
    )

    @classmethod
    def of(cls, place: FingerPlace) -> "ScaraPlace":
        """A place."""
        angle = 180_000 - (180_000 - place.direction) % 360_000
        return cls(
            x=Micrometres(value=round(place.x, DECIMALS)),
            y=Micrometres(value=round(place.y, DECIMALS)),
            angle=Millidegrees(value=round(angle, DECIMALS)),
        )


class ScaraAxisMove(Record):
    """One axis in a move of the robot."""

    axis: int = Field(description="0 is the base, 1 the arm, 2 the finger.")
    body_id: str
    move_id: str | None = Field(
        None,
        description="The body's own move; null before it is begun, and of an axis that has no part in it.",
    )
    status: MoveStatus | None = Field(None, description="Status of the body's move; null without one.")
    end_cause: str | None = Field(None, description="End cause of the body's move.")
    start_position: int = Field(description="Start position in pulses, as the controllers were told (HPS).")
    target_position: int = Field(description="Target position in pulses, as the gateway calculates it.")
    position: int = Field(description="Position in pulses, as last read.")


class ScaraMove(MoveRecord):
    """One move of a SCARA robot: all its axes from one start."""

    scara_id: str
    kind: ScaraMoveKind
    preparation: list[str] = Field(
        default_factory=list, description="The frames before the one that starts it, CR as \\r."
    )
    end_cause: str | None = Field(
        default=None,
        description="normal, stop_command, or what has ended the axes that failed: ems, stall, cw_limit, "
        "ccw_limit as a controller says; not_executed, position_mismatch, lost, unknown as the gateway does.",
    )
    failed_axes: list[int] = Field(default_factory=list, description="The axes that made it fail.")
    start: ScaraPlace | None = Field(
        default=None, description="Place at which the finger ended before the move."
    )
    target: ScaraPlace | None = Field(default=None, description="Place at which the finger is to end.")
    coordinates: ScaraPlace | None = Field(
        default=None,
        description="Place of the finger by the positions last read; null while one is not known.",
    )
    axes: list[ScaraAxisMove] = Field(default_factory=list, description="Moves of the axes, in their order.")


class ScaraSamples(Record):
    """Where the axes of a robot were seen during a move."""

    scara_id: str
    move_id: str
    axes: list[BodySamples] = Field(
        description=(
            "Samples of each axis that has a part in the move, as of its body's own move: each is asked at "
            "a time of its own."
        )
    )


class PlannedScaraMove(Record):
    """A robot's move that was worked out and not sent."""

    scara_id: str
    frames: list[str] = Field(description="The exact frames that would be sent, CR as \\r.")
    start: ScaraPlace
    target: ScaraPlace
    start_positions: list[int] = Field(description="Present positions in pulses, in the order of the axes.")
    target_positions: list[int] = Field(
        description="Target positions in pulses, in the order of the axes, as the gateway calculates them."
    )
    length_um: float | None = Field(
        description="Length in micrometres of the way that the speed counts on; null where axes turn alone."
    )
    duration_s: float | None = Field(
        None, description="Seconds for which pulses would run, with the present settings."
    )
    note: str | None = Field(None, description="Why something is not known, or would be refused.")
