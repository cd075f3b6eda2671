"""Every operation of the gateway as a method; generated from openapi/resources.json."""

from __future__ import annotations

from typing import Any, Literal, Protocol

from motion_gateway_client.generated.types import (
    AbsoluteMoveRequest,
    Alarm,
    AlarmList,
    Audit,
    AxisPulses,
    Backup,
    BackupComparison,
    BodyComparisonRequest,
    BodyErrorOutputs,
    BodyInfo,
    BodyInputs,
    BodyJog,
    BodyJogRequest,
    BodyList,
    BodyOutputs,
    BodyPositions,
    BodyRestoreRequest,
    BodySamples,
    BodySensors,
    BodySettings,
    BodySettingsChange,
    BodyStatus,
    CaptureList,
    CaptureRequest,
    CaptureState,
    ChangedPattern,
    ChangedSettings,
    ChangedSpeedSet,
    ChannelList,
    CommandList,
    Commissioning,
    CommissioningRequest,
    ContinuousMoveRequest,
    CoordinateSystem,
    CurveDraft,
    Encoder,
    EncoderChange,
    ErrorOutputChoice,
    EventList,
    GeometryApplication,
    GroupDefinition,
    GroupInfo,
    GroupList,
    GroupMove,
    GroupPlan,
    HomeRequest,
    Homing,
    HomingChange,
    Identity,
    JogRequest,
    JogSession,
    KeyInfo,
    KeyList,
    Kinematics,
    Lease,
    LeaseList,
    LeaseRequest,
    LengthUnit,
    LineComparisonRequest,
    LineInfo,
    LineList,
    LinePositions,
    LineRestoreRequest,
    LineStatuses,
    Liveness,
    MacroList,
    MacroRunRequest,
    MadeKey,
    Memory,
    MemoryChange,
    MemoryChanges,
    MemoryList,
    ModeChange,
    Moment,
    Move,
    MoveList,
    NewBodies,
    NewKey,
    NewLine,
    NightlyBackups,
    NoiseFilters,
    NoiseFiltersChange,
    Numbers,
    OutputPulse,
    OutputState,
    OutputSwitch,
    PathDefinition,
    Pattern,
    PatternChange,
    PatternList,
    PatternValues,
    PlannedMove,
    PlannedRobotMove,
    PlannedScaraMove,
    PortList,
    PortScan,
    PortScanRequest,
    Position,
    PositionLabel,
    PositionMoveRequest,
    PositionName,
    PositionReading,
    PositionsToStore,
    PositionTable,
    PositionToCall,
    PositionUpload,
    Posture,
    Program,
    ProgramRun,
    ProgramState,
    ProgramUpload,
    RawReply,
    RawRequest,
    Readiness,
    RecordingInfo,
    RecordingList,
    RecordingRequest,
    RelativeMoveRequest,
    Reloaded,
    ReloadRequest,
    Resolution,
    ResolutionRequest,
    Restore,
    RestorePlan,
    RobotAbsoluteMoveRequest,
    RobotComparisonRequest,
    RobotErrors,
    RobotHomeRequest,
    RobotInfo,
    RobotLineInfo,
    RobotList,
    RobotMove,
    RobotMoveList,
    RobotPositionMoveRequest,
    RobotRawReply,
    RobotRawRequest,
    RobotRelativeMoveRequest,
    RobotRestoreRequest,
    RobotSamples,
    RobotStepRequest,
    Rotation,
    RunRequest,
    Scan,
    ScaraAlignRequest,
    ScaraCoordinates,
    ScaraExtendRequest,
    ScaraFingerRequest,
    ScaraGeometry,
    ScaraInfo,
    ScaraLineRequest,
    ScaraList,
    ScaraMove,
    ScaraMoveList,
    ScaraOffsetRequest,
    ScaraPathRequest,
    ScaraRetractRequest,
    ScaraRotateRequest,
    ScaraSamples,
    SecurityEntries,
    SessionInfo,
    SessionList,
    SettingsChange,
    Shift,
    SignalState,
    Speed,
    SpeedAccepted,
    SpeedCurve,
    SpeedDecrease,
    SpeedIncrease,
    SpeedSet,
    SpeedSetChange,
    SpeedSetList,
    SpeedSetting,
    SpeedSetWanted,
    StopRequest,
    StopResult,
    StoredPath,
    TableUpload,
    Taken,
    TakeOverRequest,
    Ticket,
    Trace,
    Translations,
    UnitInfo,
    UnitPosition,
    UnitPositionLabel,
    UnitSettings,
    UnitStatus,
    Uploaded,
    VariableList,
    VariableSetting,
    VariableValue,
    Version,
    WantedPlace,
)
from motion_gateway_client.paths import filled


