"""What the gateway takes and gives; generated from openapi/resources.json."""

from __future__ import annotations

from typing import Any, Literal, NotRequired, TypeAlias, TypedDict


class AboutSetting(TypedDict):
    """The manual's words on a setting."""

    command: str
    """The code that sets it."""
    unit: str | None
    """pulse, pps, pps/s, percent, ms, um, pulse/count; null for none."""
    minimum: float | None
    maximum: float | None
    default: JsonValue
    """Value when nothing was written to flash memory."""


class AbsoluteMoveRequest(TypedDict):
    """Move to a position (RC-420 manual 13.2)."""

    start_within_s: NotRequired[float]
    """Seconds the move may wait for its turn; if it is not sent by then, it never is. Left out: 5.0."""
    kind: Literal["absolute"]
    position: Length
    speed: NotRequired[Speed]
    """`low` runs at the start speed, without ramps. Left out: high."""
    pattern: NotRequired[int | None]
    """Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."""
    max_speed: NotRequired[Rate | None]
    """The fastest it may get; the standard speed set still bounds it. The gateway writes it to the body's `slow_pattern` (RAM only) before; neither `pattern` nor `low` goes with it."""


class Alarm(TypedDict):
    """A fault of the plant, from its time until a person has reset it."""

    id: str
    cause: str
    """Kind of the alarm, such as `body.offline`; never changes."""
    number: int
    """The number of its cause, as `GET /numbers` has it; never changes."""
    subject: str
    """The part it is about, as in events: /bodies/line1.3F, /lines/line1, /gateway."""
    raised_at: str
    ended_at: str | None
    """Time at which its cause was seen to be over; null while it lasts."""
    reset_at: str | None
    """Time of the reset; null while the alarm stands."""
    reset_by: str | None
    """Who has reset it; `gateway: it came again` where a newer one stands in its place, `gateway: disproved` where it turned out to have had no cause."""
    caller: str
    """The caller in whose name the gateway worked when the alarm came."""
    request_id: str | None
    """The X-Request-Id of that caller's request."""
    move_id: str | None
    """Id of the move that it has ended, if any."""
    code: str | None
    """The controller's own error code."""
    manual: str
    """Section of the manual; empty if the alarm is not about a controller."""
    en: AlarmText
    ja: AlarmText
    when_over: PastWords | None
    """Words of the alarm once its cause is over, in the place of `en` and `ja`; null if these stay true, or were replaced already."""
    part_of: str | None
    """The id of the standing alarm that tells the same event: of a failed move that of its cause, of a body that of its line, of several bodies that of the first. Events leave it out."""
    next: list[NextCall]
    """The calls that help, in the order in which they do."""


class AlarmList(TypedDict):
    """Alarms: those that stand first, then those that were reset, each newest first."""

    alarms: list[Alarm]


class AlarmOfShift(TypedDict):
    """The alarms of one cause that were raised."""

    cause: str
    raised: int
    """Number of alarms that were raised."""
    standing: int
    """Number of alarms that still stand."""


