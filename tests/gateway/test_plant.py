"""The plant: addresses, rules across bodies, and what it notices unasked."""

import asyncio
from pathlib import Path

import pytest

from gateway.config import parse
from gateway.core.errors import (
    Ambiguous,
    BodyBusy,
    ControllerRefused,
    GatewayError,
    InvalidRequest,
    NoReply,
    NotFound,
)
from gateway.core.move_record import Move
from gateway.core.sampler import Sampler
from gateway.rorze.config import UnitsTable
from gateway.rorze.errors import refused as refusal_of
from gateway.rorze.knowledge import MotorState
from gateway.rorze.probes import HEALTH_POLL_S
from protocols.rorze.flash import SaveSettings
from protocols.rorze.link_master import SetGroup
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.origin import GetHomingDistance
from protocols.rorze.programs import RunProgram, StepProgram
from protocols.rorze.row import RorzeCommand
from protocols.rorze.speeds import SetStartSpeed
from protocols.table import Ack
from simulator.faults import Direction
from simulator.rorze.line import build_line
from simulator.rorze.rc400 import LinkSettings
from simulator.rorze.world import EMS, Span
from tests.plants import SET_UP_S, Rig, Wire, configuration, in_virtual_time, lose, rig
from tests.tested_plant import TestedPlant

FAR = MoveClockwise(distance=50_000)


def now() -> float:
    """The time of the running loop."""
    return asyncio.get_running_loop().time()


async def up(rig: Rig) -> None:
    """Wait until the line has just been set up again."""
    await anext(rig.plant.events.subscribe(types=["line.up"]))


# addresses


@in_virtual_time
async def test_a_body_is_found_by_its_short_and_its_long_address_in_either_case() -> None:
    async with rig() as it:
        found = {it.plant.body(text) for text in ("3F", "3f", "line1.3F", "line1.3f", "LINE1.3f")}
        assert [body.address for body in found] == ["line1.3F"]
        assert it.plant.group("80") is it.plant.group("LINE1.80")


@in_virtual_time
async def test_a_body_on_two_lines_needs_its_long_address() -> None:
    async with rig(lines=("left", "right")) as it:
        for find in (it.plant.body, it.plant.group):
            with pytest.raises(Ambiguous, match=r"left\..., right\..."):
                find("3F" if find == it.plant.body else "80")
        with pytest.raises(Ambiguous) as ambiguous:
            it.plant.group("80")
        assert ambiguous.value.remedy == "Say which group is meant: left.80 or right.80."
        body = it.plant.body("right.3f")
        assert body.address == "right.3F"
        await body.ask(GetHomingDistance())
        assert "&3F0PD" in it.wires["right"].frames()
        assert "&3F0PD" not in it.wires["left"].frames()


@pytest.mark.parametrize(
    "address", ["40", "line1.40", "line2.3F", "", ".", "3F.", "3FF", "line1.", "Ｆ", "0"]
)
@in_virtual_time
async def test_what_is_not_there_is_not_found(address: str) -> None:
    async with rig() as it:
        with pytest.raises(NotFound, match="nothing was sent"):
            it.plant.body(address)


@in_virtual_time
async def test_a_line_is_found_by_its_id() -> None:
    async with rig() as it:
        assert it.plant.line("line1").id == "line1"
        with pytest.raises(NotFound, match="there is line1"):
            it.plant.line("line2")


# groups


@in_virtual_time
async def test_a_group_can_be_defined_and_moved_and_is_defined_again_after_a_restart() -> None:
    async with rig() as it:
        group = await it.plant.define_group("81", ["01", "3f"], "pair")
        assert (group.address, group.name) == ("line1.81", "pair")
        assert it.plant.group("81") is group
        moves = await it.plant.moves.start(group, FAR)
        for move in moves:
            assert (await it.plant.moves.wait(move.id, 10.0)).status == "succeeded"
        it.plant.line("line1").set_up_again("a test")
        await asyncio.sleep(1.0)
        assert [frame for frame in it.wire.frames() if frame.startswith("&7F")][-1] == "&7FXVS81,01,3F"


