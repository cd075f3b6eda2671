"""The meaning of the bits of ACD and ASD is a setting, and is compared with a homed robot at rest."""

import asyncio

import pytest

from gateway.config import parse
from gateway.core.move_record import MoveStatus
from gateway.core.toml_files import ConfigError
from gateway.fics.bits import Bits
from gateway.fics.exchange import RobotAnswered
from gateway.fics.watch import HEALTH_POLL_S
from protocols.fics.homing import HomeRobot
from protocols.fics.status import (
    SENSOR_BITS,
    AxisSensors,
    AxisStatus,
    AxisStatuses,
    MotionMode,
    SensorStates,
)
from simulator.fics.settings import RobotSettings
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time

OTHER = ("alarm", "moving", "origin_done", "servo_ready")
CONFIGURED = f", status_bits = {list(OTHER)}"


async def homed(rig: FicsRig) -> None:
    assert (await rig.move(HomeRobot())).status is MoveStatus.SUCCEEDED
    await asyncio.sleep(2 * HEALTH_POLL_S)


def other(machine: object) -> None:
    machine.robot.settings = RobotSettings(status_bits=OTHER)  # type: ignore[attr-defined]


@in_virtual_time
async def test_a_robot_that_shows_what_is_configured_is_told_to_nobody() -> None:
    async with fics_rig() as rig:
        await homed(rig)
        assert (rig.robot.known.bits.mismatches, rig.types("robot.bits")) == ({}, [])


@in_virtual_time
async def test_a_robot_with_other_bits_is_told_once() -> None:
    async with fics_rig(prepare=other) as rig:
        await asyncio.sleep(HEALTH_POLL_S)
        assert rig.robot.known.bits.mismatches == {}  # it is not homed
        await homed(rig)
        (event,) = rig.events("robot.bits.mismatch")
        assert "axis A shows origin_done off" in event.data["detail"]
        assert rig.robot.known.bits.mismatches == {1: event.data["detail"]}


@in_virtual_time
async def test_with_its_bits_configured_their_names_are_right() -> None:
    async with fics_rig(prepare=other, bits=CONFIGURED) as rig:
        await homed(rig)
        axis = (await rig.robot.unit(1).status())["Z"]
        assert (axis.origin_done, axis.servo_ready, axis.moving, axis.alarm) == (True, True, False, False)
        assert rig.types("robot.bits") == []


@in_virtual_time
async def test_a_robot_that_was_homed_before_is_compared_at_set_up() -> None:
    def homed_before(machine: object) -> None:
        other(machine)
        for motor in machine.robot.units[1].motors:  # type: ignore[attr-defined]
            motor.homed = True

    async with fics_rig(prepare=homed_before) as rig:
        await asyncio.sleep(HEALTH_POLL_S)
        assert rig.types("robot.bits") == ["robot.bits.mismatch"]


def shown(*axes: tuple[MotionMode, bool]) -> RobotAnswered:
    """The answer of a robot with axes in these modes, and with this bit for `moving`."""
    told = [
        AxisStatus(motion_mode=at, moving=on, origin_done=True, servo_ready=True, alarm=False, driver_error=0)
        for at, on in axes
    ]
    return RobotAnswered((AxisStatuses(axes=told),))


@pytest.mark.parametrize(
    ("history", "believed"),
    [
        ([], False),
        ([(MotionMode.MOVE, True)], False),
        ([(MotionMode.MOVE, True), (MotionMode.STANDING, False)], True),
        ([(MotionMode.MOVE, False), (MotionMode.STANDING, False)], False),
        ([(MotionMode.MOVE, True), (MotionMode.STANDING, True), (MotionMode.STANDING, False)], False),
        ([(MotionMode.STOPPED, True), (MotionMode.STANDING, False)], False),
    ],
)
def test_the_bit_of_motion_is_believed_of_a_robot_that_has_shown_it_in_motion_alone(
    history: list[tuple[MotionMode, bool]], believed: bool
) -> None:
    bits = Bits()
    for status in history:
        bits.read(shown(status))
    (stopped,) = shown((MotionMode.STOPPED, False)).replies
    assert isinstance(stopped, AxisStatuses)
    assert bits.may_brake(stopped.axes) is not believed


def test_sensors_are_named_in_their_order() -> None:
    bits = Bits(sensors=("minus_limit", "origin", "plus_limit"))
    usual = AxisSensors(origin=True, plus_limit=False, minus_limit=False)
    named = bits.read(RobotAnswered((SensorStates(axes=[usual]),)))
    assert isinstance(named, RobotAnswered)
    assert named.replies == (
        SensorStates(axes=[AxisSensors(origin=False, plus_limit=False, minus_limit=True)]),
    )


def test_the_configuration_names_each_bit_once() -> None:
    table = (
        '[[lines]]\nid = "cell"\naddress = "tcp://127.0.0.1:1"\nprotocol = "fics"\n'
        f'robot = {{id = "r1", units = [{{number = 1, axes = ["X"]}}], '
        f"sensor_bits = {list(SENSOR_BITS[:2])}}}\n"
    )
    with pytest.raises(ConfigError, match="each of them once"):
        parse(table, "x")
