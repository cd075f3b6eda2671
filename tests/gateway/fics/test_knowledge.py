"""The unit a robot acts on is set, and seen, before what depends on it; what a command needs is asked for."""

import asyncio
from collections.abc import Iterable, Mapping, Sequence

import pytest

from gateway.core.errors import ControllerRefused, GatewayError, NoReply, NotSent, PowerCycled
from gateway.core.preparation import Asked
from gateway.fics.axes import UnitAxes
from gateway.fics.errors import RobotBusy, UnitMissing, UnitNotSelected
from gateway.fics.exchange import Outcome, Proof, RobotAnswered, RobotQuestion
from gateway.fics.knowledge import Knowledge
from gateway.fics.power import Missing
from gateway.fics.watch import HEALTH_POLL_S
from protocols.fics.alarms import CurrentError
from protocols.fics.axis_settings import SpeedPercents
from protocols.fics.homing import HomeRobot
from protocols.fics.link import FicsRefusal
from protocols.fics.moves import MoveRelative
from protocols.fics.notation import AxisSystem
from protocols.fics.speeds import GetSpeedPercent
from protocols.fics.status import AxisCoordinates, GetAxisSensors, MotionMode
from protocols.fics.system import CommunicationMode, UnitNumbers
from protocols.table import Reply
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time

EDITED = ("editing", True, "E03")
RUN_BY_TERMINAL = ("terminal", MotionMode.MACRO, "E01")
TERMINAL = pytest.mark.parametrize(("state", "value", "error"), [EDITED, RUN_BY_TERMINAL])
DOWN = MoveRelative(coordinates=[None, None, -5.0])


@in_virtual_time
async def test_h02_a_selection_whose_answer_is_lost_counts_if_the_robot_says_so_itself() -> None:
    async with fics_rig(units=2) as rig:
        await rig.robot.unit(1).position()
        rig.lose_replies()
        assert await rig.robot.unit(2).position() == {"X": None, "Y": None, "Z": None}
        assert rig.robot.known.unit.number == rig.fics.host_unit == 2


@in_virtual_time
async def test_h02_a_robot_that_stays_with_another_unit_is_not_moved() -> None:
    async with fics_rig(units=2) as rig:
        await rig.move(HomeRobot())
        rig.cable.lost_command = "UNT 2"
        with pytest.raises(UnitNotSelected, match="acts on unit 1, not on unit 2"):
            await rig.move(DOWN, unit=2)
        assert rig.heard("LMI") == []


@in_virtual_time
async def test_a_refusal_leaves_the_unit_as_it_was() -> None:
    async with fics_rig(units=2) as rig:
        await rig.robot.unit(1).position()
        rig.edit(True)
        with pytest.raises(ControllerRefused):
            await rig.robot.unit(2).position()
        assert await rig.robot.unit(1).position() == {"X": None, "Y": None, "Z": None}


@in_virtual_time
async def test_in_motion_no_other_unit_is_asked_for() -> None:
    async with fics_rig(units=2) as rig:
        await rig.start(HomeRobot())
        sent = len(rig.cable.written)
        with pytest.raises(RobotBusy):
            await rig.robot.unit(2).position()
        assert [text for text in rig.cable.frames(sent) if text.startswith("UNT")] == []


@in_virtual_time
async def test_h01_silence_after_a_selection_may_be_that_of_a_robot_without_power() -> None:
    async with fics_rig(units=2) as rig:
        await rig.robot.unit(1).position()
        rig.power_cycle()
        with pytest.raises(PowerCycled):
            await rig.robot.unit(2).position()
        assert rig.robot.power_cycled


@in_virtual_time
async def test_in_mode_2_units_are_selected_while_an_error_hides_every_refusal() -> None:
    async with fics_rig(units=2, mode=2) as rig:
        await rig.robot.unit(1).position()
        assert (await rig.robot.stop("immediate")).state == "confirmed"
        assert rig.robot.latched_error is not None
        await rig.robot.unit(2).position()
        await rig.robot.unit(1).position()
        assert (await rig.robot.stop("immediate")).state == "confirmed"
        with pytest.raises(NotSent):
            await rig.move(DOWN)


