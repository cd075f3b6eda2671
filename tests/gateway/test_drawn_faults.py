"""A fault of the gateway itself, at any place, leaves no caller waiting and no motor without its stop."""

import asyncio
import logging
from collections.abc import Awaitable, Callable, Sequence
from contextlib import suppress
from functools import cache
from importlib import import_module
from random import Random
from types import CodeType, FunctionType
from typing import Any, TypeVar

import pytest

from gateway.access.principal import EVERYBODY, asking
from gateway.config import Config, parse
from gateway.core.admission import SUSPENDED_S
from gateway.core.family import Extension
from gateway.core.leases import Holder
from gateway.core.move_record import MoveStatus
from gateway.core.origin import Claim, Origin
from gateway.core.parts import Part
from gateway.door.stopping import stop_all
from gateway.families import EXTENSIONS
from gateway.rorze.family import Rorze
from gateway.rorze.move_requests import BodyJogRequest
from protocols.fics.alarms import ResetErrors
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveRelative
from protocols.fics.system import GetSystemVersion
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from tests.drawing import commit
from tests.drawn_faults import AGAIN_S, STRUCK, DrawnFault, Story, Strike, functions, place, strike
from tests.fics_plants import FicsRig, fics_rig
from tests.plants import Rig, configuration, rig
from tests.virtual_time import run_virtual

pytestmark = pytest.mark.filterwarnings(  # a function that raises leaves coroutines that nothing awaits
    "ignore::pytest.PytestUnraisableExceptionWarning", "ignore:coroutine:RuntimeWarning"
)

T = TypeVar("T")

LONG = MoveClockwise(distance=20_000)
SHORT = MoveClockwise(distance=300)
ENDLESS = MoveClockwise(distance="endless")
FAR = MoveRelative(coordinates=[90.0, None, None])
NEAR = MoveRelative(coordinates=[5.0, None, None])
HEARTBEAT_S = 2.0
"""Seconds from the last heartbeat of a jog: half a second, and the longest way to a standstill."""
CONFIRMED_S = 0.0
"""Seconds after its report by which the stop of a robot is confirmed at last."""


async def is_itself(it: Rig) -> None:
    """After a while each body answers, moves, and is stopped with a confirmation."""
    await asyncio.sleep(AGAIN_S)
    for body in it.plant.bodies():
        await body.ask(GetPosition())
        [move] = await it.plant.moves.start(body, SHORT)
        assert (await it.plant.moves.wait(move.id, 60.0)).status is MoveStatus.SUCCEEDED
        [report] = await it.plant.stops.stop([body], "immediate")
        assert report.state == "confirmed"


async def robot_is_itself(it: FicsRig) -> None:
    """After a while the robot moves, and is stopped with a confirmation."""
    await asyncio.sleep(AGAIN_S)
    await it.robot.ask(ResetErrors())  # an axis that nothing could prove to stand was stopped by AES
    if it.robot.power_cycled:  # a fault may look like one
        it.robot.known.power.acknowledge()
        assert (await it.move(HomeRobot())).status is MoveStatus.SUCCEEDED
    assert (await it.move(NEAR)).status is MoveStatus.SUCCEEDED
    await it.robot.stop("immediate")
    await asyncio.sleep(CONFIRMED_S)
    assert it.robot.stops.unconfirmed is None


async def again(deed: Callable[[], Awaitable[T]]) -> T:
    """Ask as a person does who has got an error from the gateway: once more."""
    try:
        return await deed()
    except DrawnFault:
        return await deed()


