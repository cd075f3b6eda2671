"""A fault of the gateway itself, at any place, leaves no caller waiting and no motor without its stop."""

import asyncio
from contextlib import suppress

import pytest

from gateway.access.territory import Territory
from gateway.config import parse
from gateway.core.admission import SUSPENDED_S, Admission
from gateway.core.alarms import Alarms
from gateway.core.events import EventHub
from gateway.core.gate import Gate
from gateway.core.leases import Holder, Leases
from gateway.core.line import LineDriver
from gateway.core.load import Load
from gateway.core.move_record import MoveStatus
from gateway.core.origin import Claim, Origin
from gateway.core.parts import Part
from gateway.core.scheduler import Scheduler
from gateway.core.sequence_lock import SequenceLock
from gateway.core.session import Session
from gateway.core.stops import Stopping
from gateway.door.stopping import stop_all
from gateway.fics.conversation import Accepted, Conversation
from gateway.fics.family import Fics
from gateway.fics.jogs import RobotJogs
from gateway.fics.knowledge import Knowledge, SelectedUnit
from gateway.fics.motion_state import MotionState
from gateway.fics.moves import RobotMotion, RobotMoves, RobotRun
from gateway.fics.power import RobotPower
from gateway.fics.stops import RobotStops, _RobotStop
from gateway.plant import Plant
from gateway.rorze import move_proof
from gateway.rorze.bodies import Body
from gateway.rorze.body_watch import BodyWatch
from gateway.rorze.family import Rorze
from gateway.rorze.line import Line
from gateway.rorze.move_proof import BodyRun
from gateway.rorze.move_requests import BodyJogRequest
from gateway.rorze.moves import BodiesMotion, Moves
from gateway.rorze.power import Mark
from gateway.rorze.probes import Health
from gateway.rorze.session import RorzeSession
from gateway.rorze.stops import Stops, _BodyStop
from gateway.wind_down import WindDown
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveRelative
from protocols.fics.system import GetSystemVersion
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from tests.fics_plants import fics_rig
from tests.own_faults import Place, fail_always, fail_once, named
from tests.plants import Rig, configuration, in_virtual_time, rig
from transports.recorder import Recorder

LONG = MoveClockwise(distance=20_000)
SHORT = MoveClockwise(distance=300)
ENDLESS = MoveClockwise(distance="endless")
AGAIN_S = 30.0
"""Seconds after which the gateway is itself again, whatever has happened."""


async def is_itself(it: Rig) -> None:
    """Each body answers, moves, and is stopped with a confirmation."""
    for body in it.plant.bodies():
        await body.ask(GetPosition())
        [move] = await it.plant.moves.start(body, SHORT)
        assert (await it.plant.moves.wait(move.id, 60.0)).status is MoveStatus.SUCCEEDED
        [report] = await it.plant.stops.stop([body], "immediate")
        assert report.state == "confirmed"