@pytest.mark.parametrize(
    ("address", "members"),
    [
        ("7F", ["00", "01"]),
        ("9F", ["00", "01"]),
        ("8", ["00", "01"]),
        ("+8", ["00", "01"]),
        ("81", ["00"]),
        ("81", ["00", "00"]),
    ],
)
@in_virtual_time
async def test_a_group_that_cannot_be_is_refused_before_anything_is_sent(
    address: str, members: list[str]
) -> None:
    async with rig() as it:
        sent = len(it.wire.sent)
        with pytest.raises(InvalidRequest, match="nothing was sent"):
            await it.plant.define_group(address, members)
        assert len(it.wire.sent) == sent


@in_virtual_time
async def test_a_group_spans_one_line_only() -> None:
    async with rig(lines=("left", "right")) as it:
        with pytest.raises(InvalidRequest, match="one line"):
            await it.plant.define_group("81", ["left.00", "right.01"])


@in_virtual_time
async def test_the_members_of_a_group_are_looked_for_on_its_line() -> None:
    async with rig(lines=("left", "right")) as it:
        group = await it.plant.define_group("right.81", ["00", "01"])
        assert [member.address for member in group.members] == ["right.00", "right.01"]


@in_virtual_time
async def test_a_group_is_not_changed_under_a_moving_member() -> None:
    async with rig() as it:
        [move] = await it.plant.moves.start(it.body("01"), FAR)
        with pytest.raises(BodyBusy, match=r"line1\.01 is moving"):
            await it.plant.define_group("80", ["00", "3F"])
        await it.plant.moves.wait(move.id, 10.0)


async def settled(rig: Rig, moves: list[Move]) -> None:
    """Wait for the ends of moves."""
    for move in moves:
        assert (await rig.plant.moves.wait(move.id, 60.0)).status.final


@in_virtual_time
async def test_while_a_group_is_defined_anew_nothing_but_a_stop_goes_to_its_number() -> None:
    async with rig(bodies=(0, 1, 2, 3), baud=9600) as it:
        await asyncio.sleep(2.0)
        old = it.plant.group("80")
        sent = len(it.wire.sent)
        defining = asyncio.create_task(it.plant.define_group("80", ["02", "03"]))
        await asyncio.sleep(0)
        with pytest.raises(BodyBusy, match=r"line1\.80 is being defined anew; nothing was sent"):
            await it.plant.moves.start(it.plant.group("80"), FAR)
        with pytest.raises(BodyBusy, match="defined anew"):
            await it.plant.group("80").ask(GetHomingDistance())
        it.plant.stops.stop(old.members, "immediate")
        new = await defining
        assert [body.short for body in new.members] == ["02", "03"]
        with pytest.raises(BodyBusy, match="defined anew"):
            await it.plant.moves.start(old, FAR)
        assert "&801+M50000" not in it.wire.frames(sent)
        assert "&805IS" in it.wire.frames(sent)
        moves = await it.plant.moves.start(new, FAR)
        assert [move.body_id for move in moves] == ["line1.02", "line1.03"]
        await settled(it, moves)
        assert {fact.body for fact in it.truth.of("pulses_start")} == {2, 3}


@in_virtual_time
async def test_what_waits_for_a_group_does_not_reach_the_members_of_its_next_definition() -> None:
    async with rig(bodies=(0, 1, 2, 3), baud=9600) as it:
        await asyncio.sleep(2.0)
        blocking = asyncio.create_task(it.body("00").ask(GetHomingDistance()))
        await asyncio.sleep(0)
        waiting = asyncio.create_task(it.plant.group("80").ask(SetStartSpeed(speed=700)))
        await asyncio.sleep(0)
        await it.plant.define_group("80", ["02", "03"])
        with pytest.raises(BodyBusy, match="defined anew"):
            await waiting
        await blocking
        assert not it.executed("OLS")


