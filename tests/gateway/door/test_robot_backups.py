"""Backups of robots: what they tell of what they keep, brought back, and told exactly where it is not."""

import asyncio
from functools import partial
from random import Random

import pytest

from gateway.core.backup_record import Restore, RestorePlan
from gateway.core.errors import BodyBusy, InvalidRequest, InvalidText
from gateway.core.origin import Origin, acting
from gateway.door import backups, doing
from gateway.fics.door import backups as of_robots
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveRelative
from protocols.fics.speeds import SetSpeedPercent
from protocols.fics.variables import SetVariable
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import in_virtual_time
from tests.through_the_door import ask
from tests.virtual_time import run_virtual

ME, OTHER = Origin("test", "1"), Origin("other", "2")
SMALL = "[robot r1]\n[unit 1 settings]\nspeed_percent X=50 Y=25.5\n[unit 1 positions]\n1 X=5 Z=-7\n"


async def read(it: FicsRig) -> str:
    return await backups.text(of_robots.of_robot(it.plant, "r1"))


async def wanted(it: FicsRig, text: str) -> backups.ComparisonOrder:
    return of_robots.for_robot(it.plant, "r1", of_robots.check_robot(it.plant, "r1", text))


async def planned(it: FicsRig, text: str) -> RestorePlan:
    return await backups.plan(it.plant, await wanted(it, text))


async def restored(it: FicsRig, text: str, wait_s: float = 600.0) -> Restore:
    with acting(ME):
        return await backups.start(it.plant, await wanted(it, text), False, False, wait_s)


def teach(it: FicsRig) -> None:
    """Let the robot keep something of everything."""
    table = it.fics.units[1].positions
    table[1], table[9] = (10.0, 20.5, -30.25), (1.0, None, -2.0)


@pytest.mark.parametrize("mode", [2, 3])
def test_a_robot_is_brought_back_to_its_backup(mode: int) -> None:
    async def story() -> None:
        async with fics_rig(units=2, mode=mode) as it:
            teach(it)
            await it.robot.change(SetVariable(number=5, value=-3.5))
            await doing.do(it.plant, ME, "/robots/r1/units/2", SetSpeedPercent(percents=[40.0]))
            text = await read(it)
            for line in (
                "V05 -3.5",
                "1 X=10 Y=20.5 Z=-30.25 ",
                "9 X=1 Z=-2 ",
                "speed_percent X=40 Y=100 Z=100 ",
            ):
                assert f"\n{line}" in text
            assert await read(it) == text
            assert (await planned(it, text)).differences == []
            it.fics.units[1].positions.clear()
            it.fics.units[1].positions[3] = (1.0, 1.0, 1.0)
            await it.robot.change(SetVariable(number=5, value=0.0))
            await doing.do(it.plant, ME, "/robots/r1/units/2", SetSpeedPercent(percents=[70.0]))
            plan = await planned(it, text)
            told = [(found.section, found.name, found.wanted, found.held) for found in plan.differences]
            assert told == [
                ("variables", "V05", "-3.5", "0"),
                ("unit 1 positions", "position 1", "X=10 Y=20.5 Z=-30.25", None),
                ("unit 1 positions", "position 3", None, "X=1 Y=1 Z=1"),
                ("unit 1 positions", "position 9", "X=1 Z=-2", None),
                ("unit 2 settings", "speed_percent", "X=40 Y=100 Z=100", "X=70 Y=100 Z=100"),
            ]
            assert plan.commands[0].startswith("VAR V05=-3.5")
            assert plan.commands[1] == "UNT 1"
            over = await restored(it, text)
            assert (over.status, over.differences, over.power_proved) == ("verified", [], mode == 3)
            assert (over.commands, over.written) == (len(plan.commands), len(plan.commands) - 2)
            assert await read(it) == text
            assert it.types("robot.restore") == ["robot.restore.started", "robot.restore.verified"]

    run_virtual(story())


@in_virtual_time
async def test_soft_limits_are_changed_in_an_order_in_which_they_never_cross() -> None:
    async with fics_rig() as it:
        text = "[robot r1]\n[unit 1 settings]\nupper_soft_limit X=-400\nlower_soft_limit X=-500\n"
        plan = await planned(it, text)
        assert len(plan.commands) == 2
        over = await restored(it, text)
        assert (over.status, over.error) == ("verified", None)
        back = text.replace("-400", "600").replace("-500", "500")
        assert (await restored(it, back)).status == "verified"