class AlarmRaisedEvent(TypedDict):
    """Something has gone wrong; about `/gateway or /lines/{line_id} or /groups/{group_id} or /bodies/{body_id} or /robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["alarm.raised"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Alarm


class AlarmResetEvent(TypedDict):
    """Somebody has seen to it, or a newer alarm stands in its place; about `/gateway or /lines/{line_id} or /groups/{group_id} or /bodies/{body_id} or /robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["alarm.reset"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Alarm


class AlarmText(TypedDict):
    """An alarm in one language."""

    happened: str
    """The event, in words."""
    motor: str
    """The motor's reaction, or what it may still do."""
    remedy: str
    """The next step for the operator."""


class Amount(TypedDict):
    """A coordinate, or an amount to move by, in the unit its axis is set up for."""

    value: float
    unit: AmountUnit


class Angle(TypedDict):
    """An angle, counterclockwise from X."""

    value: float
    unit: Literal["deg", "mdeg"]


class Audit(TypedDict):
    """Actions, the newest first."""

    deeds: list[Deed]
    cursor: str | None
    """Cursor of the next page, with older actions; null if there is none."""


class AxisAmounts(TypedDict):
    """AxisAmounts"""


class AxisInfo(TypedDict):
    """An axis as it is configured."""

    name: str
    unit: str
    """Unit of its coordinates: mm, pulse or degree."""
    speed_unit: str


class AxisOfShift(TypedDict):
    """The moves of one body, or of one unit of a robot."""

    target: str
    """Address of the body or unit: line1.3F, or r1/units/1."""
    moves: int
    """Number of moves."""
    succeeded: int
    """Number of moves that ended well."""
    failed: int
    """Number of moves that failed, were lost or rejected, or are unknown."""
    mean_s: float | None
    """Mean time from the command to the end, in seconds; null if nothing moved."""
    longest_s: float | None
    longest_move: str | None
    """The id of the move that took longest."""


class AxisPlace(TypedDict):
    """Where an axis stands."""

    value: float | None
    """Coordinate; null while the robot does not know it."""
    unit: str
    """mm, pulse or degree."""
    reason: UnknownReason | None
    """Why it is not known: not homed, homing or a macro or automatic operation under way, no user coordinates where the motors stand, or not to be found out."""


class AxisPulses(TypedDict):
    """Positions of all axes."""

    pulses: list[int]
    """Positions of axes 0, 1 and 2; belt-linked robots have two."""


class AxisSensorChange(TypedDict):
    """A sensor of a motor axis as it is now (C-HOST manual 2-11)."""

    unit: int
    axis: str
    sensor: Literal["origin", "plus_limit", "minus_limit"]
    on: bool


class AxisSensors(TypedDict):
    """The sensors of a motor axis."""

    origin: bool
    plus_limit: bool
    minus_limit: bool


class AxisSpeed(TypedDict):
    """A speed in the unit its axis is set up for."""

    value: float
    unit: Literal["mm/s", "kpps", "rpm"]


class AxisState(TypedDict):
    """How a motor axis is (C-HOST manual 2-10, 2-11)."""

    motion: AxisMotion
    """stopped: by the stop input or an immediate stop."""
    origin_done: bool
    servo_ready: bool
    moving: bool
    alarm: bool
    driver_error: str
    """The driver's own code, hexadecimal as in `31h`; `00h` when it has none."""
    sensors: AxisSensors


class AxisStatusChange(TypedDict):
    """How a motor axis is now (C-HOST manual 2-10)."""

    unit: int
    axis: str
    status: list[Literal["origin_done", "servo_ready", "alarm"]]
    """The bits that are set."""
    driver_error: str
    """The driver's own code, hexadecimal as in `31h`; `00h` when it has none."""


class AxisUnits(TypedDict):
    """AxisUnits"""


class AxisValue(TypedDict):
    """A coordinate or a speed of an axis, with its unit."""

    value: float
    unit: str
    """mm, pulse or degree; mm/s, kpps or rpm."""


class AxisValues(TypedDict):
    """AxisValues"""


class Backup(TypedDict):
    """One backup that is being read, or was."""

    id: str
    target: str
    """Path of the body, line or robot that is read."""
    status: JobStatus
    controllers: list[str]
    """Ids of the bodies, or of the robot, that are read, in their order."""
    controller: str | None
    """The controller that is being read, or was when the reading ended."""
    read: int
    """Answers read so far."""
    expected: int | None
    """Answers it takes at most, as far as is known: settings that were never set are not asked for. Null if unknown."""
    left_s: float | None
    """Seconds that it still takes, by the line's speed first, then by its own pace; null if unknown."""
    baud: int | None
    """Baud rate of the line, if its port tells it: 38400 takes a third of the time of 9600."""
    error: BackupError | None
    """The error that ended the reading early."""
    request_id: str | None
    """The X-Request-Id of the request that asked for it."""
    started_at: str
    ended_at: str | None
    text: str | None
    """The backup, once it has succeeded. Events leave it out: ask for the record."""


class BackupComparison(TypedDict):
    """One comparison of controllers with a backup: what a restore would do; nothing is written."""

    id: str
    target: str
    """Path of the body, line or robot that is read."""
    status: JobStatus
    controllers: list[str]
    """Ids of the bodies, or of the robot, that are read, in their order."""
    controller: str | None
    """The controller that is being read, or was when the reading ended."""
    read: int
    """Answers read so far."""
    expected: int | None
    """Answers it takes at most, as far as is known: settings that were never set are not asked for. Null if unknown."""
    left_s: float | None
    """Seconds that it still takes, by the line's speed first, then by its own pace; null if unknown."""
    baud: int | None
    """Baud rate of the line, if its port tells it: 38400 takes a third of the time of 9600."""
    error: BackupError | None
    """The error that ended the reading early."""
    request_id: str | None
    """The X-Request-Id of the request that asked for it."""
    started_at: str
    ended_at: str | None
    scales: list[ScaleDifference]
    """The bodies whose scale is not that of the backup, and what `units` made of that."""
    commands: list[str] | None
    """The exact commands of a restore, in their order, once it has succeeded. Events leave them and the differences out: ask for the record."""
    differences: list[Difference] | None
    """Differences from the backup; empty if the controllers hold it already."""
    differing: dict[str, int] | None
    """Number of differences by kind: settings, positions, program and others; a program counts once."""
    restore_s: float | None
    """Seconds that a restore and its reading back would take; null if unknown."""


class BackupError(TypedDict):
    """Why it was not read, in the words of a problem detail."""

    type: str
    """The kind of error; stable."""
    detail: str
    remedy: str


class BitMismatch(TypedDict):
    """Bits of a unit at rest that the configured order of bits does not explain."""

    unit: int
    detail: str


class BodyBackupCancelledEvent(TypedDict):
    """A request or the end of the gateway has ended it; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.backup.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class BodyBackupFailedEvent(TypedDict):
    """A controller did not tell all; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.backup.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class BodyBackupProgressEvent(TypedDict):
    """More of it was read; once a second at most; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.backup.progress"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class BodyBackupStartedEvent(TypedDict):
    """A backup is being read; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.backup.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class BodyBackupSucceededEvent(TypedDict):
    """All was read: the record has the text; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.backup.succeeded"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class BodyComparisonCancelledEvent(TypedDict):
    """A request or the end of the gateway has ended it; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.comparison.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class BodyComparisonFailedEvent(TypedDict):
    """A controller did not tell all; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.comparison.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class BodyComparisonProgressEvent(TypedDict):
    """More of it was read; once a second at most; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.comparison.progress"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class BodyComparisonRequest(TypedDict):
    """A backup that a body is to be compared with."""

    backup: NotRequired[str | None]
    """The text of a backup; comments after `;` mean nothing."""
    nightly: NotRequired[Literal["last"] | str | None]
    """Night of a kept backup to be used in the place of `backup`: the last, or a date."""
    without: NotRequired[
        list[Literal["settings", "speed-sets", "patterns", "positions", "memories", "program"]] | None
    ]
    """Sections of the backup that are left as they are, such as positions."""
    units: NotRequired[Literal["keep_pulses", "convert"] | None]
    """Conversion of a backup made at another scale (`[scale]`), which is refused else. keep_pulses: the same pulses, which are other lengths; convert: the same lengths, speeds and accelerations, to the nearest pulse."""
    from_body: NotRequired[str | None]
    """Take what the backup has of another body: two hex digits. Else of the same number."""


class BodyComparisonStartedEvent(TypedDict):
    """It is being compared with a backup; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.comparison.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class BodyComparisonSucceededEvent(TypedDict):
    """All was compared: the record has the differences; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.comparison.succeeded"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class BodyControllerEventEvent(TypedDict):
    """It has reported a change of state (frame 7E); about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.controller_event"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ControllerEvent


class BodyEndFrameEvent(TypedDict):
    """An unknown body has ended a move (frame 7D); about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.end_frame"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: EndFrame


class BodyErrorOutputs(TypedDict):
    """The outputs that report errors."""

    body_id: str
    error_outputs: list[ErrorOutputState]


class BodyInfo(TypedDict):
    """A body as the gateway knows it, without asking it."""

    body_id: str
    """Unique address, such as arm.3F."""
    line_id: str
    name: str
    online: bool
    """True if it can be asked now, as far as is known."""
    last_heard_at: str | None
    """Time at which it last answered anything."""
    known_age_s: float | None
    """Age of the reading in seconds; null if it never answered."""
    moving: bool | None
    """True if the motor moves; null while out of reach, and until its status is read."""
    move_id: str | None
    """The move that is not over yet."""
    homed: Homed
    """yes: homed by the gateway, and its power was kept since; no: it has lost its power."""
    power_cycled: bool
    """True if it has lost its power; motions to places are refused until it is homed, its position is set, or that is acknowledged."""
    unit: str | None
    """The unit of its scale; null without one."""
    pulses_per_unit: float | None
    groups: list[str]
    counted_in: CountedIn | None
    """Unit of the position; null until its operating mode is read, as `position` of a body and its live values have it, and again after it may have changed."""
    position: int | None
    """Position as last read, in `counted_in`; null until it was read since it was called otherwise."""
    position_read_at: str | None
    status: list[str] | None
    """The status bits that were set when last read."""


class BodyInputChangedEvent(TypedDict):
    """An input is told to be another than before; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.input.changed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: InputChange


class BodyInputs(TypedDict):
    """The general inputs, after their logic (DIS) and their noise filters (DCS)."""

    body_id: str
    read_at: str
    """Time of the controller's answer."""
    age_ms: float
    """Age of the answer in ms when it was passed on."""
    inputs: list[SignalState]


class BodyJog(TypedDict):
    """A body that jogs, or has jogged."""

    id: str
    """Id of the jog, and of the move it makes."""
    state: Literal["jogging", "stopping", "ended", "lost", "stopped"]
    """`stopping`: it is told to stop, and may still move. `ended`, `lost` and `stopped`: it was seen to stand still. `ended`: by request, or by itself as at its limit; `lost`: for want of a heartbeat; `stopped`: with all that moves there, or at the end of the gateway."""
    ends_as: Literal["ended", "lost", "stopped"] | None
    """State that follows at standstill; null while it jogs."""
    heartbeat_within_ms: int
    """Seconds within which the next heartbeat has to come."""
    body_id: str
    direction: Direction
    speed: Speed
    distance: int
    """Longest way in pulses; encoder counts in encoder mode."""


class BodyJogEndedEvent(TypedDict):
    """The jog was ended by request, or by its move's end, and the motor stands still; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.jog.ended"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BodyJog


class BodyJogLostEvent(TypedDict):
    """Its heartbeat stayed away, and the motor stands still; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.jog.lost"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BodyJog


class BodyJogRequest(TypedDict):
    """The direction of a jog, its speed and its longest way."""

    direction: Literal["cw", "ccw", "+", "-"]
    """+ is cw, - is ccw."""
    speed: NotRequired[Speed]
    """`low` runs at the start speed, without ramps. Left out: low."""
    pattern: NotRequired[int | None]
    """Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."""
    max_speed: NotRequired[Rate | None]
    """The fastest it may get; the standard speed set still bounds it. The gateway writes it to the body's `slow_pattern` (RAM only) before; neither `pattern` nor `low` goes with it."""
    at_most: NotRequired[Length | None]
    """The jog ends after this distance; never further than 10 s take at its top speed, nor beyond the soft limits."""


class BodyJogStartedEvent(TypedDict):
    """It jogs; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.jog.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BodyJog


class BodyJogStoppedEvent(TypedDict):
    """A stop or the end of the gateway has ended it, and the motor stands still; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.jog.stopped"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BodyJog


class BodyJogStoppingEvent(TypedDict):
    """It is told to stop, and may still move; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.jog.stopping"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BodyJog


class BodyLeaseBrokenEvent(TypedDict):
    """Somebody else has ended a lease; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.lease.broken"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class BodyLeaseExpiredEvent(TypedDict):
    """A lease was not renewed in time; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.lease.expired"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class BodyLeaseReleasedEvent(TypedDict):
    """Its holder has given a lease back; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.lease.released"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class BodyLeaseTakenEvent(TypedDict):
    """Somebody has leased it: nobody else moves or sets it; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.lease.taken"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class BodyLeaseTakenOverEvent(TypedDict):
    """An admin has leased it instead; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.lease.taken_over"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class BodyLeftMovingEvent(TypedDict):
    """The gateway ends, and it moves as far as is known; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.left_moving"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: LeftMoving


class BodyList(TypedDict):
    """All bodies of the configuration."""

    bodies: list[BodyInfo]


class BodyMotionForeignEvent(TypedDict):
    """It moves, and the gateway has not started that; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.motion.foreign"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Nothing


class BodyMoveCancelledEvent(TypedDict):
    """It was not sent, and will not be; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.move.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Move


class BodyMoveFailedEvent(TypedDict):
    """It has ended otherwise; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.move.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Move


class BodyMoveLostEvent(TypedDict):
    """It could not be followed to its end; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.move.lost"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Move


class BodyMoveQueuedEvent(TypedDict):
    """A move waits for its turn; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.move.queued"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Move


class BodyMoveRejectedEvent(TypedDict):
    """The controller has refused its command, or has not executed it: nothing moved; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.move.rejected"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Move


class BodyMoveSentEvent(TypedDict):
    """Its command is on the wire; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.move.sent"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Move


class BodyMoveStartedEvent(TypedDict):
    """It is seen to move; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.move.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Move


class BodyMoveStoppedEvent(TypedDict):
    """A stop has ended it; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.move.stopped"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Move


class BodyMoveSucceededEvent(TypedDict):
    """It has ended as it should; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.move.succeeded"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Move


class BodyMoveUnknownEvent(TypedDict):
    """Nobody can tell whether it was executed, or how it has ended; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.move.unknown"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Move


class BodyNow(TypedDict):
    """A body, as far as is known."""

    body_id: str
    online: bool
    moving: bool | None
    move_id: str | None
    counted_in: CountedIn | None
    """Unit of the position; null where that is not known."""
    position: int | None
    """Position as last read, in `counted_in`."""
    homed: str
    power_cycled: bool
    status: list[str] | None


class BodyOfflineEvent(TypedDict):
    """It does not answer any more; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.offline"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: WentOffline


class BodyOnlineEvent(TypedDict):
    """It answers again; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.online"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Nothing


class BodyOutputs(TypedDict):
    """The general outputs; in servo mode output 0 is the CLR signal."""

    body_id: str
    read_at: str
    """Time of the controller's answer."""
    age_ms: float
    """Age of the answer in ms when it was passed on."""
    outputs: list[SignalState]


class BodyPosition(TypedDict):
    """Where a motor stands (6PD)."""

    pulses: int
    """Or encoder counts: see `counted_in`."""
    counted_in: CountedIn | None
    """Unit of `pulses`; null where its operating mode could not be read."""
    value: float | None
    """Position in `unit`; null without a scale."""
    unit: str | None


class BodyPositionEvent(TypedDict):
    """Somebody watches it (`sample`); about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.position"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    data: BodyPosition
    cursor: str


class BodyPositionReadingCancelledEvent(TypedDict):
    """A request or the end of the gateway has ended it; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.position_reading.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: PositionReading


class BodyPositionReadingFailedEvent(TypedDict):
    """It did not tell all; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.position_reading.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: PositionReading


class BodyPositionReadingProgressEvent(TypedDict):
    """More of it was read; once a second at most; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.position_reading.progress"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: PositionReading


class BodyPositionReadingStartedEvent(TypedDict):
    """Its table of positions is being read; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.position_reading.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: PositionReading


class BodyPositionReadingSucceededEvent(TypedDict):
    """All was read: the record has the positions; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.position_reading.succeeded"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: PositionReading


class BodyPositionUploadCancelledEvent(TypedDict):
    """A request or the end of the gateway has ended it; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.position_upload.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: TableUpload


class BodyPositionUploadFailedEvent(TypedDict):
    """Not all were sent, or it holds others; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.position_upload.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: TableUpload


class BodyPositionUploadProgressEvent(TypedDict):
    """More were sent, or read back; once a second at most; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.position_upload.progress"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: TableUpload


class BodyPositionUploadStartedEvent(TypedDict):
    """Positions are being stored in it; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.position_upload.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: TableUpload


class BodyPositionUploadSucceededEvent(TypedDict):
    """All were read back and are those that were sent; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.position_upload.succeeded"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: TableUpload


class BodyPositions(TypedDict):
    """Stored positions of a body."""

    body_id: str
    positions: list[NamedPosition]
    flash: dict[str, int]
    """Positions in flash memory, by number, as `pulses`: those that count at power-on. Only known ones: the gateway has to have seen that the table was saved (FPS) or loaded (FPD)."""


class BodyPowerCycleAcknowledgedEvent(TypedDict):
    """It may go to places again; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.power_cycle.acknowledged"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: PowerAcknowledged


class BodyPowerCycledEvent(TypedDict):
    """It has lost its power, or seems to; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.power_cycled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BodyPowerLoss


class BodyPowerLoss(TypedDict):
    """How sure the gateway is, and why."""

    certain: bool
    why: str
    """A sign that was seen: its mark is gone, or its position changed, say."""


class BodyPowerMarkMissingEvent(TypedDict):
    """No mark can be kept in it; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.power_mark.missing"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: MarkMissing


class BodyProgramEndedEvent(TypedDict):
    """That program has ended, or nobody knows: `status`; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.program.ended"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ProgramRun


class BodyProgramMessageEvent(TypedDict):
    """Its user program tells something (SDC, SDD); about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.program.message"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ProgramText


class BodyProgramStartedEvent(TypedDict):
    """The gateway has started its user program; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.program.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ProgramRun


class BodyProgramUploadCancelledEvent(TypedDict):
    """A request, a stop or the end of the gateway has broken off an upload; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.program.upload.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ProgramUpload


class BodyProgramUploadFailedEvent(TypedDict):
    """An upload was broken off, or the body holds another program: `stored` says what; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.program.upload.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ProgramUpload


class BodyProgramUploadProgressEvent(TypedDict):
    """An upload has come further; once a second at most; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.program.upload.progress"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ProgramUpload


class BodyProgramUploadStartedEvent(TypedDict):
    """A user program is being uploaded; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.program.upload.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ProgramUpload


class BodyProgramUploadSucceededEvent(TypedDict):
    """The program was read back and is the one that was sent; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.program.upload.succeeded"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ProgramUpload


class BodyRestoreCancelledEvent(TypedDict):
    """A request, a stop or the end of the gateway has ended it; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.restore.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class BodyRestoreDiffersEvent(TypedDict):
    """It was read back, and `differences` is what is not as in the backup; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.restore.differs"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class BodyRestoreFailedEvent(TypedDict):
    """Nobody could read it back, or what flash memory holds is not known; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.restore.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class BodyRestoreProgressEvent(TypedDict):
    """A restore has come further; once a second at most; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.restore.progress"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class BodyRestoreRequest(TypedDict):
    """A backup to be restored to one body."""

    backup: NotRequired[str | None]
    """The text of a backup; comments after `;` mean nothing."""
    nightly: NotRequired[Literal["last"] | str | None]
    """Night of a kept backup to be used in the place of `backup`: the last, or a date."""
    without: NotRequired[
        list[Literal["settings", "speed-sets", "patterns", "positions", "memories", "program"]] | None
    ]
    """Sections of the backup that are left as they are, such as positions."""
    units: NotRequired[Literal["keep_pulses", "convert"] | None]
    """Conversion of a backup made at another scale (`[scale]`), which is refused else. keep_pulses: the same pulses, which are other lengths; convert: the same lengths, speeds and accelerations, to the nearest pulse."""
    from_body: NotRequired[str | None]
    """Take what the backup has of another body: two hex digits. Else of the same number."""
    dry_run: NotRequired[bool]
    """True to be told what would be written and what differs; nothing is written. Left out: false."""
    flash: NotRequired[bool]
    """True to write the settings to flash memory, too, once they were read back. Left out: false."""
    power_cycle: NotRequired[bool]
    """True to wait, with `flash`, until the power was off and on, and compare again. Left out: false."""


class BodyRestoreStartedEvent(TypedDict):
    """A backup is being restored; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.restore.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class BodyRestoreVerifiedEvent(TypedDict):
    """All of the backup was read back; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.restore.verified"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class BodySample(TypedDict):
    """Where a motor stood."""

    time: str
    """Time of the controller's answer."""
    time_s: float
    """Seconds since the move's command was written."""
    pulses: int
    value: float | None
    """Position in `unit`; null without a scale."""
    planned_pulses: float | None
    """Planned place in pulses at this time; null without a plan."""


class BodySamples(TypedDict):
    """Where a body was seen during a move: each answer that told its position, 512 at most."""

    move_id: str
    body_id: str
    unit: str | None
    pulses_per_unit: float | None
    """The body's scale; null without one."""
    planned_s: float | None
    """Seconds for which pulses run in the plan; null without a plan or an end."""
    plan: list[PlannedPoint] | None
    """Evenly spread, and where a part of the curve begins."""
    note: str | None
    """Why there is no plan."""
    samples: list[BodySample]


class BodySensorChangedEvent(TypedDict):
    """A sensor is told to be another than before; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.sensor.changed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: SensorChange


class BodySensors(TypedDict):
    """The sensors, after their logic (DLS)."""

    body_id: str
    read_at: str
    """Time of the controller's answer."""
    age_ms: float
    """Age of the answer in ms when it was passed on."""
    sensors: SensorBits


class BodySettings(TypedDict):
    """The settings of a body."""

    body_id: str
    version: str
    """Version of the control software (9VD)."""
    settings: Settings
    """Settings in RAM: those in force."""
    in_unit: dict[str, Scaled]
    """Settings in pulses, in the body's unit, by their names; empty without a scale."""
    unavailable: dict[str, str]
    """Settings that cannot be read now, and why."""
    flash: Settings | None
    """Settings in flash memory, as far as is known; null where the gateway has seen neither the power come on nor FIS. Position index and outputs change without a command, so they are never told."""
    about: dict[str, AboutSetting]
    """Units, ranges, and values of the factory, by name."""


class BodySettingsChange(TypedDict):
    """Settings to change; the others stay as they are.

    Null ends soft limits, error outputs, and what interrupts are heeded for, record and pulse. For every
    other setting null says that it is not set, or cannot be read, which has to be so.
    """

    origin_offset: NotRequired[int | None]
    """0SS: pulses from the CW edge of the origin sensor to the origin."""
    overrun_factor: NotRequired[int | None]
    """0BS: origin offsets to overrun the origin sensor (RC-420 manual 13.5.1)."""
    homing_retries: NotRequired[int | None]
    """0RS: how often a failed origin search is tried again."""
    stall_sensor_interval: NotRequired[int | None]
    """QIS: period of the stall dogs in pulses, from ON edge to ON edge."""
    stall_sensor_detection: NotRequired[bool | None]
    """QSS."""
    start_speed_pps: NotRequired[int | None]
    maximum_speed_pps: NotRequired[int | None]
    acceleration_pps_s: NotRequired[int | None]
    rising_percent: NotRequired[int | None]
    falling_percent: NotRequired[int | None]
    encoder_multiplier: NotRequired[Literal["double", "quadruple"] | None]
    """PAS: edges counted for each encoder line (RC-420 manual 13.7.3)."""
    encoder_ratio: NotRequired[float | None]
    """PBS: motor pulses for each encoder count, at most two decimals."""
    encoder_stall_threshold: NotRequired[int | None]
    """PES: pulses between motor and encoder that are a step-out."""
    encoder_stall_detection: NotRequired[bool | None]
    """PSS."""
    adjustment: NotRequired[bool | None]
    """PJS: adjust to the encoder after a move; encoder mode only."""
    adjustment_limit: NotRequired[int | None]
    """PKS: most pulses of an adjustment, beyond which is a STALL error; encoder mode only."""
    adjustment_speed_pps: NotRequired[int | None]
    """PLS: 0 is the start speed of speed set 30; encoder mode only."""
    adjustment_delay_ms: NotRequired[int | None]
    """PTS: wait between a move and its adjustment, in steps of 10 ms; encoder mode only."""
    operating_mode: NotRequired[Literal["stepping", "encoder", "servo"] | None]
    """EAS: stepping motor, stepping motor with encoder, or servo drive (RC-420 manual 13.1)."""
    pulse_format: NotRequired[Literal["pulse_direction", "cw_ccw"] | None]
    """EDS."""
    soft_limits: NotRequired[Stretch | None]
    """EPS: moves that would end outside are refused; null where there are none."""
    input_logic: NotRequired[dict[str, Literal["normally_open", "normally_closed"]] | None]
    """DIS."""
    sensor_logic: NotRequired[dict[str, Literal["normally_open", "normally_closed"]] | None]
    """DLS: the sensor inputs, and the CLR output."""
    noise_filters: NotRequired[dict[str, int] | None]
    """DCS: equal samples, one each ms, that make a change of level."""
    outputs: NotRequired[dict[str, bool] | None]
    """COS: general outputs; FIS keeps them as they are then."""
    error_outputs: NotRequired[dict[str, ErrorOutputSetting | None] | None]
    """CES: the output that reports an error; each needs one of its own."""
    interrupt_edges: NotRequired[dict[str, Literal["off", "falling", "rising"]] | None]
    """CPS: the edge that interrupts; setting it clears what is recorded and pulsed."""
    interrupt_ranges: NotRequired[dict[str, Stretch | None] | None]
    """CSS: where an interrupt is heeded; null for everywhere."""
    interrupt_records: NotRequired[dict[str, dict[str, int | None]] | None]
    """CFS: the positions of the table that take a value."""
    interrupt_pulses: NotRequired[dict[str, InterruptPulse | None] | None]
    """CFS: the pulse that an interrupt gives."""
    clear_pulse_ms: NotRequired[int | None]
    """CCS: the CLR signal's pulse; 0 gives none; servo mode only."""
    robot_type: NotRequired[Literal["three_axes", "two_axes_belt_linked"] | None]
    """HTS; not in encoder mode."""
    driven_axis: NotRequired[int | None]
    """HCS: the axis of a SCARA robot that it drives; not in encoder mode."""
    arm_length_um: NotRequired[int | None]
    """HAS; not in encoder mode."""
    finger_length_um: NotRequired[int | None]
    """HFS; not in encoder mode."""
    pulses_per_turn: NotRequired[dict[str, float] | None]
    """HZS: of each axis, with up to eight decimals; not in encoder mode."""
    position_index: NotRequired[int | None]
    """3IS: moves that step it change it, too."""
    comments: NotRequired[dict[str, str] | None]
    """9VS: up to 40 printable ASCII characters; the mark of the gateway is not shown."""
    autostart: NotRequired[bool | None]
    """UAS: whether the user program starts at power-on (RC-420 manual 15)."""


class BodySettingsChangedEvent(TypedDict):
    """Settings were changed by one of its documents; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.settings.changed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: SettingsNews


class BodyStatus(TypedDict):
    """The state of a controller."""

    body_id: str
    moving: bool
    status: StatusBits
    sensors: SensorBits
    stalls: list[StallFound]
    """Finders whose STALL error stands."""
    end_causes: list[str]
    """Why the last move ended: stall, cw_limit, ccw_limit, ems, stop_command; empty after a normal end, and while the motor moves."""
    read_at: str
    """Time of the first of the three answers."""
    age_ms: float


class BodyStatusChangedEvent(TypedDict):
    """Bits of its controller status have changed; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.status.changed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: StatusChange


class BodyStopConfirmedEvent(TypedDict):
    """The motor stands still, as its controller says; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.stop.confirmed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: StopReport


class BodyStopRequestedEvent(TypedDict):
    """A stop is asked for; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.stop.requested"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: StopReport


class BodyStopUnconfirmedEvent(TypedDict):
    """It is not confirmed in time, and is repeated on; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.stop.unconfirmed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: StopReport


class BodySwappedEvent(TypedDict):
    """Its settings after a loss of power are not those of the last night; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.swapped"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Swap


class BodyUnreadableEvent(TypedDict):
    """The health poll could not learn its state; about `/bodies/{body_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["body.unreadable"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Unreadable


class CaptureBounds(TypedDict):
    """The stretch of positions in which an edge counts."""

    lower: int
    """Lower bound in pulses; encoder counts in encoder mode."""
    upper: int
    """Upper bound, counted as `lower`."""


class CaptureList(TypedDict):
    """The captures of both inputs."""

    body_id: str
    captures: list[CaptureState]


class CapturePulse(TypedDict):
    """A pulse that the edge sets off. Arming gives the output the opposite state."""

    output: int
    """General output, 0-7."""
    on: bool
    """State of the output during the pulse."""
    duration_ms: int


class CaptureRequest(TypedDict):
    """Actions of an edge in the next move; an action that is left out is not done."""

    edge: Literal["off", "falling", "rising"]
    """`off` only of what is not armed, as GET gives it; DELETE disarms."""
    position: NotRequired[int | None]
    """Position number that takes the position."""
    encoder: NotRequired[int | None]
    """Position number that takes the encoder count."""
    encoder_in_pulses: NotRequired[int | None]
    """Position number that takes the encoder count converted to pulses."""
    recorded: NotRequired[list[EntryToRecord] | None]
    """The three numbers as GET gives them, in their place."""
    pulse: NotRequired[CapturePulse | None]
    between: NotRequired[Section | None]
    """Numbers of the three entries as GET gives them, each in its place."""


class CaptureState(TypedDict):
    """How an input is set up to capture, and what it has captured."""

    body_id: str
    input: int
    name: str | None
    """Name of the input in the configuration."""
    edge: Literal["off", "falling", "rising"]
    """Edge that it waits for; off: it is not armed, or not any more."""
    armed: bool
    captured: bool | None
    """True if an edge has set the values; null where no entry takes a value."""
    recorded: list[CapturedValue]
    pulse: CapturePulse | None
    between: CaptureBounds | None
    """Positions between which an edge counts; null: everywhere."""


class CapturedValue(TypedDict):
    """An entry of the position table that takes a value."""

    kind: Literal["position", "encoder", "encoder_in_pulses"]
    number: int
    """Position number."""
    pulses: int | None
    """Value in pulses; null until an edge comes; where another host has armed the input, 0. Encoder counts for `encoder`, and in encoder mode for `position`."""
    value: float | None
    """Value in `unit`; null without a scale, and for `encoder`."""
    unit: str | None


class ChangeStep(TypedDict):
    """The outcome of one value that was asked for."""

    name: str
    command: str
    """The command that sets it, without frame."""
    outcome: Literal["unchanged", "changed"]
    """unchanged: it was so already, and nothing was sent; changed: set, and read back."""
    before: JsonValue
    """Value before; null also where it could not be read."""


class ChangedPattern(TypedDict):
    """A pattern as it was read back after a change."""

    body_id: str
    number: int
    """0-29, or 30: the standard one, which is made of set 30 and has no changes."""
    acceleration_set: int | None
    """Number of the speed set for acceleration; null where the pattern was never set."""
    deceleration_set: int | None
    changes: list[SpeedChangeInfo] | None
    """Kept in RAM only; null where the body cannot work them out: its speed sets are not complete, or the changes do not suit them."""
    flash: PatternSets | None
    """Sets in flash memory; null where that is not known."""
    steps: list[ChangeStep]
    """Steps of the change, in order."""


class ChangedSettings(TypedDict):
    """Settings after a change, as they were read back."""

    body_id: str
    settings: Settings
    """Settings that were named; the others are left out."""
    steps: list[ChangeStep]
    """Steps of the change, in order."""


class ChangedSpeedSet(TypedDict):
    """A set as it was read back after a change."""

    body_id: str
    number: int
    """0-29, or 30: the standard set."""
    start_speed_pps: int | None
    """OL, 1-30,000."""
    maximum_speed_pps: int | None
    """OH, 1-1,000,000."""
    acceleration_pps_s: int | None
    """OS, 1-10,000,000."""
    rising_percent: int | None
    """OA, 0-100. The controller tells one that was never set as 0: null where it does so in a set that has no speeds either."""
    falling_percent: int | None
    """OB, 0-100; null as `rising_percent`."""
    start_speed: Scaled | None
    """Start speed in the body's unit; null without a scale."""
    maximum_speed: Scaled | None
    acceleration: Scaled | None
    flash: InFlash | None
    """Values in flash memory, as far as is known; null where the gateway has seen neither the power come on nor FIS."""
    steps: list[ChangeStep]
    """Steps of the change, in order."""


class Changes(TypedDict):
    """The differences between the configuration that is served and another."""

    lines: list[LineChange]
    """All others go on undisturbed."""
    needs_restart: list[str]
    """Keys whose change takes a restart of the gateway."""


class Channel(TypedDict):
    """Eight inputs or outputs."""

    channel: int
    bits: list[bool]
    """Bit 0 first."""


class ChannelList(TypedDict):
    """Inputs or outputs of a robot."""

    robot_id: str
    channels: list[Channel]


class CommandError(TypedDict):
    """An error with which a controller may refuse a command (RC-420 manual 21)."""

    code: str
    ja: str
    en: str


class CommandInfo(TypedDict):
    """A row of the RC-420 command table (RC-420 manual 14 and 19)."""

    code: str
    """The three characters of the command; empty where a macro's name takes their place."""
    name: str
    """Name of the command, the last part of its route .../commands/NAME."""
    title_ja: str
    title_en: str
    parameters: dict[str, Any]
    """JSON Schema of the request body."""
    reply: dict[str, Any]
    """JSON Schema of the reply."""
    usage: list[str]
    """Forms in which the parameters are written on the line."""
    starts_motion: bool
    effect: Effect
    """The effect of the command, from which the right follows."""
    right: Right
    """The right that a caller needs to send the command."""
    retry: Retry
    """The effect of repeating it after a missing reply. The gateway repeats only `read` and software stops. `setting`: read back, and repeat what differs; `conditional`: look first, for it may hide an alarm, wear the flash memory or move; `never`: it is done twice."""
    example: list[str]
    """Commands and replies in turn, as the manual prints them."""
    family: Literal["rorze"]
    addressed_to: Literal["body", "line"]
    modes: list[Literal["stepping", "encoder", "servo"]]
    """Operating modes in which it is allowed."""
    while_moving: bool
    """True if it is allowed while the motor moves."""
    in_programs: bool
    """True if it is allowed in user programs."""
    errors: list[CommandError]


class CommandList(TypedDict):
    """The whole tables of both families, in the manuals' order."""

    commands: list[CommandInfo | FicsCommandInfo]


class Commissioning(TypedDict):
    """One commissioning of a line: which assumptions about real hardware hold there."""

    id: str
    line_id: str
    status: Literal["running", "finished", "failed", "cancelled"]
    done: int
    """Number of assumptions that were tried so far."""
    of: int | None
    """Number of assumptions about such a line."""
    doing: str | None
    """The assumption that is being tried."""
    report: dict[str, JsonValue] | None
    """All results and frames, as `motion-gateway commission --report` writes them."""
    error: str | None
    started_at: str
    ended_at: str | None


class CommissioningRequest(TypedDict):
    """The line to commission."""

    line_id: str
    """A line of the configuration."""


class ContinuousMoveRequest(TypedDict):
    """Move until stopped; only where the configuration has `allow_endless_moves`."""

    start_within_s: NotRequired[float]
    """Seconds the move may wait for its turn; if it is not sent by then, it never is. Left out: 5.0."""
    kind: Literal["continuous"]
    direction: Direction
    speed: NotRequired[Speed]
    """`low` runs at the start speed, without ramps. Left out: high."""
    pattern: NotRequired[int | None]
    """Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."""


class ControllerEvent(TypedDict):
    """A frame 7E: the fields that its ESS setting names, in the order they came (RC-420 manual 13.11.3)."""

    C: NotRequired[int | None]
    """Controller status (9CD)."""
    M: NotRequired[int | None]
    """Cause of the end of the last move (9MD)."""
    S: NotRequired[int | None]
    """Sensors (CLD)."""
    I: NotRequired[int | None]
    """Inputs."""
    O: NotRequired[int | None]
    """Outputs."""
    P: NotRequired[int | None]
    """Position in pulses; encoder counts in encoder mode."""


class ControllerGeometry(TypedDict):
    """The mechanics that a controller holds."""

    type: Literal["three_axes", "two_axes_belt_linked"]
    arm: LinkLength
    finger: LinkLength
    pulses_per_turn: list[float]
    body_id: str
    axis: int
    """The one that it drives."""
    agrees: bool
    """True if it equals the geometry in the configuration."""


class Crashed(TypedDict):
    """The work under way when the last life of the gateway ended unasked."""

    last_seen_at: str | None
    """Time at which the last life was known to run; null if it never was."""
    moves: list[str]
    """Moves that were not over: they are followed, or resolved."""
    targets: list[str]
    """The part that moves in each of these moves."""
    commands: list[str]
    """Commands with an unknown outcome."""


class CurveDraft(TypedDict):
    """A move with a pattern that no body has yet."""

    acceleration: SpeedSetValues
    deceleration: NotRequired[SpeedSetValues | None]
    """Deceleration; left out: as the acceleration."""
    changes: NotRequired[list[SpeedChangeRequest]]
    """All that it shall have."""
    distance: Length
    """Distance of the move."""
    speed: NotRequired[Speed]
    """`low` runs at the start speed, without ramps. Left out: high."""
    points: NotRequired[int]
    """Number of moments, evenly spread. Left out: 200."""


class CurvePoint(TypedDict):
    """A moment of the move, in the pulses that are put out."""

    time_s: float
    """Seconds since the first pulse."""
    position: float
    """Pulses since the start."""
    speed: float
    """Pulses per second."""
    acceleration: float
    """Pulses per second, per second; below 0 while it slows down."""
    position_in_unit: float | None
    """Position in the body's unit; null without a scale."""
    speed_in_unit: float | None
    acceleration_in_unit: float | None


class Deed(TypedDict):
    """An action with an effect that a caller asked for, and its outcome."""

    id: str
    """Id of the action, which sorts by time; also the cursor before which older actions lie."""
    at: str
    caller: str
    """The caller: the name of a key, an interface and an address."""
    request_id: str | None
    """The X-Request-Id of the request."""
    target: str
    """Address of the body, group or robot: line1.3F, line1.80 for a group, r1."""
    command: str
    """The row of the command table."""
    effect: str
    """Effect of the command: motion, stop, setting or maintenance."""
    frame: str
    """The exact bytes for the controller."""
    moves: list[str]
    """Ids of the moves that the command was to make."""
    written_at: str | None
    """Time at which the frame was handed to the port; null if it was not."""
    ended_at: str | None
    """Time at which the outcome was known; null while it is not."""
    outcome: str | None
    """Outcome: answered, refusal, failure, not_sent, or unknown: it may have been executed or not."""
    detail: str | None
    """Reason for which it was not carried out, or the controller's error."""


class Difference(TypedDict):
    """A difference between a controller and the backup."""

    target: str
    """The body or the robot."""
    section: str
    name: str
    """The setting, position or instruction in words."""
    wanted: str | None
    """Value in the backup; null if it is empty or was never set."""
    held: str | None
    """Value in the controller."""
    restorable: bool
    """False if no command can restore it."""


class Distance(TypedDict):
    """A length or a coordinate."""

    value: float
    unit: Literal["mm", "um"]


class Encoder(TypedDict):
    """The encoder of a body, and its set-up."""

    body_id: str
    operating_mode: Literal["stepping", "encoder", "servo"]
    settings: EncoderSettings
    """Settings in RAM."""
    in_unit: dict[str, Scaled]
    """Settings in pulses, in the body's unit, by their names."""
    unavailable: dict[str, str]
    """Settings that cannot be read now, and why."""
    last: EncoderCounts
    """Counts at the last reading."""


class EncoderChange(TypedDict):
    """Changes of the set-up of the encoder; the rest stays as it is."""

    encoder_multiplier: NotRequired[Literal["double", "quadruple"] | None]
    """PAS: edges counted for each encoder line (RC-420 manual 13.7.3)."""
    encoder_ratio: NotRequired[float | None]
    """PBS: motor pulses for each encoder count, at most two decimals."""
    encoder_stall_threshold: NotRequired[int | None]
    """PES: pulses between motor and encoder that are a step-out."""
    encoder_stall_detection: NotRequired[bool | None]
    """PSS."""
    adjustment: NotRequired[bool | None]
    """PJS: adjust to the encoder after a move; encoder mode only."""
    adjustment_limit: NotRequired[int | None]
    """PKS: most pulses of an adjustment, beyond which is a STALL error; encoder mode only."""
    adjustment_speed_pps: NotRequired[int | None]
    """PLS: 0 is the start speed of speed set 30; encoder mode only."""
    adjustment_delay_ms: NotRequired[int | None]
    """PTS: wait between a move and its adjustment, in steps of 10 ms; encoder mode only."""


class EncoderCounts(TypedDict):
    """Where the encoder is."""

    counted_in: CountedIn
    """Unit of positions and amounts of this body."""
    position: int
    """Position that the body tells, in `counted_in` (6PD)."""
    position_in_unit: Scaled | None
    count: int
    """The encoder's count (6ED)."""
    count_in_pulses: int
    """Encoder's count in pulses: the count times the ratio (6MD)."""
    difference: int | None
    """Pulses put out beyond what the encoder has seen; null in encoder mode, where only the encoder is told."""
    stalled: bool
    """True if the encoder has found a step-out that stands (PRD)."""


class EncoderSettings(TypedDict):
    """How the encoder is counted, watched and adjusted to (RC-420 manual 13.7)."""

    encoder_multiplier: NotRequired[Literal["double", "quadruple"] | None]
    """PAS: edges counted for each encoder line (RC-420 manual 13.7.3)."""
    encoder_ratio: NotRequired[float | None]
    """PBS: motor pulses for each encoder count, at most two decimals."""
    encoder_stall_threshold: NotRequired[int | None]
    """PES: pulses between motor and encoder that are a step-out."""
    encoder_stall_detection: NotRequired[bool | None]
    """PSS."""
    adjustment: NotRequired[bool | None]
    """PJS: adjust to the encoder after a move; encoder mode only."""
    adjustment_limit: NotRequired[int | None]
    """PKS: most pulses of an adjustment, beyond which is a STALL error; encoder mode only."""
    adjustment_speed_pps: NotRequired[int | None]
    """PLS: 0 is the start speed of speed set 30; encoder mode only."""
    adjustment_delay_ms: NotRequired[int | None]
    """PTS: wait between a move and its adjustment, in steps of 10 ms; encoder mode only."""


class EndFrame(TypedDict):
    """A frame 7D of a body that is not in the configuration."""

    command: str
    cause: int
    """The byte of 9MD, 0 after a normal end."""


class Entry(TypedDict):
    """An entry of the security log, as it stands in its file."""

    number: int
    """Number of the entry, one more than that of the entry before; none is given twice."""
    time: str
    type: str
    """Type of the entry, such as `key.made`; docs/configuration.md lists all."""
    caller: str | None
    """Name of the key or of the token's holder, or another cause such as SIGHUP; null if the caller is not known."""
    address: str | None
    """The network address that the request came from."""
    request_id: str | None
    """The X-Request-Id of the request."""
    target: str
    """Subject of the entry: the name of a key, an address, a path."""
    count: int
    """Number of like entries that were counted in this one in a flood, else 1."""
    since: str | None
    """Time of the first of them; null where `count` is 1."""
    data: dict[str, Any]
    """Further facts, by the entry's type."""
    previous: str
    """The `hash` of the entry before, 64 zeros in the first."""
    hash: str
    """SHA-256 of the entry's line up to this member, in hex."""


class EntryToRecord(TypedDict):
    """An entry of the position table that takes a value, as GET gives it."""

    kind: Literal["position", "encoder", "encoder_in_pulses"]
    number: int


class ErrorOutputChoice(TypedDict):
    """The output that reports a cause, and its state on an error."""

    output: int | None
    """General output; null: nothing reports it."""
    on: NotRequired[bool | None]
    """The state it takes on an error; with `output`."""


class ErrorOutputSetting(TypedDict):
    """The output that reports an error."""

    output: int
    on: bool
    """The state that it takes on an error."""


class ErrorOutputState(TypedDict):
    """The output that reports a cause of errors."""

    cause: Literal["ems", "limit", "stall", "any"]
    output: int | None
    """Number of the output; null: nothing reports the cause."""
    name: str | None
    """Name of the output in the configuration."""
    on: bool | None
    """The state it takes on an error."""
    standing: bool
    """True if the cause has come, and was not taken back since."""


class ErrorsReset(TypedDict):
    """The end of an error that stood, and who reset it."""

    by: str
    """gateway, or elsewhere."""


class EventList(TypedDict):
    """Some events in their order, and where the list goes on."""

    events: list[
        LineUpEvent
        | LineDownEvent
        | LineOwnedEvent
        | LineTakenOverEvent
        | LineOrderViolatedEvent
        | GatewayJournalTroubleEvent
        | GatewayJournalRecoveredEvent
        | GatewayJournalSetAsideEvent
        | GatewayCrashedEvent
        | GatewayLoopHeldEvent
        | GatewayShuttingDownEvent
        | StreamGapEvent
        | LineLeaseTakenEvent
        | LineLeaseReleasedEvent
        | LineLeaseExpiredEvent
        | LineLeaseTakenOverEvent
        | LineLeaseBrokenEvent
        | AlarmRaisedEvent
        | AlarmResetEvent
        | IoEvent
        | GatewayReloadedEvent
        | GatewayReloadFailedEvent
        | GatewayScanFinishedEvent
        | GatewayScanFailedEvent
        | GatewayRecordingFinishedEvent
        | GatewayRecordingFailedEvent
        | GatewaySecurityTroubleEvent
        | GatewaySecurityRecoveredEvent
        | GatewayRefusalsBurstEvent
        | GatewayKeyMadeEvent
        | GatewayKeyApprovedEvent
        | GatewayKeyRotatedEvent
        | GatewayKeyEndsSoonEvent
        | GatewayKeyExpiredEvent
        | GatewayKeyRevokedEvent
        | PlantUnreachableEvent
        | PlantReachedEvent
        | StreamSnapshotEvent
        | BodyMoveQueuedEvent
        | BodyMoveSentEvent
        | BodyMoveStartedEvent
        | BodyMoveSucceededEvent
        | BodyMoveFailedEvent
        | BodyMoveStoppedEvent
        | BodyMoveRejectedEvent
        | BodyMoveCancelledEvent
        | BodyMoveLostEvent
        | BodyMoveUnknownEvent
        | BodyLeaseTakenEvent
        | BodyLeaseReleasedEvent
        | BodyLeaseExpiredEvent
        | BodyLeaseTakenOverEvent
        | BodyLeaseBrokenEvent
        | BodyStopRequestedEvent
        | BodyStopConfirmedEvent
        | BodyStopUnconfirmedEvent
        | BodyMotionForeignEvent
        | BodyOnlineEvent
        | BodyOfflineEvent
        | BodyUnreadableEvent
        | BodyStatusChangedEvent
        | BodyPowerCycledEvent
        | BodySwappedEvent
        | BodyPowerCycleAcknowledgedEvent
        | BodyPowerMarkMissingEvent
        | BodyControllerEventEvent
        | BodySensorChangedEvent
        | BodyInputChangedEvent
        | BodyProgramMessageEvent
        | BodyEndFrameEvent
        | BodyProgramUploadStartedEvent
        | BodyProgramUploadProgressEvent
        | BodyProgramUploadSucceededEvent
        | BodyProgramUploadFailedEvent
        | BodyProgramUploadCancelledEvent
        | BodyBackupStartedEvent
        | BodyBackupProgressEvent
        | BodyBackupSucceededEvent
        | BodyBackupFailedEvent
        | BodyBackupCancelledEvent
        | BodyComparisonStartedEvent
        | BodyComparisonProgressEvent
        | BodyComparisonSucceededEvent
        | BodyComparisonFailedEvent
        | BodyComparisonCancelledEvent
        | BodyPositionReadingStartedEvent
        | BodyPositionReadingProgressEvent
        | BodyPositionReadingSucceededEvent
        | BodyPositionReadingFailedEvent
        | BodyPositionReadingCancelledEvent
        | BodyPositionUploadStartedEvent
        | BodyPositionUploadProgressEvent
        | BodyPositionUploadSucceededEvent
        | BodyPositionUploadFailedEvent
        | BodyPositionUploadCancelledEvent
        | BodyRestoreStartedEvent
        | BodyRestoreProgressEvent
        | BodyRestoreVerifiedEvent
        | BodyRestoreDiffersEvent
        | BodyRestoreFailedEvent
        | BodyRestoreCancelledEvent
        | BodyJogStartedEvent
        | BodyJogStoppingEvent
        | BodyJogEndedEvent
        | BodyJogLostEvent
        | BodyJogStoppedEvent
        | BodyProgramStartedEvent
        | BodyProgramEndedEvent
        | BodyPositionEvent
        | BodySettingsChangedEvent
        | BodyLeftMovingEvent
        | LineBackupStartedEvent
        | LineBackupProgressEvent
        | LineBackupSucceededEvent
        | LineBackupFailedEvent
        | LineBackupCancelledEvent
        | LineComparisonStartedEvent
        | LineComparisonProgressEvent
        | LineComparisonSucceededEvent
        | LineComparisonFailedEvent
        | LineComparisonCancelledEvent
        | LineRestoreStartedEvent
        | LineRestoreProgressEvent
        | LineRestoreVerifiedEvent
        | LineRestoreDiffersEvent
        | LineRestoreFailedEvent
        | LineRestoreCancelledEvent
        | GroupLeaseTakenEvent
        | GroupLeaseReleasedEvent
        | GroupLeaseExpiredEvent
        | GroupLeaseTakenOverEvent
        | GroupLeaseBrokenEvent
        | GroupStrangersEvent
        | LineStopsUnconfirmedEvent
        | LineStrictEvent
        | LineMessageEvent
        | LineScanRunningEvent
        | LineScanFinishedEvent
        | LineScanFailedEvent
        | ScaraMoveQueuedEvent
        | ScaraMoveSentEvent
        | ScaraMoveStartedEvent
        | ScaraMoveSucceededEvent
        | ScaraMoveFailedEvent
        | ScaraMoveStoppedEvent
        | ScaraMoveRejectedEvent
        | ScaraMoveCancelledEvent
        | ScaraMoveLostEvent
        | ScaraMoveUnknownEvent
        | RobotMoveQueuedEvent
        | RobotMoveSentEvent
        | RobotMoveStartedEvent
        | RobotMoveSucceededEvent
        | RobotMoveFailedEvent
        | RobotMoveStoppedEvent
        | RobotMoveRejectedEvent
        | RobotMoveCancelledEvent
        | RobotMoveLostEvent
        | RobotMoveUnknownEvent
        | RobotLeaseTakenEvent
        | RobotLeaseReleasedEvent
        | RobotLeaseExpiredEvent
        | RobotLeaseTakenOverEvent
        | RobotLeaseBrokenEvent
        | RobotMoveOverdueEvent
        | RobotStopRequestedEvent
        | RobotStopConfirmedEvent
        | RobotStopUnconfirmedEvent
        | RobotStopRefusedEvent
        | RobotMotionForeignEvent
        | RobotOnlineEvent
        | RobotOfflineEvent
        | RobotUnreadableEvent
        | RobotErrorEvent
        | RobotErrorsResetEvent
        | RobotSwappedEvent
        | RobotPowerCycledEvent
        | RobotSpeedsRestoredEvent
        | RobotPowerCycleAcknowledgedEvent
        | RobotBitsMismatchEvent
        | RobotInputChangedEvent
        | RobotStatusChangedEvent
        | RobotSensorChangedEvent
        | RobotUnitChangedEvent
        | RobotUnitMissingEvent
        | RobotJogStartedEvent
        | RobotJogStoppingEvent
        | RobotJogEndedEvent
        | RobotJogLostEvent
        | RobotJogStoppedEvent
        | RobotJogNotStoppedEvent
        | RobotBackupStartedEvent
        | RobotBackupProgressEvent
        | RobotBackupSucceededEvent
        | RobotBackupFailedEvent
        | RobotBackupCancelledEvent
        | RobotComparisonStartedEvent
        | RobotComparisonProgressEvent
        | RobotComparisonSucceededEvent
        | RobotComparisonFailedEvent
        | RobotComparisonCancelledEvent
        | RobotRestoreStartedEvent
        | RobotRestoreProgressEvent
        | RobotRestoreVerifiedEvent
        | RobotRestoreDiffersEvent
        | RobotRestoreFailedEvent
        | RobotRestoreCancelledEvent
        | RobotPositionEvent
        | RobotLeftMovingEvent
    ]
    cursor: str


class FailureOfShift(TypedDict):
    """The moves that failed for one reason."""

    cause: str
    """The end's cause, such as ems; else the kind of error, or the status."""
    moves: int
    """Number of moves."""
    targets: int
    """Number of bodies or units concerned."""
    last_move: str
    """Id of the last of these moves."""


class FicsCommandInfo(TypedDict):
    """A row of the C-HOST command table (C-HOST manual 1-7 and 4-1)."""

    code: str
    """The three characters of the command; empty where a macro's name takes their place."""
    name: str
    """Name of the command, the last part of its route .../commands/NAME."""
    title_ja: str
    title_en: str
    parameters: dict[str, Any]
    """JSON Schema of the request body."""
    reply: dict[str, Any]
    """JSON Schema of the reply."""
    usage: list[str]
    """Forms in which the parameters are written on the line."""
    starts_motion: bool
    effect: Effect
    """The effect of the command, from which the right follows."""
    right: Right
    """The right that a caller needs to send the command."""
    retry: Retry
    """The effect of repeating it after a missing reply. The gateway repeats only `read` and software stops. `setting`: read back, and repeat what differs; `conditional`: look first, for it may hide an alarm, wear the flash memory or move; `never`: it is done twice."""
    example: list[str]
    """Commands and replies in turn, as the manual prints them."""
    family: Literal["fics"]
    addressed_to: Literal["robot", "unit"]
    answered: WhenAnswered
    """Condition of an answer; Ver.2 answers only `always`."""
    blocked_by: list[Block]
    """Conditions in which the robot refuses it, by the manual's letters."""
    during_upload: bool
    """True if it is allowed between POF 1 and POF 2."""


class FoundBody(TypedDict):
    """A body that answered."""

    body_id: str
    configured: bool
    """True if the body is in the configuration."""


class FoundPort(TypedDict):
    """A controller that answered at a port."""

    address: str
    told: str
    """The controllers in words."""
    line: dict[str, JsonValue]
    """A table `[[lines]]` that serves it, for `POST /lines`."""
    comment: str
    """Facts that the table does not hold; of a robot, settings to compare first."""


class Gap(TypedDict):
    """The place in the stream at which events are missing."""

    requested: str
    """The cursor that was asked for."""
    first_available: str
    """The cursor of the oldest event that can be had."""


class GatewayCrashedEvent(TypedDict):
    """It has started after a life that did not end as it should; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.crashed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Crashed


class GatewayJournalRecoveredEvent(TypedDict):
    """The journal can be written again; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.journal.recovered"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Nothing


class GatewayJournalSetAsideEvent(TypedDict):
    """A broken journal was replaced at the start; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.journal.set_aside"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: JournalSetAside


class GatewayJournalTroubleEvent(TypedDict):
    """The journal cannot be written: nothing with an effect is sent, reads and stops go on; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.journal.trouble"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: JournalTrouble


class GatewayKeyApprovedEvent(TypedDict):
    """A second administrator has approved a key; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.key.approved"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: KeyInfo


class GatewayKeyEndsSoonEvent(TypedDict):
    """A key ends within `access.key_warning_d`; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.key.ends_soon"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: KeyInfo


class GatewayKeyExpiredEvent(TypedDict):
    """The time of a key is over; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.key.expired"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: KeyInfo


class GatewayKeyMadeEvent(TypedDict):
    """An administrator has made a key; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.key.made"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: KeyInfo


class GatewayKeyRevokedEvent(TypedDict):
    """A key can never be used again; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.key.revoked"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: KeyInfo


class GatewayKeyRotatedEvent(TypedDict):
    """A new key has taken the place of one that ends soon; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.key.rotated"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: KeyInfo


class GatewayLoopHeldEvent(TypedDict):
    """The gateway was suspended or held up; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.loop.held"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: LoopHeld


class GatewayRecordingFailedEvent(TypedDict):
    """The disk has not taken a recording; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.recording.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RecordingInfo


class GatewayRecordingFinishedEvent(TypedDict):
    """A recording is over, and can be downloaded; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.recording.finished"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RecordingInfo


class GatewayRefusalsBurstEvent(TypedDict):
    """Many requests or sign-ins were refused in a minute; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.refusals.burst"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RefusalsBurst


class GatewayReloadFailedEvent(TypedDict):
    """The file was not taken; nothing has changed; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.reload_failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ReloadFailed


class GatewayReloadedEvent(TypedDict):
    """The lines are served as the file has them now; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.reloaded"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Changes


class GatewayScanFailedEvent(TypedDict):
    """A scan of ports was broken off; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.scan.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: PortScan


class GatewayScanFinishedEvent(TypedDict):
    """A scan of ports has asked at all of them; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.scan.finished"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: PortScan


class GatewaySecurityRecoveredEvent(TypedDict):
    """The security log can be written again; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.security.recovered"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Nothing


class GatewaySecurityTroubleEvent(TypedDict):
    """The security log cannot be written; what is to stand in it waits; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.security.trouble"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: SecurityTrouble


class GatewayShuttingDownEvent(TypedDict):
    """Nothing begins any more; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["gateway.shutting_down"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ShuttingDown


class Geometry(TypedDict):
    """A robot's mechanics."""

    type: Literal["three_axes", "two_axes_belt_linked"]
    arm: LinkLength
    finger: LinkLength
    pulses_per_turn: list[float]


class GeometryApplication(TypedDict):
    """How the geometry is given to the controllers."""

    flash: NotRequired[bool]
    """Write all their settings to flash memory too (FIS). Left out: false."""


class GroupDefinition(TypedDict):
    """The definition of a group."""

    members: list[str]
    """Addresses of bodies on one line, such as 02 or arm.02."""
    name: NotRequired[str]
    """Left out: empty."""


class GroupInfo(TypedDict):
    """A group and its members."""

    group_id: str
    """Unique address, such as arm.80."""
    line_id: str
    name: str
    members: list[str]
    """Addresses of the bodies, in the order of their replies."""


class GroupLeaseBrokenEvent(TypedDict):
    """Somebody else has ended a lease; about `/groups/{group_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["group.lease.broken"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class GroupLeaseExpiredEvent(TypedDict):
    """A lease was not renewed in time; about `/groups/{group_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["group.lease.expired"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class GroupLeaseReleasedEvent(TypedDict):
    """Its holder has given a lease back; about `/groups/{group_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["group.lease.released"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class GroupLeaseTakenEvent(TypedDict):
    """Somebody has leased it: nobody else moves or sets it; about `/groups/{group_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["group.lease.taken"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class GroupLeaseTakenOverEvent(TypedDict):
    """An admin has leased it instead; about `/groups/{group_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["group.lease.taken_over"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class GroupList(TypedDict):
    """All groups."""

    groups: list[GroupInfo]


class GroupMove(TypedDict):
    """One command to a group, with one move for each member."""

    group_id: str
    moves: list[Move]


class GroupPlan(TypedDict):
    """A group's move that was checked and not sent."""

    group_id: str
    frame: str
    """The exact bytes that would be sent, CR as \\r."""
    members: list[PlannedMove]


class GroupStrangersEvent(TypedDict):
    """Bodies obey the group that do not count among it; about `/groups/{group_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["group.strangers"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Strangers


class HomeRequest(TypedDict):
    """Search the origin (RC-420 manual 13.5), or the centre of the stall dog after that (13.6.2)."""

    start_within_s: NotRequired[float]
    """Seconds the move may wait for its turn; if it is not sent by then, it never is. Left out: 5.0."""
    kind: Literal["home"]
    method: NotRequired[HomeMethod]
    """Commands 00M, 01M, 02M, 03M, 04M and 0QM, in this order. 0QM goes to the nearest dog, and makes no body `homed`. Left out: standard."""


class Homing(TypedDict):
    """How a body searches its origin."""

    body_id: str
    settings: HomingSettings
    """Settings in RAM; the speeds are those of the standard set."""
    in_unit: dict[str, Scaled]
    """Settings in pulses, in the body's unit, by their names; empty without a scale."""
    overrun: int
    """Pulses to overrun the sensor: the offset times the factor."""
    last: LastHoming


class HomingChange(TypedDict):
    """Changes of the set-up of homing; the rest stays as it is."""

    origin_offset: NotRequired[int | None]
    """0SS: pulses from the CW edge of the origin sensor to the origin."""
    overrun_factor: NotRequired[int | None]
    """0BS: origin offsets to overrun the origin sensor (RC-420 manual 13.5.1)."""
    homing_retries: NotRequired[int | None]
    """0RS: how often a failed origin search is tried again."""
    stall_sensor_interval: NotRequired[int | None]
    """QIS: period of the stall dogs in pulses, from ON edge to ON edge."""
    stall_sensor_detection: NotRequired[bool | None]
    """QSS."""
    start_speed_pps: NotRequired[int | None]
    maximum_speed_pps: NotRequired[int | None]
    acceleration_pps_s: NotRequired[int | None]
    rising_percent: NotRequired[int | None]
    falling_percent: NotRequired[int | None]


class HomingOfShift(TypedDict):
    """Differences between the origins that a body has found."""

    target: str
    homings: int
    """Number of homings that can be compared with the one before."""
    last_off_by: int
    """Place by the latest origin less that by the one before, in pulses or encoder counts."""
    largest_off_by: int
    """The difference farthest from 0, in pulses or encoder counts."""


class HomingSettings(TypedDict):
    """Settings of origin searches and of the centring of stall dogs (RC-420 manual 13.5, 13.6.2)."""

    origin_offset: NotRequired[int | None]
    """0SS: pulses from the CW edge of the origin sensor to the origin."""
    overrun_factor: NotRequired[int | None]
    """0BS: origin offsets to overrun the origin sensor (RC-420 manual 13.5.1)."""
    homing_retries: NotRequired[int | None]
    """0RS: how often a failed origin search is tried again."""
    stall_sensor_interval: NotRequired[int | None]
    """QIS: period of the stall dogs in pulses, from ON edge to ON edge."""
    stall_sensor_detection: NotRequired[bool | None]
    """QSS."""
    start_speed_pps: NotRequired[int | None]
    maximum_speed_pps: NotRequired[int | None]
    acceleration_pps_s: NotRequired[int | None]
    rising_percent: NotRequired[int | None]
    falling_percent: NotRequired[int | None]


class Identity(TypedDict):
    """The caller as the gateway knows it: name, role and rights."""

    name: str
    """Name of the key, or of the person; `everybody` if no key is needed."""
    role: Role
    rights: list[Right]
    scope: list[str] | None
    """The lines, bodies, groups and robots that the key is for; null means all."""


class InFlash(TypedDict):
    """The parameters in flash memory."""

    start_speed_pps: int | None
    maximum_speed_pps: int | None
    acceleration_pps_s: int | None
    rising_percent: int | None
    falling_percent: int | None


class InputChange(TypedDict):
    """A general input that is on or off now."""

    number: int
    name: str | None
    """Name of the input in the configuration."""
    on: bool


class InterruptPulse(TypedDict):
    """A one-shot pulse on an output."""

    output: int
    on: bool
    """The state during the pulse."""
    duration_ms: int


class InvalidField(TypedDict):
    """One fault of the request, and the field it is in."""

    field: str
    """Path of the field in the request, such as distance.value."""
    message: str
    line: NotRequired[int | None]
    """Number of the line in a text of many lines, from 1."""
    column: NotRequired[int | None]
    """Number of the character in that line, from 1."""


class IoEvent(TypedDict):
    """Somebody watches it (`sample`); twice a second at most; about `/bodies/{body_id} or /robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["io"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    data: Signals
    cursor: str


class JogRequest(TypedDict):
    """The axis to jog, and its direction (C-HOST manual 2-2)."""

    unit: int
    axis: str
    """X Y Z .. for a user axis, A B C .. for a motor axis, @ for theta."""
    direction: Literal["+", "-"]


class JogSession(TypedDict):
    """An axis that jogs, or has jogged."""

    id: str
    state: Literal["jogging", "stopping", "ended", "lost", "stopped"]
    """`stopping`: it is told to stop, and may still move. `ended`, `lost` and `stopped`: it was seen to stand still. `ended`: by request, or by itself as at its limit; `lost`: for want of a heartbeat; `stopped`: with all that moves there, or at the end of the gateway."""
    ends_as: Literal["ended", "lost", "stopped"] | None
    """State that follows at standstill; null while it jogs."""
    heartbeat_within_ms: int
    """Seconds within which the next heartbeat has to come."""
    unit: int
    axis: str
    direction: Literal["+", "-"]


class JournalSetAside(TypedDict):
    """Where a broken journal was put."""

    file: str


class JournalTrouble(TypedDict):
    """Why the journal cannot be written."""

    reason: str


class KeyInfo(TypedDict):
    """A key, without what is secret of it."""

    name: str
    role: Role
    scope: list[str] | None
    """Addresses of the lines, bodies, groups and robots that the key is for; null means all."""
    begins: str
    """Beginning of the key, which is no secret."""
    state: Literal["good", "expired", "revoked", "waiting"]
    """State of the key; `waiting`: an admin's key that no second admin has approved yet (`access.four_eyes`)."""
    ends_soon: bool
    """True if the key ends within `access.key_warning_d`, and no newer key has its name."""
    made_by: str | None
    """The caller who made the key over HTTP, if that was noted."""
    approved_by: str | None
    made_at: str
    expires_at: str | None
    revoked_at: str | None
    used_at: str | None
    """Time at which the key was last used, noted once a minute."""


class KeyList(TypedDict):
    """All keys, those that cannot be used any more too, oldest first."""

    keys: list[KeyInfo]


class Kinematics(TypedDict):
    """Positions of the axes, and where the finger is then."""

    x: Micrometres
    y: Micrometres
    angle: Millidegrees
    """Angle between finger and X axis, above -180 and up to 180 degrees."""
    scara_id: str
    pulses: list[int]
    """Positions of axes 0, 1 and 2."""


class LastHoming(TypedDict):
    """The outcome of the last search."""

    homed: Homed
    distance: int
    """Pulses from its end back to its start (0PD); 0 after power-on."""
    in_unit: Scaled | None


class Lease(TypedDict):
    """A lease: its holder alone moves a part of the plant."""

    lease: str
    """Id of the lease."""
    scope: str
    """Address of the leased line, body, group or robot."""
    covers: list[str]
    """Addresses of the leased bodies and robots, or of the line."""
    holder: str
    """The name of the key that took it."""
    ttl_s: float
    """Seconds that the lease lasts after each renewal."""
    expires_in_s: float
    """Seconds that the lease still lasts, unless it is renewed."""


class LeaseList(TypedDict):
    """All present leases."""

    leases: list[Lease]


class LeaseRequest(TypedDict):
    """The part to lease, and for how long."""

    scope: str
    """The address of a line, a body, a group or a robot."""
    ttl_s: NotRequired[float]
    """Seconds after which the lease ends, unless it is renewed before. Left out: 10.0."""
    take_over: NotRequired[bool]
    """End the leases of others that are in the way; takes the right `admin`. Left out: false."""


class LeftMoving(TypedDict):
    """A part that still moves, or is not seen to stand still, when the gateway ends."""

    move_id: str | None
    """Id of its move, if it has one."""
    detail: str


class Length(TypedDict):
    """A distance or a position with its unit."""

    value: float
    """Pulses are whole numbers."""
    unit: LengthUnit
    """mm, um, deg and mdeg need the body's scale in the configuration."""


class LineBackupCancelledEvent(TypedDict):
    """A request or the end of the gateway has ended it; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.backup.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class LineBackupFailedEvent(TypedDict):
    """A controller did not tell all; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.backup.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class LineBackupProgressEvent(TypedDict):
    """More of it was read; once a second at most; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.backup.progress"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class LineBackupStartedEvent(TypedDict):
    """A backup is being read; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.backup.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class LineBackupSucceededEvent(TypedDict):
    """All was read: the record has the text; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.backup.succeeded"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class LineChange(TypedDict):
    """The change of a line."""

    line_id: str
    change: Literal["added", "removed", "changed"]
    keys: list[str]
    """Keys of the line that have changed: `bodies.40`, `reply_timeout_s`."""


class LineComparisonCancelledEvent(TypedDict):
    """A request or the end of the gateway has ended it; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.comparison.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class LineComparisonFailedEvent(TypedDict):
    """A controller did not tell all; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.comparison.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class LineComparisonProgressEvent(TypedDict):
    """More of it was read; once a second at most; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.comparison.progress"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class LineComparisonRequest(TypedDict):
    """A backup that bodies of a line are to be compared with."""

    backup: NotRequired[str | None]
    """The text of a backup; comments after `;` mean nothing."""
    nightly: NotRequired[Literal["last"] | str | None]
    """Night of a kept backup to be used in the place of `backup`: the last, or a date."""
    without: NotRequired[
        list[Literal["settings", "speed-sets", "patterns", "positions", "memories", "program"]] | None
    ]
    """Sections of the backup that are left as they are, such as positions."""
    units: NotRequired[Literal["keep_pulses", "convert"] | None]
    """Conversion of a backup made at another scale (`[scale]`), which is refused else. keep_pulses: the same pulses, which are other lengths; convert: the same lengths, speeds and accelerations, to the nearest pulse."""
    bodies: NotRequired[list[str] | None]
    """These only: addresses such as 3F. Else all that the backup has."""


class LineComparisonStartedEvent(TypedDict):
    """It is being compared with a backup; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.comparison.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class LineComparisonSucceededEvent(TypedDict):
    """All was compared: the record has the differences; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.comparison.succeeded"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class LineDown(TypedDict):
    """Why a line cannot be used."""

    reason: str


class LineDownEvent(TypedDict):
    """Its port has gone, or nobody answers any more; follows each up; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.down"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: LineDown


class LineInfo(TypedDict):
    """A line: one port with an RC-400 and the bodies behind it."""

    line_id: str
    address: str
    """Address of the port."""
    state: LineState
    down_reason: str | None
    """Reason why the line is `down` or `silent`, and what to check; null if it is neither."""
    waiting: dict[str, int]
    """Requests waiting in each lane."""
    load: dict[str, float]
    """Percent of the last ten seconds that the line was taken up by clients, followers (they see moves to their ends), health, live (values that clients watch), probes (of silent controllers), fences, stops and set_up."""
    counters: dict[str, int]
    """Counters of the line since the start."""
    owner: NotRequired[OwnerInfo]
    """Owner of the line; only of a line that another gateway may take over."""
    protocol: Literal["rorze"]
    controllers: str
    """Answer of the link master to XID."""
    stop_mode: StopTiming
    """Moment of a stop: at the next frame boundary, or after the reply under way."""
    strict: bool
    """A reply came twice here lately: an acknowledgement counts only when a fence before and one after it have shown that it was no copy."""
    bodies: list[str]
    offline: list[str]
    """Bodies that do not answer."""
    groups: list[str]


class LineLeaseBrokenEvent(TypedDict):
    """Somebody else has ended a lease; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.lease.broken"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class LineLeaseExpiredEvent(TypedDict):
    """A lease was not renewed in time; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.lease.expired"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class LineLeaseReleasedEvent(TypedDict):
    """Its holder has given a lease back; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.lease.released"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class LineLeaseTakenEvent(TypedDict):
    """Somebody has leased it: nobody else moves or sets it; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.lease.taken"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class LineLeaseTakenOverEvent(TypedDict):
    """An admin has leased it instead; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.lease.taken_over"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class LineList(TypedDict):
    """All lines of the configuration."""

    lines: list[LineInfo | RobotLineInfo]


class LineMessage(TypedDict):
    """A frame of a special address that the gateway does not know."""

    frame: str


class LineMessageEvent(TypedDict):
    """A frame came that nobody knows; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.message"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: LineMessage


class LineNow(TypedDict):
    """A line."""

    line_id: str
    state: LineState
    down_reason: str | None


class LineOrderViolatedEvent(TypedDict):
    """A reply came behind its fence: they do not keep their order; once an hour at most; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.order.violated"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: OrderViolated


class LineOwnedEvent(TypedDict):
    """A person has had this gateway take the line over; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.owned"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: LineOwner


class LineOwner(TypedDict):
    """The gateway of a plant that has a line now, and the reason."""

    reason: str
    owner: str | None
    """Name of the gateway that has the line; null if unknown."""
    epoch: int
    """Number of take-overs so far, plus one."""


class LinePositions(TypedDict):
    """Where all motors of a line stand."""

    line_id: str
    positions: list[Position]
    unanswered: list[Unanswered]


class LineRestoreCancelledEvent(TypedDict):
    """A request, a stop or the end of the gateway has ended it; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.restore.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class LineRestoreDiffersEvent(TypedDict):
    """It was read back, and `differences` is what is not as in the backup; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.restore.differs"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class LineRestoreFailedEvent(TypedDict):
    """Nobody could read it back, or what flash memory holds is not known; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.restore.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class LineRestoreProgressEvent(TypedDict):
    """A restore has come further; once a second at most; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.restore.progress"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class LineRestoreRequest(TypedDict):
    """A backup to be restored to bodies of a line."""

    backup: NotRequired[str | None]
    """The text of a backup; comments after `;` mean nothing."""
    nightly: NotRequired[Literal["last"] | str | None]
    """Night of a kept backup to be used in the place of `backup`: the last, or a date."""
    without: NotRequired[
        list[Literal["settings", "speed-sets", "patterns", "positions", "memories", "program"]] | None
    ]
    """Sections of the backup that are left as they are, such as positions."""
    units: NotRequired[Literal["keep_pulses", "convert"] | None]
    """Conversion of a backup made at another scale (`[scale]`), which is refused else. keep_pulses: the same pulses, which are other lengths; convert: the same lengths, speeds and accelerations, to the nearest pulse."""
    bodies: NotRequired[list[str] | None]
    """These only: addresses such as 3F. Else all that the backup has."""
    dry_run: NotRequired[bool]
    """True to be told what would be written and what differs; nothing is written. Left out: false."""
    flash: NotRequired[bool]
    """True to write the settings to flash memory, too, once they were read back. Left out: false."""
    power_cycle: NotRequired[bool]
    """True to wait, with `flash`, until the power was off and on, and compare again. Left out: false."""


class LineRestoreStartedEvent(TypedDict):
    """A backup is being restored; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.restore.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class LineRestoreVerifiedEvent(TypedDict):
    """All of the backup was read back; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.restore.verified"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class LineScanFailedEvent(TypedDict):
    """It was broken off; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.scan.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Scan


class LineScanFinishedEvent(TypedDict):
    """It has asked all 120 body numbers; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.scan.finished"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Scan


class LineScanRunningEvent(TypedDict):
    """A scan has begun, or has found a body; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.scan.running"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Scan


class LineStatuses(TypedDict):
    """The controller status of all bodies of a line."""

    line_id: str
    statuses: list[MotorStatus]
    unanswered: list[Unanswered]


class LineStopsUnconfirmed(TypedDict):
    """Stops on a line on which no body answers; the event of each body is told as well."""

    silent_s: float
    """Seconds since the first of them without an answer of any body on the line."""
    stops: int
    """The number of bodies whose stops are not confirmed."""
    bodies: list[str]


class LineStopsUnconfirmedEvent(TypedDict):
    """Nobody on it answers, and stops of its bodies are not confirmed in time; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.stops.unconfirmed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: LineStopsUnconfirmed


class LineStrictEvent(TypedDict):
    """A reply came twice, or none has for an hour; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.strict"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Strictness


class LineTakenOverEvent(TypedDict):
    """Another gateway has the line, or may have it: this one does not open it again by itself; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.taken_over"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: LineOwner


class LineUp(TypedDict):
    """The controllers that answered when the line was set up."""

    controllers: NotRequired[str | None]
    """Answer of an RC-400 to XID."""
    mode: NotRequired[int | None]
    """The communication mode of a Fics: 2 or 3."""


class LineUpEvent(TypedDict):
    """Somebody answers on the line, and it is set up; about `/lines/{line_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["line.up"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: LineUp


class LinkLength(TypedDict):
    """A length of the mechanics."""

    value: int
    unit: Literal["um"]


class LiveAxis(TypedDict):
    """Where an axis stands."""

    value: float | None
    """Coordinate; null while the robot does not know it."""
    unit: str
    """mm, pulse or degree."""


class Liveness(TypedDict):
    """The gateway's process answers."""

    status: Literal["alive"]


class LoopHeld(TypedDict):
    """For how long the gateway did nothing."""

    seconds: float
    """Seconds for which the event loop was held, 0.25 at least."""
    cancelled: bool
    """True if commands that waited are not sent any more: after more than 2 s."""


class MacroInfo(TypedDict):
    """A macro by its name."""

    name: str
    title: str | None
    """Title of the macro in the configuration; null without one."""
    refused: bool
    """True if the robot refused it as unknown at the last call."""


class MacroList(TypedDict):
    """The macros that are known: a robot cannot be asked for their names."""

    robot_id: str
    macros: list[MacroInfo]


class MacroRunRequest(TypedDict):
    """How to run a macro (C-HOST manual 1-7)."""

    unit: NotRequired[int | None]
    """The unit that is selected while it runs; left out, the only one."""
    arguments: NotRequired[list[float | None] | None]
    """Up to four numbers; null leaves one out."""


class MadeKey(TypedDict):
    """A key that was made, with its secret."""

    name: str
    role: Role
    scope: list[str] | None
    """Addresses of the lines, bodies, groups and robots that the key is for; null means all."""
    begins: str
    """Beginning of the key, which is no secret."""
    state: Literal["good", "expired", "revoked", "waiting"]
    """State of the key; `waiting`: an admin's key that no second admin has approved yet (`access.four_eyes`)."""
    ends_soon: bool
    """True if the key ends within `access.key_warning_d`, and no newer key has its name."""
    made_by: str | None
    """The caller who made the key over HTTP, if that was noted."""
    approved_by: str | None
    made_at: str
    expires_at: str | None
    revoked_at: str | None
    used_at: str | None
    """Time at which the key was last used, noted once a minute."""
    key: str
    """The secret that the owner sends. It is told this once: the gateway keeps its hash only."""


class MarkMissing(TypedDict):
    """Why no mark can be kept in a body."""

    comment: int
    """The number of the user comment, 1-7."""
    detail: str


class Memory(TypedDict):
    """A memory of the user program."""

    name: str
    value: int | None
    """A timer counts tenths of a second down."""


class MemoryChange(TypedDict):
    """A number for a memory."""

    value: int | None
    """A value that is null, as GET gives it, leaves a memory without a number as it is."""


class MemoryChanges(TypedDict):
    """Numbers for memories."""

    memories: list[NamedMemory]


class MemoryList(TypedDict):
    """Memories of one bank."""

    body_id: str
    memories: list[Memory]


class Micrometres(TypedDict):
    """A coordinate."""

    value: float
    unit: Literal["um"]


class Millidegrees(TypedDict):
    """An angle, counterclockwise from X."""

    value: float
    unit: Literal["mdeg"]


class MissingUnit(TypedDict):
    """A unit of the configuration that the robot does not have."""

    unit: int


class ModeChange(TypedDict):
    """The mode a robot is to be in."""

    mode: HostMode
    """3; or 2, in which most commands are silent."""


class Moment(TypedDict):
    """The plant as it was."""

    at: str
    known_since: str | None
    """Time at which the journal begins; null if it is empty."""
    places: list[PlaceThen]
    """Places of all parts that had moved by then."""
    unreached: list[str]
    """Addresses of bodies, robots and lines that did not answer."""
    alarms: list[Alarm]
    """Alarms that stood at that moment, newest first."""


class MotorStatus(TypedDict):
    """The controller status of a body."""

    body_id: str
    moving: bool
    status: StatusBits
    read_at: str
    """Time of the controller's answer."""
    age_ms: float
    """Age of the answer in ms when it was passed on."""


class Move(TypedDict):
    """One move of one body."""

    id: str
    body_id: str
    """Address of what moves: a body, LINE.3F, or a unit, ROBOT/units/1."""
    status: MoveStatus
    command: str
    """The three characters of the controller's command."""
    frame: str
    """The exact bytes, CR as \\r."""
    evidence: list[str]
    """Observations that the status rests on, in words."""
    error: MoveError | None
    request_id: str | None
    """The X-Request-Id of the request that asked for it."""
    created_at: str
    sent_at: str | None
    acknowledged_at: str | None
    ended_at: str | None
    event_cursor: str
    """Cursor after which the events include all later news of the move."""
    group_id: str | None
    """Id of the group that the command was sent to, if any."""
    kind: MoveKind
    end_cause: str | None
    """Cause of the end. By the controller: normal, stall, cw_limit, ccw_limit, ems, stop_command, or several joined by +; by the gateway: not_executed, position_mismatch or not_in_position."""
    counted_in: CountedIn | None
    """Unit of the positions; null if the body's operating mode is not known."""
    start_position: int | None
    """Position before the move, in `counted_in`."""
    target_position: int | None
    """Position to reach, in `counted_in`; null if it cannot be known beforehand."""
    position: int | None
    """Position as last read, in `counted_in`."""
    homing_distance: int | None
    """Distance from the end of a good homing back to its start, in `counted_in` (0PD)."""
    completion: Completion | None
    """`frame`: the link master announced the end; `polling`: the gateway found it."""


class MoveError(TypedDict):
    """Why a move did not succeed, in the words of a problem detail."""

    type: str
    """The kind of error; stable."""
    title: str
    detail: str
    moved: Moved
    """Says if the motor did anything because of this move: no, yes or unknown."""
    remedy: str
    controller_error: str | None
    """The controller's error code, such as 0x51."""
    next: list[NextCall]
    """The calls that help."""


class MoveList(TypedDict):
    """Moves of a body, newest first."""

    moves: list[Move]


class NamedMemory(TypedDict):
    """A memory, and what it shall hold."""

    name: str
    """D0-D199, C0-C29 or T0-T29."""
    value: int | None
    """A value that is null, as GET gives it, leaves a memory without a number as it is."""


class NamedPosition(TypedDict):
    """A stored position."""

    number: int
    name: str | None
    pulses: int
    """Encoder counts in encoder mode."""
    value: float | None
    """Position in `unit`; null without a scale."""
    unit: str | None


class NewBodies(TypedDict):
    """Bodies to be served, too."""

    dry_run: NotRequired[bool]
    """True to be told what would change; nothing is changed. Left out: false."""
    comment: NotRequired[str]
    """Comment for the file, above the table and behind the time and the caller. Left out: empty."""
    bodies: list[dict[str, JsonValue]]
    """Tables `[[lines.bodies]]` of the configuration."""


class NewKey(TypedDict):
    """A key to be made."""

    name: str
    """The person or program it is for: letters, digits and . _ @ -; records name it."""
    role: Role
    """The rights of the key; every role may stop."""
    scope: NotRequired[list[str] | None]
    """Addresses of the lines, bodies, groups and robots that the key is for; left out: all."""
    expires_s: NotRequired[float | None]
    """Seconds from now; left out: `access.key_lifetime_d`, a year if nothing else is said."""


class NewLine(TypedDict):
    """A line to be served, too."""

    dry_run: NotRequired[bool]
    """True to be told what would change; nothing is changed. Left out: false."""
    comment: NotRequired[str]
    """Comment for the file, above the table and behind the time and the caller. Left out: empty."""
    line: dict[str, JsonValue]
    """A table `[[lines]]` of the configuration, with its `bodies` or its `robot`."""


class NextCall(TypedDict):
    """A request to this gateway that helps."""

    method: CallMethod
    path: str
    right: Right
    """The right that the caller needs."""
    body: NotRequired[dict[str, JsonValue] | None]
    """Content of the request; left out if there is none, or if only the caller can know it."""
    en: str
    """Effect of the call, in English."""
    ja: str
    """Effect of the call, in Japanese."""


class NightlyBackup(TypedDict):
    """A backup of one line, or one robot, that was read by night and kept."""

    target: str
    """The line or the robot."""
    date: str
    """Night in which it was read, as YYYY-MM-DD."""
    changed: int | None
    """Number of lines that differ from the backup before it; null where there was none."""


class NightlyBackups(TypedDict):
    """The backups that are kept."""

    backups: list[NightlyBackup]
    """Kept backups, the newest first."""


class NoiseFilters(TypedDict):
    """The time for which an input or a sensor has to hold a new level before it counts as changed."""

    body_id: str
    noise_filters: dict[str, int]
    """Equal samples, one each ms, that make a change of level, by input or sensor."""


class NoiseFiltersChange(TypedDict):
    """Noise filters to be set; those that are not named stay as they are."""

    noise_filters: dict[str, int]
    """Samples by input or sensor."""


class Nothing(TypedDict):
    """The type says all."""


class Numbers(TypedDict):
    """Numbers that never change, in later versions neither; each type and cause has one of its own."""

    events: dict[str, int]
    """Number of each type of event, from 1."""
    alarms: dict[str, int]
    """Number of each cause of an alarm, from 1."""


class OrderViolated(TypedDict):
    """A reply that came too late: it was credited to its own command, or to none."""

    late: str
    """The command whose reply came late, such as `1+M of line1.3F`."""
    before: str
    """The fence that was sent after it and answered before it."""


class OutputPulse(TypedDict):
    """For how long an output is inverted."""

    duration_ms: int


class OutputState(TypedDict):
    """The state that an output is to take."""

    on: bool


class OutputSwitch(TypedDict):
    """A level for an output."""

    on: bool


class Overdue(TypedDict):
    """A move that takes longer than its way and its speeds explain."""

    move_id: str
    longest_s: float | None
    request_id: str | None


class OwnerInfo(TypedDict):
    """The gateway that has a line which may be taken over."""

    gateway: str | None
    """Name of the gateway in the plant; null if unknown."""
    epoch: int
    """Number of take-overs so far, plus one; the header Owner-Epoch."""


class PastWords(TypedDict):
    """An alarm whose cause is over, in both languages: nothing of it is told as so now."""

    en: AlarmText
    ja: AlarmText


class PathDefinition(TypedDict):
    """A whole path; without points it is cleared."""

    points: list[ViaPoint]
    """Points in their order; the last is the end."""


class PathSpeed(TypedDict):
    """How fast the finger's end goes along its way."""

    value: float
    unit: Literal["mm/s", "um/s"]


class Pattern(TypedDict):
    """An acceleration pattern as the body holds it in RAM."""

    body_id: str
    number: int
    """0-29, or 30: the standard one, which is made of set 30 and has no changes."""
    acceleration_set: int | None
    """Number of the speed set for acceleration; null where the pattern was never set."""
    deceleration_set: int | None
    changes: list[SpeedChangeInfo] | None
    """Kept in RAM only; null where the body cannot work them out: its speed sets are not complete, or the changes do not suit them."""
    flash: PatternSets | None
    """Sets in flash memory; null where that is not known."""


class PatternChange(TypedDict):
    """Changes of a pattern; the rest stays as it is."""

    changes: NotRequired[list[SpeedChangeRequest] | None]
    acceleration_set: NotRequired[int | None]
    """0-29."""
    deceleration_set: NotRequired[int | None]
    """0-29."""


class PatternList(TypedDict):
    """Acceleration patterns of a body."""

    body_id: str
    patterns: list[Pattern]
    """Patterns in the order of their numbers."""


class PatternSets(TypedDict):
    """The speed parameter sets of a pattern."""

    acceleration_set: int
    deceleration_set: int


class PatternValues(TypedDict):
    """A pattern: two speed parameter sets, and its changes of speed.

    Null, as GET gives it, is what was never set, or cannot be worked out, and stays so.
    """

    changes: NotRequired[list[SpeedChangeRequest] | None]
    acceleration_set: int | None
    """Speed parameter set of the acceleration, 0-29."""
    deceleration_set: int | None
    """Speed parameter set of the deceleration, 0-29."""


class PersonOfShift(TypedDict):
    """The actions of one caller in the shift."""

    caller: str
    motions: int
    """Number of commands that move something."""
    stops: int
    """Number of requests for stops, whatever they were for."""
    settings: int
    """Number of commands that change what a controller keeps."""


class PlaceThen(TypedDict):
    """Place of a motor, or of a unit's axes, by the last move before the moment."""

    target: str
    """Address of the part: line1.3F, r1/units/1 or wafer."""
    state: Literal["moving", "standing"]
    position: JsonValue
    """Position as moves have it: pulses or encoder counts, or by axis; on the way it is interpolated by time between start and end. Null if unknown."""
    move_id: str
    """Id of the move that was under way, or of the last one."""


class PlannedMove(TypedDict):
    """A move that was checked and not sent."""

    body_id: str
    frame: str
    """The exact bytes that would be sent, CR as \\r."""
    counted_in: CountedIn | None
    """Unit of the target's position."""
    distance: int | None
    """Pulses it would emit; null where only the motion itself can tell."""
    target_position: int | None
    """Target in `counted_in`, where it can be known beforehand."""
    duration_s: float | None
    """Seconds for which pulses would run, with the present settings."""
    note: str | None
    """Why something is not known, or would be refused."""


class PlannedPoint(TypedDict):
    """Where the plan has a motor, had it begun when its command was written."""

    time_s: float
    pulses: float
    speed: float
    """Pulses per second; below 0 where positions decrease."""


class PlannedRobotMove(TypedDict):
    """A move that was checked and not sent."""

    body_id: str
    """Address of the unit, ROBOT/units/1."""
    frame: str
    """The exact bytes that would be sent, CR as \\r."""
    coordinates: CoordinateSystem
    """Coordinates of the positions."""
    units: AxisUnits
    """Units by axis: mm, pulse or degree."""
    start_position: AxisValues | None
    """Present position by axis; null while the robot does not tell it."""
    target_position: AxisValues | None
    """Target by axis that moves, where it can be known beforehand."""
    duration_s: float | None
    """Seconds that it would move by the present settings, where that can be calculated."""
    note: str | None
    """Why something is not known, or would be refused."""


class PlannedScaraMove(TypedDict):
    """A robot's move that was worked out and not sent."""

    scara_id: str
    frames: list[str]
    """The exact frames that would be sent, CR as \\r."""
    start: ScaraPlace
    target: ScaraPlace
    start_positions: list[int]
    """Present positions in pulses, in the order of the axes."""
    target_positions: list[int]
    """Target positions in pulses, in the order of the axes, as the gateway calculates them."""
    length_um: float | None
    """Length in micrometres of the way that the speed counts on; null where axes turn alone."""
    duration_s: float | None
    """Seconds for which pulses would run, with the present settings."""
    note: str | None
    """Why something is not known, or would be refused."""


class PlantReachedEvent(TypedDict):
    """The servers of the plant take this gateway's events again; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["plant.reached"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Nothing


class PlantUnreachable(TypedDict):
    """Why the servers of the plant do not take the gateway's events."""

    reason: str


class PlantUnreachableEvent(TypedDict):
    """The servers of the plant do not take this gateway's events; they are sent later; about `/gateway`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["plant.unreachable"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: PlantUnreachable


class Port(TypedDict):
    """A serial port of the gateway's machine."""

    port: str
    line_id: str | None
    """The line that has it."""


class PortList(TypedDict):
    """The serial ports of the gateway's machine."""

    ports: list[Port]


class PortScan(TypedDict):
    """One scan of ports."""

    id: str
    ports: list[str]
    status: Literal["running", "finished", "failed"]
    doing: list[str]
    """Present work at the ports, in words."""
    found: list[FoundPort]
    """Controllers that were found, once the scan is over or was broken off."""
    notes: list[str]
    """Reasons for which ports could not be asked."""
    error: str | None
    started_at: str
    ended_at: str | None


class PortScanRequest(TypedDict):
    """The ports to ask."""

    ports: list[str]
    """Devices and addresses: /dev/ttyUSB1, tcp://HOST:PORT, dpram:///dev/uio0. A serial port is tried at every baud rate, unless its address has `?baud=`."""


class Position(TypedDict):
    """Where a motor stands."""

    body_id: str
    pulses: int
    """Or encoder counts: see `counted_in`."""
    counted_in: CountedIn | None
    """encoder_counts in encoder mode (RC-420 manual 13.1.3); null where the mode is not known."""
    value: float | None
    """Position in `unit`; null without a scale."""
    unit: str | None
    read_at: str
    """Time of the controller's answer."""
    age_ms: float
    """Age of the answer in ms when it was passed on."""


class PositionEntry(TypedDict):
    """A position to be stored."""

    number: int
    axes: NotRequired[AxisAmounts | None]
    """Coordinates by name; an axis that is not named is left out. Without axes, where the unit stands."""
    name: NotRequired[str | None]
    """Name of the position; left out or null, it keeps the name it has."""


class PositionLabel(TypedDict):
    """The name that a position has now."""

    body_id: str
    number: int
    name: str | None


class PositionMoveRequest(TypedDict):
    """Move to a position of the body's table (RC-420 manual 13.4)."""

    start_within_s: NotRequired[float]
    """Seconds the move may wait for its turn; if it is not sent by then, it never is. Left out: 5.0."""
    kind: Literal["position"]
    position: int
    """Position number."""
    speed: NotRequired[Speed]
    """`low` runs at the start speed, without ramps. Left out: high."""
    pattern: NotRequired[int | None]
    """Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."""
    max_speed: NotRequired[Rate | None]
    """The fastest it may get; the standard speed set still bounds it. The gateway writes it to the body's `slow_pattern` (RAM only) before; neither `pattern` nor `low` goes with it."""


class PositionName(TypedDict):
    """A name for a position."""

    name: str | None
    """Name of the position; null takes the name away."""


class PositionReading(TypedDict):
    """Positions of a body that are being read, or were."""

    id: str
    target: str
    """Path of the body, line or robot that is read."""
    status: JobStatus
    controllers: list[str]
    """Ids of the bodies, or of the robot, that are read, in their order."""
    controller: str | None
    """The controller that is being read, or was when the reading ended."""
    read: int
    """Answers read so far."""
    expected: int | None
    """Answers it takes at most, as far as is known: settings that were never set are not asked for. Null if unknown."""
    left_s: float | None
    """Seconds that it still takes, by the line's speed first, then by its own pace; null if unknown."""
    baud: int | None
    """Baud rate of the line, if its port tells it: 38400 takes a third of the time of 9600."""
    error: BackupError | None
    """The error that ended the reading early."""
    request_id: str | None
    """The X-Request-Id of the request that asked for it."""
    started_at: str
    ended_at: str | None
    first: int
    """Number of the first position."""
    last: int
    """Number of the last position."""
    positions: list[NamedPosition] | None
    """Once it has succeeded. Events leave them out: ask for the record."""


class PositionTable(TypedDict):
    """Stored positions of a unit."""

    robot_id: str
    unit: int
    positions: list[StoredEntry]
    ended_at: int | None
    """The number that is not set, where the robot ended: what is stored behind it has to be asked for from there. Null where `last` was reached."""


class PositionToCall(TypedDict):
    """A number for the present position: by `value` and `unit`, or by `pulses`, as GET gives it."""

    value: NotRequired[float | None]
    """Pulses are whole numbers."""
    unit: NotRequired[LengthUnit | None]
    """mm, um, deg and mdeg need the body's scale in the configuration."""
    pulses: NotRequired[int | None]
    """Encoder counts in encoder mode; `value` and `unit` follow from them."""


class PositionToStore(TypedDict):
    """A position to be stored."""

    number: int
    position: NotRequired[Length | None]
    """Position to store; left out, where the motor stands."""
    pulses: NotRequired[int | None]
    """Instead of `position`: as GET gives it, encoder counts in encoder mode."""
    name: NotRequired[str | None]
    """Name of the position; left out or null, it keeps the name it has."""


class PositionUpload(TypedDict):
    """Positions to be stored; others stay as they are."""

    positions: list[PositionEntry]


class PositionsToStore(TypedDict):
    """Positions to be stored; others stay as they are."""

    positions: list[PositionToStore]
    flash: NotRequired[bool]
    """Write the whole table to flash memory too (FPS). Left out: false."""


class Posture(TypedDict):
    """The protection of the gateway, and the assumptions that it rests on."""

    access: Literal["keys", "open"]
    """`keys`: each request needs a key; `open`: none does."""
    tls: bool
    """True if the gateway itself speaks TLS."""
    network: bool
    """True if other machines can reach the gateway, a proxy's clients included."""
    weakened: list[Weakened]
    """Every default of the configuration that protects less than it could."""
    untried: list[UntriedLine]
    """Lines whose assumptions about real hardware were not all tried, or do not all hold."""


class PowerAcknowledged(TypedDict):
    """The reason why it may go to places again."""

    by: Literal["homing", "set_position", "request"]


class Problem(TypedDict):
    """The reason for which a request was not carried out (RFC 9457)."""

    type: str
    """The kind of error, urn:motion-gateway:problem:KIND; never changes."""
    title: str
    """The kind of error in words."""
    status: int
    """The HTTP status."""
    detail: str
    """One sentence: what happened, and what was and was not done to the motor."""
    instance: str
    """The path that was asked for."""
    moved: Moved
    """Says if the motor did anything because of this request: no, yes or unknown."""
    remedy: str
    """The next step for the caller."""
    retryable: bool
    """True if the same request may succeed later."""
    request_id: NotRequired[str | None]
    """The header X-Request-Id of this answer, which the line's trace has too."""
    code: NotRequired[str | None]
    """The controller's error code, such as 0x51 or E05."""
    next: NotRequired[list[NextCall] | None]
    """The calls that help, in the order in which they do."""
    errors: NotRequired[list[InvalidField] | None]
    """Every part that is not valid."""


class Program(TypedDict):
    """The user program that a body holds in RAM."""

    body_id: str
    source: str
    """One instruction a line: line N stands at address N - 1."""
    instructions: int
    steps: int
    """The room it takes, of 6039 steps."""
    labels: dict[str, int]
    """The address of each label."""
    running: bool


class ProgramRun(TypedDict):
    """One run of a body's user program."""

    id: str
    body_id: str
    status: Literal["running", "ended", "unknown"]
    label: str | None
    """Label at which the program began, if at one."""
    address: int | None
    """Address at which the program began, if at one."""
    single_step: bool
    """True if only one instruction is executed."""
    end_cause: str | None
    """normal, stopped (by UES), command_error, nothing_there (a branch to an empty address), error_end (by EED), move_while_moving or single_step, or several joined by +."""
    ended_at_address: int | None
    detail: str | None
    """Reason for which its end is unknown."""
    request_id: str | None
    """The X-Request-Id of the request that asked for it."""
    started_at: str
    ended_at: str | None


class ProgramState(TypedDict):
    """A body's answer about its user program, and the last run that the gateway has started."""

    body_id: str
    running: bool
    end_cause: str | None
    """End cause of the last program; null while one runs, and if the end of `run` is unknown."""
    address: int
    """The address it is at, or has ended at (UND)."""
    line: int
    """The line of that address in the program's text, from 1."""
    instruction: str | None
    """Instruction at that address; null where there is none."""
    elapsed_s: float | None
    """Duration of `run` in seconds, so far or in all; null without one, or where another program runs."""
    run: ProgramRun | None
    """Last run that the gateway has started; null where it has started none."""


class ProgramText(TypedDict):
    """Text that a user program sends (SDC, SDD)."""

    text: str


class ProgramUpload(TypedDict):
    """One upload of a user program to one body."""

    id: str
    body_id: str
    status: JobStatus
    phase: Literal["clearing", "writing", "verifying", "saving", "done"]
    """Phase of the upload now, or when it was broken off."""
    instructions: int
    """Number of instructions of the program."""
    steps: int
    """The room they take, of 6039 steps."""
    written: int
    """Instructions that the controller has taken."""
    verified: int
    """Instructions that were read back and are those of the source."""
    flash: bool
    """True if the program is to be written to flash memory, too."""
    saved: bool
    """True if it was written to flash memory."""
    stored: str
    """Contents of the body now, as far as is known."""
    error: UploadError | None
    request_id: str | None
    """The X-Request-Id of the request that asked for it."""
    started_at: str
    ended_at: str | None


class Rate(TypedDict):
    """A speed with its unit."""

    value: float
    unit: RateUnit
    """Other units than pulse/s need the body's scale in the configuration."""


class RawReply(TypedDict):
    """The answer to a command as text."""

    body_id: str
    sent: str
    """The exact bytes, CR as \\r."""
    reply: str
    """Text behind the code in the reply, as it came."""
    age_ms: float


class RawRequest(TypedDict):
    """A command as it stands on the line, without introducer, body number and CR."""

    text: str


class Readiness(TypedDict):
    """Readiness of the gateway: can requests be carried out, and if not, because of which part?"""

    ready: bool
    """True if every line is open and set up, and at least one controller answers on it."""
    lines: dict[str, LineState]
    """State of each line that the request's key is for; without a good key none is named."""
    journal: JournalState
    """State of the journal; while it is `unavailable`, all that has an effect is refused but stops."""
    detail: str
    """The reasons in words, and what to do."""


class RecordingInfo(TypedDict):
    """One recording, under way or kept."""

    id: str
    """Id of the recording, which sorts by time."""
    status: Literal["running", "finished", "failed"]
    cause: Literal["request", "alarm"]
    alarm_id: str | None
    """The alarm that has begun it."""
    lines: list[str]
    whole_plant: bool
    """True if these are all lines."""
    since: str
    """Beginning of the recorded time."""
    until: str | None
    """End of the recorded time; null while the recording goes on."""
    bytes: int | None
    """Size of its file."""
    complete: bool
    """False where the gateway ended in the middle of it: it holds what was on the disk."""
    error: str | None
    """Reason for which there is no file."""
    request_id: str | None
    """The X-Request-Id of the request that asked for it."""
    started_at: str
    ended_at: str | None


class RecordingList(TypedDict):
    """Recordings, the newest first."""

    recordings: list[RecordingInfo]


class RecordingRequest(TypedDict):
    """The time and the lines to record."""

    last_s: NotRequired[float]
    """Seconds before now, as far as the memory reaches. Left out: 0.0."""
    for_s: NotRequired[float]
    """Seconds after now. Left out: 0.0."""
    lines: NotRequired[list[str] | None]
    """Only these lines with what is on them; left out, all that the caller may see."""


class RefusalsBurst(TypedDict):
    """Refusals that came faster than by mistake."""

    refusals: int
    """Their number."""
    seconds: float
    """Within this time."""
    type: str
    """The type of the last, as in the security log."""
    address: str | None
    """The network address of the last."""


class RelativeMoveRequest(TypedDict):
    """Move by a distance (RC-420 manual 13.2)."""

    start_within_s: NotRequired[float]
    """Seconds the move may wait for its turn; if it is not sent by then, it never is. Left out: 5.0."""
    kind: Literal["relative"]
    direction: Direction
    distance: Length
    speed: NotRequired[Speed]
    """`low` runs at the start speed, without ramps. Left out: high."""
    pattern: NotRequired[int | None]
    """Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."""
    max_speed: NotRequired[Rate | None]
    """The fastest it may get; the standard speed set still bounds it. The gateway writes it to the body's `slow_pattern` (RAM only) before; neither `pattern` nor `low` goes with it."""


class ReloadFailed(TypedDict):
    """Why the configuration is served as before."""

    reason: str


class ReloadRequest(TypedDict):
    """Options for reading the configuration again."""

    dry_run: NotRequired[bool]
    """True to be told what would change; nothing is changed. Left out: false."""


class Reloaded(TypedDict):
    """The differences between the configuration file and what was served."""

    lines: list[LineChange]
    """All others go on undisturbed."""
    needs_restart: list[str]
    """Keys whose change takes a restart of the gateway."""
    applied: bool
    """True if the lines are served as the file says now; false after a dry run."""
    busy: list[str]
    """Parts that move or work on lines that would be closed: nothing changes while they do."""


class Resolution(TypedDict):
    """The encoder's settings that follow from motor and encoder."""

    body_id: str
    encoder_multiplier: Literal["double", "quadruple"]
    """PAS."""
    encoder_ratio: float
    """PBS: motor pulses for each count, rounded to two decimals."""
    counts_per_turn: int
    drift_per_turn: float
    """Pulses by which motor and encoder come apart in each turn, because of the rounding."""
    changed: ChangedSettings | None
    """Settings as they were read back; null after a dry run."""


class ResolutionRequest(TypedDict):
    """A turn of the shaft, in steps of the motor and in lines of the encoder."""

    motor_steps_per_turn: int
    """Pulses that turn the motor once."""
    encoder_lines_per_turn: int
    """Lines of the encoder, before any multiplication."""
    multiplier: NotRequired[Literal["double", "quadruple"] | None]
    """Multiplier; left out: quadruple, or double where the ratio would be below 1."""
    dry_run: NotRequired[bool]
    """Only say what would be set. Left out: false."""


class Restore(TypedDict):
    """One restore of a backup."""

    id: str
    target: str
    """Path of the body, line or robot that is restored."""
    status: Literal["running", "verified", "differs", "failed", "cancelled"]
    """`verified`: read back, all of the backup is there. `differs`: `differences` is all that is not. `failed`: it could not be read back, or it is not known what flash memory holds."""
    phase: Literal[
        "comparing", "writing", "reading_back", "saving", "awaiting_power_cycle", "verifying", "done"
    ]
    controllers: list[str]
    """Ids of the bodies, or of the robot, that are written."""
    scales: list[ScaleDifference]
    """The bodies whose scale is not that of the backup, and what `units` made of that."""
    commands: int
    """Commands to be written, as far as is known."""
    written: int
    """Commands written so far."""
    read: int
    """Answers read so far, before and after writing."""
    left_s: float | None
    """Seconds that the restore still takes; null if unknown."""
    flash: bool
    """True if the settings are to be written to flash memory, too."""
    saved: bool
    """True if the flash memory of all controllers was written."""
    power_cycle: bool
    """True if the controllers are compared again after the power was off and on."""
    power_proved: bool
    """False if no mark could prove that the power was kept while it was read back: a short loss of power may have gone unseen."""
    differences: list[Difference] | None
    """Differences between the controllers and the backup; null while unknown. Events tell the first 20."""
    error: RestoreError | None
    """The error that ended the restore early."""
    request_id: str | None
    """The X-Request-Id of the request that asked for it."""
    started_at: str
    ended_at: str | None


class RestoreError(TypedDict):
    """The error that ended a restore early, in the words of a problem detail."""

    type: str
    """The kind of error; stable."""
    detail: str
    remedy: str


class RestorePlan(TypedDict):
    """The plan of a restore; nothing was written."""

    target: str
    """Path of the body, line or robot that is restored."""
    dry_run: Literal[True]
    commands: list[str]
    """The exact commands, in their order."""
    differences: list[Difference]
    """Differences from the backup; empty if the controllers hold it already."""
    differing: dict[str, int]
    """Number of differences by kind: settings, positions, program and others; a program counts once."""
    scales: list[ScaleDifference]
    """The bodies whose scale is not that of the backup, and what `units` made of that."""


class RobotAbsoluteMoveRequest(TypedDict):
    """Move axes to a position (C-HOST manual 2-6, 4-3)."""

    start_within_s: NotRequired[float]
    """Seconds the move may wait for its turn; if it is not sent by then, it never is. Left out: 5.0."""
    speed_percent: NotRequired[float | None]
    """Percent of full speed, 0.1-100, for this move: the gateway sets it for all axes of the unit before (VAO, MAO), and it stays so until it is set otherwise, or the power goes. Left out, the move runs at what is set. JOG and JTE have a speed of the robot's own."""
    coordinates: NotRequired[CoordinateSystem]
    """Coordinates of the axes: those of the user or of the motors (C-HOST manual 1-6). Left out: user."""
    axes: AxisAmounts
    """Amounts by name; an axis that is not named stays where it is."""
    kind: Literal["absolute"]


class RobotBackupCancelledEvent(TypedDict):
    """A request or the end of the gateway has ended it; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.backup.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class RobotBackupFailedEvent(TypedDict):
    """A controller did not tell all; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.backup.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class RobotBackupProgressEvent(TypedDict):
    """More of it was read; once a second at most; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.backup.progress"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class RobotBackupStartedEvent(TypedDict):
    """A backup is being read; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.backup.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class RobotBackupSucceededEvent(TypedDict):
    """All was read: the record has the text; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.backup.succeeded"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Backup


class RobotBitsMismatchEvent(TypedDict):
    """It stands still, homed, and its bits do not mean what the configuration says; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.bits.mismatch"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BitMismatch


class RobotComparisonCancelledEvent(TypedDict):
    """A request or the end of the gateway has ended it; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.comparison.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class RobotComparisonFailedEvent(TypedDict):
    """A controller did not tell all; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.comparison.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class RobotComparisonProgressEvent(TypedDict):
    """More of it was read; once a second at most; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.comparison.progress"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class RobotComparisonRequest(TypedDict):
    """A backup that a robot is to be compared with."""

    backup: NotRequired[str | None]
    """The text of a backup; comments after `;` mean nothing."""
    nightly: NotRequired[Literal["last"] | str | None]
    """Night of a kept backup to be used in the place of `backup`: the last, or a date."""
    without: NotRequired[list[Literal["variables", "settings", "positions"]] | None]
    """Sections of the backup that are left as they are, such as positions."""


class RobotComparisonStartedEvent(TypedDict):
    """It is being compared with a backup; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.comparison.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class RobotComparisonSucceededEvent(TypedDict):
    """All was compared: the record has the differences; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.comparison.succeeded"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: BackupComparison


class RobotErrorEvent(TypedDict):
    """An error of the system stands; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.error"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotErrorRecord


class RobotErrorRecord(TypedDict):
    """An error of the system that stands until it is reset (C-HOST manual 2-12, 2-13)."""

    code: str | None
    """Three digits; null where the answer that named it was lost."""
    en: str
    ja: str
    remedy_en: str
    remedy_ja: str
    kind: DetailKind | None
    """Kind of error that the details describe; null if not known."""
    detail: str | None
    """Answer of ERD, as it came."""
    unit: int | None
    """Unit of the error; null in a system of a single unit, too."""
    axis: str | None
    """The motor axis."""
    driver_error: str | None
    """The driver's own code, hexadecimal as in `31h`; `FFh`: not ready."""
    program: int | None
    """The program that was stopped."""
    step: int | None
    at: str


class RobotErrors(TypedDict):
    """The errors of a robot that stand."""

    robot_id: str
    errors: list[RobotErrorRecord]
    looked_at: str | None
    """Time at which the robot last told its present error; null while it never has."""


class RobotErrorsResetEvent(TypedDict):
    """The error that stood is reset; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.errors.reset"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ErrorsReset


class RobotHomeRequest(TypedDict):
    """Home all axes, or the mechanism as its program does it (C-HOST manual 2-4)."""

    start_within_s: NotRequired[float]
    """Seconds the move may wait for its turn; if it is not sent by then, it never is. Left out: 5.0."""
    kind: Literal["home"]


class RobotInfo(TypedDict):
    """A robot as the gateway knows it, without asking it."""

    robot_id: str
    line_id: str
    line_state: LineState
    down_reason: str | None
    """Why the line's port is not open; null while it is."""
    name: str
    online: bool
    """True if it can be asked now, as far as is known."""
    mode: int
    """Communication mode: 3, or 2, in which ends are found by polling."""
    moving: bool | None
    """True if an axis moves; null while out of reach, or until it is looked at after a move with an unseen end."""
    power_cycled: bool
    """True if it has lost its power; motion is refused until that is acknowledged."""
    error: RobotErrorRecord | None
    """The error that stands, as far as is known."""
    bit_mismatches: list[str]
    """Bits of units that stood still, homed, which status_bits and sensor_bits of the configuration do not explain."""
    missing_units: list[int]
    """Units of the configuration that the robot says it does not have."""
    units: list[UnitInfo]


class RobotInputChange(TypedDict):
    """An input as it is now."""

    channel: int
    number: int
    """Number of the input within its channel, from 0."""
    on: bool


class RobotInputChangedEvent(TypedDict):
    """An input of the first channel is another than when it was last asked for: while somebody watches `io`, and as often as `input_edges_per_s` says; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.input.changed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotInputChange


class RobotJogEndedEvent(TypedDict):
    """It was ended by request or at a limit, and the axis stands still; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.jog.ended"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: JogSession


class RobotJogLostEvent(TypedDict):
    """Its heartbeat stayed away, and the axis stands still; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.jog.lost"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: JogSession


class RobotJogNotStoppedEvent(TypedDict):
    """The axis did not stand still in time: the whole robot is being stopped; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.jog.not_stopped"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: JogSession


class RobotJogStartedEvent(TypedDict):
    """An axis jogs; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.jog.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: JogSession


class RobotJogStoppedEvent(TypedDict):
    """A stop or the end of the gateway has ended it, and the axis stands still; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.jog.stopped"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: JogSession


class RobotJogStoppingEvent(TypedDict):
    """The axis is told to stop, and may still move; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.jog.stopping"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: JogSession


class RobotLeaseBrokenEvent(TypedDict):
    """Somebody else has ended a lease; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.lease.broken"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class RobotLeaseExpiredEvent(TypedDict):
    """A lease was not renewed in time; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.lease.expired"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class RobotLeaseReleasedEvent(TypedDict):
    """Its holder has given a lease back; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.lease.released"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class RobotLeaseTakenEvent(TypedDict):
    """Somebody has leased it: nobody else moves or sets it; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.lease.taken"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class RobotLeaseTakenOverEvent(TypedDict):
    """An admin has leased it instead; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.lease.taken_over"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Lease


class RobotLeftMovingEvent(TypedDict):
    """The gateway ends, and it moves as far as is known; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.left_moving"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: LeftMoving


class RobotLineInfo(TypedDict):
    """A line: one port with a robot."""

    line_id: str
    address: str
    """Address of the port."""
    state: LineState
    down_reason: str | None
    """Reason why the line is `down` or `silent`, and what to check; null if it is neither."""
    waiting: dict[str, int]
    """Requests waiting in each lane."""
    load: dict[str, float]
    """Percent of the last ten seconds that the line was taken up by clients, followers (they see moves to their ends), health, live (values that clients watch), probes (of silent controllers), fences, stops and set_up."""
    counters: dict[str, int]
    """Counters of the line since the start."""
    owner: NotRequired[OwnerInfo]
    """Owner of the line; only of a line that another gateway may take over."""
    protocol: Literal["fics"]
    robot_id: str
    mode: int
    """The robot's communication mode, 3 or 2 (C-HOST manual 1-1-1)."""
    online: bool
    """True if the robot can be asked now, as far as is known."""


class RobotList(TypedDict):
    """All robots of the configuration."""

    robots: list[RobotInfo]


class RobotMotionForeignEvent(TypedDict):
    """It moves, and the gateway has not started that; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.motion.foreign"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Nothing


class RobotMove(TypedDict):
    """One move of one unit; positions are in the units of the axes."""

    id: str
    body_id: str
    """Address of what moves: a body, LINE.3F, or a unit, ROBOT/units/1."""
    status: MoveStatus
    command: str
    """The three characters of the controller's command."""
    frame: str
    """The exact bytes, CR as \\r."""
    evidence: list[str]
    """Observations that the status rests on, in words."""
    error: MoveError | None
    request_id: str | None
    """The X-Request-Id of the request that asked for it."""
    created_at: str
    sent_at: str | None
    acknowledged_at: str | None
    ended_at: str | None
    event_cursor: str
    """Cursor after which the events include all later news of the move."""
    robot_id: str
    unit: int
    kind: RobotMoveKind
    coordinates: CoordinateSystem
    """Coordinates of the positions."""
    units: AxisUnits
    """Units of the positions, by axis: mm, pulse or degree."""
    end_cause: str | None
    """normal, stop_command or error_nnn as the robot says; not_executed, power_cycled or position_mismatch as the gateway found."""
    start_position: AxisValues | None
    """Position before the move, by axis."""
    target_position: AxisValues | None
    """Target by axis, where it can be known beforehand."""
    longest_s: float | None
    """Seconds it may take by distance and speed, where these are known."""
    position: AxisValues | None
    """Position as last read, by axis; null while an axis does not know it."""
    completion: RobotMoveCompletion | None
    """Evidence of the end: the robot's reply to the move, or inferred from its standstill."""


class RobotMoveCancelledEvent(TypedDict):
    """It was not sent, and will not be; about `/robots/{robot_id}/units/{unit}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.move.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotMove


class RobotMoveFailedEvent(TypedDict):
    """It has ended otherwise; about `/robots/{robot_id}/units/{unit}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.move.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotMove


class RobotMoveList(TypedDict):
    """Moves of a unit, newest first."""

    moves: list[RobotMove]


class RobotMoveLostEvent(TypedDict):
    """It could not be followed to its end; about `/robots/{robot_id}/units/{unit}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.move.lost"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotMove


class RobotMoveOverdueEvent(TypedDict):
    """A move takes longer than its way and speeds explain; about `/robots/{robot_id}/units/{unit}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.move.overdue"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Overdue


class RobotMoveQueuedEvent(TypedDict):
    """A move waits for its turn; about `/robots/{robot_id}/units/{unit}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.move.queued"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotMove


class RobotMoveRejectedEvent(TypedDict):
    """The controller has refused its command, or has not executed it: nothing moved; about `/robots/{robot_id}/units/{unit}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.move.rejected"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotMove


class RobotMoveSentEvent(TypedDict):
    """Its command is on the wire; about `/robots/{robot_id}/units/{unit}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.move.sent"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotMove


class RobotMoveStartedEvent(TypedDict):
    """It is seen to move; about `/robots/{robot_id}/units/{unit}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.move.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotMove


class RobotMoveStoppedEvent(TypedDict):
    """A stop has ended it; about `/robots/{robot_id}/units/{unit}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.move.stopped"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotMove


class RobotMoveSucceededEvent(TypedDict):
    """It has ended as it should; about `/robots/{robot_id}/units/{unit}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.move.succeeded"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotMove


class RobotMoveUnknownEvent(TypedDict):
    """Nobody can tell whether it was executed, or how it has ended; about `/robots/{robot_id}/units/{unit}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.move.unknown"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotMove


class RobotNow(TypedDict):
    """A robot, as far as is known."""

    robot_id: str
    online: bool
    mode: int
    moving: bool | None
    power_cycled: bool
    error: str | None
    """The code of the error that stands."""


class RobotOfflineEvent(TypedDict):
    """It does not answer any more; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.offline"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Nothing


class RobotOnlineEvent(TypedDict):
    """It answers again; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.online"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Nothing


class RobotPosition(TypedDict):
    """Where the axes of a unit stand (APS)."""

    unit: int
    coordinates: CoordinateSystem
    axes: dict[str, LiveAxis]


class RobotPositionEvent(TypedDict):
    """Somebody watches it (`sample`), and the robot acts on that unit; about `/robots/{robot_id}/units/{unit}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.position"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    data: RobotPosition
    cursor: str


class RobotPositionMoveRequest(TypedDict):
    """Move to a stored position (C-HOST manual 2-16)."""

    start_within_s: NotRequired[float]
    """Seconds the move may wait for its turn; if it is not sent by then, it never is. Left out: 5.0."""
    kind: Literal["position"]
    position: int
    """Number of the position, 1-1999; it has to be set."""
    speed_percent: NotRequired[float | None]
    """Percent of full speed, 0.1-100, for this move: the gateway sets it for all axes of the unit before (VAO, MAO), and it stays so until it is set otherwise, or the power goes. Left out, the move runs at what is set. JOG and JTE have a speed of the robot's own."""


class RobotPowerCycleAcknowledgedEvent(TypedDict):
    """Somebody knows of the loss of power; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.power_cycle.acknowledged"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Nothing


class RobotPowerCycledEvent(TypedDict):
    """It has lost its power, or seems to; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.power_cycled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotPowerLoss


class RobotPowerLoss(TypedDict):
    """How sure the gateway is, and what it will set again."""

    speeds: dict[str, dict[str, dict[str, float]]]
    """Percentages of full speed."""
    full_speed: dict[str, dict[str, list[str]]]
    certain: bool


class RobotRawReply(TypedDict):
    """The bytes that were sent, and the answers to them."""

    robot_id: str
    sent: str
    """The exact bytes, the terminator as \\r."""
    replies: list[str]
    """Text behind the name in each answer, as it came; none where mode 2 answers nothing."""


class RobotRawRequest(TypedDict):
    """A command as it stands on the line, without its terminator."""

    text: str


class RobotRelativeMoveRequest(TypedDict):
    """Move axes by an amount (C-HOST manual 2-5, 4-2)."""

    start_within_s: NotRequired[float]
    """Seconds the move may wait for its turn; if it is not sent by then, it never is. Left out: 5.0."""
    speed_percent: NotRequired[float | None]
    """Percent of full speed, 0.1-100, for this move: the gateway sets it for all axes of the unit before (VAO, MAO), and it stays so until it is set otherwise, or the power goes. Left out, the move runs at what is set. JOG and JTE have a speed of the robot's own."""
    coordinates: NotRequired[CoordinateSystem]
    """Coordinates of the axes: those of the user or of the motors (C-HOST manual 1-6). Left out: user."""
    axes: AxisAmounts
    """Amounts by name; an axis that is not named stays where it is."""
    kind: Literal["relative"]


class RobotRestoreCancelledEvent(TypedDict):
    """A request, a stop or the end of the gateway has ended it; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.restore.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class RobotRestoreDiffersEvent(TypedDict):
    """It was read back, and `differences` is what is not as in the backup; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.restore.differs"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class RobotRestoreFailedEvent(TypedDict):
    """Nobody could read it back, or what flash memory holds is not known; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.restore.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class RobotRestoreProgressEvent(TypedDict):
    """A restore has come further; once a second at most; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.restore.progress"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class RobotRestoreRequest(TypedDict):
    """A backup to be restored to a robot."""

    backup: NotRequired[str | None]
    """The text of a backup; comments after `;` mean nothing."""
    nightly: NotRequired[Literal["last"] | str | None]
    """Night of a kept backup to be used in the place of `backup`: the last, or a date."""
    without: NotRequired[list[Literal["variables", "settings", "positions"]] | None]
    """Sections of the backup that are left as they are, such as positions."""
    dry_run: NotRequired[bool]
    """True to be told what would be written and what differs; nothing is written. Left out: false."""
    flash: NotRequired[bool]
    """True to write the settings to flash memory, too, once they were read back. Left out: false."""
    power_cycle: NotRequired[bool]
    """True to wait, with `flash`, until the power was off and on, and compare again. Left out: false."""


class RobotRestoreStartedEvent(TypedDict):
    """A backup is being restored; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.restore.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class RobotRestoreVerifiedEvent(TypedDict):
    """All of the backup was read back; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.restore.verified"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Restore


class RobotSample(TypedDict):
    """Where the axes stood."""

    time: str
    """Time of the robot's answer."""
    time_s: float
    """Seconds since the move's command was written."""
    axes: AxisValues
    """Coordinates by axis; null while the robot does not know one."""
    planned: dict[str, float] | None
    """Planned place of the axis that moves at this time, in its `units`; null without a plan."""


class RobotSamples(TypedDict):
    """Where a unit was seen during a move: 512 answers at most."""

    move_id: str
    robot_id: str
    unit: int
    coordinates: CoordinateSystem
    units: AxisUnits
    """Units of the positions, by axis: mm, pulse or degree."""
    planned_s: float | None
    """Seconds that the plan takes; null without a plan."""
    note: str | None
    """Why there is no plan."""
    samples: list[RobotSample]


class RobotSensorChangedEvent(TypedDict):
    """A sensor of a motor axis is another than when it was last asked for; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.sensor.changed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: AxisSensorChange


class RobotSpeedsRestoredEvent(TypedDict):
    """The speeds that were known are set again; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.speeds.restored"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: SpeedsKnown


class RobotStatusChangedEvent(TypedDict):
    """Status bits of a motor axis, or its driver's error, are others than when they were last asked for; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.status.changed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: AxisStatusChange


class RobotStepRequest(TypedDict):
    """Move one axis by a few of the smallest amounts it displays (C-HOST manual 2-3)."""

    start_within_s: NotRequired[float]
    """Seconds the move may wait for its turn; if it is not sent by then, it never is. Left out: 5.0."""
    kind: Literal["step"]
    axis: str
    steps: int
    """1-255 in either direction."""


class RobotStopConfirmedEvent(TypedDict):
    """All axes stand still, as the robot says; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.stop.confirmed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotStopReport


class RobotStopRefusedEvent(TypedDict):
    """The robot has refused the stop; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.stop.refused"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: StopRefusal


class RobotStopReport(TypedDict):
    """The state of the stop of a robot, and its evidence."""

    robot_id: str
    state: StopState
    """Only confirmed means that the robot itself reports standstill of all axes."""
    detail: str | None
    """Why it is not confirmed."""
    request_id: str | None
    """The X-Request-Id of the request that asked for it first."""
    units_unknown: list[int]
    """Units of which the robot has not told whether they stand still."""


class RobotStopRequestedEvent(TypedDict):
    """A stop is asked for; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.stop.requested"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotStopReport


class RobotStopUnconfirmedEvent(TypedDict):
    """It is not confirmed in time, and is repeated on; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.stop.unconfirmed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: RobotStopReport


class RobotSwappedEvent(TypedDict):
    """After a loss of power it is not as in the last night; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.swapped"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Swap


class RobotUnitChangedEvent(TypedDict):
    """Somebody else has selected another unit; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.unit.changed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: UnitChange


class RobotUnitMissingEvent(TypedDict):
    """The robot says that it has no such unit as is configured; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.unit.missing"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: MissingUnit


class RobotUnreadableEvent(TypedDict):
    """The watch could not learn its state; about `/robots/{robot_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["robot.unreadable"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Unreadable


class Rotation(TypedDict):
    """The rotation of a key."""

    overlap_s: NotRequired[float]
    """Seconds for which the old key stays good. Left out: 604800.0."""


class RunRequest(TypedDict):
    """Where a program begins: at a label or an address, else at its first instruction."""

    label: NotRequired[str | None]
    """Label with or without its `*`."""
    address: NotRequired[int | None]
    single_step: NotRequired[bool]
    """Execute one instruction only; without label and address the next one. Left out: false."""


class ScaleDifference(TypedDict):
    """A controller whose scale is not that of the backup."""

    target: str
    """The body."""
    backup: str
    """The scale of the backup: 100 pulses/mm."""
    controller: str
    """The scale of the body: 250 pulses/mm, or no scale."""
    units: Literal["keep_pulses", "convert"]
    """The requested conversion: keep the pulses, or keep lengths and speeds."""


class Scaled(TypedDict):
    """A number of pulses, or of pulses per second, in the body's unit."""

    value: float
    unit: str
    """Unit such as mm, mm/s or mm/s2."""


class Scan(TypedDict):
    """One scan of a line."""

    id: str
    line_id: str
    status: Literal["running", "finished", "failed"]
    found: list[FoundBody]
    asked: int
    """Body numbers asked so far, of 120."""
    error: str | None
    started_at: str
    ended_at: str | None


class ScaraAlignRequest(TypedDict):
    """Turn base and finger to the line of a place, or of the end of a stored path (RC-420 manual 13.10.6).

    From there an extension ends there, through the centre if need be. At a speed in pulses per second.
    """

    kind: Literal["align"]
    pattern: NotRequired[int | None]
    """Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."""
    max_speed: NotRequired[TurnSpeed | None]
    """The fastest it may get; the standard speed sets still bound it. The gateway writes it to the `slow_pattern` of all axes (RAM only) before; `pattern` does not go with it."""
    x: NotRequired[Distance | None]
    y: NotRequired[Distance | None]
    path: NotRequired[int | None]
    """Interpolation path 0-63, in the place of x and y."""


class ScaraAxis(TypedDict):
    """An axis of a robot, and the body that drives it."""

    axis: int
    """0 is the base, 1 the arm, 2 the finger."""
    body_id: str
    position: int | None
    """Position in pulses, as last read."""


class ScaraAxisMove(TypedDict):
    """One axis in a move of the robot."""

    axis: int
    """0 is the base, 1 the arm, 2 the finger."""
    body_id: str
    move_id: str | None
    """The body's own move; null before it is begun, and of an axis that has no part in it."""
    status: MoveStatus | None
    """Status of the body's move; null without one."""
    end_cause: str | None
    """End cause of the body's move."""
    start_position: int
    """Start position in pulses, as the controllers were told (HPS)."""
    target_position: int
    """Target position in pulses, as the gateway calculates it."""
    position: int
    """Position in pulses, as last read."""


class ScaraCoordinates(TypedDict):
    """Where the finger of a robot is now."""

    x: Micrometres
    y: Micrometres
    angle: Millidegrees
    """Angle between finger and X axis, above -180 and up to 180 degrees."""
    scara_id: str
    pulses: list[int]
    """Positions of axes 0, 1 and 2."""
    moving: bool | None
    """True if an axis moves, so that the finger is elsewhere by now."""
    power_cycled: bool
    """A body has lost its power: this means nothing then."""
    read_at: str
    """Time of the answer of all axes."""
    age_ms: float


class ScaraExtendRequest(TypedDict):
    """Extend the arm along its axis."""

    kind: Literal["extend"]
    pattern: NotRequired[int | None]
    """Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."""
    max_speed: NotRequired[PathSpeed | None]
    """The fastest it may get; the standard speed sets still bound it. The gateway writes it to the `slow_pattern` of all axes (RAM only) before; `pattern` does not go with it."""
    distance: Distance


class ScaraFingerRequest(TypedDict):
    """Turn the finger alone to a direction, at a speed in pulses per second (three axes)."""

    kind: Literal["finger"]
    pattern: NotRequired[int | None]
    """Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."""
    max_speed: NotRequired[TurnSpeed | None]
    """The fastest it may get; the standard speed sets still bound it. The gateway writes it to the `slow_pattern` of all axes (RAM only) before; `pattern` does not go with it."""
    angle: Angle
    """Angle between finger and X axis at the end."""


class ScaraGeometry(TypedDict):
    """The geometry as it is configured and as the controllers hold it."""

    scara_id: str
    agrees: bool
    """True if all controllers hold the geometry in the configuration."""
    configured: Geometry
    controllers: list[ControllerGeometry]


class ScaraInfo(TypedDict):
    """A SCARA robot as the gateway knows it, without asking it."""

    scara_id: str
    name: str
    line_id: str
    group_id: str
    """The virtual body that stands for all its bodies."""
    online: bool
    """True if all its bodies can be asked now, as far as is known."""
    moving: bool | None
    """True if an axis moves; null while that is not known."""
    move_id: str | None
    """The move that is not over yet."""
    homed: Homed
    """yes where all its bodies are, no where one has lost its power."""
    power_cycled: bool
    """A body has lost its power: where the finger is means nothing, and moves are refused."""
    axes: list[ScaraAxis]
    geometry: Geometry
    """Geometry in the configuration."""
    own_path: int
    """The stored path that the gateway overwrites for its lines."""


class ScaraLineRequest(TypedDict):
    """Move the finger's end straight to a place; the finger keeps its direction (RC-420 manual 13.10.3)."""

    kind: Literal["line"]
    pattern: NotRequired[int | None]
    """Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."""
    max_speed: NotRequired[PathSpeed | None]
    """The fastest it may get; the standard speed sets still bound it. The gateway writes it to the `slow_pattern` of all axes (RAM only) before; `pattern` does not go with it."""
    x: Distance
    y: Distance


class ScaraList(TypedDict):
    """All SCARA robots of the configuration."""

    scaras: list[ScaraInfo]


class ScaraMove(TypedDict):
    """One move of a SCARA robot: all its axes from one start."""

    id: str
    body_id: str
    """Address of what moves: a body, LINE.3F, or a unit, ROBOT/units/1."""
    status: MoveStatus
    command: str
    """The three characters of the controller's command."""
    frame: str
    """The exact bytes, CR as \\r."""
    evidence: list[str]
    """Observations that the status rests on, in words."""
    error: MoveError | None
    request_id: str | None
    """The X-Request-Id of the request that asked for it."""
    created_at: str
    sent_at: str | None
    acknowledged_at: str | None
    ended_at: str | None
    event_cursor: str
    """Cursor after which the events include all later news of the move."""
    scara_id: str
    kind: Literal["line", "path", "offset", "extend", "retract", "rotate", "finger", "align"]
    preparation: list[str]
    """The frames before the one that starts it, CR as \\r."""
    end_cause: str | None
    """normal, stop_command, or what has ended the axes that failed: ems, stall, cw_limit, ccw_limit as a controller says; not_executed, position_mismatch, lost, unknown as the gateway does."""
    failed_axes: list[int]
    """The axes that made it fail."""
    start: ScaraPlace | None
    """Place at which the finger ended before the move."""
    target: ScaraPlace | None
    """Place at which the finger is to end."""
    coordinates: ScaraPlace | None
    """Place of the finger by the positions last read; null while one is not known."""
    axes: list[ScaraAxisMove]
    """Moves of the axes, in their order."""


class ScaraMoveCancelledEvent(TypedDict):
    """It was not sent, and will not be; about `/scaras/{scara_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["scara.move.cancelled"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ScaraMove


class ScaraMoveFailedEvent(TypedDict):
    """It has ended otherwise; about `/scaras/{scara_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["scara.move.failed"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ScaraMove


class ScaraMoveList(TypedDict):
    """Moves of a robot, newest first."""

    moves: list[ScaraMove]


class ScaraMoveLostEvent(TypedDict):
    """It could not be followed to its end; about `/scaras/{scara_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["scara.move.lost"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ScaraMove


class ScaraMoveQueuedEvent(TypedDict):
    """A move waits for its turn; about `/scaras/{scara_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["scara.move.queued"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ScaraMove


class ScaraMoveRejectedEvent(TypedDict):
    """The controller has refused its command, or has not executed it: nothing moved; about `/scaras/{scara_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["scara.move.rejected"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ScaraMove


class ScaraMoveSentEvent(TypedDict):
    """Its command is on the wire; about `/scaras/{scara_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["scara.move.sent"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ScaraMove


class ScaraMoveStartedEvent(TypedDict):
    """It is seen to move; about `/scaras/{scara_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["scara.move.started"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ScaraMove


class ScaraMoveStoppedEvent(TypedDict):
    """A stop has ended it; about `/scaras/{scara_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["scara.move.stopped"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ScaraMove


class ScaraMoveSucceededEvent(TypedDict):
    """It has ended as it should; about `/scaras/{scara_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["scara.move.succeeded"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ScaraMove


class ScaraMoveUnknownEvent(TypedDict):
    """Nobody can tell whether it was executed, or how it has ended; about `/scaras/{scara_id}`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["scara.move.unknown"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: ScaraMove


class ScaraOffsetRequest(TypedDict):
    """Move the finger's end straight by an amount in X, in Y or in both."""

    kind: Literal["offset"]
    pattern: NotRequired[int | None]
    """Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."""
    max_speed: NotRequired[PathSpeed | None]
    """The fastest it may get; the standard speed sets still bound it. The gateway writes it to the `slow_pattern` of all axes (RAM only) before; `pattern` does not go with it."""
    x: NotRequired[Distance | None]
    y: NotRequired[Distance | None]


class ScaraPathRequest(TypedDict):
    """Move the finger's end along a stored path, or through points (RC-420 manual 13.10.5)."""

    kind: Literal["path"]
    pattern: NotRequired[int | None]
    """Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."""
    max_speed: NotRequired[PathSpeed | None]
    """The fastest it may get; the standard speed sets still bound it. The gateway writes it to the `slow_pattern` of all axes (RAM only) before; `pattern` does not go with it."""
    path: NotRequired[int | None]
    """Interpolation path 0-63."""
    points: NotRequired[list[ViaPoint] | None]
    """Points instead of `path`: the finger goes through these, to the last. They are put into the path that the gateway keeps for its lines."""


class ScaraPlace(TypedDict):
    """Where the finger ends, and where it points (RC-420 manual 13.10.8)."""

    x: Micrometres
    y: Micrometres
    angle: Millidegrees
    """Angle between finger and X axis, above -180 and up to 180 degrees."""


class ScaraRetractRequest(TypedDict):
    """Retract the arm along its axis."""

    kind: Literal["retract"]
    pattern: NotRequired[int | None]
    """Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."""
    max_speed: NotRequired[PathSpeed | None]
    """The fastest it may get; the standard speed sets still bound it. The gateway writes it to the `slow_pattern` of all axes (RAM only) before; `pattern` does not go with it."""
    distance: Distance


class ScaraRotateRequest(TypedDict):
    """Turn the finger to a direction about a point on its line, the arm following (three axes)."""

    kind: Literal["rotate"]
    pattern: NotRequired[int | None]
    """Acceleration pattern; left out, number 30 (RC-420 manual 13.3.4)."""
    max_speed: NotRequired[PathSpeed | None]
    """The fastest it may get; the standard speed sets still bound it. The gateway writes it to the `slow_pattern` of all axes (RAM only) before; `pattern` does not go with it."""
    radius: Distance
    """Distance from the third joint to the centre of the turn."""
    angle: Angle
    """Angle between finger and X axis at the end."""


class ScaraSamples(TypedDict):
    """Where the axes of a robot were seen during a move."""

    scara_id: str
    move_id: str
    axes: list[BodySamples]
    """Samples of each axis that has a part in the move, as of its body's own move: each is asked at a time of its own."""


class Section(TypedDict):
    """The stretch of positions in which an edge counts."""

    lower: Length | int
    """A number alone, as GET gives it, is in pulses; encoder counts in encoder mode."""
    upper: Length | int


class SecurityEntries(TypedDict):
    """Entries, the newest first."""

    entries: list[Entry]
    cursor: int | None
    """Number to give as `cursor` for the next page, with older entries; null if there is none."""


class SecurityTrouble(TypedDict):
    """Why the security log cannot be written."""

    reason: str


class SensorBits(TypedDict):
    """The sensors, bits of CLD (RC-420 manual 14)."""

    stall: bool
    origin: bool
    cw_limit: bool
    ccw_limit: bool
    in_position: bool
    ems: bool


class SensorChange(TypedDict):
    """A sensor that is on or off now."""

    sensor: str
    """stall, origin, cw_limit, ccw_limit, in_position or ems."""
    on: bool


class SessionInfo(TypedDict):
    """A session, without what is secret of it."""

    id: str
    """Id of the session, which does not open it."""
    name: str
    """The name of the key, or of the token's holder."""
    role: Role
    address: str | None
    """The network address that it was begun from."""
    began_at: str
    used_at: str


class SessionList(TypedDict):
    """Sessions, the one that was used last first."""

    sessions: list[SessionInfo]


class Settings(TypedDict):
    """Settings by name; null is one that is not set, or not known."""

    origin_offset: NotRequired[int | None]
    """0SS: pulses from the CW edge of the origin sensor to the origin."""
    overrun_factor: NotRequired[int | None]
    """0BS: origin offsets to overrun the origin sensor (RC-420 manual 13.5.1)."""
    homing_retries: NotRequired[int | None]
    """0RS: how often a failed origin search is tried again."""
    stall_sensor_interval: NotRequired[int | None]
    """QIS: period of the stall dogs in pulses, from ON edge to ON edge."""
    stall_sensor_detection: NotRequired[bool | None]
    """QSS."""
    start_speed_pps: NotRequired[int | None]
    maximum_speed_pps: NotRequired[int | None]
    acceleration_pps_s: NotRequired[int | None]
    rising_percent: NotRequired[int | None]
    falling_percent: NotRequired[int | None]
    encoder_multiplier: NotRequired[Literal["double", "quadruple"] | None]
    """PAS: edges counted for each encoder line (RC-420 manual 13.7.3)."""
    encoder_ratio: NotRequired[float | None]
    """PBS: motor pulses for each encoder count, at most two decimals."""
    encoder_stall_threshold: NotRequired[int | None]
    """PES: pulses between motor and encoder that are a step-out."""
    encoder_stall_detection: NotRequired[bool | None]
    """PSS."""
    adjustment: NotRequired[bool | None]
    """PJS: adjust to the encoder after a move; encoder mode only."""
    adjustment_limit: NotRequired[int | None]
    """PKS: most pulses of an adjustment, beyond which is a STALL error; encoder mode only."""
    adjustment_speed_pps: NotRequired[int | None]
    """PLS: 0 is the start speed of speed set 30; encoder mode only."""
    adjustment_delay_ms: NotRequired[int | None]
    """PTS: wait between a move and its adjustment, in steps of 10 ms; encoder mode only."""
    operating_mode: NotRequired[Literal["stepping", "encoder", "servo"] | None]
    """EAS: stepping motor, stepping motor with encoder, or servo drive (RC-420 manual 13.1)."""
    pulse_format: NotRequired[Literal["pulse_direction", "cw_ccw"] | None]
    """EDS."""
    soft_limits: NotRequired[Stretch | None]
    """EPS: moves that would end outside are refused; null where there are none."""
    input_logic: NotRequired[dict[str, Literal["normally_open", "normally_closed"]] | None]
    """DIS."""
    sensor_logic: NotRequired[dict[str, Literal["normally_open", "normally_closed"]] | None]
    """DLS: the sensor inputs, and the CLR output."""
    noise_filters: NotRequired[dict[str, int] | None]
    """DCS: equal samples, one each ms, that make a change of level."""
    outputs: NotRequired[dict[str, bool] | None]
    """COS: general outputs; FIS keeps them as they are then."""
    error_outputs: NotRequired[dict[str, ErrorOutputSetting | None] | None]
    """CES: the output that reports an error; each needs one of its own."""
    interrupt_edges: NotRequired[dict[str, Literal["off", "falling", "rising"]] | None]
    """CPS: the edge that interrupts; setting it clears what is recorded and pulsed."""
    interrupt_ranges: NotRequired[dict[str, Stretch | None] | None]
    """CSS: where an interrupt is heeded; null for everywhere."""
    interrupt_records: NotRequired[dict[str, dict[str, int | None]] | None]
    """CFS: the positions of the table that take a value."""
    interrupt_pulses: NotRequired[dict[str, InterruptPulse | None] | None]
    """CFS: the pulse that an interrupt gives."""
    clear_pulse_ms: NotRequired[int | None]
    """CCS: the CLR signal's pulse; 0 gives none; servo mode only."""
    robot_type: NotRequired[Literal["three_axes", "two_axes_belt_linked"] | None]
    """HTS; not in encoder mode."""
    driven_axis: NotRequired[int | None]
    """HCS: the axis of a SCARA robot that it drives; not in encoder mode."""
    arm_length_um: NotRequired[int | None]
    """HAS; not in encoder mode."""
    finger_length_um: NotRequired[int | None]
    """HFS; not in encoder mode."""
    pulses_per_turn: NotRequired[dict[str, float] | None]
    """HZS: of each axis, with up to eight decimals; not in encoder mode."""
    position_index: NotRequired[int | None]
    """3IS: moves that step it change it, too."""
    comments: NotRequired[dict[str, str] | None]
    """9VS: up to 40 printable ASCII characters; the mark of the gateway is not shown."""
    autostart: NotRequired[bool | None]
    """UAS: whether the user program starts at power-on (RC-420 manual 15)."""


class SettingsChange(TypedDict):
    """Settings to change; what is not named stays as it is, and so do axes that are not named."""

    smooth_acceleration: NotRequired[bool | None]
    """S-curve; of all axes of the unit."""
    speed_percent: NotRequired[dict[str, Any] | None]
    """Percent of the maximum speed, 0.1-100."""
    maximum_speed: NotRequired[dict[str, Any] | None]
    acceleration_time_ms: NotRequired[dict[str, Any] | None]
    """In milliseconds, 1-9999."""
    deceleration_time_ms: NotRequired[dict[str, Any] | None]
    """In milliseconds, 1-9999."""
    upper_soft_limit: NotRequired[dict[str, Any] | None]
    lower_soft_limit: NotRequired[dict[str, Any] | None]
    start_speed_pps: NotRequired[dict[str, Any] | None]
    """In pulses per second, 0-9999."""
    homing_type: NotRequired[dict[str, Any] | None]
    """0 encoder Z phase, 1 no Z phase, 2 and 3 the same without turning back at the sensor, 4 and 5 the same with the limit sensor for the origin sensor, 6 fast with Z phase."""
    homing_offset: NotRequired[dict[str, Any] | None]
    homing_speed: NotRequired[dict[str, Any] | None]
    index_search_speed: NotRequired[dict[str, Any] | None]
    motor_speed_percent: NotRequired[dict[str, Any] | None]
    """Percent of the maximum speed, 0.1-100."""
    motor_maximum_speed: NotRequired[dict[str, Any] | None]
    motor_acceleration_time_ms: NotRequired[dict[str, Any] | None]
    """In milliseconds, 1-9999."""
    motor_deceleration_time_ms: NotRequired[dict[str, Any] | None]
    """In milliseconds, 1-9999."""
    motor_upper_soft_limit: NotRequired[dict[str, Any] | None]
    motor_lower_soft_limit: NotRequired[dict[str, Any] | None]


class SettingsNews(TypedDict):
    """Settings, speed sets or patterns that are otherwise now."""

    commands: list[str]
    """Commands that were sent and read back, in order, without frames."""
    saved: bool
    """True if all its settings were written to flash memory then (FIS)."""


class Shift(TypedDict):
    """A shift, or any other span of time of a month at most."""

    since: str
    until: str
    known_since: str | None
    """Time at which the journal begins: before it nothing is known. Null if it is empty."""
    moves: int
    """Number of moves that were asked for."""
    ends: dict[str, int]
    """Number of moves by status."""
    failures: list[FailureOfShift]
    """One entry for each cause, the most frequent first."""
    axes: list[AxisOfShift]
    """One entry for each axis, the one with the longest move first."""
    homings: list[HomingOfShift]
    """Bodies that were homed after another homing, with their power kept between."""
    stops: int
    """Number of requests for stops."""
    people: list[PersonOfShift]
    alarms: list[AlarmOfShift]
    """One entry for each cause, the most frequent first."""


class ShuttingDown(TypedDict):
    """The end of the gateway."""

    on_exit: str
    """The configured treatment of motors that move: stop or leave."""


class Signal(TypedDict):
    """One input or output."""

    channel: NotRequired[int | None]
    """Channel of a robot: eight inputs or outputs, from 1; null for a body."""
    number: int
    """Number of the signal, from 0; of a robot, within its channel."""
    name: NotRequired[str | None]
    """Name of the signal in the configuration."""
    on: bool


class SignalState(TypedDict):
    """An input or an output."""

    number: int
    name: str | None
    """Name in the configuration."""
    on: bool


class Signals(TypedDict):
    """The inputs and outputs of a body, or of a robot's first channel."""

    inputs: list[Signal]
    outputs: list[Signal]


class Snapshot(TypedDict):
    """The plant when the event was made; later events up to `as_of` are in it already."""

    as_of: str
    """The cursor of the newest event that it takes account of."""
    lines: list[LineNow]
    """State of the lines; empty if only some bodies or robots were asked for."""
    bodies: list[BodyNow]
    robots: list[RobotNow]
    moves: list[Move | ScaraMove | RobotMove]
    """Moves that are not over."""


class SpeedAccepted(TypedDict):
    """The controller has accepted a change of speed."""

    body_id: str
    command: str
    """The three characters of the controller's command."""


class SpeedChangeInfo(TypedDict):
    """A change of speed as the body works it out."""

    point: int
    begin: int
    """Pulses after the start at which it begins."""
    end: int
    """Pulses after the start at which it is done."""
    speed_pps: int
    begin_in_unit: Scaled | None
    """Begin of the change in the body's unit; null without a scale."""
    end_in_unit: Scaled | None
    speed: Scaled | None


class SpeedChangeRequest(TypedDict):
    """A change of speed on the way: placed by where it begins, or by where it is done.

    With both `begin` counts, and `end` has to be that of the pattern as it was read.
    """

    point: int
    """Number of the change, 0-15."""
    begin: NotRequired[int | None]
    """Pulses after the start at which it begins; or `end`."""
    end: NotRequired[int | None]
    """Pulses after the start at which it is done; or `begin`."""
    speed_pps: int
    """Speed after the change, 1-1,000,000 pps."""


class SpeedCurve(TypedDict):
    """The speed of a move from its first pulse to its last."""

    body_id: str
    pattern: int
    distance: int
    """Distance in pulses; in encoder mode in encoder counts."""
    pulses: int
    """Number of pulses that are put out."""
    distance_in_unit: Scaled | None
    unit: str | None
    """The body's; null without a scale."""
    total_time_s: float
    top_speed: float
    """The highest speed it comes to, in pulses per second."""
    points: list[CurvePoint]
    """Evenly spread, and each moment in which a part of the curve begins."""


class SpeedDecrease(TypedDict):
    """Decelerate to the start speed: command 5DS."""

    mode: Literal["decelerate"]


class SpeedIncrease(TypedDict):
    """Accelerate to the maximum speed: command 5AS."""

    mode: Literal["accelerate"]


class SpeedSet(TypedDict):
    """A speed parameter set as the body holds it in RAM; null is what was never set."""

    body_id: str
    number: int
    """0-29, or 30: the standard set."""
    start_speed_pps: int | None
    """OL, 1-30,000."""
    maximum_speed_pps: int | None
    """OH, 1-1,000,000."""
    acceleration_pps_s: int | None
    """OS, 1-10,000,000."""
    rising_percent: int | None
    """OA, 0-100. The controller tells one that was never set as 0: null where it does so in a set that has no speeds either."""
    falling_percent: int | None
    """OB, 0-100; null as `rising_percent`."""
    start_speed: Scaled | None
    """Start speed in the body's unit; null without a scale."""
    maximum_speed: Scaled | None
    acceleration: Scaled | None
    flash: InFlash | None
    """Values in flash memory, as far as is known; null where the gateway has seen neither the power come on nor FIS."""


class SpeedSetChange(TypedDict):
    """Parameters of a set to change; the others stay as they are."""

    start_speed_pps: NotRequired[int | None]
    maximum_speed_pps: NotRequired[int | None]
    acceleration_pps_s: NotRequired[int | None]
    rising_percent: NotRequired[int | None]
    falling_percent: NotRequired[int | None]


class SpeedSetList(TypedDict):
    """Speed parameter sets of a body."""

    body_id: str
    speed_sets: list[SpeedSet]
    """Sets in the order of their numbers."""


class SpeedSetValues(TypedDict):
    """The five parameters of a set."""

    start_speed_pps: int
    """OL: 1 to 30,000 pps; 50 at first."""
    maximum_speed_pps: int
    """OH: 1 to 1,000,000 pps; 50,000 at first."""
    acceleration_pps_s: int
    """OS: 1 to 10,000,000 pps/s; 100,000 at first."""
    rising_percent: int
    """OA: percent of the ramp's time in which the acceleration rises; 50 at first."""
    falling_percent: int
    """OB: percent of the ramp's time in which it falls; 50 at first."""


class SpeedSetWanted(TypedDict):
    """The five parameters of a set; null, as GET gives it, is one that was never set, and stays so."""

    start_speed_pps: int | None
    maximum_speed_pps: int | None
    acceleration_pps_s: int | None
    rising_percent: int | None
    falling_percent: int | None


class SpeedSetting(TypedDict):
    """Change to a speed: command 5CS."""

    mode: Literal["change"]
    speed: int
    """Speed in pulses per second."""


class SpeedsKnown(TypedDict):
    """The speeds in percent that are set again, and the axes that are at 100 %: by unit and coordinates."""

    speeds: dict[str, dict[str, dict[str, float]]]
    """Percentages of full speed."""
    full_speed: dict[str, dict[str, list[str]]]


class StallFound(TypedDict):
    """A STALL error that stands: moves are refused until it is cleared or the axis homed."""

    finder: StallFinder
    """Finder that raised it: QRD or PRD tells of it."""
    reset: str
    """The route that clears it: POST, with {}."""


class StatusBits(TypedDict):
    """The bits of 9CD (RC-420 manual 13.8.1). The errors stay until they are cleared."""

    pulses_running: bool
    limit_error: bool
    ems_error: bool
    command_error: bool
    initialisation_error: bool
    range_error: bool
    stall_error: bool
    communication_error: bool


class StatusChange(TypedDict):
    """The bits of its controller status that are set (RC-420 manual 13.8.1)."""

    status: list[str]


class StopRefusal(TypedDict):
    """The state of a stop that the robot has refused."""

    robot_id: str
    state: StopState
    """Only confirmed means that the robot itself reports standstill of all axes."""
    detail: str | None
    """Why it is not confirmed."""
    request_id: str | None
    """The X-Request-Id of the request that asked for it first."""
    units_unknown: list[int]
    """Units of which the robot has not told whether they stand still."""
    error: str
    """The refusal, such as E03."""


class StopReport(TypedDict):
    """The state of the stop of one body, and its evidence."""

    body_id: str
    state: StopState
    """Only confirmed means that the controller itself reports standstill."""
    position: int | None
    """Position in pulses, at standstill."""
    detail: str | None
    """Why it is not confirmed."""
    request_id: str | None
    """The X-Request-Id of the request that asked for it first."""


class StopRequest(TypedDict):
    """The way to stop."""

    mode: NotRequired[StopMode]
    """`decelerate` is command 5SS, `immediate` is 5IS (RC-420 manual 14); for robots ASS and AES (C-HOST manual 2-7, 2-8). Left out: decelerate."""


class StopResult(TypedDict):
    """Progress of the stop, after two seconds at most."""

    confirmed: bool
    """True if every controller reports standstill. If false, use the hardware stop."""
    bodies: list[StopReport]
    robots: list[RobotStopReport]


class StoredEntry(TypedDict):
    """A stored position."""

    number: int
    name: str | None
    axes: dict[str, AxisValue]
    """Coordinates by name, without the axes it has no coordinate for."""


class StoredPath(TypedDict):
    """A path as the controllers hold it."""

    scara_id: str
    path: int
    points: list[StoredPoint]
    """Points in their order; empty where the path is."""


class StoredPoint(TypedDict):
    """A point of a path as the controllers hold it."""

    x: Micrometres | None
    y: Micrometres | None
    radius: Micrometres | None
    place: Literal["center"] | None


class Strangers(TypedDict):
    """Bodies that have obeyed a command to a group, and are no members of it."""

    bodies: list[str]


class StreamGapEvent(TypedDict):
    """Events are missing at this place of the stream; about `/events`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["stream.gap"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Gap


class StreamSnapshotEvent(TypedDict):
    """Follows each gap: all that is known now of what is wanted; about `/events`."""

    specversion: NotRequired[Literal["1.0"]]
    id: str
    source: NotRequired[str]
    type: Literal["stream.snapshot"]
    subject: str
    time: str
    datacontenttype: NotRequired[Literal["application/json"]]
    sequence: str
    cursor: str
    correlationid: NotRequired[str | None]
    data: Snapshot


class Stretch(TypedDict):
    """Positions from the lower to the upper, in pulses."""

    lower: int
    """Lower position in pulses, below `upper`."""
    upper: int
    """Upper position in pulses."""


class Strictness(TypedDict):
    """The new strictness of a line: strict, it believes acknowledgements only between two fences."""

    strict: bool


class Swap(TypedDict):
    """Differences between a controller and its backup of the last night, after a loss of power."""

    night: str
    """The night of the backup, as YYYY-MM-DD."""
    differing: int
    """Number of settings, and of a robot's positions, that differ."""
    told: list[str]
    """The first five differences, as in the backup and as the controller holds them."""
    certain: bool
    """True if a user comment differs, which may hold a serial number: then it is another controller. Else settings that were not in flash memory may have been lost."""


class TableUpload(TypedDict):
    """Positions that are being stored in a body, or were: all are sent, then all are read back."""

    id: str
    target: str
    """Path of the body, line or robot that is read."""
    status: JobStatus
    controllers: list[str]
    """Ids of the bodies, or of the robot, that are read, in their order."""
    controller: str | None
    """The controller that is being read, or was when the reading ended."""
    read: int
    """Answers read so far."""
    expected: int | None
    """Answers it takes at most, as far as is known: settings that were never set are not asked for. Null if unknown."""
    left_s: float | None
    """Seconds that it still takes, by the line's speed first, then by its own pace; null if unknown."""
    baud: int | None
    """Baud rate of the line, if its port tells it: 38400 takes a third of the time of 9600."""
    error: BackupError | None
    """The error that ended the reading early."""
    request_id: str | None
    """The X-Request-Id of the request that asked for it."""
    started_at: str
    ended_at: str | None
    count: int
    """The number of positions it has."""
    flash: bool
    """True if the whole table is to be written to flash memory, too (FPS)."""
    positions: list[NamedPosition] | None
    """Positions as read back, once all are stored. Events leave them out: ask for the record."""


class TakeOverRequest(TypedDict):
    """Confirmation that a line may be taken over from another gateway."""

    old: str
    """Name of the gateway that has had the line."""
    has_cut: Literal[True]
    """True if the old gateway is off, or cannot reach the terminal server: a person has made sure."""


class Taken(TypedDict):
    """A lease as its holder sees it."""

    lease: str
    """Id of the lease."""
    scope: str
    """Address of the leased line, body, group or robot."""
    covers: list[str]
    """Addresses of the leased bodies and robots, or of the line."""
    holder: str
    """The name of the key that took it."""
    ttl_s: float
    """Seconds that the lease lasts after each renewal."""
    expires_in_s: float
    """Seconds that the lease still lasts, unless it is renewed."""
    token: int
    """Number for the header Lease-Token of motions and settings."""


class Ticket(TypedDict):
    """A secret that opens one event stream."""

    ticket: str
    """The secret, for the query parameter `ticket` of /events, /events/stream or the stream of a trace."""
    expires_in_s: float
    """Seconds for which the ticket is valid, once."""


class Trace(TypedDict):
    """The newest records of a line, oldest first."""

    line_id: str
    entries: list[TraceRecord]


class TraceRecord(TypedDict):
    """An event at the port: bytes were received or sent, or the port opened, was lost or closed."""

    at: str
    """UTC wall time, which jumps when the clock is set."""
    monotonic_ns: int
    """A clock that never jumps."""
    kind: TraceKind
    data: str
    """The bytes; unprintable ones as \\r, \\n, \\t or \\x00."""
    caller: NotRequired[str | None]
    """The caller of sent bytes: an interface and a client's address, or `gateway: fence`."""
    request_id: NotRequired[str | None]
    """The X-Request-Id of the request behind it."""


class Translations(TypedDict):
    """Translations of texts that the gateway has in English only: hints of parameters, reasons, notes."""

    ja: dict[str, str]
    """The Japanese sentence for each English one."""


class TurnSpeed(TypedDict):
    """How fast each axis turns."""

    value: float
    unit: Literal["deg/s", "mdeg/s"]


class Unanswered(TypedDict):
    """A body that did not answer."""

    body_id: str
    detail: str
    """Why."""


class UnitChange(TypedDict):
    """The selected unit, as the gateway had left it and as it was found."""

    expected: int
    """Number of a unit."""
    found: int
    """Number of a unit."""


class UnitInfo(TypedDict):
    """A unit of a robot as the gateway knows it, without asking it."""

    robot_id: str
    number: int
    axes: list[AxisInfo]
    """User axes, in the robot's order."""
    motor_axes: list[AxisInfo]
    """Motor axes; the same ones where nothing is converted."""
    homed: UnitHomed
    """yes: every axis has told its place when the unit was read last, and no homing, macro or loss of power is known since. Another unit is not selected just to ask it."""
    move_id: str | None
    """The move that is not over yet."""


class UnitPosition(TypedDict):
    """Where the axes of a unit stand."""

    robot_id: str
    unit: int
    coordinates: CoordinateSystem
    axes: dict[str, AxisPlace]
    read_at: str
    """Time of the robot's answer."""
    age_ms: float
    """Age of the answer in ms when it was passed on."""


class UnitPositionLabel(TypedDict):
    """The name that a unit's position has now."""

    robot_id: str
    unit: int
    number: int
    name: str | None


class UnitSettings(TypedDict):
    """The settings of a unit; after a change those that were changed, read back."""

    robot_id: str
    unit: int
    smooth_acceleration: NotRequired[bool | None]
    """S-curve; of all axes of the unit."""
    speed_percent: NotRequired[dict[str, float] | None]
    """100 after power-on."""
    maximum_speed: NotRequired[dict[str, AxisValue] | None]
    acceleration_time_ms: NotRequired[dict[str, int] | None]
    deceleration_time_ms: NotRequired[dict[str, int] | None]
    upper_soft_limit: NotRequired[dict[str, AxisValue] | None]
    lower_soft_limit: NotRequired[dict[str, AxisValue] | None]
    start_speed_pps: NotRequired[dict[str, int] | None]
    homing_type: NotRequired[dict[str, int] | None]
    """0 encoder Z phase, 1 no Z phase, 2 and 3 the same without turning back at the sensor, 4 and 5 the same with the limit sensor for the origin sensor, 6 fast with Z phase."""
    homing_offset: NotRequired[dict[str, AxisValue] | None]
    homing_speed: NotRequired[dict[str, AxisValue] | None]
    index_search_speed: NotRequired[dict[str, AxisValue] | None]
    motor_speed_percent: NotRequired[dict[str, float] | None]
    """100 after power-on."""
    motor_maximum_speed: NotRequired[dict[str, AxisValue] | None]
    motor_acceleration_time_ms: NotRequired[dict[str, int] | None]
    motor_deceleration_time_ms: NotRequired[dict[str, int] | None]
    motor_upper_soft_limit: NotRequired[dict[str, AxisValue] | None]
    motor_lower_soft_limit: NotRequired[dict[str, AxisValue] | None]


class UnitStatus(TypedDict):
    """The state of a unit and its axes."""

    robot_id: str
    unit: int
    moving: bool
    """True if an axis moves, or a macro, homing or a move is under way."""
    axes: dict[str, AxisState]
    """States of the motor axes, by name."""
    read_at: str
    age_ms: float


class Unreadable(TypedDict):
    """Why the state could not be learned."""

    detail: str


class UntriedLine(TypedDict):
    """A line that rests on assumptions about real hardware."""

    line_id: str
    assumptions: list[str]
    """Names of the assumptions; empty if none was ever tried."""
    meaning: str
    """The meaning for the line, and what to do."""


class UploadError(TypedDict):
    """Why an upload did not succeed, in the words of a problem detail."""

    type: str
    """The kind of error; stable."""
    detail: str
    remedy: str
    line: int | None
    """The first line of the source that differs, from 1."""


class Uploaded(TypedDict):
    """Positions that were stored."""

    robot_id: str
    unit: int
    count: int


class VariableList(TypedDict):
    """Variables of a robot."""

    robot_id: str
    variables: list[VariableValue]


class VariableSetting(TypedDict):
    """The value that a variable is to take."""

    value: float


class VariableValue(TypedDict):
    """A variable and what it holds."""

    number: int
    """Number of the variable, 0-99."""
    value: float


class Version(TypedDict):
    """The program that runs here, and its version."""

    name: str
    version: str
    """Semantic version of the gateway."""


class ViaPoint(TypedDict):
    """A point that a path leads through, or the centre (RC-420 manual 13.10.5, 13.10.6)."""

    x: NotRequired[Distance | None]
    y: NotRequired[Distance | None]
    radius: NotRequired[Distance | None]
    """Radius of the arc that rounds the corner; left out, 0. The last point has none."""
    place: NotRequired[Literal["center"] | None]
    """`center`: the third joint is over the origin of coordinates."""


class WantedPlace(TypedDict):
    """A place of the finger."""

    x: Distance
    y: Distance
    angle: NotRequired[Angle | None]
    """Angle between finger and X axis; left out, 0, or the only one of a belt-linked robot."""


class Weakened(TypedDict):
    """A setting that protects less than its default."""

    setting: str
    """Name of the setting in the configuration file."""
    value: str | None
    """Value of the setting; null for callers who are no admins."""
    meaning: str
    """The risk that the value allows, in words."""


class WentOffline(TypedDict):
    """Why a body counts as silent."""

    asked: bool
    """False where no body on its line was heard, and it was not asked itself."""


AmountUnit: TypeAlias = Literal["mm", "pulse", "degree"]


AxisMotion: TypeAlias = Literal["standing", "jog", "move", "homing", "macro", "stopped"]


Block: TypeAlias = Literal["a", "b", "c", "d"]


CallMethod: TypeAlias = Literal["GET", "POST", "PUT"]


Completion: TypeAlias = Literal["frame", "polling"]


CoordinateSystem: TypeAlias = Literal["user", "motor"]


CountedIn: TypeAlias = Literal["pulses", "encoder_counts"]


DetailKind: TypeAlias = Literal["none", "emergency", "driver", "connection", "timeout", "fics", "unreadable"]


Direction: TypeAlias = Literal["cw", "ccw"]


Effect: TypeAlias = Literal["read", "setting", "clearing", "motion", "stop", "maintenance"]


HomeMethod: TypeAlias = Literal[
    "standard", "stall_detection", "fast_then_stop", "fast_then_decelerate", "rc204", "centre_stall_dog"
]


Homed: TypeAlias = Literal["yes", "no", "unknown"]


HostMode: TypeAlias = Literal[2, 3]


JobStatus: TypeAlias = Literal["running", "succeeded", "failed", "cancelled"]


JournalState: TypeAlias = Literal["ready", "unavailable"]


JsonValue: TypeAlias = Any


LengthUnit: TypeAlias = Literal["pulse", "mm", "um", "deg", "mdeg"]


LineState: TypeAlias = Literal["down", "silent", "standby", "setting_up", "ready", "out_of_step"]


MoveKind: TypeAlias = Literal["relative", "absolute", "home", "continuous", "jog", "interpolated"]


MoveStatus: TypeAlias = Literal[
    "queued", "sent", "moving", "succeeded", "failed", "stopped", "rejected", "cancelled", "lost", "unknown"
]


Moved: TypeAlias = Literal["no", "yes", "unknown"]


RateUnit: TypeAlias = Literal["pulse/s", "mm/s", "um/s", "deg/s", "mdeg/s"]


Retry: TypeAlias = Literal["read", "setting", "conditional", "never", "stop"]


Right: TypeAlias = Literal["open", "view", "stop", "operate", "setup", "admin"]


RobotMoveCompletion: TypeAlias = Literal["reply", "inferred"]


RobotMoveKind: TypeAlias = Literal["absolute", "relative", "position", "home", "step", "macro"]


Role: TypeAlias = Literal["viewer", "operator", "setup", "admin"]


Speed: TypeAlias = Literal["high", "low"]


StallFinder: TypeAlias = Literal["stall_sensor", "encoder"]


StopMode: TypeAlias = Literal["decelerate", "immediate"]


StopState: TypeAlias = Literal["requested", "sent", "acknowledged", "refused", "confirmed", "not_sent"]


StopTiming: TypeAlias = Literal["interject", "after_reply"]


TraceKind: TypeAlias = Literal["rx", "tx", "opened", "lost", "closed"]


UnitHomed: TypeAlias = Literal["yes", "unknown"]


UnknownReason: TypeAlias = Literal["not_homed", "homing", "macro", "automatic", "no_conversion", "not_known"]


WhenAnswered: TypeAlias = Literal["always", "on_completion", "at_once"]


Event: TypeAlias = (
    LineUpEvent
    | LineDownEvent
    | LineOwnedEvent
    | LineTakenOverEvent
    | LineOrderViolatedEvent
    | GatewayJournalTroubleEvent
    | GatewayJournalRecoveredEvent
    | GatewayJournalSetAsideEvent
    | GatewayCrashedEvent
    | GatewayLoopHeldEvent
    | GatewayShuttingDownEvent
    | StreamGapEvent
    | LineLeaseTakenEvent
    | LineLeaseReleasedEvent
    | LineLeaseExpiredEvent
    | LineLeaseTakenOverEvent
    | LineLeaseBrokenEvent
    | AlarmRaisedEvent
    | AlarmResetEvent
    | IoEvent
    | GatewayReloadedEvent
    | GatewayReloadFailedEvent
    | GatewayScanFinishedEvent
    | GatewayScanFailedEvent
    | GatewayRecordingFinishedEvent
    | GatewayRecordingFailedEvent
    | GatewaySecurityTroubleEvent
    | GatewaySecurityRecoveredEvent
    | GatewayRefusalsBurstEvent
    | GatewayKeyMadeEvent
    | GatewayKeyApprovedEvent
    | GatewayKeyRotatedEvent
    | GatewayKeyEndsSoonEvent
    | GatewayKeyExpiredEvent
    | GatewayKeyRevokedEvent
    | PlantUnreachableEvent
    | PlantReachedEvent
    | StreamSnapshotEvent
    | BodyMoveQueuedEvent
    | BodyMoveSentEvent
    | BodyMoveStartedEvent
    | BodyMoveSucceededEvent
    | BodyMoveFailedEvent
    | BodyMoveStoppedEvent
    | BodyMoveRejectedEvent
    | BodyMoveCancelledEvent
    | BodyMoveLostEvent
    | BodyMoveUnknownEvent
    | BodyLeaseTakenEvent
    | BodyLeaseReleasedEvent
    | BodyLeaseExpiredEvent
    | BodyLeaseTakenOverEvent
    | BodyLeaseBrokenEvent
    | BodyStopRequestedEvent
    | BodyStopConfirmedEvent
    | BodyStopUnconfirmedEvent
    | BodyMotionForeignEvent
    | BodyOnlineEvent
    | BodyOfflineEvent
    | BodyUnreadableEvent
    | BodyStatusChangedEvent
    | BodyPowerCycledEvent
    | BodySwappedEvent
    | BodyPowerCycleAcknowledgedEvent
    | BodyPowerMarkMissingEvent
    | BodyControllerEventEvent
    | BodySensorChangedEvent
    | BodyInputChangedEvent
    | BodyProgramMessageEvent
    | BodyEndFrameEvent
    | BodyProgramUploadStartedEvent
    | BodyProgramUploadProgressEvent
    | BodyProgramUploadSucceededEvent
    | BodyProgramUploadFailedEvent
    | BodyProgramUploadCancelledEvent
    | BodyBackupStartedEvent
    | BodyBackupProgressEvent
    | BodyBackupSucceededEvent
    | BodyBackupFailedEvent
    | BodyBackupCancelledEvent
    | BodyComparisonStartedEvent
    | BodyComparisonProgressEvent
    | BodyComparisonSucceededEvent
    | BodyComparisonFailedEvent
    | BodyComparisonCancelledEvent
    | BodyPositionReadingStartedEvent
    | BodyPositionReadingProgressEvent
    | BodyPositionReadingSucceededEvent
    | BodyPositionReadingFailedEvent
    | BodyPositionReadingCancelledEvent
    | BodyPositionUploadStartedEvent
    | BodyPositionUploadProgressEvent
    | BodyPositionUploadSucceededEvent
    | BodyPositionUploadFailedEvent
    | BodyPositionUploadCancelledEvent
    | BodyRestoreStartedEvent
    | BodyRestoreProgressEvent
    | BodyRestoreVerifiedEvent
    | BodyRestoreDiffersEvent
    | BodyRestoreFailedEvent
    | BodyRestoreCancelledEvent
    | BodyJogStartedEvent
    | BodyJogStoppingEvent
    | BodyJogEndedEvent
    | BodyJogLostEvent
    | BodyJogStoppedEvent
    | BodyProgramStartedEvent
    | BodyProgramEndedEvent
    | BodyPositionEvent
    | BodySettingsChangedEvent
    | BodyLeftMovingEvent
    | LineBackupStartedEvent
    | LineBackupProgressEvent
    | LineBackupSucceededEvent
    | LineBackupFailedEvent
    | LineBackupCancelledEvent
    | LineComparisonStartedEvent
    | LineComparisonProgressEvent
    | LineComparisonSucceededEvent
    | LineComparisonFailedEvent
    | LineComparisonCancelledEvent
    | LineRestoreStartedEvent
    | LineRestoreProgressEvent
    | LineRestoreVerifiedEvent
    | LineRestoreDiffersEvent
    | LineRestoreFailedEvent
    | LineRestoreCancelledEvent
    | GroupLeaseTakenEvent
    | GroupLeaseReleasedEvent
    | GroupLeaseExpiredEvent
    | GroupLeaseTakenOverEvent
    | GroupLeaseBrokenEvent
    | GroupStrangersEvent
    | LineStopsUnconfirmedEvent
    | LineStrictEvent
    | LineMessageEvent
    | LineScanRunningEvent
    | LineScanFinishedEvent
    | LineScanFailedEvent
    | ScaraMoveQueuedEvent
    | ScaraMoveSentEvent
    | ScaraMoveStartedEvent
    | ScaraMoveSucceededEvent
    | ScaraMoveFailedEvent
    | ScaraMoveStoppedEvent
    | ScaraMoveRejectedEvent
    | ScaraMoveCancelledEvent
    | ScaraMoveLostEvent
    | ScaraMoveUnknownEvent
    | RobotMoveQueuedEvent
    | RobotMoveSentEvent
    | RobotMoveStartedEvent
    | RobotMoveSucceededEvent
    | RobotMoveFailedEvent
    | RobotMoveStoppedEvent
    | RobotMoveRejectedEvent
    | RobotMoveCancelledEvent
    | RobotMoveLostEvent
    | RobotMoveUnknownEvent
    | RobotLeaseTakenEvent
    | RobotLeaseReleasedEvent
    | RobotLeaseExpiredEvent
    | RobotLeaseTakenOverEvent
    | RobotLeaseBrokenEvent
    | RobotMoveOverdueEvent
    | RobotStopRequestedEvent
    | RobotStopConfirmedEvent
    | RobotStopUnconfirmedEvent
    | RobotStopRefusedEvent
    | RobotMotionForeignEvent
    | RobotOnlineEvent
    | RobotOfflineEvent
    | RobotUnreadableEvent
    | RobotErrorEvent
    | RobotErrorsResetEvent
    | RobotSwappedEvent
    | RobotPowerCycledEvent
    | RobotSpeedsRestoredEvent
    | RobotPowerCycleAcknowledgedEvent
    | RobotBitsMismatchEvent
    | RobotInputChangedEvent
    | RobotStatusChangedEvent
    | RobotSensorChangedEvent
    | RobotUnitChangedEvent
    | RobotUnitMissingEvent
    | RobotJogStartedEvent
    | RobotJogStoppingEvent
    | RobotJogEndedEvent
    | RobotJogLostEvent
    | RobotJogStoppedEvent
    | RobotJogNotStoppedEvent
    | RobotBackupStartedEvent
    | RobotBackupProgressEvent
    | RobotBackupSucceededEvent
    | RobotBackupFailedEvent
    | RobotBackupCancelledEvent
    | RobotComparisonStartedEvent
    | RobotComparisonProgressEvent
    | RobotComparisonSucceededEvent
    | RobotComparisonFailedEvent
    | RobotComparisonCancelledEvent
    | RobotRestoreStartedEvent
    | RobotRestoreProgressEvent
    | RobotRestoreVerifiedEvent
    | RobotRestoreDiffersEvent
    | RobotRestoreFailedEvent
    | RobotRestoreCancelledEvent
    | RobotPositionEvent
    | RobotLeftMovingEvent
)
