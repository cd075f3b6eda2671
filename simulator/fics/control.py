"""The control interface of a simulated Fics, over HTTP: the pendant, drivers, sensors, power and the line."""

from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Annotated, Literal

from fastapi import FastAPI, HTTPException, Path
from pydantic import Field

from protocols.fics.link import Terminator
from protocols.fics.status import MotionMode
from protocols.lines import CR
from simulator.control import Hold, Power, Strict, Touchable, add_faults, add_truth
from simulator.fics.alarms import connection_lost, driver_error, emergency, system_error, timed_out
from simulator.fics.axes import Motor, Sensor
from simulator.fics.dpram_port import SimulatedDpram, Tears
from simulator.fics.line import SimulatedFics
from simulator.fics.robot import Robot
from simulator.fics.units import Unit

SensorName = Literal["origin", "plus_limit", "minus_limit"]
SENSORS: dict[SensorName, Sensor] = {
    "origin": Sensor.ORIGIN,
    "plus_limit": Sensor.PLUS_LIMIT,
    "minus_limit": Sensor.MINUS_LIMIT,
}


Activity = Literal["automatic", "homing", "jog", "editing"]
RUNS: dict[Activity, MotionMode] = {
    "automatic": MotionMode.MACRO,
    "homing": MotionMode.HOMING,
    "jog": MotionMode.JOG,
}
"""Motion modes that ACD tells while an activity runs: an assumption."""


class MotorState(Strict):
    """One motor axis as it really is."""

    name: str
    place: float = Field(description="Coordinate in the axis's unit, whether the controller knows it or not.")
    homed: bool
    driver_error: int
    answers: bool = Field(description="True if its driver answers.")
    sensors: dict[SensorName, bool]


class UnitState(Strict):
    """One unit as it really is."""

    unit: int
    moving: bool
    motors: list[MotorState]
    user_places: dict[str, float]


class SystemState(Strict):
    """The system as it really is."""

    time_s: float = Field(description="The clock that the truth tells the times by.")
    powered: bool
    mode: int
    host_unit: int
    fics_unit: int
    states: list[str] = Field(description="States of (a) to (d) that hold (C-HOST manual 1-7).")
    uploading: int | None = Field(description="The number the next POS gets, between POF 1 and POF 2.")
    moving: str | None = Field(description="The command that is under way.")
    error: int | None = Field(description="The error that stands.")
    inputs: list[int]
    outputs: list[int]
    requests: int = Field(description="Frames the host has sent.")


class On(Strict):
    """A switch, on or off."""

    on: bool


class BrownOut(Strict):
    """A loss of power that ends after a time."""

    for_s: float = Field(ge=0, le=3600, description="Seconds without power; `boot_s` comes on top.")


class DriverChange(Strict):
    """A driver with an error, or one that no longer answers; what is left out stays as it is."""

    error: int | None = Field(default=None, ge=0, le=0xFF)
    answers: bool | None = None


class TerminalUse(Strict):
    """The activity at the teaching terminal; null for none."""

    activity: Activity | None


class TerminalUnit(Strict):
    """The unit shown at the teaching terminal."""

    unit: int


class ChannelLevels(Strict):
    """The levels of eight inputs."""

    bits: int = Field(ge=0, le=0xFF)


class Trouble(Strict):
    """An error of the system; without a code, one of time."""

    code: int | None = Field(default=None, ge=1, le=999)
    program: int = Field(default=0, ge=0, le=999)
    step: int = Field(default=0, ge=0, le=9999)


class LineChange(Strict):
    """Settings that the manual leaves open about the line; what is left out stays as it is."""

    reply_delay_s: float | None = Field(default=None, ge=0, le=60)
    terminator: Terminator | None = None
    boot_s: float | None = Field(default=None, ge=0, le=3600)
    hears: Literal["either", "crlf"] | None = None
    half_commands: Literal["refused", "executed"] | None = None
    echoes: bool | None = None


Bits = Annotated[tuple[str, ...], Field(strict=False)]  # JSON has lists only


