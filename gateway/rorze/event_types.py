"""The types of events of bodies, of their groups and of their lines."""

from pydantic import Field

from gateway.core.backup_record import Restore
from gateway.core.event_types import (
    LINE,
    EventData,
    EventType,
    LeftMoving,
    Nothing,
    Swap,
    Unreadable,
    backup_types,
    lease_types,
    move_types,
    news_types,
    restore_types,
)
from gateway.core.move_record import Move
from gateway.rorze.live import BodyPosition
from gateway.rorze.move_requests import BodyJog
from gateway.rorze.positions import PositionReading, TableUpload
from gateway.rorze.power import Acknowledgement
from gateway.rorze.program_runs import ProgramRun
from gateway.rorze.program_uploads import ProgramUpload
from gateway.rorze.scans import Scan
from gateway.rorze.stops import StopReport

BODY, GROUP = "/bodies/{body_id}", "/groups/{group_id}"


class WentOffline(EventData):
    """Why a body counts as silent."""

    asked: bool = Field(description="False where no body on its line was heard, and it was not asked itself.")


class LineStopsUnconfirmed(EventData):
    """Stops on a line on which no body answers; the event of each body is told as well."""

    silent_s: float = Field(
        description="Seconds since the first of them without an answer of any body on the line."
    )
    stops: int = Field(description="The number of bodies whose stops are not confirmed.")
    bodies: list[str]


class StatusChange(EventData):
    """The bits of its controller status that are set (RC-420 manual 13.8.1)."""

    status: list[str]


class BodyPowerLoss(EventData):
    """How sure the gateway is, and why."""

    certain: bool
    why: str = Field(description="A sign that was seen: its mark is gone, or its position changed, say.")


class PowerAcknowledged(EventData):
    """The reason why it may go to places again."""

    by: Acknowledgement


class MarkMissing(EventData):
    """Why no mark can be kept in a body."""

    comment: int = Field(description="The number of the user comment, 1-7.")
    detail: str


class ControllerEvent(EventData):
    """A frame 7E: the fields that its ESS setting names, in the order they came (RC-420 manual 13.11.3)."""

    C: int | None = Field(None, description="Controller status (9CD).")
    M: int | None = Field(None, description="Cause of the end of the last move (9MD).")
    S: int | None = Field(None, description="Sensors (CLD).")
    I: int | None = Field(None, description="Inputs.")  # noqa: E741  # the letter of the frame
    O: int | None = Field(None, description="Outputs.")  # noqa: E741  # the letter of the frame
    P: int | None = Field(None, description="Position in pulses; encoder counts in encoder mode.")


class SensorChange(EventData):
    """A sensor that is on or off now."""

    sensor: str = Field(description="stall, origin, cw_limit, ccw_limit, in_position or ems.")
    on: bool


class InputChange(EventData):
    """A general input that is on or off now."""

    number: int
    name: str | None = Field(description="Name of the input in the configuration.")
    on: bool


class ProgramText(EventData):
    """Text that a user program sends (SDC, SDD)."""

    text: str


class EndFrame(EventData):
    """A frame 7D of a body that is not in the configuration."""

    command: str
    cause: int = Field(description="The byte of 9MD, 0 after a normal end.")


class SettingsNews(EventData):
    """Settings, speed sets or patterns that are otherwise now."""

    commands: list[str] = Field(
        description="Commands that were sent and read back, in order, without frames."
    )
    saved: bool = Field(description="True if all its settings were written to flash memory then (FIS).")


class Strangers(EventData):
    """Bodies that have obeyed a command to a group, and are no members of it."""

    bodies: list[str]


class Strictness(EventData):
    """The new strictness of a line: strict, it believes acknowledgements only between two fences."""

    strict: bool


class LineMessage(EventData):
    """A frame of a special address that the gateway does not know."""

    frame: str