@pytest.mark.parametrize(
    "place",
    [
        (Session, "has_something"),
        (Session, "next"),
        (Session, "written"),
        (Session, "pass_deadlines"),
        (Session, "_ended"),
        (RorzeSession, "receive"),
        (RorzeSession, "was_written"),
        (Gate, "refuses"),
        (Scheduler, "next"),
        (Load, "note"),
        (Body, "was_sent"),
        (Body, "has_replied"),
        (Body, "was_set_going"),
        (BodyWatch, "_attend"),
        (BodyRun, "know_the_start"),
        (BodyRun, "_look"),
        (BodyRun, "_finding"),
        (BodiesMotion, "_write"),
        (BodyRun, "advance"),
        (Stopping, "_is_proved"),
        (Stopping, "_repeat"),
        (Stopping, "tell"),
        (Stops, "_with_interpolation_partners"),
        (Stops, "_forbid_what_waits"),
        (Stops, "_groups_within"),
        (Stops, "_begin"),
        (Stops, "_over"),
        (Stops, "_forget"),
        (Stops, "under_way"),
        (_BodyStop, "submit"),
        (_BodyStop, "withdraw"),
        (Moves, "_see_through"),
        (Recorder, "record"),
    ],
    ids=named,
)
@in_virtual_time
async def test_a_fault_amid_moves_and_stops_of_bodies_is_survived(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(bodies=(0x00, 0x3F), groups={}) as it:
        await asyncio.sleep(3.0)
        failed = fail_once(monkeypatch, place)
        moving = asyncio.gather(it.plant.moves.start(it.body(), LONG), return_exceptions=True)
        asking = asyncio.gather(it.plant.body("00").ask(GetPosition()), return_exceptions=True)
        await asyncio.sleep(0.7)
        stopping = asyncio.gather(it.plant.stops.stop([it.body()], "decelerate"), return_exceptions=True)
        await asyncio.sleep(AGAIN_S)
        assert moving.done()
        assert asking.done()
        assert stopping.done()
        assert failed
        assert it.body().move is None
        assert not it.axis().motor.moving
        await is_itself(it)


@pytest.mark.parametrize(
    "place",
    [
        (Session, "next"),
        (Session, "written"),
        (Session, "_ended"),
        (Gate, "refuses"),
        (Load, "note"),
        (RobotMotion, "make"),
        (RobotRun, "follow"),
        (Stopping, "_is_proved"),
        (Stopping, "tell"),
        (RobotStops, "_begin"),
        (RobotStops, "_over"),
        (RobotStops, "_forget"),
        (_RobotStop, "submit"),
        (SequenceLock, "_pass_on"),
        (SequenceLock, "_release"),
        (Conversation, "poll_error"),
        (Recorder, "record"),
        (RobotJogs, "robot_stops"),
        (MotionState, "confirm_stop"),
        (Accepted, "was_refused"),
        (RobotMoves, "_see_through"),
    ],
    ids=named,
)
@in_virtual_time
async def test_a_fault_amid_moves_and_stops_of_a_robot_is_survived(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with fics_rig() as it:
        assert (await it.move(HomeRobot())).status is MoveStatus.SUCCEEDED
        failed = fail_once(monkeypatch, place)
        moving = asyncio.gather(
            it.start(MoveRelative(coordinates=[90.0, None, None])), return_exceptions=True
        )
        asking = asyncio.gather(it.robot.ask(GetSystemVersion()), return_exceptions=True)
        await asyncio.sleep(0.7)
        stopping = asyncio.gather(it.robot.stop("decelerate"), return_exceptions=True)
        await asyncio.sleep(AGAIN_S)
        assert moving.done()
        assert asking.done()
        assert stopping.done()
        assert failed
        assert it.robot.known.motion.idle.is_set()
        assert (await it.move(MoveRelative(coordinates=[5.0, None, None]))).status is MoveStatus.SUCCEEDED
        assert (await it.robot.stop("immediate")).state == "confirmed"


@pytest.mark.parametrize("place", [(Stops, "_begin"), (_BodyStop, "submit"), (Stopping, "tell")], ids=named)
@in_virtual_time
async def test_a_fault_at_one_body_keeps_no_other_from_its_stop(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(groups={}) as it:
        bodies = it.plant.bodies()
        for body in bodies:
            await it.plant.moves.start(body, LONG)
        failed = fail_once(monkeypatch, place)
        reports = await it.plant.stops.stop(bodies, "immediate")
        assert failed
        assert [report.state for report in reports] == ["confirmed"] * len(bodies)
        assert not any(axis.motor.moving for axis in it.machine.axes.values())


@in_virtual_time
async def test_one_that_fails_again_and_again_keeps_no_other_from_its_stop(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def submit(stop: _BodyStop) -> None:
        if stop.body is first:
            raise ZeroDivisionError
        good(stop)

    async with rig(groups={}) as it:
        first, *others = it.plant.bodies()
        good = _BodyStop.submit
        monkeypatch.setattr(_BodyStop, "submit", submit)
        for body in others:
            await it.plant.moves.start(body, LONG)
        await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert not any(axis.motor.moving for axis in it.machine.axes.values())


@in_virtual_time
async def test_where_a_stop_is_not_confirmed_the_hardware_stop_is_called_for_all_the_same(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with rig(groups={}) as it:
        it.machine.switch_body(0x3F, on=False, now=asyncio.get_running_loop().time())
        failed = fail_once(monkeypatch, (_BodyStop, "has_had_no_turn"))
        await it.plant.stops.stop([it.body()], "immediate")
        await asyncio.sleep(1.0)
        assert failed
        assert "body.stop.unconfirmed" in it.types()


@in_virtual_time
async def test_a_move_of_a_group_that_nobody_follows_any_more_ends_once(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with rig(bodies=(0x00, 0x01), groups={"80": ("00", "01")}) as it:
        fail_once(monkeypatch, (BodyRun, "_finding"))
        begun = await it.plant.moves.start(it.plant.group("80"), SHORT)
        await asyncio.sleep(AGAIN_S)
        assert sorted(move.status for move in begun) == [MoveStatus.SUCCEEDED, MoveStatus.UNKNOWN]
        assert not it.plant.line("line1").followed
        await is_itself(it)


@in_virtual_time
async def test_a_move_that_a_fault_has_met_as_it_ended_is_over(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig(groups={}) as it:
        [move] = await it.plant.moves.start(it.body(), LONG)
        fail_once(monkeypatch, (move_proof, "calls_for_body"))
        it.machine.switch_body(0x3F, on=False, now=asyncio.get_running_loop().time())
        assert (await it.plant.moves.wait(move.id, 120.0)).status is MoveStatus.UNKNOWN
        assert it.body().move is None


@in_virtual_time
async def test_a_body_that_was_silent_is_found_again_after_a_fault(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig(groups={}) as it:
        it.machine.switch_body(0x3F, on=False, now=asyncio.get_running_loop().time())
        await asyncio.sleep(5.0)
        assert not it.body().online
        failed = fail_once(monkeypatch, (Line, "_probe_each"))
        await asyncio.sleep(5.0)
        it.machine.switch_body(0x3F, on=True, now=asyncio.get_running_loop().time())
        await asyncio.sleep(AGAIN_S)
        assert failed
        assert it.body().online


@in_virtual_time
async def test_what_waits_is_not_left_waiting_where_a_fault_meets_what_expires(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with rig(groups={}) as it:
        fail_once(monkeypatch, (Scheduler, "expire"))
        await it.body().ask(GetPosition())
        await asyncio.sleep(AGAIN_S)
        await is_itself(it)


@pytest.mark.parametrize(
    "place",
    [(RobotPower, "lost"), (SelectedUnit, "forget"), (Knowledge, "note_change")],
    ids=named,
)
@in_virtual_time
async def test_a_loss_of_power_is_known_in_spite_of_a_fault(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with fics_rig() as it:
        assert (await it.move(HomeRobot())).status is MoveStatus.SUCCEEDED
        failed = fail_once(monkeypatch, place)
        it.power_cycle()
        await asyncio.sleep(AGAIN_S)
        assert failed
        assert it.robot.power_cycled
        it.robot.known.power.acknowledge()
        assert (await it.move(HomeRobot())).status is MoveStatus.SUCCEEDED
        assert (await it.robot.stop("immediate")).state == "confirmed"


@pytest.mark.parametrize(
    "place",
    [
        (Rorze, "end_motion"),
        (Rorze, "at_rest"),
        (Rorze, "letting_go"),
        (Rorze, "_never_ends"),
        (Stops, "_begin"),
        (Stops, "_with_interpolation_partners"),
        (Fics, "end_motion"),
        (Fics, "letting_go"),
        (LineDriver, "revoke"),
        (Admission, "end"),
        (WindDown, "_end_motion"),
        (WindDown, "_name_what_moves"),
        (WindDown, "done"),
        (EventHub, "publish"),
    ],
    ids=named,
)
@in_virtual_time
async def test_what_would_never_end_is_stopped_at_the_end_in_spite_of_a_fault(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(groups={}) as it:
        for body in it.plant.bodies():
            await it.plant.moves.start(body, ENDLESS)
        failed = fail_once(monkeypatch, place)
        await it.plant.wind_down()
        assert failed
        assert not any(axis.motor.moving for axis in it.machine.axes.values())


@pytest.mark.parametrize(
    "place", [(Rorze, "_never_ends"), (Stops, "_with_interpolation_partners")], ids=named
)
@in_virtual_time
async def test_at_the_end_a_fault_that_lasts_leaves_nothing_going(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(groups={}) as it:
        for body in it.plant.bodies():
            await it.plant.moves.start(body, ENDLESS)
        fail_always(monkeypatch, place)
        await it.plant.wind_down()
        assert not any(axis.motor.moving for axis in it.machine.axes.values())


@pytest.mark.parametrize(
    "place",
    [
        (WindDown, "_wind_down"),
        (Stops, "close"),
        (Moves, "close"),
        (Leases, "close"),
        (Plant, "_unwatch"),
        (Fics, "closing"),
    ],
    ids=named,
)
@in_virtual_time
async def test_a_fault_amid_the_end_leaves_no_motor_going_and_no_line_open(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(groups={}) as it:
        for body in it.plant.bodies():
            await it.plant.moves.start(body, ENDLESS)
        failed = fail_once(monkeypatch, place)
        await it.plant.wind_down()
        await it.plant.close()
        assert failed
        assert not any(axis.motor.moving for axis in it.machine.axes.values())
        assert it.plant.line("line1").state == "down"


@in_virtual_time
async def test_a_trace_that_fails_for_good_keeps_no_line_from_its_work(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with rig(groups={}) as it:
        fail_always(monkeypatch, (Recorder, "record"))
        await is_itself(it)


@pytest.mark.parametrize(
    "place",
    [
        (BodyWatch, "_look"),
        (BodyWatch, "_pause_s"),
        (Health, "next_poll"),
        (Health, "turn"),
        (Body, "poll"),
        (Mark, "tend"),
        (Alarms, "note_ends"),
    ],
    ids=named,
)
@in_virtual_time
async def test_bodies_are_looked_after_in_spite_of_a_fault(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(groups={}) as it:
        failed = fail_once(monkeypatch, place)
        await asyncio.sleep(60.0)
        assert failed
        it.machine.switch_body(0x3F, on=False, now=asyncio.get_running_loop().time())
        await asyncio.sleep(8.0)
        assert not it.body().online
        it.machine.switch_body(0x3F, on=True, now=asyncio.get_running_loop().time())
        await asyncio.sleep(AGAIN_S)
        assert it.body().online
        assert it.body().power.cycled


@pytest.mark.parametrize(
    "place", [(Rorze, "was_left_alone"), (EventHub, "publish"), (Stops, "_begin")], ids=named
)
@in_virtual_time
async def test_what_jogs_after_a_suspension_is_stopped_in_spite_of_a_fault(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(groups={}) as it:
        await it.plant.rorze.jogs.start(it.body(), BodyJogRequest(direction="cw"))
        failed = fail_once(monkeypatch, place)
        it.plant.admission.watch.on_held(SUSPENDED_S + 1.0)
        await asyncio.sleep(0.3)  # less than its heartbeat allows
        assert failed
        assert not it.axis().motor.moving


@pytest.mark.parametrize(
    "place",
    [
        (Rorze, "end_motion"),
        (Leases, "_told"),
        (Leases, "_end"),
        (EventHub, "publish"),
        (Stops, "_begin"),
    ],
    ids=named,
)
@in_virtual_time
async def test_what_would_never_end_is_stopped_with_its_lease_in_spite_of_a_fault(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(groups={}) as it:
        it.plant.access.leases.clock = asyncio.get_running_loop().time
        part = Part(it.body().line.id, it.body().address)
        leases = it.plant.access.leases
        await it.plant.moves.start(it.body(), ENDLESS)
        await leases.take("3F", "/bodies/3F", [part], Holder("a", "a"), 2.0, over=False)
        failed = fail_once(monkeypatch, place)
        await asyncio.sleep(5.0)
        assert failed
        assert not it.axis().motor.moving


@pytest.mark.parametrize("what", ["renewal", "takeover"])
@pytest.mark.parametrize("name", ["_find", "_told", "_told_to_holder", "_end", "_wait", "_wake", "expire"])
@in_virtual_time
async def test_what_would_never_end_is_stopped_in_the_end_though_a_lease_meets_a_fault(
    what: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(groups={}) as it:
        it.plant.access.leases.clock = asyncio.get_running_loop().time
        part, leases = Part(it.body().line.id, it.body().address), it.plant.access.leases
        await it.plant.moves.start(it.body(), ENDLESS)
        held = await leases.take("3F", "/bodies/3F", [part], Holder("a", "a"), 2.0, over=False)
        fail_once(monkeypatch, (Leases, name))
        with suppress(ZeroDivisionError):
            if what == "renewal":
                leases.renew(held.lease, Claim((held.token,), (), "a"))
            else:
                await leases.take("3F", "/bodies/3F", [part], Holder("b", "b"), 2.0, over=True)
        await asyncio.sleep(6.0)
        assert not it.axis().motor.moving
        assert leases.all() == []
        await is_itself(it)


@pytest.mark.parametrize(
    "place",
    [
        (LineDriver, "retire"),
        (LineDriver, "close"),
        (LineDriver, "start"),
        (Plant, "_unwatch"),
        (Plant, "_build"),
        (Plant, "_open_port"),
        (Plant, "_start"),
        (Rorze, "removing"),
        (Rorze, "add"),
        (Rorze, "watches"),
        (Territory, "forget"),
        (EventHub, "publish"),
    ],
    ids=named,
)
@in_virtual_time
async def test_a_reload_that_meets_a_fault_leaves_every_line_at_work(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    lines = ("line1", "line2")
    async with rig(lines=lines, bodies=(0x00, 0x3F), groups={}) as it:
        table = configuration(lines, (0x00, 0x3F), {})
        other = parse(table.replace('id = "line2"', 'id = "line2"\nlate_reply_s = 1.5'), "other.toml")
        await it.plant.moves.start(it.body("line1.3F"), ENDLESS)
        failed = fail_once(monkeypatch, place)
        await it.plant.reload(other)
        await asyncio.sleep(5.0)
        assert failed
        assert it.machines["line1"].axes[0x3F].motor.moving
        assert it.plant.line("line2").late_reply_s == 1.5
        reports = await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert [report.state for report in reports] == ["confirmed"] * 4
        assert all(body.moving is False for body in it.plant.bodies())


@pytest.mark.parametrize("place", [(Rorze, "stop_all"), (Fics, "stop_all")], ids=named)
@in_virtual_time
async def test_a_fault_at_one_family_keeps_nobody_from_the_stop_of_all(
    place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(groups={}) as it:
        await it.plant.moves.start(it.body(), LONG)
        failed = fail_once(monkeypatch, place)
        stopped = await stop_all(it.plant, Origin("test"), "immediate")
        assert failed
        assert {report.state for report in stopped.reports["bodies"]} == {"confirmed"}
