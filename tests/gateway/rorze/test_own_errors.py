"""A refusal is told in the meaning that the command's own page gives its code."""

import pytest

from gateway.core.errors import ControllerRefused
from gateway.door.problems import problem_of
from gateway.rorze.alarms import CALLS, calls_for_body
from gateway.rorze.errors import refused
from protocols.rorze.interpolation import SetStartPosition, StartInterpolation, TurnFinger
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.notation import PositionReference
from protocols.rorze.origin import CentreStallDog, HomeWithStallDetection
from protocols.rorze.programs import AddProgramInstruction, RunProgram
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack
from simulator.rorze.world import STALL
from tests.plants import in_virtual_time, rig


@pytest.mark.parametrize(
    ("command", "code", "cause", "remedies"),
    [
        (HomeWithStallDetection(), "0x54", "not set up", ("QSS", "QIS")),
        (CentreStallDog(), "0x52", "STALL sensor is not on", ("CLD", "DLS")),
    ],
)
@in_virtual_time
async def test_the_remedy_is_that_of_the_command_in_both_languages(
    command: RorzeCommand[Ack], code: str, cause: str, remedies: tuple[str, ...]
) -> None:
    async with rig() as it:
        it.touch(0x3F, lambda axis: axis.world.forced.update({STALL: False}))
        with pytest.raises(ControllerRefused) as caught:
            await it.plant.moves.start(it.body(), command)
        english, japanese = problem_of(caught.value, "/"), problem_of(caught.value, "/", japanese=True)
        assert (english.code, english.moved) == (code, "no")
        assert cause in english.detail
        assert not japanese.detail.isascii()
        assert all(name in english.remedy and name in japanese.remedy for name in remedies)


@pytest.mark.parametrize(
    ("command", "code", "named"),
    [
        (
            HomeWithStallDetection(),
            0x54,
            ["commands/set-stall-sensor-detection", "commands/set-stall-sensor-interval"],
        ),
        (CentreStallDog(), 0x52, ["sensors", "commands/set-sensor-logic"]),
        (CentreStallDog(), 0x55, ["sensors"]),
        (AddProgramInstruction(instruction="END"), 0x5B, ["commands/get-free-program-steps"]),
        (RunProgram(), 0x5B, ["commands/get-last-program-address"]),
    ],
)
def test_the_calls_that_help_are_those_of_the_command(
    command: RorzeCommand[Ack], code: int, named: list[str]
) -> None:
    refusal = refused("line1.3F", command, code)
    calls = calls_for_body(refusal, refusal.address)
    assert [call.path.removeprefix("/bodies/line1.3F/") for call in calls] == named
    assert all(call.en.isascii() and not call.ja.isascii() for call in calls)


@pytest.mark.parametrize("code", ["0x52", "0x55"])
def test_a_move_that_is_refused_by_the_same_code_keeps_the_calls_of_the_table(code: str) -> None:
    refusal = refused("line1.3F", MoveClockwise(distance=5), int(code, 16))
    assert [call.path for call in calls_for_body(refusal, "line1.3F")] == [
        call.path.format(subject="/bodies/line1.3F") for call in CALLS[code]
    ]


@pytest.mark.parametrize(
    "command",
    [
        StartInterpolation(),
        TurnFinger(angle=90_000),
        SetStartPosition(axis=0, position=PositionReference(position="next")),
    ],
    ids=lambda command: command.code,
)
def test_a_place_out_of_range_is_no_sign_of_a_garbled_command(command: RorzeCommand[Ack]) -> None:
    """5D is answered by any move that would end outside EPS, and for an index past the table (13.4.3, 14)."""
    refusal = refused("line1.00", command, 0x5D)
    assert (type(refusal), refusal.lasting) == (ControllerRefused, True)