async def bodies_move_and_stop(struck: Strike) -> None:
    async with rig(bodies=(0x00, 0x3F), groups={}) as it:
        await asyncio.sleep(3.0)
        moved, read = it.body(), it.plant.body("00")
        moves, stops = it.plant.moves, it.plant.stops
        with struck():
            asked: list[asyncio.Future[Any]] = [
                asyncio.ensure_future(deed) for deed in (moves.start(moved, LONG), read.ask(GetPosition()))
            ]
            await asyncio.sleep(0.7)
            asked.append(asyncio.ensure_future(again(lambda: stops.stop([moved], "decelerate"))))
            await asyncio.sleep(AGAIN_S)
        assert all(each.done() for each in asked)
        await asyncio.gather(*asked, return_exceptions=True)
        assert moved.move is None
        assert not it.axis().motor.moving
        await is_itself(it)


async def a_robot_moves_and_stops(struck: Strike, mode: int = 3) -> None:
    async with fics_rig(mode=mode) as it:
        assert (await it.move(HomeRobot())).status is MoveStatus.SUCCEEDED
        robot = it.robot
        with struck():
            asked: list[asyncio.Future[Any]] = [
                asyncio.ensure_future(deed) for deed in (it.start(FAR), robot.ask(GetSystemVersion()))
            ]
            await asyncio.sleep(0.7)
            asked.append(asyncio.ensure_future(again(lambda: robot.stop("decelerate"))))
            await asyncio.sleep(AGAIN_S)
        assert all(each.done() for each in asked)
        await asyncio.gather(*asked, return_exceptions=True)
        assert robot.known.motion.idle.is_set()
        await robot_is_itself(it)


async def a_robot_in_mode_2_moves_and_stops(struck: Strike) -> None:
    await a_robot_moves_and_stops(struck, mode=2)


async def a_group_moves(struck: Strike) -> None:
    async with rig(bodies=(0x00, 0x01), groups={"80": ("00", "01")}) as it:
        group = it.plant.group("80")
        with struck(), suppress(Exception):
            await it.plant.moves.start(group, SHORT)
            await asyncio.sleep(AGAIN_S)
        await asyncio.sleep(AGAIN_S)
        assert not it.plant.line("line1").followed
        await is_itself(it)


async def all_are_stopped(struck: Strike) -> None:
    async with rig(groups={}) as it:
        for body in it.plant.bodies():
            await it.plant.moves.start(body, LONG)
        with struck():
            with asking(EVERYBODY):
                await again(lambda: stop_all(it.plant, Origin("test"), "immediate"))
            await asyncio.sleep(1.0)
            assert not any(axis.motor.moving for axis in it.machine.axes.values())
        await is_itself(it)


async def a_body_jogs_and_is_left_alone(struck: Strike) -> None:
    async with rig(groups={}) as it:
        jogs, body, axis = it.plant.rorze.jogs, it.body(), it.axis()
        with struck():
            with suppress(Exception):
                await jogs.start(body, BodyJogRequest(direction="cw"))
            await asyncio.sleep(HEARTBEAT_S + 0.3)
            assert not axis.motor.moving
        await asyncio.sleep(AGAIN_S)
        jog = await jogs.start(it.body(), BodyJogRequest(direction="ccw"))
        assert (await jogs.end(jog.id, it.body())).state == "ended"
        await is_itself(it)


async def a_body_jogs_and_is_let_go(struck: Strike) -> None:
    async with rig(groups={}) as it:
        jogs, body, axis = it.plant.rorze.jogs, it.body(), it.axis()
        with struck():
            with suppress(Exception):
                jog = await jogs.start(body, BodyJogRequest(direction="cw"))
                await asyncio.sleep(0.3)
                await jogs.end(jog.id, body)
            await asyncio.sleep(HEARTBEAT_S)
            assert not axis.motor.moving
        await is_itself(it)


async def an_axis_jogs_and_is_left_alone(struck: Strike, mode: int = 3) -> None:
    async with fics_rig(mode=mode) as it:
        await it.move(HomeRobot())
        jogs = it.robot.jogs
        with struck():
            with suppress(Exception):
                await jogs.start(1, "Z", "-")
            await asyncio.sleep(HEARTBEAT_S + 0.3)
            assert it.fics.job is None
        await robot_is_itself(it)


