"""A robot that executes a command cut off by a new opening of the port: the gateway tells nothing false.

No setting makes the gateway right there (`half-robot-command` contradicts it); it has to be honest.
"""

import asyncio
from typing import Any, Final

import pytest

from gateway.core.errors import GatewayError
from gateway.core.move_record import MoveStatus
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveAbsolute
from protocols.fics.row import FicsCommand
from protocols.fics.variables import SetVariable
from simulator.fics.quirks import QUIRKS
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time

FAR: Final = MoveAbsolute(coordinates=[183.5, None, None])
NUMBER: Final = 9
SET: Final = SetVariable(number=NUMBER, value=123.5)
UNPLUGGED_S: Final = 1.0
AFTERWARDS_S: Final = 30.0

each_mode = pytest.mark.parametrize("mode", [2, 3])


def lengths(command: FicsCommand[Any]) -> list[int]:
    """After how many bytes a command is cut off: anywhere before its end."""
    return list(range(1, len(command.text) + 1))


async def cut_off(rig: FicsRig, command: FicsCommand[Any], length: int) -> None:
    """Let `length` bytes of a command arrive, pull the cable, and plug it in again."""
    cable, frame, unplugged = rig.cable, command.text.encode("ascii") + b"\r", asyncio.Event()
    write = cable.write

    def cut(data: bytes) -> None:
        if data != frame or unplugged.is_set():
            write(data)
            return
        unplugged.set()
        rig.machine.receive(data[:length], asyncio.get_running_loop().time())
        asyncio.get_running_loop().call_soon(cable.unplug)

    cable.write = cut  # type: ignore[method-assign]
    async with asyncio.timeout(60):
        await unplugged.wait()
    await asyncio.sleep(UNPLUGGED_S)
    cable.plugged_in = True


@each_mode
@pytest.mark.parametrize("command", [FAR, HomeRobot()], ids=lambda it: it.code)
@in_virtual_time
async def test_a_move_that_was_cut_off_is_told_as_unknown_or_as_it_was(
    command: FicsCommand[Any], mode: int
) -> None:
    executed = 0
    for length in lengths(command):
        async with fics_rig(mode=mode, baud=19200) as rig:
            if command is FAR:
                await rig.move(HomeRobot())
            QUIRKS["half-robot-command"](rig.machine)
            before = len(rig.machine.truth.of("motion_start"))
            cutting = asyncio.create_task(cut_off(rig, command, length))
            move = await rig.move(command)
            await cutting
            await asyncio.sleep(AFTERWARDS_S)
            ran = len(rig.machine.truth.of("motion_start")) > before
            executed += ran
            if move.status is MoveStatus.SUCCEEDED:
                assert rig.heard(command.code)[-1] == command.text, length
            else:
                assert move.status is MoveStatus.UNKNOWN, length
                assert "robot.move.unknown" in [it.cause for it in rig.plant.alarms.standing()], length
    assert executed > 0, "the quirk does not show"


@each_mode
@in_virtual_time
async def test_a_variable_is_told_as_set_only_where_it_is(mode: int) -> None:
    values = set()
    for length in lengths(SET):
        async with fics_rig(mode=mode, baud=19200) as rig:
            QUIRKS["half-robot-command"](rig.machine)
            cutting = asyncio.create_task(cut_off(rig, SET, length))
            await asyncio.sleep(0)
            told = "set"
            try:
                await rig.robot.ask(SET)
            except GatewayError as error:
                told = error.moved
            await cutting
            await asyncio.sleep(AFTERWARDS_S)
            values.add(rig.fics.variables[NUMBER])
            assert told != "set" or rig.fics.variables[NUMBER] == SET.value, length
    assert len(values) > 1, "the quirk does not show"
