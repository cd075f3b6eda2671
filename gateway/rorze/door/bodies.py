"""Bodies: what they are, where they stand, in which state, and the speed of a running move."""

import asyncio
from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Annotated, Any, Final, Literal, Self

from pydantic import Field, WithJsonSchema, model_validator
from typing_extensions import TypeAliasType, TypedDict

from gateway.core.errors import GatewayError
from gateway.core.marks import DETAIL
from gateway.core.move_record import CountedIn, Move
from gateway.core.operation import Rows, Wait
from gateway.core.records import AnswerModel, RequestModel, SentBack, example, require_same
from gateway.core.rights import Right
from gateway.core.targets import CommandReplies, Target
from gateway.core.times import age_ms_of, utc_of
from gateway.door.caller import sees
from gateway.door.doing import do_text
from gateway.door.names import LineId
from gateway.door.results import StopResult
from gateway.plant import Plant
from gateway.rorze.asked_body import Homed
from gateway.rorze.bodies import Body
from gateway.rorze.family import Rorze
from gateway.rorze.knowledge import PULSES_RUNNING
from gateway.rorze.line import Line
from gateway.rorze.move_requests import SpeedRequest
from gateway.rorze.signals import SensorBits
from gateway.rorze.units import Length, LengthUnit, require_whole
from gateway.security import entries
from protocols.rorze.encoder import ClearEncoderStallError, GetEncoderStallError
from protocols.rorze.inputs_outputs import GetSensors
from protocols.rorze.notation import BILLION
from protocols.rorze.position import GetPosition, SetPosition
from protocols.rorze.row import RorzeCommand
from protocols.rorze.stall_sensor import ClearStallSensorError, GetStallSensorError, StallError
from protocols.rorze.status import (
    CONTROLLER_STATUS_BITS,
    END_CAUSE_BITS,
    SENSOR_BITS,
    GetControllerStatus,
    GetEndCause,
    names_of,
)
from protocols.table import Ack

ROWS: Final = Rows("bodies")
StallFinder = TypeAliasType("StallFinder", Literal["stall_sensor", "encoder"])
WHERE = GetPosition()
STALL_FINDERS: Final[Sequence[tuple[StallFinder, RorzeCommand[StallError], type[RorzeCommand[Ack]]]]] = (
    ("stall_sensor", GetStallSensorError(), ClearStallSensorError),
    ("encoder", GetEncoderStallError(), ClearEncoderStallError),
)
Fresh = Annotated[bool, Field(description="Ask each body for its status and position first.")]


class BodyInfo(TypedDict):
    """A body as the gateway knows it, without asking it."""

    # No model: nothing of it comes from outside, and a list of 120 has no time for checks.
    body_id: Annotated[str, Field(description="Unique address, such as arm.3F.")]
    line_id: str
    name: str
    online: Annotated[bool, Field(description="True if it can be asked now, as far as is known.")]
    last_heard_at: Annotated[datetime | None, Field(description="Time at which it last answered anything.")]
    known_age_s: Annotated[
        float | None,
        Field(description="Age of the reading in seconds; null if it never answered."),
    ]
    moving: Annotated[
        bool | None,
        Field(description="True if the motor moves; null while out of reach, and until its status is read."),
    ]
    move_id: Annotated[str | None, Field(description="The move that is not over yet.")]
    homed: Annotated[
        Homed,
        Field(
            description="yes: homed by the gateway, and its power was kept since; no: it has lost its power."
        ),
    ]
    power_cycled: Annotated[
        bool,
        Field(
            description=(
                "True if it has lost its power; motions to places are refused until it is homed, its "
                "position is set, or that is acknowledged."
            )
        ),
    ]
    unit: Annotated[str | None, Field(description="The unit of its scale; null without one.")]
    pulses_per_unit: float | None
    groups: list[str]
    counted_in: Annotated[
        CountedIn | None,
        Field(
            description=(
                "Unit of the position; null until its operating mode is read, as `position` of a body and "
                "its live values have it, and again after it may have changed."
            )
        ),
    ]
    position: Annotated[
        int | None,
        Field(
            description=(
                "Position as last read, in `counted_in`; null until it was read since it was called "
                "otherwise."
            )
        ),
    ]
    position_read_at: datetime | None
    status: Annotated[list[str] | None, Field(description="The status bits that were set when last read.")]


