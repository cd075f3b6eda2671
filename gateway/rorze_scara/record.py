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
    angle: Millidegrees = Field(description="Between finger and X axis, above -180 and up to 180 degrees.")

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
    status: MoveStatus | None = Field(None, description="As the body's move says; null without one.")
    end_cause: str | None = Field(None, description="As the body's move says.")
    start_position: int = Field(description="In pulses, as the controllers were told (HPS).")
    target_position: int = Field(description="In pulses, as the gateway calculates it.")
    position: int = Field(description="In pulses, as last read.")


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
    start: ScaraPlace | None = Field(default=None, description="Where the finger ended before.")
    target: ScaraPlace | None = Field(default=None, description="Where it should come to.")
    coordinates: ScaraPlace | None = Field(
        default=None, description="Where it ends by the positions last read; null while one is not known."
    )
    axes: list[ScaraAxisMove] = Field(default_factory=list, description="In the order of the axes.")


class ScaraSamples(Record):
    """Where the axes of a robot were seen during a move."""

    scara_id: str
    move_id: str
    axes: list[BodySamples] = Field(
        description="Those of each axis that has a part in it, as the samples of its body's own move: each "
        "is asked at a time of its own."
    )


class PlannedScaraMove(Record):
    """A robot's move that was worked out and not sent."""

    scara_id: str
    frames: list[str] = Field(description="The exact frames that would be sent, CR as \\r.")
    start: ScaraPlace
    target: ScaraPlace
    start_positions: list[int] = Field(description="In pulses, in the order of the axes.")
    target_positions: list[int] = Field(description="In pulses, as the gateway calculates them.")
    length_um: float | None = Field(
        description="Of the way that the speed counts on, in micrometres; null where axes turn alone."
    )
    duration_s: float | None = Field(None, description="How long pulses would run, with the settings of now.")
    note: str | None = Field(None, description="Why something is not known, or would be refused.")