async def an_axis_in_mode_2_jogs_and_is_let_go(struck: Strike) -> None:
    async with fics_rig(mode=2) as it:
        await it.move(HomeRobot())
        jogs = it.robot.jogs
        with struck():
            with suppress(Exception):
                jog = await jogs.start(1, "Z", "-")
                await asyncio.sleep(0.3)
                await jogs.end(jog.id)
            await asyncio.sleep(HEARTBEAT_S)
            assert it.fics.job is None
        await robot_is_itself(it)


async def a_suspended_process_stops_what_jogs(struck: Strike) -> None:
    async with rig(groups={}) as it:
        await it.plant.rorze.jogs.start(it.body(), BodyJogRequest(direction="cw"))
        watch, axis = it.plant.admission.watch, it.axis()
        with struck():
            with suppress(Exception):
                watch.on_held(SUSPENDED_S + 1.0)
            await asyncio.sleep(HEARTBEAT_S)
            assert not axis.motor.moving


async def a_robot_loses_its_power(struck: Strike) -> None:
    async with fics_rig() as it:
        assert (await it.move(HomeRobot())).status is MoveStatus.SUCCEEDED
        it.power_cycle()
        with struck():
            await asyncio.sleep(AGAIN_S)
        assert it.robot.power_cycled
        await robot_is_itself(it)


async def a_body_loses_its_power(struck: Strike) -> None:
    async with rig(groups={}) as it:
        [move] = await it.plant.moves.start(it.body(), SHORT)  # at 0, and not homed, it has nothing to lose
        await it.plant.moves.wait(move.id, 60.0)
        await asyncio.sleep(10.0)
        now = asyncio.get_running_loop().time
        with struck():
            await asyncio.sleep(10.0)
            it.machine.switch_body(0x3F, on=False, now=now())
            await asyncio.sleep(8.0)
            it.machine.switch_body(0x3F, on=True, now=now())
            await asyncio.sleep(AGAIN_S)
        await asyncio.sleep(AGAIN_S)
        assert it.body().online
        assert it.body().power.cycled


async def the_gateway_ends(struck: Strike) -> None:
    async with rig(groups={}) as it:
        for body in it.plant.bodies():
            await it.plant.moves.start(body, ENDLESS)
        with struck():
            await again(it.plant.wind_down)
            assert not any(axis.motor.moving for axis in it.machine.axes.values())


async def a_lease_ends(struck: Strike) -> None:
    async with rig(groups={}) as it:
        leases, axis = it.plant.access.leases, it.axis()
        leases.clock = asyncio.get_running_loop().time
        part = Part(it.body().line.id, it.body().address)
        await it.plant.moves.start(it.body(), ENDLESS)
        held = await leases.take("3F", "/bodies/3F", [part], Holder("a", "a"), 2.0, over=False)
        with struck():
            with suppress(Exception):
                leases.renew(held.lease, Claim((held.token,), (), "a"))
            await asyncio.sleep(6.0)
            assert not axis.motor.moving
        await asyncio.sleep(AGAIN_S)
        assert leases.all() == []
        await is_itself(it)


async def the_configuration_is_read_anew(struck: Strike) -> None:
    lines = ("line1", "line2")
    async with rig(lines=lines, bodies=(0x00, 0x3F), groups={}) as it:
        table = configuration(lines, (0x00, 0x3F), {})
        other = parse(table.replace('id = "line2"', 'id = "line2"\nstop_mode = "after_reply"'), "other.toml")
        await it.plant.moves.start(it.body("line1.3F"), ENDLESS)
        with struck():
            await again(lambda: it.plant.reload(other))
            await asyncio.sleep(5.0)
        assert it.machines["line1"].axes[0x3F].motor.moving
        assert not it.plant.line("line2").interject_stops
        reports = await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert [report.state for report in reports] == ["confirmed"] * 4