class RobotChange(Strict):
    """Settings that the manual leaves open about the robot; what is left out stays as it is."""

    stop_while_braking: Literal["overtakes", "refused"] | None = None
    emergency_stop: Literal["at_once", "brakes"] | None = None
    status_bits: Bits | None = Field(default=None, description="Bits 0 to 3, each name once.")
    sensor_bits: Bits | None = Field(default=None, description="Bits 0 to 2, each name once.")
    origin_bit: Literal["homed", "lasting"] | None = None
    hidden_positions: Literal["several_units", "always", "at_rest"] | None = None
    mode_change: Literal["new_mode", "old_mode"] | None = None
    displayed_decimals: int | None = Field(default=None, ge=0, le=6)
    upload_end: Literal["refused", "done"] | None = None
    upload_refusal: Literal["E03", "E01"] | None = None
    download_end: Literal["first_hole", "skips_holes"] | None = None
    left_out: Literal["without", "kept"] | None = None
    numbers: Literal["as_set", "whole"] | None = None
    homing: Literal["lasting", "lost_by_moves"] | None = None
    jog_mode: Literal["jog", "move", "standing"] | None = None
    positions_after_power: Literal["unknown", "kept"] | None = None
    error_after_power: Literal["gone", "kept"] | None = None


class TornMessages(Strict):
    """Messages to the host whose second half comes after the delay, behind their flag."""

    next_messages: int = Field(
        default=0, ge=0, le=1_000_000, description="Messages that are torn for certain."
    )
    delay_s: float = Field(default=0.002, ge=0, le=60)


class StrayMessage(Strict):
    """A line to the host, without its CR."""

    text: str = Field(min_length=1, max_length=254, pattern="^[ -~]+$")


class DpramState(Strict):
    """The dual-port RAM: a flag is 1 while its area holds a message that has not been taken."""

    host_flag: int = Field(description="Flag at offset 257: a command for Fics.")
    fics_flag: int = Field(description="Flag at offset 512: a message for the host.")
    stalled: bool
    torn: TornMessages
    ends_with_cr: bool


UnitNumber = Annotated[int, Path(ge=1)]
MotorName = Annotated[str, Path(pattern="^[A-Z@]$")]
ChannelNumber = Annotated[int, Path(ge=1)]


# All routes are coroutines: they run on the event loop's thread, as the machine does.
def create_control(line: SimulatedFics, port: Touchable) -> FastAPI:
    """Build the interface to a Fics that runs in this event loop."""
    app = FastAPI(title="Simulated Fics", docs_url=None, redoc_url=None)
    control = _Control(line, port)
    _add_system(app, control)
    _add_settings(app, line.robot)
    _add_power(app, control)
    _add_terminal(app, control)
    _add_drivers(app, control)
    _add_line(app, control)
    if isinstance(port, SimulatedDpram):
        _add_dpram(app, port)
    add_faults(app, line.faults)
    add_truth(app, line.truth)
    return app


class _Control:
    """The machine and the way to touch it while it runs."""

    def __init__(self, line: SimulatedFics, port: Touchable) -> None:
        self.line = line
        self.robot = line.robot
        self.port = port

    def change(self, deed: Callable[[float], object]) -> SystemState:
        """Do something to the system, let follow what follows, and tell how it is then."""

        def act(now: float) -> SystemState:
            self.robot.advance(now)
            deed(now)
            self.line.look_after(now)
            return self._state(now)

        return self.port.touch(act)

    def _state(self, now: float) -> SystemState:
        robot, job = self.robot, self.robot.job
        return SystemState(
            time_s=now,
            powered=self.line.powered,
            mode=robot.mode,
            host_unit=robot.host_unit,
            fics_unit=robot.fics_unit,
            states=sorted(robot.blocks()),
            uploading=robot.upload,
            moving=None if job is None else job.name,
            error=None if robot.alarm is None else robot.alarm.code,
            inputs=robot.inputs[:],
            outputs=robot.outputs[:],
            requests=self.line.requests,
        )

    def unit(self, number: int) -> Unit:
        """Find a unit, or answer 404."""
        if number not in self.robot.units:
            raise HTTPException(404, f"This system has units 1 to {len(self.robot.units)}, no unit {number}.")
        return self.robot.units[number]

    def motor(self, number: int, name: str) -> Motor:
        """Find a motor, or answer 404."""
        unit = self.unit(number)
        for motor in unit.motors:
            if motor.name == name:
                return motor
        known = ", ".join(motor.name for motor in unit.motors)
        raise HTTPException(404, f"Unit {number} has no motor {name}; it has {known}.")

    def unit_state(self, number: int) -> UnitState:
        """Tell how a unit is."""
        unit = self.unit(number)

        def tell(now: float) -> UnitState:
            self.line.look_after(now)
            return _unit_state(unit, now)

        return self.port.touch(tell)