class Operations(Protocol):
    """What a gateway can be asked; how it is asked is up to `call`."""

    def call(
        self,
        method: str,
        path: str,
        *,
        query: dict[str, Any] | None = None,
        body: Any = None,
        idempotency_key: str | None = None,
    ) -> Any:
        """Send a request, and give the answer's content."""

    def stop_body(self, body_id: str, body: StopRequest | None = None, /) -> StopResult:
        """Stop a body by software: what waits is cancelled, and the stop goes out at the next frame boundary."""
        answer: StopResult = self.call("POST", filled("/bodies/{body_id}/stop", body_id=body_id), body=body)
        return answer

    def stop_group(self, group_id: str, body: StopRequest | None = None, /) -> StopResult:
        """Stop all members of a group by software, with one frame for all and then one for each."""
        answer: StopResult = self.call(
            "POST", filled("/groups/{group_id}/stop", group_id=group_id), body=body
        )
        return answer

    def stop_all(self, body: StopRequest | None = None, /) -> StopResult:
        """Stop all bodies and robots of all lines by software. It does not replace a hardware stop."""
        answer: StopResult = self.call("POST", filled("/stop"), body=body)
        return answer

    def list_bodies(self, *, fresh: bool | None = None) -> BodyList:
        """List all bodies as they were last seen; with `fresh`, they are asked for status and position first."""
        answer: BodyList = self.call("GET", filled("/bodies"), query={"fresh": fresh})
        return answer

    def get_body(self, body_id: str) -> BodyInfo:
        """Tell what is known of a body; nothing is sent."""
        answer: BodyInfo = self.call("GET", filled("/bodies/{body_id}", body_id=body_id))
        return answer

    def get_position(self, body_id: str) -> Position:
        """Ask the controller where the motor stands (6PD), and for its mode where that is not known (EAD)."""
        answer: Position = self.call("GET", filled("/bodies/{body_id}/position", body_id=body_id))
        return answer

    def set_position(
        self, body_id: str, body: PositionToCall, /, *, idempotency_key: str | None = None
    ) -> Position:
        """Call the present position by another number (6PS). Nothing moves; refused while the motor moves."""
        answer: Position = self.call(
            "PUT",
            filled("/bodies/{body_id}/position", body_id=body_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def acknowledge_body_power_cycle(self, body_id: str, *, idempotency_key: str | None = None) -> BodyInfo:
        """Allow motions to places again after a loss of power: its position counts from where it was switched on.

        The controller is asked whether it has kept its power since. Its settings and its position table are those
        of its flash memory. Homing does the same as this, and so does setting its position.
        """
        answer: BodyInfo = self.call(
            "POST",
            filled("/bodies/{body_id}/power-cycle/acknowledge", body_id=body_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def change_speed_of_move(
        self,
        body_id: str,
        body: SpeedIncrease | SpeedDecrease | SpeedSetting,
        /,
        *,
        idempotency_key: str | None = None,
    ) -> SpeedAccepted:
        """Change the speed of the running move; refused at standstill, while homing and while interpolating."""
        answer: SpeedAccepted = self.call(
            "POST",
            filled("/bodies/{body_id}/speed", body_id=body_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def get_status(self, body_id: str) -> BodyStatus:
        """Ask the controller for its status (9CD), the cause of the last end (9MD) and its sensors (CLD).

        Where a STALL error stands it is asked who has found it (QRD, PRD).
        """
        answer: BodyStatus = self.call("GET", filled("/bodies/{body_id}/status", body_id=body_id))
        return answer

    def get_positions(self, line_id: str) -> LinePositions:
        """Ask all bodies of a line where they stand (6PD), in the fewest frames."""
        answer: LinePositions = self.call("GET", filled("/lines/{line_id}/positions", line_id=line_id))
        return answer

    def get_statuses(self, line_id: str) -> LineStatuses:
        """Ask all bodies of a line for their status (9CD), in the fewest frames."""
        answer: LineStatuses = self.call("GET", filled("/lines/{line_id}/statuses", line_id=line_id))
        return answer

    def start_move(
        self,
        body_id: str,
        body: RelativeMoveRequest
        | AbsoluteMoveRequest
        | PositionMoveRequest
        | HomeRequest
        | ContinuousMoveRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> Move:
        """Start a move, or with `validate_only` say what it would be.

        202 when the controller has accepted it and it is not over, 200 when it ended while the request waited. A
        move that has started and failed is no HTTP error: see its `status`, `end_cause` and `error`. `plan_move` does that.
        """
        answer: Move = self.call(
            "POST",
            filled("/bodies/{body_id}/moves", body_id=body_id),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def plan_move(
        self,
        body_id: str,
        body: RelativeMoveRequest
        | AbsoluteMoveRequest
        | PositionMoveRequest
        | HomeRequest
        | ContinuousMoveRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> PlannedMove:
        """Say what `start_move` would send, and how long it would take; nothing moves."""
        answer: PlannedMove = self.call(
            "POST",
            filled("/bodies/{body_id}/moves", body_id=body_id),
            query={"wait": wait},
            body={**body, "validate_only": True},
            idempotency_key=idempotency_key,
        )
        return answer

    def list_moves(self, body_id: str, *, limit: int | None = None) -> MoveList:
        """List the body's moves, newest first."""
        answer: MoveList = self.call(
            "GET", filled("/bodies/{body_id}/moves", body_id=body_id), query={"limit": limit}
        )
        return answer

    def get_move(self, body_id: str, move_id: str, *, wait: float | None = None) -> Move:
        """Get a move, at once or when it is over."""
        answer: Move = self.call(
            "GET",
            filled("/bodies/{body_id}/moves/{move_id}", body_id=body_id, move_id=move_id),
            query={"wait": wait},
        )
        return answer

    def change_speed_of_one_move(
        self,
        body_id: str,
        move_id: str,
        body: SpeedIncrease | SpeedDecrease | SpeedSetting,
        /,
        *,
        idempotency_key: str | None = None,
    ) -> Move:
        """Change the speed of this move on its way (5AS, 5CS, 5DS); 409 when it is over, or homes."""
        answer: Move = self.call(
            "POST",
            filled("/bodies/{body_id}/moves/{move_id}/speed", body_id=body_id, move_id=move_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def start_group_move(
        self,
        group_id: str,
        body: RelativeMoveRequest
        | AbsoluteMoveRequest
        | PositionMoveRequest
        | HomeRequest
        | ContinuousMoveRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> GroupMove:
        """Start a move of all members of a group by one command; each has a move of its own. `plan_group_move` does that."""
        answer: GroupMove = self.call(
            "POST",
            filled("/groups/{group_id}/moves", group_id=group_id),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def plan_group_move(
        self,
        group_id: str,
        body: RelativeMoveRequest
        | AbsoluteMoveRequest
        | PositionMoveRequest
        | HomeRequest
        | ContinuousMoveRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> GroupPlan:
        """Say what `start_group_move` would send, and how long it would take; nothing moves."""
        answer: GroupPlan = self.call(
            "POST",
            filled("/groups/{group_id}/moves", group_id=group_id),
            query={"wait": wait},
            body={**body, "validate_only": True},
            idempotency_key=idempotency_key,
        )
        return answer

    def list_body_positions(
        self, body_id: str, *, first: int | None = None, last: int | None = None
    ) -> BodyPositions:
        """Read stored positions (3ND), each in a frame of its own: all 2048 take 90 s at 9600 baud.

        `POST .../positions/readings` answers at once.
        """
        answer: BodyPositions = self.call(
            "GET",
            filled("/bodies/{body_id}/positions", body_id=body_id),
            query={"first": first, "last": last},
        )
        return answer

    def store_body_positions(
        self,
        body_id: str,
        body: PositionsToStore,
        /,
        *,
        first: int | None = None,
        last: int | None = None,
        idempotency_key: str | None = None,
    ) -> BodyPositions:
        """Store positions (3PS) and read them back; without a position, where the motor stands.

        `If-Match` is the ETag of the positions from `first` to `last`, which are read first then. Each position
        takes 0.13 s at 9600 baud: for many, `POST .../positions/uploads` answers at once.
        """
        answer: BodyPositions = self.call(
            "PUT",
            filled("/bodies/{body_id}/positions", body_id=body_id),
            query={"first": first, "last": last},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def download_body_positions(
        self, body_id: str, *, first: int | None = None, last: int | None = None
    ) -> str:
        """Read stored positions as CSV: the columns `number` and `pulse`."""
        answer: str = self.call(
            "GET",
            filled("/bodies/{body_id}/positions.csv", body_id=body_id),
            query={"first": first, "last": last},
        )
        return answer

    def read_body_positions(
        self,
        body_id: str,
        *,
        first: int | None = None,
        last: int | None = None,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> PositionReading:
        """Begin to read stored positions; the record at `Location` has them in the end."""
        answer: PositionReading = self.call(
            "POST",
            filled("/bodies/{body_id}/positions/readings", body_id=body_id),
            query={"first": first, "last": last, "wait": wait},
            idempotency_key=idempotency_key,
        )
        return answer

    def cancel_body_position_reading(
        self, body_id: str, *, idempotency_key: str | None = None
    ) -> PositionReading:
        """Read no more."""
        answer: PositionReading = self.call(
            "DELETE",
            filled("/bodies/{body_id}/positions/readings/current", body_id=body_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_body_position_reading(
        self, body_id: str, reading_id: str, *, wait: float | None = None
    ) -> PositionReading:
        """Get a reading of positions, at once or when it is over; `current` is the one under way, or the last."""
        answer: PositionReading = self.call(
            "GET",
            filled(
                "/bodies/{body_id}/positions/readings/{reading_id}", body_id=body_id, reading_id=reading_id
            ),
            query={"wait": wait},
        )
        return answer

    def upload_body_position_table(
        self,
        body_id: str,
        body: PositionsToStore,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> TableUpload:
        """Begin to store positions as `PUT .../positions` does; the record at `Location` tells the progress.

        The request is not held meanwhile: all 2048 positions take four minutes at 9600 baud.
        """
        answer: TableUpload = self.call(
            "POST",
            filled("/bodies/{body_id}/positions/uploads", body_id=body_id),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def cancel_body_position_upload(self, body_id: str, *, idempotency_key: str | None = None) -> TableUpload:
        """Store no more; what was sent stays in RAM, and `error` says how much that is."""
        answer: TableUpload = self.call(
            "DELETE",
            filled("/bodies/{body_id}/positions/uploads/current", body_id=body_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_body_position_upload(
        self, body_id: str, upload_id: str, *, wait: float | None = None
    ) -> TableUpload:
        """Get an upload of positions, at once or when it is over; `current` is the one under way, or the last."""
        answer: TableUpload = self.call(
            "GET",
            filled("/bodies/{body_id}/positions/uploads/{upload_id}", body_id=body_id, upload_id=upload_id),
            query={"wait": wait},
        )
        return answer

    def name_body_position(
        self, body_id: str, number: int, body: PositionName, /, *, idempotency_key: str | None = None
    ) -> PositionLabel:
        """Name a position. The gateway keeps the name; nothing is sent."""
        answer: PositionLabel = self.call(
            "PUT",
            filled("/bodies/{body_id}/positions/{number}/name", body_id=body_id, number=number),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def list_groups(self) -> GroupList:
        """List all groups."""
        answer: GroupList = self.call("GET", filled("/groups"))
        return answer

    def get_group(self, group_id: str) -> GroupInfo:
        """Tell who is in a group; nothing is sent."""
        answer: GroupInfo = self.call("GET", filled("/groups/{group_id}", group_id=group_id))
        return answer

    def define_group(
        self, group_id: str, body: GroupDefinition, /, *, idempotency_key: str | None = None
    ) -> GroupInfo:
        """Define a group at the link master (XVS), or define it anew; not while a member moves.

        It lasts until the gateway ends; groups of the configuration are defined at every start. One that is so
        already stays as it is, and nothing is sent.
        """
        answer: GroupInfo = self.call(
            "PUT", filled("/groups/{group_id}", group_id=group_id), body=body, idempotency_key=idempotency_key
        )
        return answer

    def list_robots(self) -> RobotList:
        """List all robots; nothing is sent."""
        answer: RobotList = self.call("GET", filled("/robots"))
        return answer

    def get_robot(self, robot_id: str) -> RobotInfo:
        """Tell what is known of a robot; nothing is sent."""
        answer: RobotInfo = self.call("GET", filled("/robots/{robot_id}", robot_id=robot_id))
        return answer

    def list_robot_errors(self, robot_id: str, *, fresh: bool | None = None) -> RobotErrors:
        """Tell which errors stand, as the gateway has read them; with `fresh` the robot is asked (ERR).

        An error of the system is not cleared by that.
        """
        answer: RobotErrors = self.call(
            "GET", filled("/robots/{robot_id}/errors", robot_id=robot_id), query={"fresh": fresh}
        )
        return answer

    def reset_robot_errors(self, robot_id: str, *, idempotency_key: str | None = None) -> RobotErrors:
        """Reset the errors and the state EMERGENCY (DRT), and tell what still stands. Nothing moves."""
        answer: RobotErrors = self.call(
            "POST",
            filled("/robots/{robot_id}/errors/reset", robot_id=robot_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_inputs(self, robot_id: str, *, first: int | None = None, count: int | None = None) -> ChannelList:
        """Ask the robot for inputs, channel by channel (IDI)."""
        answer: ChannelList = self.call(
            "GET",
            filled("/robots/{robot_id}/inputs", robot_id=robot_id),
            query={"first": first, "count": count},
        )
        return answer

    def list_macros(self, robot_id: str) -> MacroList:
        """List the macros of the configuration, and those the robot has refused; nothing is sent."""
        answer: MacroList = self.call("GET", filled("/robots/{robot_id}/macros", robot_id=robot_id))
        return answer

    def change_robot_mode(
        self, robot_id: str, body: ModeChange, /, *, idempotency_key: str | None = None
    ) -> RobotInfo:
        """Bring the robot into another mode (MOD) until the gateway ends; refused while it moves."""
        answer: RobotInfo = self.call(
            "PUT",
            filled("/robots/{robot_id}/mode", robot_id=robot_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def get_outputs(
        self, robot_id: str, *, first: int | None = None, count: int | None = None
    ) -> ChannelList:
        """Ask the robot for outputs, channel by channel (IDO)."""
        answer: ChannelList = self.call(
            "GET",
            filled("/robots/{robot_id}/outputs", robot_id=robot_id),
            query={"first": first, "count": count},
        )
        return answer

    def switch_output(
        self,
        robot_id: str,
        channel: int,
        bit: int,
        body: OutputState,
        /,
        *,
        idempotency_key: str | None = None,
    ) -> ChannelList:
        """Switch an output on or off (IOT), and read its channel back; `not-done` where it is not as asked."""
        answer: ChannelList = self.call(
            "PUT",
            filled("/robots/{robot_id}/outputs/{channel}/{bit}", robot_id=robot_id, channel=channel, bit=bit),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def acknowledge_power_cycle(self, robot_id: str, *, idempotency_key: str | None = None) -> RobotInfo:
        """Allow motion again after a loss of power, once the speeds are set: they are at 100 % since then."""
        answer: RobotInfo = self.call(
            "POST",
            filled("/robots/{robot_id}/power-cycle/acknowledge", robot_id=robot_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def stop_robot(self, robot_id: str, body: StopRequest | None = None, /) -> StopResult:
        """Stop all axes of a robot by software: what waits is cancelled, and the stop goes out first."""
        answer: StopResult = self.call(
            "POST", filled("/robots/{robot_id}/stop", robot_id=robot_id), body=body
        )
        return answer

    def get_unit(self, robot_id: str, unit: int) -> UnitInfo:
        """Tell what is known of a unit; nothing is sent."""
        answer: UnitInfo = self.call(
            "GET", filled("/robots/{robot_id}/units/{unit}", robot_id=robot_id, unit=unit)
        )
        return answer

    def get_unit_position(
        self, robot_id: str, unit: int, *, coordinates: CoordinateSystem | None = None
    ) -> UnitPosition:
        """Ask the robot where the unit stands, in user (APS) or motor coordinates (MPS)."""
        answer: UnitPosition = self.call(
            "GET",
            filled("/robots/{robot_id}/units/{unit}/position", robot_id=robot_id, unit=unit),
            query={"coordinates": coordinates},
        )
        return answer

    def get_unit_status(self, robot_id: str, unit: int) -> UnitStatus:
        """Ask the robot how the unit's motor axes are (ACD) and for their sensors (ASD)."""
        answer: UnitStatus = self.call(
            "GET", filled("/robots/{robot_id}/units/{unit}/status", robot_id=robot_id, unit=unit)
        )
        return answer

    def stop_unit(self, robot_id: str, unit: int, body: StopRequest | None = None, /) -> StopResult:
        """Stop all axes of the unit's robot by software: it knows no stop of a single unit."""
        answer: StopResult = self.call(
            "POST", filled("/robots/{robot_id}/units/{unit}/stop", robot_id=robot_id, unit=unit), body=body
        )
        return answer

    def get_variables(
        self, robot_id: str, *, first: int | None = None, count: int | None = None
    ) -> VariableList:
        """Ask the robot for variables, one by one (VAR)."""
        answer: VariableList = self.call(
            "GET",
            filled("/robots/{robot_id}/variables", robot_id=robot_id),
            query={"first": first, "count": count},
        )
        return answer

    def set_variable(
        self, robot_id: str, number: int, body: VariableSetting, /, *, idempotency_key: str | None = None
    ) -> VariableValue:
        """Set a variable (VAR), and read it back; `not-done` where it is not as asked.

        `If-Match` is the ETag of this variable alone, as `?first=` gives it; it is read first then.
        """
        answer: VariableValue = self.call(
            "PUT",
            filled("/robots/{robot_id}/variables/{number}", robot_id=robot_id, number=number),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def run_macro(
        self,
        robot_id: str,
        name: str,
        body: MacroRunRequest | None = None,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> RobotMove:
        """Run a macro of the robot; the run is a move of the unit it is started on."""
        answer: RobotMove = self.call(
            "POST",
            filled("/robots/{robot_id}/macros/{name}/runs", robot_id=robot_id, name=name),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def start_robot_move(
        self,
        robot_id: str,
        unit: int,
        body: RobotAbsoluteMoveRequest
        | RobotRelativeMoveRequest
        | RobotPositionMoveRequest
        | RobotHomeRequest
        | RobotStepRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> RobotMove:
        """Start a move of a unit, or with `validate_only` say what it would be.

        202 when the robot has not refused it and it is not over, 200 when it ended while the request waited. A
        move that has started and failed is no HTTP error: see its `status`, `end_cause` and `error`. `plan_robot_move` does that.
        """
        answer: RobotMove = self.call(
            "POST",
            filled("/robots/{robot_id}/units/{unit}/moves", robot_id=robot_id, unit=unit),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def plan_robot_move(
        self,
        robot_id: str,
        unit: int,
        body: RobotAbsoluteMoveRequest
        | RobotRelativeMoveRequest
        | RobotPositionMoveRequest
        | RobotHomeRequest
        | RobotStepRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> PlannedRobotMove:
        """Say what `start_robot_move` would send, and how long it would take; nothing moves."""
        answer: PlannedRobotMove = self.call(
            "POST",
            filled("/robots/{robot_id}/units/{unit}/moves", robot_id=robot_id, unit=unit),
            query={"wait": wait},
            body={**body, "validate_only": True},
            idempotency_key=idempotency_key,
        )
        return answer

    def list_robot_moves(self, robot_id: str, unit: int, *, limit: int | None = None) -> RobotMoveList:
        """List the unit's moves, newest first."""
        answer: RobotMoveList = self.call(
            "GET",
            filled("/robots/{robot_id}/units/{unit}/moves", robot_id=robot_id, unit=unit),
            query={"limit": limit},
        )
        return answer

    def get_robot_move(
        self, robot_id: str, unit: int, move_id: str, *, wait: float | None = None
    ) -> RobotMove:
        """Get a move, at once or when it is over."""
        answer: RobotMove = self.call(
            "GET",
            filled(
                "/robots/{robot_id}/units/{unit}/moves/{move_id}",
                robot_id=robot_id,
                unit=unit,
                move_id=move_id,
            ),
            query={"wait": wait},
        )
        return answer

    def list_lines(self) -> LineList:
        """List all lines."""
        answer: LineList = self.call("GET", filled("/lines"))
        return answer

    def add_line(self, body: NewLine, /, *, idempotency_key: str | None = None) -> Reloaded:
        """Write one more line with its bodies or its robot into the configuration file, and serve it.

        A scan of ports gives the line of each controller that it finds. The file keeps its comments.
        """
        answer: Reloaded = self.call("POST", filled("/lines"), body=body, idempotency_key=idempotency_key)
        return answer

    def get_line(self, line_id: str) -> LineInfo | RobotLineInfo:
        """Tell the state of a line; nothing is sent."""
        answer: LineInfo | RobotLineInfo = self.call("GET", filled("/lines/{line_id}", line_id=line_id))
        return answer

    def start_scan(
        self, line_id: str, *, wait: float | None = None, idempotency_key: str | None = None
    ) -> Scan:
        """Ask all 120 body numbers of the line, between its other work, whether a body is there.

        A line with a robot has none.
        """
        answer: Scan = self.call(
            "POST",
            filled("/lines/{line_id}/scans", line_id=line_id),
            query={"wait": wait},
            idempotency_key=idempotency_key,
        )
        return answer

    def get_scan(self, line_id: str, scan_id: str, *, wait: float | None = None) -> Scan:
        """Get a scan, at once or when it is over."""
        answer: Scan = self.call(
            "GET",
            filled("/lines/{line_id}/scans/{scan_id}", line_id=line_id, scan_id=scan_id),
            query={"wait": wait},
        )
        return answer

    def get_trace(
        self,
        line_id: str,
        *,
        limit: int | None = None,
        last: int | None = None,
        since: str | None = None,
        until: str | None = None,
        bodies: str | None = None,
        request_id: str | None = None,
        polls: bool | None = None,
    ) -> Trace:
        """Give the newest bytes of the line, a robot's too, both ways, with their times."""
        answer: Trace = self.call(
            "GET",
            filled("/lines/{line_id}/trace", line_id=line_id),
            query={
                "limit": limit,
                "last": last,
                "since": since,
                "until": until,
                "bodies": bodies,
                "request_id": request_id,
                "polls": polls,
            },
        )
        return answer

    def list_events(
        self,
        *,
        after: str | None = None,
        bodies: str | None = None,
        types: str | None = None,
        limit: int | None = None,
        sample: float | None = None,
    ) -> EventList:
        """List events after a cursor, or from the oldest event that is kept.

        Ask again after the answer's `cursor` to go on. The event `stream.gap` stands for events no longer kept.
        With `sample` the values that are watched follow the events, as read within a second.
        """
        answer: EventList = self.call(
            "GET",
            filled("/events"),
            query={"after": after, "bodies": bodies, "types": types, "limit": limit, "sample": sample},
        )
        return answer

    def list_alarms(self, *, standing: bool | None = None, limit: int | None = None) -> AlarmList:
        """List alarms, over restarts: the event, the motor's reaction, and the calls that help."""
        answer: AlarmList = self.call("GET", filled("/alarms"), query={"standing": standing, "limit": limit})
        return answer

    def get_alarm(self, alarm_id: str) -> Alarm:
        """Get an alarm."""
        answer: Alarm = self.call("GET", filled("/alarms/{alarm_id}", alarm_id=alarm_id))
        return answer

    def reset_alarm(self, alarm_id: str, *, idempotency_key: str | None = None) -> Alarm:
        """Reset an alarm, once its cause is over. Nothing moves, and nothing is sent."""
        answer: Alarm = self.call(
            "POST", filled("/alarms/{alarm_id}/reset", alarm_id=alarm_id), idempotency_key=idempotency_key
        )
        return answer

    def get_identity(self) -> Identity:
        """Tell the caller's name, role, rights and scope."""
        answer: Identity = self.call("GET", filled("/system/identity"))
        return answer

    def get_posture(self) -> Posture:
        """Tell the protection of the gateway, and each weakened default; values to admins only."""
        answer: Posture = self.call("GET", filled("/system/posture"))
        return answer

    def issue_ticket(self, *, idempotency_key: str | None = None) -> Ticket:
        """Give a ticket for one event stream, which ends with the session or the key it was given for.

        It is for browsers, whose WebSockets and EventSources send no key.
        """
        answer: Ticket = self.call("POST", filled("/tickets"), idempotency_key=idempotency_key)
        return answer

    def livez(self) -> Liveness:
        """Answer, as long as the process can."""
        answer: Liveness = self.call("GET", filled("/livez"))
        return answer

    def readyz(self) -> Readiness:
        """Say whether all lines are open and set up, a device answers on each, and the journal can be written.

        A journal in trouble is no 503: no other gateway could carry out the stops and reads that go on.
        """
        answer: Readiness = self.call("GET", filled("/readyz"))
        return answer

    def version(self) -> Version:
        """Tell the version."""
        answer: Version = self.call("GET", filled("/version"))
        return answer

    def list_sessions(self) -> SessionList:
        """List the sessions of browsers: the key, the address, and the time of the last use."""
        answer: SessionList = self.call("GET", filled("/access/sessions"))
        return answer

    def end_sessions(self, *, key: str | None = None, idempotency_key: str | None = None) -> SessionList:
        """End all sessions of a key, which stays good, and list them."""
        answer: SessionList = self.call(
            "DELETE", filled("/access/sessions"), query={"key": key}, idempotency_key=idempotency_key
        )
        return answer

    def end_session(self, session_id: str, *, idempotency_key: str | None = None) -> SessionInfo:
        """End a session: its next request is refused, and its event streams end within 5 s."""
        answer: SessionInfo = self.call(
            "DELETE",
            filled("/access/sessions/{session_id}", session_id=session_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def list_security_entries(
        self, *, limit: int | None = None, cursor: int | None = None
    ) -> SecurityEntries:
        """List the security log: sign-ins, refusals, keys, sessions, leases, reloads and what else needs a name.

        No use of the gateway pushes an entry out; a flood is counted in one entry.
        """
        answer: SecurityEntries = self.call(
            "GET", filled("/security"), query={"limit": limit, "cursor": cursor}
        )
        return answer

    def get_samples(self, body_id: str, move_id: str) -> BodySamples:
        """Get where a body was seen during a move, and where the plan has it, for the settings of the move.

        The settings for the plan are read from the controller at the first request for the samples. The newest
        200 moves have samples until the gateway ends; one that is under way has those until now.
        """
        answer: BodySamples = self.call(
            "GET", filled("/bodies/{body_id}/moves/{move_id}/samples", body_id=body_id, move_id=move_id)
        )
        return answer

    def download_samples(self, body_id: str, move_id: str) -> str:
        """Get the same as CSV: time, time_s, pulses, the planned pulses, and the value in the body's unit."""
        answer: str = self.call(
            "GET", filled("/bodies/{body_id}/moves/{move_id}/samples.csv", body_id=body_id, move_id=move_id)
        )
        return answer

    def get_robot_samples(self, robot_id: str, unit: int, move_id: str) -> RobotSamples:
        """Get where a unit was seen during a move, and where its settings lead an axis that goes alone.

        No command tells the timing of several axes, or of an S-curve: `note` says then why nothing is planned.
        The settings are read from the robot at the first request for the samples.
        """
        answer: RobotSamples = self.call(
            "GET",
            filled(
                "/robots/{robot_id}/units/{unit}/moves/{move_id}/samples",
                robot_id=robot_id,
                unit=unit,
                move_id=move_id,
            ),
        )
        return answer

    def download_robot_samples(self, robot_id: str, unit: int, move_id: str) -> str:
        """Get the same as CSV: time, time_s, a column for each axis with its unit, and one for its plan."""
        answer: str = self.call(
            "GET",
            filled(
                "/robots/{robot_id}/units/{unit}/moves/{move_id}/samples.csv",
                robot_id=robot_id,
                unit=unit,
                move_id=move_id,
            ),
        )
        return answer

    def start_body_jog(
        self, body_id: str, body: BodyJogRequest, /, *, idempotency_key: str | None = None
    ) -> BodyJog:
        """Start to jog a body. It stops when no heartbeat has come for half a second.

        It is a move of the same id, no further than `at_most`, 10 s at its top speed, or a soft limit.
        """
        answer: BodyJog = self.call(
            "POST",
            filled("/bodies/{body_id}/jogs", body_id=body_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def keep_jogging_body(self, body_id: str, jog_id: str, *, idempotency_key: str | None = None) -> BodyJog:
        """Let the motor move for another half second; 409 when it is being stopped, or cannot be reached."""
        answer: BodyJog = self.call(
            "POST",
            filled("/bodies/{body_id}/jogs/{jog_id}/heartbeat", body_id=body_id, jog_id=jog_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def end_body_jog(self, body_id: str, jog_id: str) -> BodyJog:
        """Stop the motor, and answer when it stands still.

        Where that was not seen in time, the state is `stopping`; ask again until the state is another.
        """
        answer: BodyJog = self.call(
            "POST", filled("/bodies/{body_id}/jogs/{jog_id}/stop", body_id=body_id, jog_id=jog_id)
        )
        return answer

    def start_jog(
        self, robot_id: str, body: JogRequest, /, *, idempotency_key: str | None = None
    ) -> JogSession:
        """Start to jog an axis. It stops when no heartbeat has come for half a second."""
        answer: JogSession = self.call(
            "POST",
            filled("/robots/{robot_id}/jogs", robot_id=robot_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def keep_jogging(self, robot_id: str, jog_id: str, *, idempotency_key: str | None = None) -> JogSession:
        """Let the axis move for another half second; 409 when it is being stopped, or cannot be reached."""
        answer: JogSession = self.call(
            "POST",
            filled("/robots/{robot_id}/jogs/{jog_id}/heartbeat", robot_id=robot_id, jog_id=jog_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def end_jog(self, robot_id: str, jog_id: str) -> JogSession:
        """Stop the axis, and answer when it stands still.

        Where that was not seen in time, the state is `stopping` and the whole robot is being stopped; ask again
        until the state is another.
        """
        answer: JogSession = self.call(
            "POST", filled("/robots/{robot_id}/jogs/{jog_id}/stop", robot_id=robot_id, jog_id=jog_id)
        )
        return answer

    def get_error_outputs(self, body_id: str) -> BodyErrorOutputs:
        """Ask the controller which outputs report errors (CED), and which errors stand (CRD)."""
        answer: BodyErrorOutputs = self.call(
            "GET", filled("/bodies/{body_id}/error-outputs", body_id=body_id)
        )
        return answer

    def reset_error_outputs(self, body_id: str, *, idempotency_key: str | None = None) -> BodyErrorOutputs:
        """Take back all error outputs (CRS), which refuse moves while they stand."""
        answer: BodyErrorOutputs = self.call(
            "POST",
            filled("/bodies/{body_id}/error-outputs/reset", body_id=body_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def set_error_output(
        self,
        body_id: str,
        cause: Literal["ems", "limit", "stall", "any"],
        body: ErrorOutputChoice,
        /,
        *,
        idempotency_key: str | None = None,
    ) -> BodyErrorOutputs:
        """Set the output that reports a cause (CES), and read it back. Each cause takes one of its own."""
        answer: BodyErrorOutputs = self.call(
            "PUT",
            filled("/bodies/{body_id}/error-outputs/{cause}", body_id=body_id, cause=cause),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def get_body_inputs(self, body_id: str) -> BodyInputs:
        """Ask the controller for all ten inputs (CID)."""
        answer: BodyInputs = self.call("GET", filled("/bodies/{body_id}/inputs", body_id=body_id))
        return answer

    def get_body_outputs(self, body_id: str) -> BodyOutputs:
        """Ask the controller for all sixteen outputs (COD)."""
        answer: BodyOutputs = self.call("GET", filled("/bodies/{body_id}/outputs", body_id=body_id))
        return answer

    def switch_body_output(
        self, body_id: str, output: int, body: OutputSwitch, /, *, idempotency_key: str | None = None
    ) -> SignalState:
        """Switch an output (COS), which ends its pulse, and read it back; `not-done` where it is not as asked."""
        answer: SignalState = self.call(
            "PUT",
            filled("/bodies/{body_id}/outputs/{output}", body_id=body_id, output=output),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def pulse_body_output(
        self, body_id: str, output: int, body: OutputPulse, /, *, idempotency_key: str | None = None
    ) -> SignalState:
        """Invert an output for a time (CBS); refused while it is inverted, and where it reports an error."""
        answer: SignalState = self.call(
            "POST",
            filled("/bodies/{body_id}/outputs/{output}/pulses", body_id=body_id, output=output),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def get_body_sensors(self, body_id: str) -> BodySensors:
        """Ask the controller for all six sensors (CLD)."""
        answer: BodySensors = self.call("GET", filled("/bodies/{body_id}/sensors", body_id=body_id))
        return answer

    def list_captures(self, body_id: str) -> CaptureList:
        """Ask the controller how both inputs capture, and what they have captured (CPD, CFD, CSD, 3ND)."""
        answer: CaptureList = self.call("GET", filled("/bodies/{body_id}/captures", body_id=body_id))
        return answer

    def get_capture(self, body_id: str, port: int, *, wait: float | None = None) -> CaptureState:
        """Ask for a capture, at once or when an edge has come; a move that ends without one disarms it too."""
        answer: CaptureState = self.call(
            "GET",
            filled("/bodies/{body_id}/captures/{port}", body_id=body_id, port=port),
            query={"wait": wait},
        )
        return answer

    def arm_capture(
        self, body_id: str, port: int, body: CaptureRequest, /, *, idempotency_key: str | None = None
    ) -> CaptureState:
        """Let an input capture in the next move (CSS, CFS, CPS), once; refused while the motor moves.

        A capture that is sent back as GET gives it stays as it is, and nothing is sent.
        """
        answer: CaptureState = self.call(
            "PUT",
            filled("/bodies/{body_id}/captures/{port}", body_id=body_id, port=port),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def disarm_capture(self, body_id: str, port: int, *, idempotency_key: str | None = None) -> CaptureState:
        """Let an input capture nothing (CPS), and forget its entries, which are set to 0 (CFS).

        Refused while the motor moves.
        """
        answer: CaptureState = self.call(
            "DELETE",
            filled("/bodies/{body_id}/captures/{port}", body_id=body_id, port=port),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_encoder(self, body_id: str) -> Encoder:
        """Ask a body what its encoder counts (6ED, 6MD), and how it is set up (RC-420 manual 13.7)."""
        answer: Encoder = self.call("GET", filled("/bodies/{body_id}/encoder", body_id=body_id))
        return answer

    def change_encoder(
        self,
        body_id: str,
        body: EncoderChange,
        /,
        *,
        flash: bool | None = None,
        idempotency_key: str | None = None,
    ) -> ChangedSettings:
        """Set what differs of the set-up of the encoder, and read it back; refused while the motor moves."""
        answer: ChangedSettings = self.call(
            "PATCH",
            filled("/bodies/{body_id}/encoder", body_id=body_id),
            query={"flash": flash},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def set_encoder_resolution(
        self,
        body_id: str,
        body: ResolutionRequest,
        /,
        *,
        flash: bool | None = None,
        idempotency_key: str | None = None,
    ) -> Resolution:
        """Set multiplier and ratio (PAS, PBS) by what a turn is to motor and encoder (RC-420 manual 13.7.2)."""
        answer: Resolution = self.call(
            "PUT",
            filled("/bodies/{body_id}/encoder/resolution", body_id=body_id),
            query={"flash": flash},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def get_homing(self, body_id: str) -> Homing:
        """Ask a body how it searches its origin, and how far its last search went (0PD)."""
        answer: Homing = self.call("GET", filled("/bodies/{body_id}/homing", body_id=body_id))
        return answer

    def change_homing(
        self,
        body_id: str,
        body: HomingChange,
        /,
        *,
        flash: bool | None = None,
        idempotency_key: str | None = None,
    ) -> ChangedSettings:
        """Set what differs of the set-up of homing, and read it back; refused while the motor moves."""
        answer: ChangedSettings = self.call(
            "PATCH",
            filled("/bodies/{body_id}/homing", body_id=body_id),
            query={"flash": flash},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def get_noise_filters(self, body_id: str) -> NoiseFilters:
        """Ask a body for the noise filters of its inputs and sensors, one by one (DCD)."""
        answer: NoiseFilters = self.call("GET", filled("/bodies/{body_id}/noise-filters", body_id=body_id))
        return answer

    def change_noise_filters(
        self,
        body_id: str,
        body: NoiseFiltersChange,
        /,
        *,
        flash: bool | None = None,
        idempotency_key: str | None = None,
    ) -> ChangedSettings:
        """Set those of the named noise filters that differ (DCS), and read each back; refused while it moves."""
        answer: ChangedSettings = self.call(
            "PATCH",
            filled("/bodies/{body_id}/noise-filters", body_id=body_id),
            query={"flash": flash},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def list_patterns(
        self, body_id: str, *, first: int | None = None, last: int | None = None
    ) -> PatternList:
        """Ask a body for its acceleration patterns: one frame for each, and sixteen more for one that is set."""
        answer: PatternList = self.call(
            "GET", filled("/bodies/{body_id}/patterns", body_id=body_id), query={"first": first, "last": last}
        )
        return answer

    def get_pattern(self, body_id: str, n: int) -> Pattern:
        """Ask a body for an acceleration pattern (SPD) with its speed changes (SED)."""
        answer: Pattern = self.call("GET", filled("/bodies/{body_id}/patterns/{n}", body_id=body_id, n=n))
        return answer

    def set_pattern(
        self,
        body_id: str,
        n: int,
        body: PatternValues,
        /,
        *,
        flash: bool | None = None,
        idempotency_key: str | None = None,
    ) -> ChangedPattern:
        """Set what differs of a pattern and its speed changes, and read it back; refused while the motor moves.

        Where a change shall go, all are cleared (SES) and those that stay are set again.
        """
        answer: ChangedPattern = self.call(
            "PUT",
            filled("/bodies/{body_id}/patterns/{n}", body_id=body_id, n=n),
            query={"flash": flash},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def change_pattern(
        self,
        body_id: str,
        n: int,
        body: PatternChange,
        /,
        *,
        flash: bool | None = None,
        idempotency_key: str | None = None,
    ) -> ChangedPattern:
        """Set what differs of what is named, and read it back; refused while the motor moves."""
        answer: ChangedPattern = self.call(
            "PATCH",
            filled("/bodies/{body_id}/patterns/{n}", body_id=body_id, n=n),
            query={"flash": flash},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def get_curve(
        self,
        body_id: str,
        n: int,
        *,
        distance: float | None = None,
        unit: LengthUnit | None = None,
        speed: Speed | None = None,
        points: int | None = None,
    ) -> SpeedCurve:
        """Work out how a move with this pattern would go, with the settings of now; nothing moves."""
        answer: SpeedCurve = self.call(
            "GET",
            filled("/bodies/{body_id}/patterns/{n}/curve", body_id=body_id, n=n),
            query={"distance": distance, "unit": unit, "speed": speed, "points": points},
        )
        return answer

    def draft_curve(
        self, body_id: str, n: int, body: CurveDraft, /, *, idempotency_key: str | None = None
    ) -> SpeedCurve:
        """Work out how a move would go if the pattern were this one; nothing is set, and nothing moves."""
        answer: SpeedCurve = self.call(
            "POST",
            filled("/bodies/{body_id}/patterns/{n}/curve", body_id=body_id, n=n),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def get_body_settings(self, body_id: str) -> BodySettings:
        """Ask a body for the settings that FIS keeps (RC-420 manual 18), some ninety frames.

        Speed sets 0-29 and patterns stand at `/speed-sets` and `/patterns`; the standard set is here.
        """
        answer: BodySettings = self.call("GET", filled("/bodies/{body_id}/settings", body_id=body_id))
        return answer

    def change_body_settings(
        self,
        body_id: str,
        body: BodySettingsChange,
        /,
        *,
        flash: bool | None = None,
        idempotency_key: str | None = None,
    ) -> ChangedSettings:
        """Set those of the named settings that differ, one by one, and read each back; refused while it moves.

        Null ends soft limits, error outputs and what interrupts do. With `If-Match` all settings are read before,
        and nothing is sent where they are otherwise than they were.
        """
        answer: ChangedSettings = self.call(
            "PATCH",
            filled("/bodies/{body_id}/settings", body_id=body_id),
            query={"flash": flash},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def list_speed_sets(
        self, body_id: str, *, first: int | None = None, last: int | None = None
    ) -> SpeedSetList:
        """Ask a body for its speed parameter sets, five frames for each."""
        answer: SpeedSetList = self.call(
            "GET",
            filled("/bodies/{body_id}/speed-sets", body_id=body_id),
            query={"first": first, "last": last},
        )
        return answer

    def get_speed_set(self, body_id: str, n: int) -> SpeedSet:
        """Ask a body for a speed parameter set (OLD, OHD, OSD, OAD, OBD)."""
        answer: SpeedSet = self.call("GET", filled("/bodies/{body_id}/speed-sets/{n}", body_id=body_id, n=n))
        return answer

    def set_speed_set(
        self,
        body_id: str,
        n: int,
        body: SpeedSetWanted,
        /,
        *,
        flash: bool | None = None,
        idempotency_key: str | None = None,
    ) -> ChangedSpeedSet:
        """Set the parameters of a set that differ, and read each back; refused while the motor moves."""
        answer: ChangedSpeedSet = self.call(
            "PUT",
            filled("/bodies/{body_id}/speed-sets/{n}", body_id=body_id, n=n),
            query={"flash": flash},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def change_speed_set(
        self,
        body_id: str,
        n: int,
        body: SpeedSetChange,
        /,
        *,
        flash: bool | None = None,
        idempotency_key: str | None = None,
    ) -> ChangedSpeedSet:
        """Set those of the named parameters that differ, and read each back; refused while the motor moves."""
        answer: ChangedSpeedSet = self.call(
            "PATCH",
            filled("/bodies/{body_id}/speed-sets/{n}", body_id=body_id, n=n),
            query={"flash": flash},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def get_memories(self, body_id: str, *, first: str | None = None, count: int | None = None) -> MemoryList:
        """Read memories of the user program, one by one (UDD)."""
        answer: MemoryList = self.call(
            "GET",
            filled("/bodies/{body_id}/memories", body_id=body_id),
            query={"first": first, "count": count},
        )
        return answer

    def set_memories(
        self, body_id: str, body: MemoryChanges, /, *, idempotency_key: str | None = None
    ) -> MemoryList:
        """Set memories in order (UDS), and tell what they hold then: a program may change them at once."""
        answer: MemoryList = self.call(
            "PUT",
            filled("/bodies/{body_id}/memories", body_id=body_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def set_memory(
        self, body_id: str, name: str, body: MemoryChange, /, *, idempotency_key: str | None = None
    ) -> Memory:
        """Set a memory (UDS), and tell what it holds then: a program that runs may change it at once."""
        answer: Memory = self.call(
            "PUT",
            filled("/bodies/{body_id}/memories/{name}", body_id=body_id, name=name),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def get_program(self, body_id: str) -> Program | str:
        """Read the user program from the controller (UED, UPD); with `Accept: text/plain` its text alone."""
        answer: Program | str = self.call("GET", filled("/bodies/{body_id}/program", body_id=body_id))
        return answer

    def upload_program(
        self,
        body_id: str,
        body: dict[str, Any],
        /,
        *,
        flash: bool | None = None,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> ProgramUpload:
        """Upload a user program (UCS, UWS), read it back and compare it; its source alone may come as text/plain.

        It is assembled first: what is wrong with it is told by line and column, and nothing is sent. Refused
        while the motor moves or a program runs. A stop breaks it off; `stored` says what the body holds then.
        """
        answer: ProgramUpload = self.call(
            "PUT",
            filled("/bodies/{body_id}/program", body_id=body_id),
            query={"flash": flash, "wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def run_program(
        self,
        body_id: str,
        body: RunRequest | None = None,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> ProgramRun:
        """Run the user program (URG), or one instruction of it (USG); it may move the motor. A stop ends it."""
        answer: ProgramRun = self.call(
            "POST",
            filled("/bodies/{body_id}/program/runs", body_id=body_id),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def get_program_state(self, body_id: str) -> ProgramState:
        """Ask the controller whether its program runs, how it ended and where it is (URD, UND, UED, UPD)."""
        answer: ProgramState = self.call(
            "GET", filled("/bodies/{body_id}/program/runs/current", body_id=body_id)
        )
        return answer

    def get_program_run(self, body_id: str, run_id: str, *, wait: float | None = None) -> ProgramRun:
        """Get a run that the gateway has started, at once or when it is over."""
        answer: ProgramRun = self.call(
            "GET",
            filled("/bodies/{body_id}/program/runs/{run_id}", body_id=body_id, run_id=run_id),
            query={"wait": wait},
        )
        return answer

    def cancel_program_upload(self, body_id: str, *, idempotency_key: str | None = None) -> ProgramUpload:
        """Cancel the upload under way before its next instruction; what is stored then stays in RAM."""
        answer: ProgramUpload = self.call(
            "DELETE",
            filled("/bodies/{body_id}/program/uploads/current", body_id=body_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_program_upload(self, body_id: str, upload_id: str, *, wait: float | None = None) -> ProgramUpload:
        """Get an upload, at once or when it is over; `current` is the one under way, or the last."""
        answer: ProgramUpload = self.call(
            "GET",
            filled("/bodies/{body_id}/program/uploads/{upload_id}", body_id=body_id, upload_id=upload_id),
            query={"wait": wait},
        )
        return answer

    def list_scaras(self) -> ScaraList:
        """List all SCARA robots; nothing is sent."""
        answer: ScaraList = self.call("GET", filled("/scaras"))
        return answer

    def get_scara(self, scara_id: str) -> ScaraInfo:
        """Tell what is known of a SCARA robot; nothing is sent."""
        answer: ScaraInfo = self.call("GET", filled("/scaras/{scara_id}", scara_id=scara_id))
        return answer

    def get_scara_coordinates(self, scara_id: str) -> ScaraCoordinates:
        """Ask all axes in one frame where they stand (6PD), and calculate where the finger ends."""
        answer: ScaraCoordinates = self.call(
            "GET", filled("/scaras/{scara_id}/coordinates", scara_id=scara_id)
        )
        return answer

    def get_scara_geometry(self, scara_id: str) -> ScaraGeometry:
        """Ask the controllers for the geometry they calculate with (HTD, HCD, HAD, HFD, HZD), and compare."""
        answer: ScaraGeometry = self.call("GET", filled("/scaras/{scara_id}/geometry", scara_id=scara_id))
        return answer

    def apply_scara_geometry(
        self, scara_id: str, body: GeometryApplication | None = None, /, *, idempotency_key: str | None = None
    ) -> ScaraGeometry:
        """Give the controllers the configured geometry (HTS, HCS, HAS, HFS, HZS), and read it back."""
        answer: ScaraGeometry = self.call(
            "POST",
            filled("/scaras/{scara_id}/geometry/apply", scara_id=scara_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def calculate_coordinates(
        self, scara_id: str, body: AxisPulses, /, *, idempotency_key: str | None = None
    ) -> Kinematics:
        """Calculate where the finger ends at positions of the axes; nothing is sent."""
        answer: Kinematics = self.call(
            "POST",
            filled("/scaras/{scara_id}/kinematics/forward", scara_id=scara_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def calculate_positions(
        self, scara_id: str, body: WantedPlace, /, *, idempotency_key: str | None = None
    ) -> Kinematics:
        """Calculate the positions of the axes for a place, the elbow bent as in the manual's example.

        Pulses are cut towards zero, as HLS answers them; the place in the answer is that of the whole pulses.
        Nothing is sent; 422 where the arm does not come.
        """
        answer: Kinematics = self.call(
            "POST",
            filled("/scaras/{scara_id}/kinematics/inverse", scara_id=scara_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def stop_scara(self, scara_id: str, body: StopRequest | None = None, /) -> StopResult:
        """Stop all axes of a robot by software, with one frame for all and then one for each."""
        answer: StopResult = self.call(
            "POST", filled("/scaras/{scara_id}/stop", scara_id=scara_id), body=body
        )
        return answer

    def start_scara_move(
        self,
        scara_id: str,
        body: ScaraLineRequest
        | ScaraPathRequest
        | ScaraOffsetRequest
        | ScaraExtendRequest
        | ScaraRetractRequest
        | ScaraRotateRequest
        | ScaraFingerRequest
        | ScaraAlignRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> ScaraMove:
        """Start a move of all axes, or with `validate_only` say what it would be.

        In one undivided turn of the line the gateway reads where the axes stand (6PD), tells all controllers
        (HPS), prepares the move, sees that they agree and that nothing has moved, and starts it by one frame
        (HMM; HFM and HNM for `finger` and `align`). 202 when it is accepted and not over, 200 when it ended while
        the request waited. When one axis fails all are stopped: see `status`, `failed_axes` and `error`. `plan_scara_move` does that.
        """
        answer: ScaraMove = self.call(
            "POST",
            filled("/scaras/{scara_id}/moves", scara_id=scara_id),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def plan_scara_move(
        self,
        scara_id: str,
        body: ScaraLineRequest
        | ScaraPathRequest
        | ScaraOffsetRequest
        | ScaraExtendRequest
        | ScaraRetractRequest
        | ScaraRotateRequest
        | ScaraFingerRequest
        | ScaraAlignRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> PlannedScaraMove:
        """Say what `start_scara_move` would send, and how long it would take; nothing moves."""
        answer: PlannedScaraMove = self.call(
            "POST",
            filled("/scaras/{scara_id}/moves", scara_id=scara_id),
            query={"wait": wait},
            body={**body, "validate_only": True},
            idempotency_key=idempotency_key,
        )
        return answer

    def list_scara_moves(self, scara_id: str, *, limit: int | None = None) -> ScaraMoveList:
        """List the robot's moves, newest first."""
        answer: ScaraMoveList = self.call(
            "GET", filled("/scaras/{scara_id}/moves", scara_id=scara_id), query={"limit": limit}
        )
        return answer

    def get_scara_move(self, scara_id: str, move_id: str, *, wait: float | None = None) -> ScaraMove:
        """Get a move, at once or when it is over."""
        answer: ScaraMove = self.call(
            "GET",
            filled("/scaras/{scara_id}/moves/{move_id}", scara_id=scara_id, move_id=move_id),
            query={"wait": wait},
        )
        return answer

    def get_scara_samples(self, scara_id: str, move_id: str) -> ScaraSamples:
        """Get where the axes were seen during a move, and where the plan has each, along the path or alone.

        The settings for the plan are read from the controllers at the first request for the samples.
        """
        answer: ScaraSamples = self.call(
            "GET", filled("/scaras/{scara_id}/moves/{move_id}/samples", scara_id=scara_id, move_id=move_id)
        )
        return answer

    def get_scara_path(self, scara_id: str, path: int) -> StoredPath:
        """Read a path from all controllers (HDD); 409 where they hold different ones."""
        answer: StoredPath = self.call(
            "GET", filled("/scaras/{scara_id}/paths/{path}", scara_id=scara_id, path=path)
        )
        return answer

    def write_scara_path(
        self, scara_id: str, path: int, body: PathDefinition, /, *, idempotency_key: str | None = None
    ) -> StoredPath:
        """Store a path in all controllers, undivided (HDS), in RAM; read it back."""
        answer: StoredPath = self.call(
            "PUT",
            filled("/scaras/{scara_id}/paths/{path}", scara_id=scara_id, path=path),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def list_positions(
        self, robot_id: str, unit: int, *, first: int | None = None, last: int | None = None
    ) -> PositionTable:
        """Read stored positions (POR); the robot ends at the first number that is not set."""
        answer: PositionTable = self.call(
            "GET",
            filled("/robots/{robot_id}/units/{unit}/positions", robot_id=robot_id, unit=unit),
            query={"first": first, "last": last},
        )
        return answer

    def store_positions(
        self,
        robot_id: str,
        unit: int,
        body: PositionUpload,
        /,
        *,
        first: int | None = None,
        last: int | None = None,
        idempotency_key: str | None = None,
    ) -> Uploaded:
        """Store positions undivided (POF, POS); a stop in the middle ends the upload first.

        A number alone stores where the unit stands; refused while it moves, and where an axis is not homed.
        `If-Match` is the ETag of the positions from `first` to `last`, which are read first then.
        """
        answer: Uploaded = self.call(
            "PUT",
            filled("/robots/{robot_id}/units/{unit}/positions", robot_id=robot_id, unit=unit),
            query={"first": first, "last": last},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def download_positions(
        self, robot_id: str, unit: int, *, first: int | None = None, last: int | None = None
    ) -> str:
        """Read stored positions as CSV: the number, then a column for each axis with its unit.

        The robot ends at the first number that is not set; the header `Ended-At` names it.
        """
        answer: str = self.call(
            "GET",
            filled("/robots/{robot_id}/units/{unit}/positions.csv", robot_id=robot_id, unit=unit),
            query={"first": first, "last": last},
        )
        return answer

    def name_unit_position(
        self,
        robot_id: str,
        unit: int,
        number: int,
        body: PositionName,
        /,
        *,
        idempotency_key: str | None = None,
    ) -> UnitPositionLabel:
        """Name a position. The gateway keeps the name; nothing is sent."""
        answer: UnitPositionLabel = self.call(
            "PUT",
            filled(
                "/robots/{robot_id}/units/{unit}/positions/{number}/name",
                robot_id=robot_id,
                unit=unit,
                number=number,
            ),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def get_settings(self, robot_id: str, unit: int) -> UnitSettings:
        """Ask the robot for all settings of a unit, one by one; refused while it moves."""
        answer: UnitSettings = self.call(
            "GET", filled("/robots/{robot_id}/units/{unit}/settings", robot_id=robot_id, unit=unit)
        )
        return answer

    def change_settings(
        self, robot_id: str, unit: int, body: SettingsChange, /, *, idempotency_key: str | None = None
    ) -> UnitSettings:
        """Change settings of a unit and read them back; refused while it moves.

        All are checked before the first is sent. They are sent one by one, each read back before the next; where
        the robot refuses one, or tells another value afterwards, the problem tells which were changed before it.
        With `If-Match` all settings are read before, and nothing is sent where they are otherwise than they were.
        """
        answer: UnitSettings = self.call(
            "PATCH",
            filled("/robots/{robot_id}/units/{unit}/settings", robot_id=robot_id, unit=unit),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def list_nightly_backups(self) -> NightlyBackups:
        """List the backups that were read by night, of every line and robot, with how much each changes."""
        answer: NightlyBackups = self.call("GET", filled("/backups/nightly"))
        return answer

    def get_nightly_backup(self, target: str, night: str) -> str:
        """Give a backup that was read by night, as a restore takes it."""
        answer: str = self.call(
            "GET", filled("/backups/nightly/{target}/{night}", target=target, night=night)
        )
        return answer

    def get_nightly_changes(self, target: str, night: str) -> str:
        """Give what a nightly backup changes of the one before it, as a unified diff."""
        answer: str = self.call(
            "GET", filled("/backups/nightly/{target}/{night}/changes", target=target, night=night)
        )
        return answer

    def get_body_backup(self, body_id: str) -> str:
        """Read all that a body keeps: settings, speeds, patterns, positions, memories, user program.

        It takes two minutes at 9600 baud; others are served meanwhile. `POST .../backups` answers at once.
        """
        answer: str = self.call("GET", filled("/bodies/{body_id}/backup", body_id=body_id))
        return answer

    def start_body_backup(
        self, body_id: str, *, wait: float | None = None, idempotency_key: str | None = None
    ) -> Backup:
        """Begin to read all that a body keeps; the record at `Location` has the text in the end."""
        answer: Backup = self.call(
            "POST",
            filled("/bodies/{body_id}/backups", body_id=body_id),
            query={"wait": wait},
            idempotency_key=idempotency_key,
        )
        return answer

    def cancel_body_backup(self, body_id: str, *, idempotency_key: str | None = None) -> Backup:
        """Read no more."""
        answer: Backup = self.call(
            "DELETE",
            filled("/bodies/{body_id}/backups/current", body_id=body_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_body_backup_record(self, body_id: str, backup_id: str, *, wait: float | None = None) -> Backup:
        """Get a backup, at once or when it is over; `current` is the one under way, or the last."""
        answer: Backup = self.call(
            "GET",
            filled("/bodies/{body_id}/backups/{backup_id}", body_id=body_id, backup_id=backup_id),
            query={"wait": wait},
        )
        return answer

    def compare_body(
        self,
        body_id: str,
        body: BodyComparisonRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> BackupComparison:
        """Begin to tell what a restore would write and what differs; the record at `Location` has it in the end.

        Nothing is written but the gateway's own mark. `POST .../restores` with `dry_run` is the same in one
        request, which takes two minutes at 9600 baud.
        """
        answer: BackupComparison = self.call(
            "POST",
            filled("/bodies/{body_id}/comparisons", body_id=body_id),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def cancel_body_comparison(self, body_id: str, *, idempotency_key: str | None = None) -> BackupComparison:
        """Read no more."""
        answer: BackupComparison = self.call(
            "DELETE",
            filled("/bodies/{body_id}/comparisons/current", body_id=body_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_body_comparison(
        self, body_id: str, comparison_id: str, *, wait: float | None = None
    ) -> BackupComparison:
        """Get a comparison, at once or when it is over; `current` is the one under way, or the last."""
        answer: BackupComparison = self.call(
            "GET",
            filled(
                "/bodies/{body_id}/comparisons/{comparison_id}", body_id=body_id, comparison_id=comparison_id
            ),
            query={"wait": wait},
        )
        return answer

    def restore_body(
        self,
        body_id: str,
        body: BodyRestoreRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> Restore | Restore | RestorePlan:
        """Bring a body back to a backup: write what differs, read it back, and tell what differs still.

        Refused while the motor moves or a program runs. A stop ends it.
        """
        answer: Restore | Restore | RestorePlan = self.call(
            "POST",
            filled("/bodies/{body_id}/restores", body_id=body_id),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def cancel_body_restore(self, body_id: str, *, idempotency_key: str | None = None) -> Restore:
        """Write no more; what differs is still read and told, unless it is cancelled once more."""
        answer: Restore = self.call(
            "DELETE",
            filled("/bodies/{body_id}/restores/current", body_id=body_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_body_restore(self, body_id: str, restore_id: str, *, wait: float | None = None) -> Restore:
        """Get a restore, at once or when it is over; `current` is the one under way, or the last."""
        answer: Restore = self.call(
            "GET",
            filled("/bodies/{body_id}/restores/{restore_id}", body_id=body_id, restore_id=restore_id),
            query={"wait": wait},
        )
        return answer

    def get_line_backup(self, line_id: str, *, bodies: str | None = None) -> str:
        """Read all that the bodies of a line keep, as one text. It takes two minutes a body at 9600 baud.

        All of them have to answer; `bodies` leaves out who does not. `POST .../backups` answers at once.
        """
        answer: str = self.call(
            "GET", filled("/lines/{line_id}/backup", line_id=line_id), query={"bodies": bodies}
        )
        return answer

    def start_line_backup(
        self,
        line_id: str,
        *,
        bodies: str | None = None,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> Backup:
        """Begin to read all that the bodies of a line keep, one after the other, as one text.

        All of them have to answer; `bodies` leaves out who does not. The record has the text in the end.
        """
        answer: Backup = self.call(
            "POST",
            filled("/lines/{line_id}/backups", line_id=line_id),
            query={"bodies": bodies, "wait": wait},
            idempotency_key=idempotency_key,
        )
        return answer

    def cancel_line_backup(self, line_id: str, *, idempotency_key: str | None = None) -> Backup:
        """Read no more."""
        answer: Backup = self.call(
            "DELETE",
            filled("/lines/{line_id}/backups/current", line_id=line_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_line_backup_record(self, line_id: str, backup_id: str, *, wait: float | None = None) -> Backup:
        """Get a backup, at once or when it is over; `current` is the one under way, or the last."""
        answer: Backup = self.call(
            "GET",
            filled("/lines/{line_id}/backups/{backup_id}", line_id=line_id, backup_id=backup_id),
            query={"wait": wait},
        )
        return answer

    def compare_line(
        self,
        line_id: str,
        body: LineComparisonRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> BackupComparison:
        """Begin to tell what a restore of a line's bodies would write and what differs, one after the other."""
        answer: BackupComparison = self.call(
            "POST",
            filled("/lines/{line_id}/comparisons", line_id=line_id),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def cancel_line_comparison(self, line_id: str, *, idempotency_key: str | None = None) -> BackupComparison:
        """Read no more."""
        answer: BackupComparison = self.call(
            "DELETE",
            filled("/lines/{line_id}/comparisons/current", line_id=line_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_line_comparison(
        self, line_id: str, comparison_id: str, *, wait: float | None = None
    ) -> BackupComparison:
        """Get a comparison, at once or when it is over; `current` is the one under way, or the last."""
        answer: BackupComparison = self.call(
            "GET",
            filled(
                "/lines/{line_id}/comparisons/{comparison_id}", line_id=line_id, comparison_id=comparison_id
            ),
            query={"wait": wait},
        )
        return answer

    def restore_line(
        self,
        line_id: str,
        body: LineRestoreRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> Restore | Restore | RestorePlan:
        """Bring the bodies of a line, or chosen ones, back to a backup, one after the other."""
        answer: Restore | Restore | RestorePlan = self.call(
            "POST",
            filled("/lines/{line_id}/restores", line_id=line_id),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def cancel_line_restore(self, line_id: str, *, idempotency_key: str | None = None) -> Restore:
        """Write no more; what differs is still read and told, unless it is cancelled once more."""
        answer: Restore = self.call(
            "DELETE",
            filled("/lines/{line_id}/restores/current", line_id=line_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_line_restore(self, line_id: str, restore_id: str, *, wait: float | None = None) -> Restore:
        """Get a restore, at once or when it is over; `current` is the one under way, or the last."""
        answer: Restore = self.call(
            "GET",
            filled("/lines/{line_id}/restores/{restore_id}", line_id=line_id, restore_id=restore_id),
            query={"wait": wait},
        )
        return answer

    def get_robot_backup(self, robot_id: str) -> str:
        """Read what a robot tells of what it keeps: variables, and of each unit settings and positions."""
        answer: str = self.call("GET", filled("/robots/{robot_id}/backup", robot_id=robot_id))
        return answer

    def start_robot_backup(
        self, robot_id: str, *, wait: float | None = None, idempotency_key: str | None = None
    ) -> Backup:
        """Begin to read what a robot tells of what it keeps; the record at `Location` has the text in the end."""
        answer: Backup = self.call(
            "POST",
            filled("/robots/{robot_id}/backups", robot_id=robot_id),
            query={"wait": wait},
            idempotency_key=idempotency_key,
        )
        return answer

    def cancel_robot_backup(self, robot_id: str, *, idempotency_key: str | None = None) -> Backup:
        """Read no more."""
        answer: Backup = self.call(
            "DELETE",
            filled("/robots/{robot_id}/backups/current", robot_id=robot_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_robot_backup_record(self, robot_id: str, backup_id: str, *, wait: float | None = None) -> Backup:
        """Get a backup, at once or when it is over; `current` is the one under way, or the last."""
        answer: Backup = self.call(
            "GET",
            filled("/robots/{robot_id}/backups/{backup_id}", robot_id=robot_id, backup_id=backup_id),
            query={"wait": wait},
        )
        return answer

    def compare_robot(
        self,
        robot_id: str,
        body: RobotComparisonRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> BackupComparison:
        """Begin to tell what a restore of a robot would write and what differs."""
        answer: BackupComparison = self.call(
            "POST",
            filled("/robots/{robot_id}/comparisons", robot_id=robot_id),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def cancel_robot_comparison(
        self, robot_id: str, *, idempotency_key: str | None = None
    ) -> BackupComparison:
        """Read no more."""
        answer: BackupComparison = self.call(
            "DELETE",
            filled("/robots/{robot_id}/comparisons/current", robot_id=robot_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_robot_comparison(
        self, robot_id: str, comparison_id: str, *, wait: float | None = None
    ) -> BackupComparison:
        """Get a comparison, at once or when it is over; `current` is the one under way, or the last."""
        answer: BackupComparison = self.call(
            "GET",
            filled(
                "/robots/{robot_id}/comparisons/{comparison_id}",
                robot_id=robot_id,
                comparison_id=comparison_id,
            ),
            query={"wait": wait},
        )
        return answer

    def restore_robot(
        self,
        robot_id: str,
        body: RobotRestoreRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> Restore | Restore | RestorePlan:
        """Bring a robot back to a backup: write what differs, read it back, and tell what differs still.

        Refused while it moves. A stop ends it. There is no `flash`: C-HOST has no command for it.
        """
        answer: Restore | Restore | RestorePlan = self.call(
            "POST",
            filled("/robots/{robot_id}/restores", robot_id=robot_id),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def cancel_robot_restore(self, robot_id: str, *, idempotency_key: str | None = None) -> Restore:
        """Write no more; what differs is still read and told, unless it is cancelled once more."""
        answer: Restore = self.call(
            "DELETE",
            filled("/robots/{robot_id}/restores/current", robot_id=robot_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def get_robot_restore(self, robot_id: str, restore_id: str, *, wait: float | None = None) -> Restore:
        """Get a restore, at once or when it is over; `current` is the one under way, or the last."""
        answer: Restore = self.call(
            "GET",
            filled("/robots/{robot_id}/restores/{restore_id}", robot_id=robot_id, restore_id=restore_id),
            query={"wait": wait},
        )
        return answer

    def start_recording(
        self, body: RecordingRequest, /, *, wait: float | None = None, idempotency_key: str | None = None
    ) -> RecordingInfo:
        """Record the traffic of lines, with the events, the journal and the samples of that time.

        Nothing is sent to a controller. Keys record the lines in their scopes.
        """
        answer: RecordingInfo = self.call(
            "POST", filled("/recordings"), query={"wait": wait}, body=body, idempotency_key=idempotency_key
        )
        return answer

    def list_recordings(self) -> RecordingList:
        """List the recordings of the lines that the caller may see."""
        answer: RecordingList = self.call("GET", filled("/recordings"))
        return answer

    def get_recording(self, recording_id: str, *, wait: float | None = None) -> RecordingInfo:
        """Get a recording, at once or when it is over."""
        answer: RecordingInfo = self.call(
            "GET", filled("/recordings/{recording_id}", recording_id=recording_id), query={"wait": wait}
        )
        return answer

    def delete_recording(self, recording_id: str, *, idempotency_key: str | None = None) -> RecordingInfo:
        """Break a recording off, or delete its file."""
        answer: RecordingInfo = self.call(
            "DELETE",
            filled("/recordings/{recording_id}", recording_id=recording_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def finish_recording(self, recording_id: str, *, idempotency_key: str | None = None) -> RecordingInfo:
        """End a recording before its time; the part until now is kept."""
        answer: RecordingInfo = self.call(
            "POST",
            filled("/recordings/{recording_id}/finish", recording_id=recording_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def start_commissioning(
        self, body: CommissioningRequest, /, *, wait: float | None = None, idempotency_key: str | None = None
    ) -> Commissioning:
        """Try which assumptions about real hardware hold on a line, by questions alone.

        Nothing may move on the line, and meanwhile it is down for all other requests; a stop ends it at once.
        Assumptions that take a setting or a motion are tried by `motion-gateway commission LINE --config FILE`
        only.
        """
        answer: Commissioning = self.call(
            "POST",
            filled("/commissionings"),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def get_commissioning(self, commissioning_id: str, *, wait: float | None = None) -> Commissioning:
        """Get a commissioning with its report, at once or when it is over."""
        answer: Commissioning = self.call(
            "GET",
            filled("/commissionings/{commissioning_id}", commissioning_id=commissioning_id),
            query={"wait": wait},
        )
        return answer

    def cancel_commissioning(
        self, commissioning_id: str, *, idempotency_key: str | None = None
    ) -> Commissioning:
        """Cancel a commissioning: nothing more is asked, and the line serves again."""
        answer: Commissioning = self.call(
            "DELETE",
            filled("/commissionings/{commissioning_id}", commissioning_id=commissioning_id),
            idempotency_key=idempotency_key,
        )
        return answer

    def apply_commissioning(
        self,
        commissioning_id: str,
        body: ReloadRequest | None = None,
        /,
        *,
        idempotency_key: str | None = None,
    ) -> Reloaded:
        """Write the settings that a commissioning proposes into the configuration file, and serve the line so."""
        answer: Reloaded = self.call(
            "POST",
            filled("/commissionings/{commissioning_id}/settings", commissioning_id=commissioning_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def add_bodies(self, line_id: str, body: NewBodies, /, *, idempotency_key: str | None = None) -> Reloaded:
        """Write bodies that a scan has found into the configuration file, and serve them.

        Their line is opened anew, which is refused while something moves on it.
        """
        answer: Reloaded = self.call(
            "POST",
            filled("/lines/{line_id}/bodies", line_id=line_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def take_over_line(
        self, line_id: str, body: TakeOverRequest, /, *, idempotency_key: str | None = None
    ) -> LineInfo | RobotLineInfo:
        """Take over a line that another gateway has had, because a person says so.

        The terminal server closes the old gateway's connection as this one connects; everything is proved as at
        each start. Moves that the old gateway began are followed as foreign, and are unknown until their
        positions are read.
        """
        answer: LineInfo | RobotLineInfo = self.call(
            "POST",
            filled("/lines/{line_id}/take-over", line_id=line_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def list_ports(self) -> PortList:
        """List the serial ports of the gateway's machine, and which line has each; nothing is sent."""
        answer: PortList = self.call("GET", filled("/system/ports"))
        return answer

    def reload_configuration(
        self, body: ReloadRequest | None = None, /, *, idempotency_key: str | None = None
    ) -> Reloaded:
        """Read the configuration file again, and serve the lines in it.

        Lines that did not change go on undisturbed, and so do moves and events. One that did is closed and opened
        anew, which is refused while something moves on it. `needs_restart` names what a restart alone changes.
        """
        answer: Reloaded = self.call(
            "POST", filled("/system/reload"), body=body, idempotency_key=idempotency_key
        )
        return answer

    def start_port_scan(
        self, body: PortScanRequest, /, *, wait: float | None = None, idempotency_key: str | None = None
    ) -> PortScan:
        """Ask who is at ports that no line has: an RC-400 with which bodies, or a Fics robot.

        No motor moves, and no setting changes. Each unit of a robot that stands is selected in turn, to count its
        axes, and then the first one again. Whatever else is at a port hears bytes that it does not know. `POST
        /lines` adds the `line` of what is found, with its `comment`.
        """
        answer: PortScan = self.call(
            "POST", filled("/system/scans"), query={"wait": wait}, body=body, idempotency_key=idempotency_key
        )
        return answer

    def break_off_port_scan(self, *, idempotency_key: str | None = None) -> PortScan:
        """End the running scan of ports; its record keeps the controllers found until then."""
        answer: PortScan = self.call(
            "DELETE", filled("/system/scans/current"), idempotency_key=idempotency_key
        )
        return answer

    def get_port_scan(self, scan_id: str, *, wait: float | None = None) -> PortScan:
        """Get a scan of ports, at once or when it is over; `current` is the one under way, or the last."""
        answer: PortScan = self.call(
            "GET", filled("/system/scans/{scan_id}", scan_id=scan_id), query={"wait": wait}
        )
        return answer

    def list_deeds(
        self,
        *,
        caller: str | None = None,
        target: str | None = None,
        since: str | None = None,
        until: str | None = None,
        cursor: str | None = None,
        limit: int | None = None,
    ) -> Audit:
        """List actions with an effect, over restarts: caller, target, command and outcome.

        A key with a scope names a target in it.
        """
        answer: Audit = self.call(
            "GET",
            filled("/audit"),
            query={
                "caller": caller,
                "target": target,
                "since": since,
                "until": until,
                "cursor": cursor,
                "limit": limit,
            },
        )
        return answer

    def get_moment(self, *, at: str | None = None) -> Moment:
        """Tell where everything was at a moment, which parts did not answer, and which alarms stood.

        The journal answers: nothing is sent to a controller. The trace has what went over a line then.

        :raises NotFound: this gateway keeps no journal.
        """
        answer: Moment = self.call("GET", filled("/moment"), query={"at": at})
        return answer

    def get_shift(
        self, *, since: str | None = None, until: str | None = None, target: str | None = None
    ) -> Shift:
        """Sum up a shift: moves and their ends, failures by cause, slow axes, homings, callers, alarms.

        A key with a scope names a target in it.
        """
        answer: Shift = self.call(
            "GET", filled("/shift"), query={"since": since, "until": until, "target": target}
        )
        return answer

    def download_shift(
        self, *, since: str | None = None, until: str | None = None, target: str | None = None
    ) -> str:
        """Sum up the axes of a shift as CSV, a line each; a key with a scope names a target in it."""
        answer: str = self.call(
            "GET", filled("/shift.csv"), query={"since": since, "until": until, "target": target}
        )
        return answer

    def list_leases(self) -> LeaseList:
        """List leases with their holders; a key with a scope sees those within it."""
        answer: LeaseList = self.call("GET", filled("/leases"))
        return answer

    def take_lease(self, body: LeaseRequest, /, *, idempotency_key: str | None = None) -> Taken:
        """Lease a line, a body, a group or a robot: until it ends, no other caller moves or sets what is in it.

        Its holder sends its `token` as the header `Lease-Token` with each motion and each setting; several tokens
        stand side by side with commas. A token that is not good any more is refused even if there is no other
        lease. Reads and stops need none. When the lease ends, moves go on to their ends, and motion that would
        never end (a JOG, a move without an end) is stopped.
        """
        answer: Taken = self.call("POST", filled("/leases"), body=body, idempotency_key=idempotency_key)
        return answer

    def get_lease(self, lease_id: str) -> Lease:
        """Get a lease: its holder, and the time for which it lasts."""
        answer: Lease = self.call("GET", filled("/leases/{lease_id}", lease_id=lease_id))
        return answer

    def end_lease(self, lease_id: str, *, idempotency_key: str | None = None) -> Lease:
        """Give a lease back; an admin may end any caller's."""
        answer: Lease = self.call(
            "DELETE", filled("/leases/{lease_id}", lease_id=lease_id), idempotency_key=idempotency_key
        )
        return answer

    def renew_lease(self, lease_id: str, *, idempotency_key: str | None = None) -> Taken:
        """Renew a lease for its whole time from now on; the header Lease-Token shows its token."""
        answer: Taken = self.call(
            "POST", filled("/leases/{lease_id}/renew", lease_id=lease_id), idempotency_key=idempotency_key
        )
        return answer

    def list_keys(self) -> KeyList:
        """List the keys, without what is secret of them."""
        answer: KeyList = self.call("GET", filled("/access/keys"))
        return answer

    def make_key(self, body: NewKey, /, *, idempotency_key: str | None = None) -> MadeKey:
        """Make a key and tell it once. The header Idempotency-Key is refused: it would store the secret."""
        answer: MadeKey = self.call(
            "POST", filled("/access/keys"), body=body, idempotency_key=idempotency_key
        )
        return answer

    def revoke_key(self, name: str, *, idempotency_key: str | None = None) -> KeyInfo:
        """Revoke a key: its next request is refused, and its event streams end within 5 s."""
        answer: KeyInfo = self.call(
            "DELETE", filled("/access/keys/{name}", name=name), idempotency_key=idempotency_key
        )
        return answer

    def approve_key(self, name: str, *, idempotency_key: str | None = None) -> KeyInfo:
        """Approve a key of an admin that another admin has made (`access.four_eyes`)."""
        answer: KeyInfo = self.call(
            "POST", filled("/access/keys/{name}/approve", name=name), idempotency_key=idempotency_key
        )
        return answer

    def rotate_key(self, name: str, body: Rotation, /, *, idempotency_key: str | None = None) -> MadeKey:
        """Make a new key in the place of a good one and tell it once; the old one is good for the overlap yet."""
        answer: MadeKey = self.call(
            "POST",
            filled("/access/keys/{name}/rotate", name=name),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def send_raw(
        self,
        body_id: str,
        body: RawRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> RawReply | StopResult | Move:
        """Send a command as text. A command that moves makes a move, and one that stops makes a stop."""
        answer: RawReply | StopResult | Move = self.call(
            "POST",
            filled("/bodies/{body_id}/raw", body_id=body_id),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def list_commands(self, *, family: Literal["rorze", "fics"] | None = None) -> CommandList:
        """List every command that controllers and robots know."""
        answer: CommandList = self.call("GET", filled("/commands"), query={"family": family})
        return answer

    def list_numbers(self) -> Numbers:
        """Give the numbers of event types and of causes of alarms, for systems that know things by numbers."""
        answer: Numbers = self.call("GET", filled("/numbers"))
        return answer

    def send_robot_raw(
        self,
        robot_id: str,
        body: RobotRawRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> RobotRawReply | StopResult | RobotMove:
        """Send a command as text. A command that moves makes a move, and one that stops makes a stop."""
        answer: RobotRawReply | StopResult | RobotMove = self.call(
            "POST",
            filled("/robots/{robot_id}/raw", robot_id=robot_id),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def send_unit_raw(
        self,
        robot_id: str,
        unit: int,
        body: RobotRawRequest,
        /,
        *,
        wait: float | None = None,
        idempotency_key: str | None = None,
    ) -> RobotRawReply | StopResult | RobotMove:
        """Send a command as text to a unit."""
        answer: RobotRawReply | StopResult | RobotMove = self.call(
            "POST",
            filled("/robots/{robot_id}/units/{unit}/raw", robot_id=robot_id, unit=unit),
            query={"wait": wait},
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def list_translations(self) -> Translations:
        """Give translations of texts that the gateway has in English only: hints, reasons, notes."""
        answer: Translations = self.call("GET", filled("/translations"))
        return answer