@in_virtual_time
async def test_a_definition_that_is_refused_leaves_the_old_group_in_force(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with rig(bodies=(0, 1, 2, 3)) as it:
        line = it.plant.line("line1")

        async def refused(_group: int, _members: list[int]) -> None:
            raise refusal_of("line1.7F", SetGroup(group="80", members=["02", "03"]), 0x50)

        with monkeypatch.context() as patch:
            patch.setattr(line, "define_group", refused)
            with pytest.raises(ControllerRefused):
                await it.plant.define_group("80", ["02", "03"])
        moves = await it.plant.moves.start(it.plant.group("80"), FAR)
        assert [move.body_id for move in moves] == ["line1.00", "line1.01"]
        await settled(it, moves)


@in_virtual_time
async def test_a_definition_whose_reply_is_lost_is_undone_before_the_group_moves() -> None:
    async with rig(bodies=(0, 1, 2, 3), baud=9600) as it:
        await asyncio.sleep(2.0)
        defining = asyncio.create_task(it.plant.define_group("80", ["02", "03"]))
        await it.wire.begun("&7FXVS80,02,03")
        lose(it, Direction.REPLIES)
        with pytest.raises(NoReply):
            await defining
        moves = await it.plant.moves.start(it.plant.group("80"), FAR)
        await settled(it, moves)
        assert {fact.body for fact in it.truth.of("pulses_start")} == {0, 1}
        frames = it.wire.frames()
        assert frames.index("&801+M50000") > frames.index("&7FXVS80,02,03") + 1
        assert "&7FXVS80,00,01" in frames[frames.index("&7FXVS80,02,03") : frames.index("&801+M50000")]


@in_virtual_time
async def test_a_body_that_obeys_a_group_it_is_no_member_of_is_looked_at_and_the_group_told_again() -> None:
    async with rig() as it:
        await asyncio.sleep(2.0)
        it.machine.receive(b"&7FXVS80,00,01,3F\r", now())
        it.machine.take_output(now())
        moves = await it.plant.moves.start(it.plant.group("80"), FAR)
        await asyncio.sleep(0.5)
        assert it.axis().motor.moving
        assert it.body().moving
        with pytest.raises(BodyBusy, match=r"line1\.3F"):
            await it.body("3F").ask(SaveSettings())
        [event] = it.events("group.strangers")
        assert (event.subject, event.data) == ("/groups/line1.80", {"bodies": ["line1.3F"]})
        assert [it.subject for it in it.events("body.motion.foreign")] == ["/bodies/line1.3F"]
        assert it.plant.line("line1").counters["strangers_in_groups"] == 1
        assert it.wire.frames().count("&7FXVS80,00,01") == 2
        await settled(it, moves)
        assert {move.status.value for move in moves} == {"succeeded"}


# rules


@in_virtual_time
async def test_flash_waits_for_the_whole_line_to_stand_still() -> None:
    async with rig() as it:
        [move] = await it.plant.moves.start(it.body("00"), FAR)
        with pytest.raises(BodyBusy, match=r"line1\.00 moves; FIS was not sent"):
            await it.body("3F").ask(SaveSettings())
        assert "&3FFIS" not in it.wire.frames()
        await it.plant.moves.wait(move.id, 10.0)
        began_at = now()
        await it.body("3F").ask(SaveSettings())
        assert now() - began_at == pytest.approx(1.5)


@in_virtual_time
async def test_flash_on_one_line_does_not_mind_a_move_on_another() -> None:
    async with rig(lines=("left", "right")) as it:
        [move] = await it.plant.moves.start(it.plant.body("left.00"), FAR)
        await it.plant.body("right.3F").ask(SaveSettings())
        await it.plant.moves.wait(move.id, 10.0)


@in_virtual_time
async def test_flash_waits_until_it_is_known_that_nothing_moves() -> None:
    async with rig() as it:
        it.wire.unplug()
        await asyncio.sleep(1.0)
        it.wire.plugged_in = True
        await up(it)
        with pytest.raises(BodyBusy, match=r"Whether .*line1\.3F moves is not known yet; FIS was not sent"):
            await it.body("00").ask(SaveSettings())
        await asyncio.sleep(0.5)
        await it.body("00").ask(SaveSettings())
        assert it.wire.frames().count("&00FIS") == 1


@in_virtual_time
async def test_a_body_that_is_not_there_does_not_keep_the_others_from_their_flash() -> None:
    async with rig(present=(0x00, 0x01)) as it:
        assert it.body().moving is None
        await it.body("00").ask(SaveSettings())
        assert "&00FIS" in it.wire.frames()


RUNS_FOR_LONG = "2+M900000"


def run_by_hand(rig: Rig, number: int = 0x3F) -> None:
    """Let another host start a motor."""
    rig.axis(number).execute(RUNS_FOR_LONG, now())
    rig.machine.look_after(number)
    rig.wire.turn()


async def refused_flash(rig: Rig) -> GatewayError:
    """Try to write the flash of another body than the one that may move."""
    with pytest.raises(BodyBusy) as refusal:
        await rig.body("00").ask(SaveSettings())
    return refusal.value


@in_virtual_time
async def test_a_refusal_does_not_make_flash_forget_a_motion_that_somebody_else_began() -> None:
    async with rig(settings=LinkSettings(error_codes=False)) as it:
        run_by_hand(it)
        await asyncio.sleep(HEALTH_POLL_S + 1.0)
        with pytest.raises(BodyBusy, match="by no move of this gateway"):
            await it.plant.moves.start(it.body(), FAR)
        await refused_flash(it)
        assert it.axis().motor.moving
        assert it.types("body.motion") == ["body.motion.foreign"]


@in_virtual_time
async def test_after_a_refusal_flash_waits_until_the_body_has_been_looked_at() -> None:
    async with rig(settings=LinkSettings(error_codes=False), baud=9600) as it:
        await asyncio.sleep(2.0)
        starting = asyncio.create_task(it.plant.moves.start(it.body(), FAR))
        await it.wire.begun("&3F1+M50000")
        it.axis().execute(RUNS_FOR_LONG, now())
        with pytest.raises(ControllerRefused):
            await starting
        assert "not known yet" in str(await refused_flash(it))
        await asyncio.sleep(0.5)
        assert "line1.3F moves" in str(await refused_flash(it))
        assert it.types("body.motion") == ["body.motion.foreign"]


@pytest.mark.parametrize("command", [RunProgram(), StepProgram()])
@in_virtual_time
async def test_after_a_program_was_started_flash_waits_until_the_body_has_been_looked_at(
    command: RorzeCommand[Ack], monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(baud=9600) as it:
        await asyncio.sleep(2.0)
        execute = it.axis().execute
        monkeypatch.setattr(
            it.axis(),
            "execute",
            lambda text, at: execute(RUNS_FOR_LONG if text.startswith(command.code) else text, at),
        )
        await it.body().ask(command)
        assert "not known yet" in str(await refused_flash(it))
        await asyncio.sleep(0.5)
        assert "line1.3F moves" in str(await refused_flash(it))
        assert "&00FIS" not in it.wire.frames()


# what it notices unasked


@in_virtual_time
async def test_an_error_bit_that_a_move_of_ours_sets_is_reported() -> None:
    async with rig() as it:
        it.touch(0x3F, lambda axis: setattr(axis.world, "cw_limit", Span(20_000, 21_000)))
        already = len(it.events())
        [move] = await it.plant.moves.start(it.body(), FAR)
        await it.plant.moves.wait(move.id, 60.0)
        assert move.end_cause == "cw_limit"
        changes = [event for event in it.events()[already:] if event.type == "body.status.changed"]
        assert [event.data for event in changes] == [{"status": ["limit_error"]}]


@in_virtual_time
async def test_that_a_move_of_ours_makes_pulses_run_is_no_change_of_status() -> None:
    async with rig() as it:
        already = len(it.events())
        [move] = await it.plant.moves.start(it.body(), FAR)
        await it.plant.moves.wait(move.id, 60.0)
        await asyncio.sleep(2 * HEALTH_POLL_S)
        assert "body.status.changed" not in [event.type for event in it.events()[already:]]


@in_virtual_time
async def test_a_motor_that_ran_before_the_gateway_is_known_to_run_as_soon_as_the_line_is_up() -> None:
    async with rig() as it:
        it.wire.unplug()
        assert [body.moving for body in it.plant.bodies()] == [None, None, None]
        it.axis().execute("1+MZ", now())
        it.wire.plugged_in = True
        await up(it)
        assert it.body().moving is None
        await asyncio.sleep(0.1)
        assert [body.moving for body in it.plant.bodies()] == [False, False, True]
        assert it.types("body.motion") == ["body.motion.foreign"]


@in_virtual_time
async def test_motion_that_nobody_here_asked_for_is_reported_once_and_forgets_the_position() -> None:
    async with rig() as it:
        await asyncio.sleep(HEALTH_POLL_S)
        assert it.body().told.rest == MotorState(0, 0)
        it.axis().execute("1+MZ", now())
        await asyncio.sleep(3 * HEALTH_POLL_S)
        assert it.types("body.motion") == ["body.motion.foreign"]
        assert it.body().moving
        with pytest.raises(BodyBusy):
            await it.body("00").ask(SaveSettings())
        it.axis().execute("5IS", now())
        await asyncio.sleep(HEALTH_POLL_S + 1.0)
        assert not it.body().moving
        assert it.body().told.rest == MotorState(0, it.axis().position(now()))


@in_virtual_time
async def test_a_change_of_status_is_reported_by_the_names_of_its_bits() -> None:
    async with rig() as it:
        await asyncio.sleep(HEALTH_POLL_S)
        it.touch(0x3F, lambda axis: axis.world.forced.update({EMS: True}))
        with pytest.raises(ControllerRefused):
            await it.plant.moves.start(it.body(), FAR)
        await asyncio.sleep(HEALTH_POLL_S)
        changes = [event for event in it.events("body.status.changed") if event.subject == "/bodies/line1.3F"]
        assert "command_error" in changes[-1].data["status"]


@in_virtual_time
async def test_a_body_that_loses_its_power_goes_offline_and_comes_back() -> None:
    async with rig() as it:
        it.machine.switch_body(0x3F, on=False, now=now())
        await asyncio.sleep(3 * HEALTH_POLL_S)
        assert not it.body().online
        assert it.body().moving is None
        assert it.body("00").online
        it.machine.switch_body(0x3F, on=True, now=now())
        await asyncio.sleep(3 * HEALTH_POLL_S)
        assert it.body().online
        assert [it.types("body.offline"), it.types("body.online")] == [["body.offline"], ["body.online"]]


@in_virtual_time
async def test_a_message_nobody_knows_is_published_with_its_text() -> None:
    async with rig() as it:
        it.machine.send_program_message(0x3F, "HELLO", now())
        it.wire.turn()
        await asyncio.sleep(0.1)
        [event] = it.events("line.message")
        assert event.data == {"frame": ">&7CUSD[3F:HELLO]"}


# the link master restarts


@in_virtual_time
async def test_a_link_master_that_restarts_while_all_is_quiet_is_set_up_again() -> None:
    async with rig() as it:
        await asyncio.sleep(2.0)
        it.machine.power_off(now())
        it.machine.power_on(now())
        sent = len(it.wire.sent)
        await asyncio.sleep(2 * HEALTH_POLL_S)
        frames = it.wire.frames(sent)
        assert [frame for frame in frames if frame.startswith("&7F")] == [
            "&7FXID",
            "&7FXRSM1",
            "&7FXVS80,00,01",
        ]
        moves = await it.plant.moves.start(it.plant.group("80"), FAR)
        for move in moves:
            assert (await it.plant.moves.wait(move.id, 10.0)).completion == "frame"


@in_virtual_time
async def test_a_move_runs_on_while_the_link_master_is_without_power() -> None:
    async with rig() as it:
        [move] = await it.plant.moves.start(it.body(), MoveClockwise(distance=500_000))
        await asyncio.sleep(1.0)
        it.machine.power_off(now())
        await asyncio.sleep(4.0)
        assert it.plant.line("line1").offline
        it.machine.power_on(now())
        await it.plant.moves.wait(move.id, 60.0)
        assert (move.status, move.position) == ("succeeded", 500_000)
        await asyncio.sleep(HEALTH_POLL_S)
        assert all(body.online for body in it.plant.bodies())
        assert it.wire.frames().count("&7FXRSM1") >= 2


@in_virtual_time
async def test_a_pulled_cable_is_reported_and_everything_is_set_up_when_it_is_back() -> None:
    async with rig() as it:
        it.wire.unplug()
        assert it.plant.line("line1").state == "down"
        await asyncio.sleep(10.0)
        it.wire.plugged_in = True
        sent = len(it.wire.sent)
        await asyncio.sleep(10.0)
        assert it.plant.line("line1").state == "ready"
        assert it.wire.frames(sent)[:4] == ["!" * 61, "&7FXID", "&7FXRSM1", "&7FXVS80,00,01"]
        assert it.types("line.")[-2:] == ["line.down", "line.up"]


# what it is made of


def tracing_plant(trace_file: Path, trace_entries: int) -> TestedPlant:
    """A plant that is not started, with a trace in a file."""
    options = f'trace_file = "{trace_file}"\ntrace_entries = {trace_entries}'
    config = parse(configuration(options=options), "test.toml")
    return TestedPlant(config, open_transport=lambda _: Wire(build_line((0x00, 0x01, 0x3F), 0.0)))


@in_virtual_time
async def test_a_trace_that_is_not_kept_in_memory_is_written_to_its_file_all_the_same(tmp_path: Path) -> None:
    plant = tracing_plant(tmp_path / "trace.jsonl", trace_entries=0)
    await plant.start()
    await asyncio.sleep(SET_UP_S)
    await plant.close()
    assert plant.history.recorders["line1"].entries() == []
    assert "&7FXID" in (tmp_path / "trace.jsonl").read_text()


@in_virtual_time
async def test_a_body_is_as_its_configuration_says() -> None:
    tables = 'bodies = [{id = "3F", position_tolerance = 3, units = {unit = "mm", pulses_per_unit = 100.0}}]'
    text = configuration(bodies=(), groups={}).replace("bodies = []", tables)
    plant = TestedPlant(parse(text, "test.toml"), open_transport=lambda _: Wire(build_line((0x3F,), 0.0)))
    [body] = plant.bodies()
    assert (body.configured.position_tolerance, body.scale) == (
        3,
        UnitsTable(unit="mm", pulses_per_unit=100.0),
    )


@in_virtual_time
async def test_only_a_body_that_was_asked_itself_is_suspected_of_having_lost_its_power() -> None:
    async with rig() as it:
        body, line = it.body(), it.plant.line("line1")
        line.on_change("body.offline", {"body": 0x3F, "asked": False})
        assert (body.moving, body.life.was_silent) == (None, False)
        line.on_change("body.offline", {"body": 0x3F, "asked": True})
        assert (body.moving, body.life.was_silent) == (None, True)
        assert [event.data for event in it.events("body.offline")] == [{"asked": False}, {"asked": True}]


@in_virtual_time
async def test_a_watch_that_fails_is_told_at_once_and_goes_on(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    begun = []

    async def broken(_: object) -> None:
        begun.append(asyncio.get_running_loop().time())
        raise ZeroDivisionError

    monkeypatch.setattr(Sampler, "run", broken)
    async with rig():
        told = "a watch of line line1 has met a fault of the gateway itself, and goes on in 0.5 s"
        assert told in caplog.text
        await asyncio.sleep(5.0)
    assert len(begun) > 3
