"""Where the axes are and how they are (C-HOST manual 2-9 to 2-11, 4-4)."""

from collections.abc import Sequence

from protocols.fics.motor_axes import GetMotorPosition
from protocols.fics.notation import UNKNOWN
from protocols.fics.status import (
    AxisSensors,
    AxisStatus,
    AxisStatuses,
    GetAxisSensors,
    GetAxisStatus,
    GetUserPosition,
    SensorStates,
)
from simulator.fics.actions import acts_out
from simulator.fics.axes import Axis, Sensor
from simulator.fics.robot import Robot


@acts_out(GetUserPosition)
def _get_user_position(robot: Robot, command: GetUserPosition, now: float) -> str:
    return _told(robot, robot.unit.users, robot.unit.shown_users(now))


@acts_out(GetMotorPosition)
def _get_motor_position(robot: Robot, command: GetMotorPosition, now: float) -> str:
    return _told(robot, robot.unit.motors, robot.unit.shown_motors(now))


def _told(robot: Robot, axes: Sequence[Axis], places: Sequence[float | None]) -> str:
    hidden, decimals = robot.hides_positions(), robot.settings.displayed_decimals
    return ",".join(
        UNKNOWN if hidden or place is None else axis.measure.displayed(place, decimals)
        for axis, place in zip(axes, places, strict=True)
    )


@acts_out(GetAxisStatus)
def _get_axis_status(robot: Robot, command: GetAxisStatus, now: float) -> AxisStatuses:
    unit = robot.unit
    mode, settings = robot.motion_mode(unit), robot.settings
    return AxisStatuses(
        axes=[
            settings.told(
                AxisStatus(
                    motion_mode=mode,
                    origin_done=motor.homed or (settings.origin_bit == "lasting" and motor.ever_homed),
                    servo_ready=motor.ready() and robot.servos_on(),
                    moving=unit.moves(place),
                    alarm=not motor.ready(),
                    driver_error=motor.driver_error,
                )
            )
            for place, motor in enumerate(unit.motors)
        ]
    )


@acts_out(GetAxisSensors)
def _get_axis_sensors(robot: Robot, command: GetAxisSensors, now: float) -> SensorStates:
    places = zip(robot.unit.motors, robot.unit.motor_places(now), strict=True)
    return SensorStates(
        axes=[
            robot.settings.told(
                AxisSensors(**{sensor.name.lower(): motor.sees(sensor, at) for sensor in Sensor})
            )
            for motor, at in places
        ]
    )