class BodyList(TypedDict):
    """All bodies of the configuration."""

    bodies: list[BodyInfo]


class Position(AnswerModel):
    """Where a motor stands."""

    body_id: str
    pulses: int = Field(description="Or encoder counts: see `counted_in`.")
    counted_in: CountedIn | None = Field(
        description="encoder_counts in encoder mode (RC-420 manual 13.1.3); null where the mode is not known."
    )
    value: float | None = Field(description="Position in `unit`; null without a scale.")
    unit: str | None
    read_at: datetime = Field(description="Time of the controller's answer.")
    age_ms: float = Field(description="Age of the answer in ms when it was passed on.")


class PositionToCall(SentBack, json_schema_extra=example(value=0, unit="pulse")):
    """A number for the present position: by `value` and `unit`, or by `pulses`, as GET gives it."""

    read_only = frozenset(("body_id", "counted_in"))
    passing = frozenset(("read_at", "age_ms"))

    value: Annotated[int | float, WithJsonSchema({"type": "number"})] | None = Field(
        default=None, gt=-BILLION, lt=BILLION, description="Pulses are whole numbers."
    )
    unit: LengthUnit | None = Field(
        default=None, description="mm, um, deg and mdeg need the body's scale in the configuration."
    )
    pulses: Annotated[int, Field(gt=-BILLION, lt=BILLION)] | None = Field(
        default=None, description="Encoder counts in encoder mode; `value` and `unit` follow from them."
    )

    @model_validator(mode="after")
    def _one_place(self) -> Self:
        if self.pulses is None and (self.value is None or self.unit is None):
            raise ValueError("give value and unit, or pulses")
        require_whole(self.value, self.unit)
        return self

    def pulses_of(self, body: Body) -> int:
        """The position as the controller counts.

        :raises InvalidRequest: the body has no scale for the unit, or something beside it is otherwise.
        """
        if self.pulses is None:
            return Length(value=self.value or 0, unit=self.unit or "pulse").pulses(body.scale)
        beside = self.model_dump(include={"value", "unit"} & self.model_fields_set)
        require_same(self.told | beside, _position(body, self.pulses, 0.0))
        return self.pulses


class StatusBits(AnswerModel):
    """The bits of 9CD (RC-420 manual 13.8.1). The errors stay until they are cleared."""

    pulses_running: bool
    limit_error: bool
    ems_error: bool
    command_error: bool
    initialisation_error: bool
    range_error: bool
    stall_error: bool
    communication_error: bool


class Unanswered(AnswerModel):
    """A body that did not answer."""

    body_id: str
    detail: str = Field(description="Why.")


class LinePositions(AnswerModel):
    """Where all motors of a line stand."""

    line_id: str
    positions: list[Position]
    unanswered: list[Unanswered]


class MotorStatus(AnswerModel):
    """The controller status of a body."""

    body_id: str
    moving: bool
    status: StatusBits
    read_at: datetime = Field(description="Time of the controller's answer.")
    age_ms: float = Field(description="Age of the answer in ms when it was passed on.")


class LineStatuses(AnswerModel):
    """The controller status of all bodies of a line."""

    line_id: str
    statuses: list[MotorStatus]
    unanswered: list[Unanswered]


class StallFound(AnswerModel):
    """A STALL error that stands: moves are refused until it is cleared or the axis homed."""

    finder: StallFinder = Field(description="Finder that raised it: QRD or PRD tells of it.")
    reset: str = Field(description="The route that clears it: POST, with {}.")


class BodyStatus(AnswerModel):
    """The state of a controller."""

    body_id: str
    moving: bool
    status: StatusBits
    sensors: SensorBits
    stalls: list[StallFound] = Field(
        description="Finders whose STALL error stands.", json_schema_extra=DETAIL
    )
    end_causes: list[str] = Field(
        description="Why the last move ended: stall, cw_limit, ccw_limit, ems, stop_command; "
        "empty after a normal end, and while the motor moves."
    )
    read_at: datetime = Field(description="Time of the first of the three answers.")
    age_ms: float


class SpeedAccepted(AnswerModel):
    """The controller has accepted a change of speed."""

    body_id: str
    command: str = Field(description="The three characters of the controller's command.")


@ROWS.get("/bodies/{body_id}/position")
async def get_position(body: Body) -> Position:
    """Ask the controller where the motor stands (6PD), and for its mode where that is not known (EAD)."""
    if body.told.mode is None:
        await body.know_mode()
    reply, answered = await body.ask(WHERE)
    return _position(body, reply.pulses, answered.at)


