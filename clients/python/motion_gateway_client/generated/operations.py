"""Every operation of the gateway as a method; generated from openapi/core.json."""

from __future__ import annotations

from typing import Any, Literal, Protocol

from motion_gateway_client.generated.types import (
    AbsoluteMoveRequest,
    BodyInfo,
    BodyList,
    BodyStatus,
    Channels,
    CommandList,
    ContinuousMoveRequest,
    EventList,
    GroupDefinition,
    GroupInfo,
    GroupList,
    GroupMove,
    GroupPlan,
    HomeRequest,
    Identity,
    JogRequest,
    JogSession,
    Length,
    LineInfo,
    LineList,
    Liveness,
    MacroRunRequest,
    Memories,
    Memory,
    MemoryChange,
    ModeChange,
    Move,
    MoveList,
    OutputState,
    PlannedMove,
    PlannedRobotMove,
    Position,
    Positions,
    PositionTable,
    PositionUpload,
    Posture,
    Program,
    ProgramRun,
    ProgramState,
    ProgramUpload,
    RawReply,
    RawRequest,
    Readiness,
    RelativeMoveRequest,
    RobotAbsoluteMoveRequest,
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
    RobotStepRequest,
    RunRequest,
    Scan,
    SettingsChange,
    SpeedAccepted,
    SpeedDecrease,
    SpeedIncrease,
    SpeedSetting,
    Statuses,
    StopRequest,
    StopResult,
    Ticket,
    Trace,
    UnitInfo,
    UnitPosition,
    UnitSettings,
    UnitStatus,
    Uploaded,
    Variables,
    VariableSetting,
    VariableValue,
    Version,
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

    def read_position(self, body_id: str) -> Position:
        """Ask the controller where the motor stands (6PD)."""
        answer: Position = self.call("GET", filled("/bodies/{body_id}/position", body_id=body_id))
        return answer

    def set_position(self, body_id: str, body: Length, /, *, idempotency_key: str | None = None) -> Position:
        """Call the present position by another number (6PS). Nothing moves; refused while the motor moves."""
        answer: Position = self.call(
            "PUT",
            filled("/bodies/{body_id}/position", body_id=body_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def read_status(self, body_id: str) -> BodyStatus:
        """Ask the controller for its status (9CD), the cause of the last end (9MD) and its sensors (CLD)."""
        answer: BodyStatus = self.call("GET", filled("/bodies/{body_id}/status", body_id=body_id))
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

    def read_positions(self, line_id: str) -> Positions:
        """Ask all bodies of a line where they stand (6PD), in the fewest frames."""
        answer: Positions = self.call("GET", filled("/lines/{line_id}/positions", line_id=line_id))
        return answer

    def read_statuses(self, line_id: str) -> Statuses:
        """Ask all bodies of a line for their status (9CD), in the fewest frames."""
        answer: Statuses = self.call("GET", filled("/lines/{line_id}/statuses", line_id=line_id))
        return answer

    def list_bodies(self, *, fresh: bool | None = None) -> BodyList:
        """List all bodies as they were last seen; with `fresh`, they are asked for status and position first."""
        answer: BodyList = self.call("GET", filled("/bodies"), query={"fresh": fresh})
        return answer

    def get_body(self, body_id: str) -> BodyInfo:
        """Tell what is known of a body; nothing is sent."""
        answer: BodyInfo = self.call("GET", filled("/bodies/{body_id}", body_id=body_id))
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

    def start_move(
        self,
        body_id: str,
        body: RelativeMoveRequest | AbsoluteMoveRequest | HomeRequest | ContinuousMoveRequest,
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
        body: RelativeMoveRequest | AbsoluteMoveRequest | HomeRequest | ContinuousMoveRequest,
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

    def start_group_move(
        self,
        group_id: str,
        body: RelativeMoveRequest | AbsoluteMoveRequest | HomeRequest | ContinuousMoveRequest,
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
        body: RelativeMoveRequest | AbsoluteMoveRequest | HomeRequest | ContinuousMoveRequest,
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

    def stop_all(self, body: StopRequest | None = None, /) -> StopResult:
        """Stop all bodies and robots of all lines by software. It does not replace a hardware stop."""
        answer: StopResult = self.call("POST", filled("/stop"), body=body)
        return answer

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

        It lasts until the gateway ends; groups of the configuration are defined at every start.
        """
        answer: GroupInfo = self.call(
            "PUT", filled("/groups/{group_id}", group_id=group_id), body=body, idempotency_key=idempotency_key
        )
        return answer

    def list_lines(self) -> LineList:
        """List all lines."""
        answer: LineList = self.call("GET", filled("/lines"))
        return answer

    def get_line(self, line_id: str) -> LineInfo | RobotLineInfo:
        """Tell the state of a line; nothing is sent."""
        answer: LineInfo | RobotLineInfo = self.call("GET", filled("/lines/{line_id}", line_id=line_id))
        return answer

    def start_scan(
        self, line_id: str, *, wait: float | None = None, idempotency_key: str | None = None
    ) -> Scan:
        """Ask all 120 body numbers of the line, between its other work, whether somebody is there.

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

    def get_trace(self, line_id: str, *, last: int | None = None, since: str | None = None) -> Trace:
        """Give the newest bytes of the line, a robot's too, both ways, with their times."""
        answer: Trace = self.call(
            "GET", filled("/lines/{line_id}/trace", line_id=line_id), query={"last": last, "since": since}
        )
        return answer

    def list_events(
        self,
        *,
        after: str | None = None,
        bodies: str | None = None,
        types: str | None = None,
        limit: int | None = None,
    ) -> EventList:
        """List what has happened after a cursor, or from the oldest event that is kept.

        Ask again after the answer's `cursor` to go on. The event `stream.gap` stands for events no longer kept.
        """
        answer: EventList = self.call(
            "GET", filled("/events"), query={"after": after, "bodies": bodies, "types": types, "limit": limit}
        )
        return answer

    def list_commands(self, *, family: Literal["rorze", "fics"] | None = None) -> CommandList:
        """List every command that controllers and robots know."""
        answer: CommandList = self.call("GET", filled("/commands"), query={"family": family})
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

    def livez(self) -> Liveness:
        """Answer, as long as the process can."""
        answer: Liveness = self.call("GET", filled("/livez"))
        return answer

    def readyz(self) -> Readiness:
        """Say whether all lines are open and set up, and somebody answers on each."""
        answer: Readiness = self.call("GET", filled("/readyz"))
        return answer

    def version(self) -> Version:
        """Tell the version."""
        answer: Version = self.call("GET", filled("/version"))
        return answer

    def issue_ticket(self, *, idempotency_key: str | None = None) -> Ticket:
        """Give a ticket for one event stream, for browsers, whose WebSockets and EventSources send no key."""
        answer: Ticket = self.call("POST", filled("/tickets"), idempotency_key=idempotency_key)
        return answer

    def get_identity(self) -> Identity:
        """Tell who asks, with which role and rights, and for what."""
        answer: Identity = self.call("GET", filled("/system/identity"))
        return answer

    def get_posture(self) -> Posture:
        """Tell how the gateway is protected, and name each default that was weakened; values to admins only."""
        answer: Posture = self.call("GET", filled("/system/posture"))
        return answer

    def read_program(self, body_id: str) -> Program | str:
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

    def get_program_upload(self, body_id: str, upload_id: str, *, wait: float | None = None) -> ProgramUpload:
        """Get an upload, at once or when it is over; `current` is the one under way, or the last."""
        answer: ProgramUpload = self.call(
            "GET",
            filled("/bodies/{body_id}/program/uploads/{upload_id}", body_id=body_id, upload_id=upload_id),
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

    def run_program(
        self,
        body_id: str,
        body: RunRequest,
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
        """Ask the controller whether its program runs, how it ended and where it is (URD, UND, UPD)."""
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

    def read_memories(self, body_id: str, *, first: str | None = None, count: int | None = None) -> Memories:
        """Read memories of the user program, one by one (UDD)."""
        answer: Memories = self.call(
            "GET",
            filled("/bodies/{body_id}/memories", body_id=body_id),
            query={"first": first, "count": count},
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

    def list_robots(self) -> RobotList:
        """List all robots; nothing is sent."""
        answer: RobotList = self.call("GET", filled("/robots"))
        return answer

    def get_robot(self, robot_id: str) -> RobotInfo:
        """Tell what is known of a robot; nothing is sent."""
        answer: RobotInfo = self.call("GET", filled("/robots/{robot_id}", robot_id=robot_id))
        return answer

    def get_unit(self, robot_id: str, unit: int) -> UnitInfo:
        """Tell what is known of a unit; nothing is sent."""
        answer: UnitInfo = self.call(
            "GET", filled("/robots/{robot_id}/units/{unit}", robot_id=robot_id, unit=unit)
        )
        return answer

    def read_unit_position(
        self, robot_id: str, unit: int, *, coordinates: Literal["user", "motor"] | None = None
    ) -> UnitPosition:
        """Ask the robot where the unit stands, in user (APS) or motor coordinates (MPS)."""
        answer: UnitPosition = self.call(
            "GET",
            filled("/robots/{robot_id}/units/{unit}/position", robot_id=robot_id, unit=unit),
            query={"coordinates": coordinates},
        )
        return answer

    def read_unit_status(self, robot_id: str, unit: int) -> UnitStatus:
        """Ask the robot how the unit's motor axes are (ACD) and for their sensors (ASD)."""
        answer: UnitStatus = self.call(
            "GET", filled("/robots/{robot_id}/units/{unit}/status", robot_id=robot_id, unit=unit)
        )
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

    def stop_unit(self, robot_id: str, unit: int, body: StopRequest | None = None, /) -> StopResult:
        """Stop all axes of the unit's robot by software: it knows no stop of a single unit."""
        answer: StopResult = self.call(
            "POST", filled("/robots/{robot_id}/units/{unit}/stop", robot_id=robot_id, unit=unit), body=body
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

    def start_jog(
        self, robot_id: str, body: JogRequest, /, *, idempotency_key: str | None = None
    ) -> JogSession:
        """Start to jog an axis. It stops by itself unless a heartbeat comes at least every half second."""
        answer: JogSession = self.call(
            "POST",
            filled("/robots/{robot_id}/jogs", robot_id=robot_id),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def keep_jogging(self, robot_id: str, jog_id: str, *, idempotency_key: str | None = None) -> JogSession:
        """Let the axis move for another half second; 409 when it is being stopped, or nobody can reach it."""
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
        self, robot_id: str, unit: int, body: PositionUpload, /, *, idempotency_key: str | None = None
    ) -> Uploaded:
        """Store positions undivided (POF, POS); a stop in the middle ends the upload first."""
        answer: Uploaded = self.call(
            "PUT",
            filled("/robots/{robot_id}/units/{unit}/positions", robot_id=robot_id, unit=unit),
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

    def read_settings(self, robot_id: str, unit: int) -> UnitSettings:
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
        """
        answer: UnitSettings = self.call(
            "PATCH",
            filled("/robots/{robot_id}/units/{unit}/settings", robot_id=robot_id, unit=unit),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def read_inputs(self, robot_id: str, *, first: int | None = None, count: int | None = None) -> Channels:
        """Ask the robot for inputs, channel by channel (IDI)."""
        answer: Channels = self.call(
            "GET",
            filled("/robots/{robot_id}/inputs", robot_id=robot_id),
            query={"first": first, "count": count},
        )
        return answer

    def read_outputs(self, robot_id: str, *, first: int | None = None, count: int | None = None) -> Channels:
        """Ask the robot for outputs, channel by channel (IDO)."""
        answer: Channels = self.call(
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
    ) -> Channels:
        """Switch an output on or off (IOT), and read its channel back; `not-done` where it is not as asked."""
        answer: Channels = self.call(
            "PUT",
            filled("/robots/{robot_id}/outputs/{channel}/{bit}", robot_id=robot_id, channel=channel, bit=bit),
            body=body,
            idempotency_key=idempotency_key,
        )
        return answer

    def read_variables(
        self, robot_id: str, *, first: int | None = None, count: int | None = None
    ) -> Variables:
        """Ask the robot for variables, one by one (VAR)."""
        answer: Variables = self.call(
            "GET",
            filled("/robots/{robot_id}/variables", robot_id=robot_id),
            query={"first": first, "count": count},
        )
        return answer

    def set_variable(
        self, robot_id: str, number: int, body: VariableSetting, /, *, idempotency_key: str | None = None
    ) -> VariableValue:
        """Set a variable (VAR), and read it back; `not-done` where it is not as asked."""
        answer: VariableValue = self.call(
            "PUT",
            filled("/robots/{robot_id}/variables/{number}", robot_id=robot_id, number=number),
            body=body,
            idempotency_key=idempotency_key,
        )
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