def stories_of(extension: type[Extension]) -> Sequence[Story]:
    package = extension.__module__.rpartition(".")[0]
    stories: Sequence[Story] = import_module(f"tests.{package}.stories").STORIES
    return stories


BODY_STORIES: tuple[Story, ...] = (
    bodies_move_and_stop,
    a_group_moves,
    all_are_stopped,
    a_body_jogs_and_is_left_alone,
    a_body_jogs_and_is_let_go,
    a_suspended_process_stops_what_jogs,
    a_body_loses_its_power,
    the_gateway_ends,
    a_lease_ends,
    the_configuration_is_read_anew,
    *(story for it in EXTENSIONS for story in stories_of(it)),
)
ROBOT_STORIES: tuple[Story, ...] = (
    a_robot_moves_and_stops,
    a_robot_in_mode_2_moves_and_stops,
    an_axis_jogs_and_is_left_alone,
    an_axis_in_mode_2_jogs_and_is_let_go,
    a_robot_loses_its_power,
)
STORIES = BODY_STORIES + ROBOT_STORIES


OFTEN = 2
"""Stories in which `make prove` strikes each function, of those that call it; the commit draws them."""
FEW = 10
"""Functions of each story that are struck in `make test`, each of them in no other story."""
Called = dict[CodeType, int]


@pytest.fixture(autouse=True)
def _quiet(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL + 1, "gateway")


@cache
def called() -> dict[Story, Called]:
    """Number of calls of each function by each story."""
    return {story: dict(functions(story)) for story in STORIES}


@cache
def shares(often: int) -> dict[Story, Called]:
    """Give each function to `often` of the stories that call it, or to all, if they are fewer."""
    dealt: dict[Story, Called] = {story: {} for story in STORIES}
    for code in dict.fromkeys(code for calls in called().values() for code in calls):
        callers = [story for story in STORIES if code in called()[story]]
        drawn = Random(f"{commit()} {place(code)}").sample(callers, len(callers))
        for story in drawn[:often]:
            dealt[story][code] = called()[story][code]
    return dealt


def few_of(story: Story) -> Called:
    """Functions that `make test` strikes in a story."""
    share = shares(1)[story]
    return dict(Random(f"{commit()} {story.__name__}").sample(list(share.items()), min(FEW, len(share))))


def broken_by(story: Story, struck: Called, record_property: Callable[[str, object], None]) -> list[str]:
    """Strike these functions; each strike that breaks a promise. The run's end tells how many they are."""
    dice = Random(f"{commit()} {story.__name__} calls")
    record_property(STRUCK, [place(code) for code in struck])
    return [text for code, calls in struck.items() if (text := strike(story, code, calls, dice))]


each_story = pytest.mark.parametrize("story", STORIES, ids=lambda story: story.__name__)


@each_story
def test_a_fault_at_a_drawn_call_is_survived(
    story: Story, record_property: Callable[[str, object], None]
) -> None:
    assert broken_by(story, few_of(story), record_property) == []


@pytest.mark.prove
@pytest.mark.long
@each_story
def test_a_fault_at_a_drawn_call_of_any_function_is_survived(
    story: Story, record_property: Callable[[str, object], None]
) -> None:
    assert broken_by(story, shares(OFTEN)[story], record_property) == []


@pytest.mark.parametrize(
    ("story", "function", "number"),
    [
        *((a_group_moves, Rorze._way_changes, number) for number in (3, 4)),
        *((the_configuration_is_read_anew, Config.made, number) for number in range(1, 11)),
    ],
)
def test_a_call_whose_fault_was_not_survived_once(story: Story, function: FunctionType, number: int) -> None:
    run_virtual(story(Strike(function.__code__, number)), survives=DrawnFault)


def test_more_functions_are_struck_than_anybody_would_name() -> None:
    assert sum(len(few_of(story)) for story in STORIES) >= 145
    assert len({code for calls in called().values() for code in calls}) >= 1_000