@TERMINAL
def test_in_mode_2_a_refusal_of_the_terminal_is_told_though_the_question_is_not_answered(
    state: str, value: object, error: str
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(units=2, mode=2) as rig:
            await rig.robot.unit(1).position()
            rig.touch(lambda fics, _: setattr(fics, state, value))
            with pytest.raises(ControllerRefused, match="which goes before LMI") as refused:
                await rig.start(DOWN, start_within_s=20.0)
            assert refused.value.error_code == error
            assert rig.heard("LMI") == []

    story()


@pytest.mark.parametrize("mode", [2, 3])
@TERMINAL
def test_a_robot_with_one_unit_is_read_without_a_selection(
    mode: int, state: str, value: object, error: str
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(mode=mode) as rig:
            rig.touch(lambda fics, _: setattr(fics, state, value))
            rig.robot.known.unit.forget()
            sent = len(rig.cable.written)
            assert await rig.robot.unit(1).status()
            assert await rig.robot.unit(1).position()
            await rig.robot.read(GetAxisSensors(), 1)
            assert rig.cable.frames(sent) == ["ACD", "APS", "ASD"]

    story()


@in_virtual_time
async def test_in_mode_2_a_lost_question_is_no_refusal() -> None:
    async with fics_rig(units=2, mode=2) as rig:
        rig.cable.lost_command = "UNT"
        with pytest.raises(UnitNotSelected, match="did not answer UNT"):
            await rig.robot.unit(2).position()


@pytest.mark.parametrize("stray", ["UNT", "UNT 1,1"])
def test_an_answer_about_units_that_nobody_asked_for_ends_the_trust_in_the_unit(stray: str) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            await rig.robot.unit(2).status()
            rig.fics.host_unit = 1  # somebody else has selected it, and this was the answer
            rig.cable.say(stray)
            sent = len(rig.cable.written)
            await rig.robot.unit(2).status()
            assert "UNT" in rig.cable.frames(sent)
            assert rig.fics.host_unit == 2

    story()


@in_virtual_time
async def test_in_motion_a_stray_answer_about_units_keeps_nobody_from_following_it() -> None:
    async with fics_rig(units=2) as rig:
        move = await rig.start(HomeRobot(), 2)
        rig.cable.say("UNT 1,1")
        assert (await rig.plant.robot_moves.wait(move.id, 600.0)).status == "succeeded"


@in_virtual_time
async def test_an_answer_about_the_mode_that_nobody_asked_for_lets_the_robot_be_looked_at() -> None:
    async with fics_rig() as rig:
        rig.power_cycle()
        rig.cable.say("MOD 2")
        await asyncio.sleep(0.5)
        assert rig.robot.power_cycled


# units that the configuration names and the robot does not have


@pytest.mark.parametrize("mode", [2, 3])
def test_a_unit_that_the_robot_does_not_have_is_told_at_the_set_up(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(units=2, there=1, mode=mode) as rig:
            assert [event.data for event in rig.events("robot.unit")] == [{"unit": 2}]
            assert rig.robot.known.unit.missing == {2}
            (alarm,) = [it for it in rig.plant.alarms.standing() if it.cause == "robot.unit.missing"]
            assert alarm.en.happened == "r1 has no unit 2, which the configuration names."
            assert rig.robot.known.unit.number == rig.fics.host_unit == 1
            with pytest.raises(UnitMissing, match="r1 says that it has no unit 2") as missing:
                await rig.robot.unit(2).status()
            assert "out of the configuration" in missing.value.remedy
            assert rig.types("robot.unit") == ["robot.unit.missing"], "once"

    story()


@pytest.mark.parametrize("mode", [2, 3])
def test_a_stop_is_confirmed_by_the_units_that_are_there(mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(units=2, there=1, mode=mode) as rig:
            await rig.robot.unit(1).position()
            started = await rig.start(HomeRobot())
            report = await rig.robot.stop("decelerate")
            assert (report.state, report.detail, report.units_unknown) == ("confirmed", None, [])
            assert (await rig.plant.robot_moves.wait(started.id, 60.0)).status == "stopped"

    story()


@in_virtual_time
async def test_a_move_of_a_unit_that_is_not_there_is_refused_and_nothing_moves() -> None:
    async with fics_rig(units=2, there=1) as rig:
        with pytest.raises(UnitMissing):
            await rig.move(DOWN, unit=2)
        assert rig.heard("LMI") == []


@in_virtual_time
async def test_a_selection_that_another_number_was_made_of_on_its_way_is_said_again() -> None:
    async with fics_rig(units=2) as rig:
        await rig.robot.unit(1).position()
        rig.cable.damaged = {"UNT 2": "UNT 8"}
        rig.cable.after(2, rig.cable.damaged.clear)
        await rig.robot.unit(2).position()
        assert "UNT 8" in rig.heard("UNT")
        assert rig.robot.known.unit.missing == set()
        assert rig.types("robot.unit") == []


@in_virtual_time
async def test_a_robot_that_moves_is_not_asked_for_its_units_until_it_stands_still() -> None:
    async with fics_rig(
        units=2, prepare=lambda machine: setattr(machine.robot, "terminal", MotionMode.MACRO)
    ) as rig:
        assert [text for text in rig.cable.frames() if text.startswith("UNT ")] == []
        rig.touch(lambda fics, _: setattr(fics, "terminal", None))
        await asyncio.sleep(2 * HEALTH_POLL_S)
        assert [text for text in rig.cable.frames() if text.startswith("UNT ")] == ["UNT 2", "UNT 1"]


# what a command needs, without a robot


class LineSeen:
    """The facts about a line that knowledge depends on."""

    def __init__(self, mode: int) -> None:
        self.mode = mode
        self.absences = self.unheard = 0

    def was_set_up(self) -> None: ...


AT_REST: Mapping[str, Reply] = {
    "UNT": UnitNumbers(host_unit=1, fics_unit=1),
    "MOD": CommunicationMode(mode=3),
    "ERR": CurrentError(error="E00"),
    "MPS": AxisCoordinates(coordinates=[1.0]),
    "VAO": SpeedPercents(percents=[50.0]),
}
"""The answers of a robot that stands still in unit 1, by the name of the question."""


def known(mode: int = 3) -> Knowledge:
    """The knowledge of a robot with two units, of which nothing is known yet."""
    axes = [UnitAxes("r1", number, ["X"], ["X"], {"X": AxisSystem.MILLIMETRE}) for number in (1, 2)]
    return Knowledge("r1", LineSeen(mode), axes, lambda _kind, _data: None)


def asked(of: Knowledge, needs: Iterable[Missing], answers: Mapping[str, Sequence[Outcome]]) -> list[str]:
    """The commands that needs ask for; `answers` go before those of a robot at rest, each once."""
    left = {name: list(outcomes) for name, outcomes in answers.items()}
    sent: list[str] = []
    for missing in needs:
        heard: list[Asked[RobotQuestion, Outcome]] = []
        while (question := missing(heard)) is not None:
            text = question.command.text
            sent.append(text)
            of.sent(question)
            outcome = left[text].pop(0) if left.get(text) else RobotAnswered((AT_REST[text],))
            of.heard(question, outcome)
            heard.append(Asked(question, outcome))
    return sent


ANOTHER = RobotAnswered((UnitNumbers(host_unit=1, fics_unit=1),))
TAKEN = RobotAnswered()
SELECTED = RobotAnswered((UnitNumbers(host_unit=2, fics_unit=2),))
SILENCE = NoReply("no reply came.")
OUT_OF_RANGE = FicsRefusal("UNT", "E05")
POWER_ON = RobotAnswered((CommunicationMode(mode=2),))


@pytest.mark.parametrize(
    ("answers", "sent"),
    [
        ({"UNT": [SELECTED]}, ["UNT"]),
        ({"UNT": [ANOTHER, SELECTED], "UNT 2": [TAKEN]}, ["UNT", "UNT 2", "UNT"]),
        ({"UNT": [ANOTHER, SELECTED], "UNT 2": [SILENCE]}, ["UNT", "UNT 2", "MOD", "UNT"]),
        (
            {"UNT": [ANOTHER, SELECTED], "UNT 2": [OUT_OF_RANGE, TAKEN]},
            ["UNT", "UNT 2", "UNT 2", "UNT"],
        ),
    ],
)
@in_virtual_time
async def test_a_unit_is_asked_for_selected_and_asked_for_again(
    answers: Mapping[str, Sequence[Outcome]], sent: list[str]
) -> None:
    robot = known()
    assert asked(robot, [robot.selected(2, afresh=True)], answers) == sent
    assert robot.unit.number == 2
    assert asked(robot, [robot.selected(2, afresh=False)], {}) == [], "it is known now"


@pytest.mark.parametrize(
    ("answers", "refusal"),
    [
        ({"UNT": [SILENCE]}, UnitNotSelected),
        ({"UNT": [ANOTHER, ANOTHER], "UNT 2": [TAKEN]}, UnitNotSelected),
        ({"UNT": [ANOTHER], "UNT 2": [OUT_OF_RANGE, OUT_OF_RANGE]}, UnitMissing),
        ({"UNT": [ANOTHER], "UNT 2": [FicsRefusal("UNT", "E03")]}, ControllerRefused),
        ({"UNT": [ANOTHER], "UNT 2": [SILENCE], "MOD": [POWER_ON]}, PowerCycled),
    ],
)
@in_virtual_time
async def test_a_command_is_refused_where_its_unit_is_not_certain(
    answers: Mapping[str, Sequence[Outcome]], refusal: type[GatewayError]
) -> None:
    robot = known()
    with pytest.raises(refusal):
        asked(robot, [robot.selected(2, afresh=True)], answers)
    assert robot.unit.number != 2


@pytest.mark.parametrize(("mode", "sent"), [(3, ["UNT", "MOD"]), (2, ["ERR", "UNT", "MPS", "VAO"])])
@in_virtual_time
async def test_the_power_is_what_a_motion_asks_for_last(mode: int, sent: list[str]) -> None:
    robot = known(mode)
    unit = robot.units[1]
    robot.replied(GetSpeedPercent(), 1, [AT_REST["VAO"]])
    robot.motion.note_foreign(moves=False)
    assert asked(robot, robot.of_motion(DOWN, unit, Proof(0)), {}) == sent


@in_virtual_time
async def test_after_a_loss_of_power_a_motion_asks_for_the_speeds_to_be_set_first() -> None:
    robot = known()
    robot.replied(GetSpeedPercent(), 1, [AT_REST["VAO"]])
    robot.power_lost()
    with pytest.raises(PowerCycled):
        robot.require_fit(DOWN)
    robot.power.acknowledge()
    sent = asked(robot, robot.of_motion(DOWN, robot.units[1], Proof(0)), {"VAO 50": [TAKEN]})
    assert sent == ["MOD", "UNT", "VAO 50", "VAO", "UNT", "MOD"]
    assert asked(robot, robot.speeds_restored(), {}) == [], "they are set"