BODIES = (
    *move_types("body", BODY, Move),
    *lease_types("body", BODY),
    *news_types(
        "body.stop",
        BODY,
        StopReport,
        requested="a stop is asked for",
        confirmed="the motor stands still, as its controller says",
        unconfirmed="it is not confirmed in time, and is repeated on",
    ),
    EventType("body.motion.foreign", BODY, Nothing, "it moves, and the gateway has not started that"),
    EventType("body.online", BODY, Nothing, "it answers again"),
    EventType("body.offline", BODY, WentOffline, "it does not answer any more"),
    EventType("body.unreadable", BODY, Unreadable, "the health poll could not learn its state"),
    EventType("body.status.changed", BODY, StatusChange, "bits of its controller status have changed"),
    EventType("body.power_cycled", BODY, BodyPowerLoss, "it has lost its power, or seems to"),
    EventType(
        "body.swapped", BODY, Swap, "its settings after a loss of power are not those of the last night"
    ),
    EventType("body.power_cycle.acknowledged", BODY, PowerAcknowledged, "it may go to places again"),
    EventType("body.power_mark.missing", BODY, MarkMissing, "no mark can be kept in it"),
    EventType("body.controller_event", BODY, ControllerEvent, "it has reported a change of state (frame 7E)"),
    EventType("body.sensor.changed", BODY, SensorChange, "a sensor is told to be another than before"),
    EventType("body.input.changed", BODY, InputChange, "an input is told to be another than before"),
    EventType("body.program.message", BODY, ProgramText, "its user program tells something (SDC, SDD)"),
    EventType("body.end_frame", BODY, EndFrame, "an unknown body has ended a move (frame 7D)"),
    *news_types(
        "body.program.upload",
        BODY,
        ProgramUpload,
        started="a user program is being uploaded",
        progress="an upload has come further; once a second at most",
        succeeded="the program was read back and is the one that was sent",
        failed="an upload was broken off, or the body holds another program: `stored` says what",
        cancelled="a request, a stop or the end of the gateway has broken off an upload",
    ),
    *backup_types("body", BODY),
    *news_types(
        "body.position_reading",
        BODY,
        PositionReading,
        started="its table of positions is being read",
        progress="more of it was read; once a second at most",
        succeeded="all was read: the record has the positions",
        failed="it did not tell all",
        cancelled="a request or the end of the gateway has ended it",
    ),
    *news_types(
        "body.position_upload",
        BODY,
        TableUpload,
        started="positions are being stored in it",
        progress="more were sent, or read back; once a second at most",
        succeeded="all were read back and are those that were sent",
        failed="not all were sent, or it holds others",
        cancelled="a request or the end of the gateway has ended it",
    ),
    *restore_types("body", BODY, Restore),
    *news_types(
        "body.jog",
        BODY,
        BodyJog,
        started="it jogs",
        stopping="it is told to stop, and may still move",
        ended="the jog was ended by request, or by its move's end, and the motor stands still",
        lost="its heartbeat stayed away, and the motor stands still",
        stopped="a stop or the end of the gateway has ended it, and the motor stands still",
    ),
    EventType("body.program.started", BODY, ProgramRun, "the gateway has started its user program"),
    EventType("body.program.ended", BODY, ProgramRun, "that program has ended, or nobody knows: `status`"),
    EventType("body.position", BODY, BodyPosition, "somebody watches it (`sample`)", live=True),
    EventType("body.settings.changed", BODY, SettingsNews, "settings were changed by one of its documents"),
    EventType("body.left_moving", BODY, LeftMoving, "the gateway ends, and it moves as far as is known"),
)

LINES = (
    *backup_types("line", LINE),
    *restore_types("line", LINE, Restore),
    *lease_types("group", GROUP),
    EventType("group.strangers", GROUP, Strangers, "bodies obey the group that do not count among it"),
    EventType(
        "line.stops.unconfirmed",
        LINE,
        LineStopsUnconfirmed,
        "nobody on it answers, and stops of its bodies are not confirmed in time",
    ),
    EventType("line.strict", LINE, Strictness, "a reply came twice, or none has for an hour"),
    EventType("line.message", LINE, LineMessage, "a frame came that nobody knows"),
    *news_types(
        "line.scan",
        LINE,
        Scan,
        running="a scan has begun, or has found a body",
        finished="it has asked all 120 body numbers",
        failed="it was broken off",
    ),
)

TYPES = (*BODIES, *LINES)