def _unit_state(unit: Unit, now: float) -> UnitState:
    motors = [
        MotorState(
            name=motor.name,
            place=place,
            homed=motor.homed,
            driver_error=motor.driver_error,
            answers=not motor.silent,
            sensors={name: motor.sees(sensor, place) for name, sensor in SENSORS.items()},
        )
        for motor, place in zip(unit.motors, unit.motor_places(now), strict=True)
    ]
    users = zip(unit.users, unit.user_places(now), strict=True)
    return UnitState(
        unit=unit.number,
        moving=unit.course is not None,
        motors=motors,
        user_places={axis.name: place for axis, place in users},
    )


def _add_system(app: FastAPI, control: _Control) -> None:
    robot = control.robot

    @app.get("/system")
    async def get_system() -> SystemState:
        """Tell the state of the system."""
        return control.change(lambda _now: None)

    @app.put("/system/stop-input")
    async def set_stop_input(stop: On) -> SystemState:
        """Activate the stop input, which acts as AES does and lasts, or release it; DRT resets the rest."""

        def act(now: float) -> None:
            robot.stop_input = stop.on
            if stop.on:
                robot.raise_alarm(emergency(), now)

        return control.change(act)

    @app.post("/system/errors")
    async def raise_error(error: Trouble) -> SystemState:
        """Let an error of the system happen: 200-299 is a message error."""
        alarm = (
            timed_out(error.program, error.step)
            if error.code is None
            else system_error(error.code, error.program, error.step)
        )
        return control.change(lambda now: robot.raise_alarm(alarm, now))

    @app.put("/inputs/{channel}")
    async def set_inputs(channel: ChannelNumber, levels: ChannelLevels) -> SystemState:
        """Set the inputs of a channel."""
        if channel > len(robot.inputs):
            raise HTTPException(404, f"There are channels 1 to {len(robot.inputs)}, no channel {channel}.")

        def act(_now: float) -> None:
            robot.inputs[channel - 1] = levels.bits

        return control.change(act)


def _add_settings(app: FastAPI, robot: Robot) -> None:
    @app.get("/system/settings")
    async def get_settings() -> RobotChange:
        """Tell how the switches of the robot are set."""
        return RobotChange(**asdict(robot.settings))

    @app.patch("/system/settings")
    async def set_settings(change: RobotChange) -> RobotChange:
        """Change what the manual leaves open about the robot."""
        try:
            robot.settings = replace(robot.settings, **change.model_dump(exclude_none=True))
        except ValueError as error:
            raise HTTPException(422, f"{error}; nothing was changed.") from None
        return await get_settings()


def _add_power(app: FastAPI, control: _Control) -> None:
    line = control.line

    @app.put("/system/power")
    async def switch_power(power: Power) -> SystemState:
        """Cut or restore the power."""
        return control.change(line.power_on if power.on else line.power_off)

    @app.post("/system/brown-outs")
    async def brown_out(loss: BrownOut) -> SystemState:
        """Cut the power for a while."""
        return control.change(lambda now: line.brown_out(now, loss.for_s))


