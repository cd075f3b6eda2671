"""Alarms of a whole plant: what goes wrong raises them, and who has seen to it resets them."""

import asyncio
import re
from datetime import UTC, datetime
from pathlib import Path
from typing import Final

import pytest

from gateway.causes import causes_of
from gateway.config import parse
from gateway.core.alarms import Alarm, AlarmLasts, Latched
from gateway.core.backup_record import Restore
from gateway.core.errors import ControllerRefused
from gateway.core.exchange import Lane
from gateway.core.journal.disk import NotWritable
from gateway.core.move_record import MoveStatus
from gateway.core.origin import Origin
from gateway.core.rights import RIGHT_OF, Right
from gateway.door.alarms import listed
from gateway.door.doing import do
from gateway.event_types import EVENT_TYPES
from gateway.plant import Plant
from gateway.security.entries import SIGN_IN_REFUSED
from protocols.fics.alarms import ResetErrors
from protocols.rorze.encoder import ClearEncoderStallError
from protocols.rorze.inputs_outputs import ClearErrorOutputStatus
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from protocols.rorze.stall_sensor import ClearStallSensorError
from protocols.rorze.status import ClearControllerStatus, SetUserComment
from simulator.fics.alarms import system_error
from simulator.rorze.line import build_line
from simulator.rorze.world import EMS
from tests.fics_plants import fics_rig
from tests.plants import SET_UP_S, Rig, Wire, configuration, finished, in_virtual_time, rig, start
from tests.tested_plant import TestedPlant
from tests.through_the_door import reset
from tests.world import World
from transports.base import Receiver, TransportLost

OPERATOR: Final = Origin("operator")

SEEN_S = 40.0
"""Seconds after which a body that does not answer is known to be silent."""


def standing(plant: Plant) -> dict[str, Alarm]:
    return {alarm.cause: alarm for alarm in plant.alarms.standing()}


def brown_out(it: Rig, for_s: float = 0.05) -> None:
    it.machine.brown_out(0x3F, for_s, asyncio.get_running_loop().time())
    it.wire.turn()


def press(it: Rig, *, on: bool) -> None:
    it.touch(0x3F, lambda axis: axis.world.forced.update({EMS: on}))


@in_virtual_time
async def test_a_plant_at_peace_has_none() -> None:
    async with rig() as it:
        move = await finished(it, MoveClockwise(distance=500))
        assert move.status is MoveStatus.SUCCEEDED
        await asyncio.sleep(SEEN_S)
        assert standing(it.plant) == {}


@in_virtual_time
async def test_a_move_into_the_ems_input_raises_the_bit_and_the_failed_move() -> None:
    async with rig() as it:
        moving = asyncio.create_task(finished(it, MoveClockwise(distance=50_000)))
        await asyncio.sleep(0.3)
        press(it, on=True)
        move = await moving
        await it.body().poll(Lane.READ)
        alarms = standing(it.plant)
        assert alarms.keys() == {"body.ems_error", "body.move.failed"}
        failed = alarms["body.move.failed"]
        assert failed.move_id == move.id
        assert "A move of line1.3F did not end as it should: EMS input." in failed.en.happened
        assert failed.ja.happened == "line1.3Fの移動は正常に終了しませんでした(EMS入力)。"
        assert f"/bodies/line1.3F/moves/{move.id}" in [call.path for call in failed.next]
        assert "EMS" in alarms["body.ems_error"].ja.happened
        with pytest.raises(AlarmLasts):
            it.plant.alarms.reset(alarms["body.ems_error"].id)
        it.plant.alarms.reset(failed.id)
        assert standing(it.plant).keys() == {"body.ems_error"}
        press(it, on=False)
        await do(it.plant, OPERATOR, "/bodies/3F", ClearControllerStatus())
        await it.body().poll(Lane.READ)
        await do_reset(it.plant)
        assert standing(it.plant) == {}


async def do_reset(plant: Plant) -> None:
    for alarm in plant.alarms.standing():
        assert (await reset(plant, OPERATOR, alarm.id)).reset_by == "operator"


@in_virtual_time
async def test_a_body_that_loses_its_power_raises_an_alarm_that_lasts_until_that_is_acknowledged() -> None:
    async with rig() as it:
        brown_out(it)
        await asyncio.sleep(SEEN_S)
        alarm = standing(it.plant)["body.power_cycled"]
        assert [call.path for call in alarm.next][-1] == "/bodies/line1.3F/power-cycle/acknowledge"
        with pytest.raises(AlarmLasts):
            await reset(it.plant, OPERATOR, alarm.id)
        await it.body().acknowledge_power_cycle()
        await do_reset(it.plant)
        assert standing(it.plant) == {}