@in_virtual_time
async def test_nobody_else_changes_or_moves_the_robot_meanwhile() -> None:
    async with fics_rig(baud=9600) as it:
        await it.move(HomeRobot())
        begun = await restored(it, SMALL, wait_s=0.0)
        assert begun.status == "running"
        with pytest.raises(BodyBusy, match="A backup is being restored"):
            await doing.do(it.plant, OTHER, "/robots/r1/units/1", SetSpeedPercent(percents=[70.0]))
        with acting(OTHER), pytest.raises(BodyBusy, match="A backup is being restored"):
            await backups.text(of_robots.of_robot(it.plant, "r1"))
        with pytest.raises(BodyBusy, match="A backup is being restored"):
            await it.move(MoveRelative(coordinates=[1.0]))
        over = await ask(it.plant, "getRobotRestore", robot_id="r1", restore_id="current", wait=600.0)
        assert (over.status, over.id) == ("verified", begun.id)


@in_virtual_time
async def test_a_stop_ends_a_restore_which_tells_what_differs() -> None:
    async with fics_rig(baud=9600) as it:
        await restored(it, SMALL, wait_s=0.2)
        await it.robot.stop("immediate")
        over = await ask(it.plant, "getRobotRestore", robot_id="r1", restore_id="current", wait=600.0)
        assert over.status == "cancelled"
        assert over.differences == (await planned(it, SMALL)).differences != []


@in_virtual_time
async def test_no_robot_is_restored_while_it_moves_and_none_has_flash_memory() -> None:
    async with fics_rig() as it:
        await it.move(HomeRobot())
        with pytest.raises(InvalidRequest, match="no command that writes flash memory"):
            await backups.start(it.plant, await wanted(it, SMALL), True, False, 0.0)
        await it.start(MoveRelative(coordinates=[20.0]))
        await asyncio.sleep(0.1)
        with pytest.raises(BodyBusy):
            await restored(it, SMALL)


@pytest.mark.parametrize("seed", range(3))
def test_whenever_the_power_is_cut_a_restore_is_verified_or_tells_what_differs(seed: int) -> None:
    dice = Random(seed)

    async def story() -> None:
        async with fics_rig() as it:
            ends = []
            for number in range(8):
                text = SMALL.replace("X=50", f"X={50 - number}").replace("X=5 ", f"X={number} ")
                begun = await restored(it, text, wait_s=0.0)
                for_s = dice.choice((0.05, 0.7, 3.0))
                it.cable.after(dice.randrange(1, 220), partial(it.brown_out, for_s))
                over = await ask(it.plant, "getRobotRestore", robot_id="r1", restore_id=begun.id, wait=600.0)
                ends.append(over.status)
                assert over.differences == (await planned(it, text)).differences
                assert over.status == ("differs" if over.differences else "verified")
                assert over.power_proved
                await asyncio.sleep(10.0)
            assert "verified" in ends

    run_virtual(story())


@pytest.mark.parametrize(
    ("lines", "place", "reason"),
    [
        ("[robot r2]\n[variables]", 1, "nothing of robot r1, but of r2"),
        ("[robot r1]\n[unit 3 settings]", 2, "no section [unit 3 settings]"),
        ("[robot r1]\n[variables]\nV100 1", 3, "V00 to V99"),
        ("[robot r1]\n[variables]\nV01 much", 3, "'much' is no number"),
        ("[robot r1]\n[variables]\nV01 1\nV01 2", 4, "comes twice"),
        ("[robot r1]\n[unit 1 settings]\nspeed X=1", 3, "no setting speed"),
        (
            "[robot r1]\n[unit 1 settings]\nspeed_percent X=101",
            3,
            "speed_percent: must be a number from 0.1 to 100",
        ),
        ("[robot r1]\n[unit 1 settings]\nspeed_percent Q=10", 3, "X=1 Y=1 Z=1"),
        ("[robot r1]\n[unit 1 settings]\nsmooth_acceleration yes", 3, "on or off"),
        ("[robot r1]\n[unit 1 positions]\n0 X=1", 3, "from 1 to 1999"),
        ("[robot r1]\n[unit 1 positions]\n1", 3, "have to follow"),
    ],
)
def test_a_text_with_faults_is_refused_with_their_lines(lines: str, place: int, reason: str) -> None:
    async def story() -> None:
        async with fics_rig() as it:
            with pytest.raises(InvalidText) as refusal:
                of_robots.check_robot(it.plant, "r1", lines)
            assert [fault.line for fault in refusal.value.faults] == [place]
            assert reason in refusal.value.faults[0].reason

    run_virtual(story())