@ROWS.put("/bodies/{body_id}/position", Right.SETUP, later=True)
async def set_position(body: Body, position: PositionToCall) -> Position:
    """Call the present position by another number (6PS). Nothing moves; refused while the motor moves."""
    pulses = position.pulses_of(body)
    _, answered = await body.ask(SetPosition(position=pulses))
    return _position(body, pulses, answered.at)


@ROWS.get("/bodies/{body_id}/status")
async def get_status(body: Body) -> BodyStatus:
    """Ask the controller for its status (9CD), the cause of the last end (9MD) and its sensors (CLD).

    Where a STALL error stands it is asked who has found it (QRD, PRD).
    """
    (status, first), (cause, _), (sensors, _) = await asyncio.gather(
        body.ask(GetControllerStatus()), body.ask(GetEndCause()), body.ask(GetSensors())
    )
    flags = _flags(status.bits or 0, CONTROLLER_STATUS_BITS)
    stalls = await _stalls(body) if flags["stall_error"] else []
    return BodyStatus(
        body_id=body.address,
        moving=bool((status.bits or 0) & PULSES_RUNNING),
        status=StatusBits(**flags),
        sensors=SensorBits(**_flags(sensors.bits or 0, SENSOR_BITS)),
        stalls=stalls,
        end_causes=names_of(cause.bits, END_CAUSE_BITS),
        read_at=utc_of(first.at),
        age_ms=age_ms_of(first.at),
    )


async def _stalls(body: Body) -> list[StallFound]:
    return [
        StallFound(finder=finder, reset=f"/bodies/{body.address}/commands/{clears.name()}")
        for finder, question, clears in STALL_FINDERS
        if (await body.ask(question))[0].stalled
    ]


@ROWS.post("/bodies/{body_id}/speed", Right.OPERATE, later=True)
async def change_speed_of_move(body: Body, speed: SpeedRequest) -> SpeedAccepted:
    """Change the speed of the running move; refused at standstill, while homing and while interpolating."""
    command = speed.command()
    await body.ask(command)
    return SpeedAccepted(body_id=body.address, command=command.code)


@ROWS.get("/lines/{line_id}/positions")
async def get_positions(plant: Plant, line_id: LineId) -> LinePositions:
    """Ask all bodies of a line where they stand (6PD), in the fewest frames."""
    told, unanswered = await _sweep(plant, line_id, WHERE)
    positions = [_position(body, reply.pulses, at) for body, (reply, at) in told.items()]
    return LinePositions(line_id=line_id, positions=positions, unanswered=unanswered)


@ROWS.get("/lines/{line_id}/statuses")
async def get_statuses(plant: Plant, line_id: LineId) -> LineStatuses:
    """Ask all bodies of a line for their status (9CD), in the fewest frames."""
    told, unanswered = await _sweep(plant, line_id, GetControllerStatus())
    statuses = [_motor_status(body, reply.bits or 0, at) for body, (reply, at) in told.items()]
    return LineStatuses(line_id=line_id, statuses=statuses, unanswered=unanswered)


@ROWS.get("/bodies", any_scope=True)
async def list_bodies(plant: Plant, *, fresh: Fresh = False) -> BodyList:
    """List all bodies as they were last seen; with `fresh`, they are asked for status and position first."""
    rorze = plant.family(Rorze)
    if fresh:  # those out of scope, too; the silent keep what was known
        await asyncio.gather(*(_poll_line(rorze, line) for line in rorze.lines.values()))
    return {"bodies": [_info(rorze, body) for body in rorze.bodies() if sees(plant.access, body.address)]}


async def _poll_line(rorze: Rorze, line: Line) -> None:
    for command in (GetControllerStatus(), GetPosition()):
        await rorze.sweep_of(line).ask(rorze.bodies_of(line), command)


@ROWS.get("/bodies/{body_id}")
async def get_body(rorze: Rorze, body: Body) -> BodyInfo:
    """Tell what is known of a body; nothing is sent."""
    return _info(rorze, body)