@in_virtual_time
async def test_an_alarm_whose_cause_is_over_is_told_in_the_past() -> None:
    async with rig() as it:
        it.machine.axes[0x3F].powered = False
        await asyncio.sleep(SEEN_S)
        silent = standing(it.plant)["body.offline"]
        assert (silent.ended_at, silent.en.happened) == (None, "line1.3F does not answer any more.")
        it.machine.axes[0x3F].powered = True
        await asyncio.sleep(SEEN_S)
        over = standing(it.plant)["body.offline"]
        assert over.ended_at is not None
        assert over.en.happened == "line1.3F did not answer for a while; it answers again."
        assert "応答が復旧しました" in over.ja.happened


@pytest.mark.parametrize(
    ("certain", "en", "ja"),
    [
        (True, "line1.3F has lost its power: its mark is gone.", "line1.3Fの電源が切れました。"),
        (False, "line1.3F seems to have lost its power: its", "line1.3Fの電源が切れた可能性があります。"),
    ],
)
def test_a_loss_of_power_is_told_as_certain_or_as_likely_and_never_as_both(
    certain: bool, en: str, ja: str
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig() as it:
            it.body().power.lost(certain=certain)
            lost = standing(it.plant)["body.power_cycled"]
            assert lost.en.happened.startswith(en)
            assert lost.ja.happened == ja
            assert lost.en.motor.startswith("The motor" if certain else "If so, the motor")

    story()


@in_virtual_time
async def test_a_loss_of_power_that_nobody_has_to_acknowledge_is_not_told_as_acknowledged() -> None:
    async with rig(body_options="needs_origin = false") as it:
        it.body().power.lost(certain=True)
        over = standing(it.plant)["body.power_cycled"]
        assert over.ended_at is not None
        assert "or its configuration asks for neither (needs_origin)" in over.en.happened
        assert "home it before it goes to a place" in over.en.remedy


@in_virtual_time
async def test_a_burst_of_refusals_without_an_address_is_an_alarm_too() -> None:
    async with rig() as it:
        for _ in range(it.plant.access.security.keeping.refusals_per_minute + 1):
            it.plant.access.security.note(SIGN_IN_REFUSED, "/sign-in", why="The key is not good.")
        burst = standing(it.plant)["gateway.refusals.burst"]
        assert burst.en.happened.endswith(" s, the last from an unknown address.")
        assert "（最後は不明なアドレスから）" in burst.ja.happened
        assert burst.when_over is not None
        assert "from an unknown address; that is over" in burst.when_over.en.happened


@in_virtual_time
async def test_a_failed_move_is_listed_as_part_of_its_cause() -> None:
    async with rig() as it:
        moving = asyncio.create_task(finished(it, MoveClockwise(distance=50_000)))
        await asyncio.sleep(0.3)
        press(it, on=True)
        await moving
        await it.body().poll(Lane.READ)
        parts = {alarm.cause: alarm.part_of for alarm in listed(it.plant)}
        ems = standing(it.plant)["body.ems_error"]
        assert parts == {"body.ems_error": None, "body.move.failed": ems.id}


@in_virtual_time
async def test_a_body_that_is_not_there_and_a_line_that_is_cut() -> None:
    async with rig(present=(0x00, 0x01)) as it:
        await asyncio.sleep(SEEN_S)
        assert standing(it.plant).keys() == {"body.offline"}
        it.plant.line("line1").connection_lost(TransportLost("pulled out"))
        await asyncio.sleep(0)
        down = standing(it.plant)["line.down"]
        assert "pulled out" in down.en.happened
        assert "pulled out" in down.ja.happened
        await asyncio.sleep(SEEN_S)
        await reset(it.plant, OPERATOR, down.id)
        assert standing(it.plant).keys() == {"body.offline"}


class Absent(Wire):
    """A port that is not there."""

    async def open(self, receiver: Receiver) -> None:  # noqa: ARG002
        raise TransportLost("no such port")


@in_virtual_time
async def test_a_line_that_never_was_up_is_alarmed_once() -> None:
    wire = Absent(build_line([0x3F], 0.0))
    plant = TestedPlant(parse(configuration(), "test.toml"), open_transport=lambda _: wire)
    await plant.start()
    await asyncio.sleep(SEEN_S)
    assert standing(plant).keys() == {"line.down"}
    assert plant.events.last == 1
    await plant.close()
    assert standing(plant).keys() == {"line.down"}, "an orderly end raises nothing"


@in_virtual_time
async def test_what_the_latch_holds_does_not_move_before_the_reset() -> None:
    command = MoveClockwise(distance=500)
    async with rig(server="latch = true") as it:
        brown_out(it)
        await asyncio.sleep(SEEN_S)
        await it.body().acknowledge_power_cycle()
        with pytest.raises(Latched, match=r"body\.power_cycled at /bodies/line1\.3F"):
            await do(it.plant, OPERATOR, "/bodies/3F", command)
        await do(it.plant, OPERATOR, "/bodies/00", command)
        await do_reset(it.plant)
        await do(it.plant, OPERATOR, "/bodies/3F", command)


@in_virtual_time
async def test_without_the_latch_an_alarm_keeps_nothing_from_moving() -> None:
    async with rig() as it:
        brown_out(it)
        await asyncio.sleep(SEEN_S)
        await do(it.plant, OPERATOR, "/bodies/3F", MoveClockwise(distance=500))


@in_virtual_time
async def test_a_member_holds_its_group() -> None:
    async with rig(server="latch = true", bodies=(0x00, 0x3F), groups={"80": ("00", "3F")}) as it:
        brown_out(it)
        await asyncio.sleep(SEEN_S)
        with pytest.raises(Latched):
            await do(it.plant, OPERATOR, "/groups/80", MoveClockwise(distance=500))


@in_virtual_time
async def test_alarms_stand_over_restarts_and_a_crash_is_one(tmp_path: Path) -> None:
    world = World(tmp_path / "data")
    async with world.gateway() as plant:
        await asyncio.sleep(SET_UP_S)
        world.wire.machine.axes[0x00].powered = False  # type: ignore[union-attr]
        await asyncio.sleep(SEEN_S)
        [before] = plant.alarms.standing()
        world.crash()
    async with world.gateway() as plant:
        alarms = standing(plant)
        assert alarms.keys() == {"body.offline", "gateway.crashed"}
        assert alarms["body.offline"].id == before.id
        world.wire.machine.axes[0x00].powered = True  # type: ignore[union-attr]
        await asyncio.sleep(SEEN_S)
        await do_reset(plant)
    async with world.gateway() as plant:
        assert [it.reset_by for it in plant.alarms.history()][:2] == ["operator", "operator"]


@in_virtual_time
async def test_a_crash_is_told_with_the_motors_that_moved_and_a_time_that_people_read(tmp_path: Path) -> None:
    world = World(tmp_path / "data")
    async with world.gateway() as plant:
        await asyncio.sleep(SET_UP_S)
        [move] = await plant.moves.start(plant.body("3F"), MoveClockwise(distance=50_000))
        world.crash()
    async with world.gateway() as plant:
        crash = standing(plant)["gateway.crashed"]
        assert f"Moves under way: line1.3F ({move.id}). Commands under way: -." in crash.en.happened
        assert f"実行中の移動: line1.3F ({move.id})" in crash.ja.happened
        for text in (crash.en, crash.ja):
            assert re.search(r"\d{4}-\d\d-\d\d \d\d:\d\d:\d\d UTC", text.happened)
        assert "motors" in crash.en.remedy


@in_virtual_time
async def test_trouble_with_the_journal_is_an_alarm_that_is_written_when_it_can_be(tmp_path: Path) -> None:
    world = World(tmp_path / "data")
    async with world.gateway() as plant:
        journal = plant.journal
        assert journal is not None
        journal._settle([], NotWritable("the disk is full"))
        assert "the disk is full" in standing(plant)["gateway.journal.trouble"].ja.happened
        with pytest.raises(AlarmLasts):
            await do_reset(plant)
        journal._settle([], None)
        await do_reset(plant)
    async with world.gateway() as plant:
        assert [it.cause for it in plant.alarms.history()] == ["gateway.journal.trouble"]


def test_an_error_of_a_robot_stands_until_it_is_reset() -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig() as it:
            it.touch(lambda fics, now: fics.raise_alarm(system_error(183, 12, 34), now))
            await it.robot.conversation.poll_error()
            alarm = standing(it.plant)["robot.error"]
            assert alarm.code == "183"
            assert [call.path for call in alarm.next] == ["/robots/r1/errors", "/robots/r1/errors/reset"]
            with pytest.raises(AlarmLasts):
                await reset(it.plant, OPERATOR, alarm.id)
            await it.robot.conversation.reset_errors()
            await do_reset(it.plant)
            assert standing(it.plant) == {}

    story()


def test_every_cause_is_worded_in_both_languages_of_what_its_event_tells() -> None:
    plant = TestedPlant(
        parse(configuration(), "test.toml"), open_transport=lambda _: Wire(build_line([], 0.0))
    )
    for cause in causes_of(plant.packages.families.values(), {}, {}, latch=False):
        assert cause.event in EVENT_TYPES
        for text in (cause.words.en, cause.words.ja):
            assert all(part.strip() for part in text.model_dump().values())
        assert cause.words.ja.happened != cause.words.en.happened
        assert all(call.path.startswith(("/", "{subject}")) for call in cause.next)


NEEDS_NOBODY: Final = {
    "line": {"up", "owned", "strict", "message", "scan.running", "scan.finished", "scan.failed"},
    "gateway": {
        *("journal.recovered", "security.recovered", "shutting_down", "reloaded", "key.made", "key.revoked"),
        *("scan.finished", "scan.failed", "key.approved", "key.rotated", "key.expired"),
        *("recording.finished", "recording.failed"),
    },
    "stream": {"gap", "snapshot"},
    "plant": {"reached"},
    "alarm": {"raised", "reset"},
    "io": {""},
    "body": {
        *("online", "unreadable", "power_cycle.acknowledged", "controller_event", "sensor.changed"),
        *("input.changed", "program.message", "program.started", "program.ended", "end_frame", "position"),
        *("settings.changed", "left_moving"),
    },
    "robot": {
        *("online", "unreadable", "stop.refused", "errors.reset", "speeds.restored", "unit.changed"),
        *("power_cycle.acknowledged", "position", "left_moving", "input.changed"),
        *("status.changed", "sensor.changed"),
    },
}
"""Events without an alarm: good news, settled matters, answers to a caller, and matters of another alarm."""
ENDS_WELL: Final = {
    "move": {"queued", "sent", "started", "succeeded", "stopped", "rejected", "cancelled"},
    "stop": {"requested", "confirmed"},
    "jog": {"started", "stopping", "ended", "lost", "stopped"},
    "lease": {"taken", "released", "expired", "taken_over", "broken"},
    "backup": {"started", "progress", "succeeded", "failed", "cancelled"},
    "comparison": {"started", "progress", "succeeded", "failed", "cancelled"},
    "position_reading": {"started", "progress", "succeeded", "failed", "cancelled"},
    "position_upload": {"started", "progress", "succeeded", "cancelled"},
    "restore": {"started", "progress", "verified", "cancelled"},
    "upload": {"started", "progress", "succeeded", "cancelled"},
}


def needs_nobody(event: str) -> bool:
    what, _, happened = event.partition(".")
    kind, _, news = event.rpartition(".")
    of_axes = event.startswith("scara.move.")  # the moves of its bodies raise alarms
    return of_axes or happened in NEEDS_NOBODY.get(what, ()) or news in ENDS_WELL.get(kind.split(".")[-1], ())


def test_every_type_of_event_raises_an_alarm_or_needs_nobody() -> None:
    plant = TestedPlant(
        parse(configuration(), "test.toml"), open_transport=lambda _: Wire(build_line([], 0.0))
    )
    alarming = {cause.event for cause in causes_of(plant.packages.families.values(), {}, {}, latch=False)}
    quiet = {event for event in EVENT_TYPES if needs_nobody(event)}
    assert alarming | quiet == EVENT_TYPES.keys()
    assert alarming & quiet == set()


@in_virtual_time
async def test_bodies_that_obey_a_group_they_do_not_belong_to_are_an_alarm_of_that_group() -> None:
    async with rig() as it:
        now = asyncio.get_running_loop().time()
        it.machine.receive(b"&7FXVS80,00,01,3F\r", now)  # as another host tells it
        it.machine.take_output(now)
        await do(it.plant, OPERATOR, "/groups/80", GetPosition())
        alarm = standing(it.plant)["group.strangers"]
        assert (alarm.subject, alarm.ended_at is None) == ("/groups/line1.80", False)
        assert "line1.3F obeyed a command to group line1.80" in alarm.en.happened
        assert [call.path for call in alarm.next] == ["/groups/line1.80", "/lines/line1"]
        await do_reset(it.plant)


@in_virtual_time
async def test_a_comment_that_is_taken_is_an_alarm_until_it_is_free() -> None:
    async with rig() as it:
        await it.body().ask(SetUserComment(comment_number=7, text="SPARE AXIS"))
        await asyncio.sleep(SEEN_S)
        alarm = standing(it.plant)["body.power_mark.missing"]
        assert "holds 'SPARE AXIS'" in alarm.en.happened
        with pytest.raises(AlarmLasts):
            await do_reset(it.plant)
        await it.body().ask(SetUserComment(comment_number=7, text=""))
        await do_reset(it.plant)


@pytest.mark.parametrize("status", ["failed", "differs"])
def test_a_restore_that_did_not_end_well_names_its_record(status: str) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig() as it:
            restore = Restore(
                id="r1",
                target="/bodies/line1.3F",
                controllers=["line1.3F"],
                flash=False,
                power_cycle=False,
                started_at=datetime.now(UTC),
            )
            it.plant.events.publish(f"body.restore.{status}", restore.target, restore, restore.id)
            alarm = standing(it.plant)[f"body.restore.{status}"]
            assert [call.path for call in alarm.next] == ["/bodies/line1.3F/restores/r1"]
            await do_reset(it.plant)

    story()


@pytest.mark.parametrize(("cancelled", "alarmed"), [(True, True), (False, False)])
def test_a_gateway_that_was_held_up_is_an_alarm_where_that_has_cancelled_something(
    cancelled: bool, alarmed: bool
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig() as it:
            it.plant.events.publish("gateway.loop.held", "/gateway", {"seconds": 3.2, "cancelled": cancelled})
            assert ("gateway.held_up" in standing(it.plant)) is alarmed
            if alarmed:
                alarm = standing(it.plant)["gateway.held_up"]
                assert ("3.2 s" in alarm.en.happened, "3.2秒" in alarm.ja.happened) == (True, True)
                await do_reset(it.plant)

    story()


@in_virtual_time
async def test_a_file_that_was_not_taken_is_an_alarm_with_its_reason() -> None:
    async with rig() as it:
        it.plant.events.publish("gateway.reload_failed", "/gateway", {"reason": "line 2: unknown key."})
        alarm = standing(it.plant)["gateway.reload_failed"]
        for text in (alarm.en, alarm.ja):
            assert "line 2: unknown key." in text.happened
        assert [call.path for call in alarm.next] == ["/system/reload"]
        await do_reset(it.plant)


JOG: Final = {
    "id": "j1",
    "state": "stopping",
    "ends_as": "lost",
    "heartbeat_within_ms": 500,
    "unit": 1,
    "axis": "X",
    "direction": "+",
}


@pytest.mark.parametrize(
    ("event", "subject", "data", "told"),
    [
        ("robot.jog.not_stopped", "/robots/r1", JOG, ["r1", "1", "X"]),
        (
            "robot.move.overdue",
            "/robots/r1/units/1",
            {"move_id": "m1", "longest_s": 2.0, "request_id": None},
            ["r1", "m1"],
        ),
    ],
)
def test_a_robot_that_may_move_on_is_an_alarm_whose_next_calls_look_and_stop(
    event: str, subject: str, data: dict[str, object], told: list[str]
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig() as it:
            it.plant.events.publish(event, subject, data)
            alarm = standing(it.plant)[event]
            for text in (alarm.en, alarm.ja):
                assert all(fact in text.happened for fact in told)
            assert [(call.method, call.path) for call in alarm.next] == [
                ("GET", "/robots/r1"),
                ("POST", "/robots/r1/stop"),
            ]
            await do_reset(it.plant)

    story()


def test_an_operator_may_clear_what_an_operator_may_cause() -> None:
    for row in (
        ClearControllerStatus,
        ClearStallSensorError,
        ClearEncoderStallError,
        ClearErrorOutputStatus,
        ResetErrors,
    ):
        assert RIGHT_OF[row.effect] is Right.OPERATE, row.code


@in_virtual_time
async def test_the_alarm_of_ems_says_when_the_motor_takes_moves_again() -> None:
    async with rig() as it:
        it.touch(0x3F, lambda axis: axis.world.forced.update({EMS: True}))
        it.axis().status |= 0x04
        await it.body().poll()
        said = standing(it.plant)["body.ems_error"].en.motor
        assert "once it is off it takes them, cleared or not" in said
        with pytest.raises(ControllerRefused):
            await start(it, MoveClockwise(distance=5))
        it.touch(0x3F, lambda axis: axis.world.forced.pop(EMS))
        assert it.axis().status & 0x04
        assert (await finished(it, MoveClockwise(distance=5))).status is MoveStatus.SUCCEEDED