def _add_terminal(app: FastAPI, control: _Control) -> None:
    robot = control.robot

    @app.put("/terminal/activity")
    async def use_terminal(use: TerminalUse) -> SystemState:
        """Run something from the teaching terminal, which is state (a), or edit there, which is (b)."""

        def act(_now: float) -> None:
            robot.terminal = None if use.activity is None else RUNS.get(use.activity)
            robot.editing = use.activity == "editing"

        return control.change(act)

    @app.put("/terminal/unit")
    async def show_unit(shown: TerminalUnit) -> SystemState:
        """Select a unit at the teaching terminal; the host's stays."""
        number = control.unit(shown.unit).number

        def act(_now: float) -> None:
            robot.fics_unit = number

        return control.change(act)


def _add_drivers(app: FastAPI, control: _Control) -> None:
    robot = control.robot

    @app.get("/units/{number}")
    async def get_unit(number: UnitNumber) -> UnitState:
        """Tell the state of a unit."""
        return control.unit_state(number)

    @app.put("/units/{number}/motors/{name}/sensors/{sensor}")
    async def hold_sensor(number: UnitNumber, name: MotorName, sensor: SensorName, hold: Hold) -> UnitState:
        """Hold a sensor on or off, or let go of it."""
        motor = control.motor(number, name)

        def act(_now: float) -> None:
            motor.held.pop(SENSORS[sensor], None)
            if hold.on is not None:
                motor.held[SENSORS[sensor]] = hold.on

        control.change(act)
        return control.unit_state(number)

    @app.patch("/units/{number}/motors/{name}/driver")
    async def change_driver(number: UnitNumber, name: MotorName, change: DriverChange) -> UnitState:
        """Let a driver report an error, or fall silent, or answer again."""
        unit, motor = control.unit(number), control.motor(number, name)

        control.change(lambda now: _change_driver(robot, unit, motor, change, now))
        return control.unit_state(number)


def _change_driver(robot: Robot, unit: Unit, motor: Motor, change: DriverChange, now: float) -> None:
    if change.answers is not None:
        motor.silent = not change.answers
        if motor.silent:
            robot.raise_alarm(connection_lost(robot.error_unit(unit), motor.name), now)
    if change.error is not None:
        motor.driver_error = change.error
        if change.error:
            robot.raise_alarm(driver_error(robot.error_unit(unit), motor.name, change.error), now)


def _add_line(app: FastAPI, control: _Control) -> None:
    line = control.line

    @app.get("/line/settings")
    async def get_line() -> LineChange:
        """Tell how the line is set up."""
        return LineChange(**asdict(line.settings))

    @app.patch("/line/settings")
    async def set_line(change: LineChange) -> LineChange:
        """Change what the manual leaves open about the line."""
        line.settings = replace(line.settings, **change.model_dump(exclude_none=True))
        return await get_line()


def _add_dpram(app: FastAPI, port: SimulatedDpram) -> None:
    @app.get("/dpram")
    async def get_dpram() -> DpramState:
        """Tell the flags of the dual-port RAM, and what is switched on there."""
        host_flag, fics_flag = port.flags
        torn = TornMessages(**asdict(port.tears))
        return DpramState(
            host_flag=host_flag,
            fics_flag=fics_flag,
            stalled=port.stalled,
            torn=torn,
            ends_with_cr=port.ends_with_cr,
        )

    @app.put("/dpram/stalled")
    async def stall(stalled: On) -> DpramState:
        """Let the Fics leave both flags of its dual-port RAM alone, or see to them again."""
        port.stalled = stalled.on
        return await get_dpram()

    @app.put("/dpram/torn")
    async def tear(torn: TornMessages) -> DpramState:
        """Let messages to the host be incomplete for a while after their flag is set."""
        port.tears = Tears(**torn.model_dump())
        return await get_dpram()

    @app.put("/dpram/ends-with-cr")
    async def end_with_cr(carried: On) -> DpramState:
        """Let messages to the host carry their CR, or be ended by their flag alone."""
        port.ends_with_cr = carried.on
        return await get_dpram()

    @app.post("/dpram/messages")
    async def leave_message(message: StrayMessage) -> DpramState:
        """Give an unsolicited message, such as an answer to an earlier program."""
        port.write(message.text.encode("ascii") + CR)
        return await get_dpram()