@ROWS.post("/bodies/{body_id}/power-cycle/acknowledge", Right.OPERATE)
async def acknowledge_body_power_cycle(plant: Plant, body: Body) -> BodyInfo:
    """Allow motions to places again after a loss of power: its position counts from where it was switched on.

    The controller is asked whether it has kept its power since. Its settings and its position table are those
    of its flash memory. Homing does the same as this, and so does setting its position.
    """
    await body.acknowledge_power_cycle()
    plant.access.security.note(entries.POWER_CYCLE_ACKNOWLEDGED, body.address)
    return _info(plant.family(Rorze), body)


def _position(body: Body, pulses: int, at: float) -> Position:
    scale = body.scale
    return Position(
        body_id=body.address,
        pulses=pulses,
        counted_in=body.counted_in,
        value=scale.value(pulses) if scale else None,
        unit=scale.unit if scale else None,
        read_at=utc_of(at),
        age_ms=age_ms_of(at),
    )


async def _sweep(
    plant: Plant, line_id: str, command: RorzeCommand[Any]
) -> tuple[Mapping[Body, tuple[Any, float]], list[Unanswered]]:
    """Ask all bodies of a line, and part those that answered from those that did not."""
    plant.target(f"/lines/{line_id}")  # a line that leads to a robot says so
    rorze = plant.family(Rorze)
    line = rorze.lines[line_id]
    results = await rorze.sweep_of(line).ask(rorze.bodies_of(line), command)
    told = {body: result for body, result in results.items() if not isinstance(result, GatewayError)}
    unanswered = [
        Unanswered(body_id=body.address, detail=result.detail)
        for body, result in results.items()
        if isinstance(result, GatewayError)
    ]
    return told, unanswered


def _motor_status(body: Body, bits: int, at: float) -> MotorStatus:
    return MotorStatus(
        body_id=body.address,
        moving=bool(bits & PULSES_RUNNING),
        status=StatusBits(**_flags(bits, CONTROLLER_STATUS_BITS)),
        read_at=utc_of(at),
        age_ms=age_ms_of(at),
    )


def _flags(bits: int, names: tuple[str, ...]) -> dict[str, bool]:
    return {name: bool(bits >> position & 1) for position, name in enumerate(names)}


def _info(rorze: Rorze, body: Body) -> BodyInfo:
    heard_at, place, online, scale = body.last_heard_at, body.told.place, body.online, body.scale
    bits = body.told.status_bits
    return {
        "body_id": body.address,
        "line_id": body.line.id,
        "name": body.configured.name,
        "online": online,
        "last_heard_at": None if heard_at is None else utc_of(heard_at),
        "known_age_s": None if heard_at is None else round(age_ms_of(heard_at) / 1000, 3),
        "moving": body.moving if online else None,
        "move_id": body.move.id if body.move else None,
        "homed": body.power.homed,
        "power_cycled": body.power.cycled,
        "unit": scale.unit if scale else None,
        "pulses_per_unit": scale.pulses_per_unit if scale else None,
        "groups": [group.address for group in rorze.groups_of(body)],
        "counted_in": body.counted_in,
        "position": body.told.position,
        "position_read_at": None if place is None else utc_of(place.at),
        "status": None if bits is None else names_of(bits, CONTROLLER_STATUS_BITS),
    }


TEXTS: Final = Rows("commands")


class RawRequest(RequestModel, json_schema_extra=example(text="6PD")):
    """A command as it stands on the line, without introducer, body number and CR."""

    text: Annotated[str, Field(pattern=r"^[0-9A-Z*+/-]{3}[ -%'-~]*$", max_length=58, examples=["6PD"])]


class RawReply(AnswerModel):
    """The answer to a command as text."""

    body_id: str
    sent: str = Field(description="The exact bytes, CR as \\r.")
    reply: str = Field(description="Text behind the code in the reply, as it came.")
    age_ms: float


@TEXTS.post("/bodies/{body_id}/raw", Right.SETUP, leased=False, result=RawReply | StopResult, may_begin=Move)
async def send_raw(
    plant: Plant, body: Body, target: Target, raw: RawRequest, *, wait: Wait = None, keyed: bool
) -> Any:
    """Send a command as text. A command that moves makes a move, and one that stops makes a stop."""
    command, result = await do_text(plant, target, raw.text, wait, keyed=keyed)
    if not isinstance(result, CommandReplies):
        return result
    return RawReply(
        body_id=body.address,
        sent=body.line.frame_of(body.number, command),
        reply=result.texts[0],
        age_ms=age_ms_of(result.at or 0.0),
    )
