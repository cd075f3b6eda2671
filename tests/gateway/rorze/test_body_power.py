"""A body that loses its power: it goes nowhere before that is acknowledged; nothing wrong is called right."""

import asyncio
import re
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import asynccontextmanager

import pytest

from gateway.core.errors import BodyBusy, PowerCycled
from gateway.core.exchange import Lane
from gateway.core.move_record import MoveStatus
from gateway.rorze.power import PROOF_HOLDS_S
from gateway.rorze.probes import MARK_POLL_S
from protocols.rorze.flash import SaveSettings
from protocols.rorze.interpolation import StartInterpolation
from protocols.rorze.modes import GetSoftLimits, SetSoftLimits
from protocols.rorze.moves import MoveClockwise, MoveTo, MoveToSlowly
from protocols.rorze.notation import PositionReference
from protocols.rorze.origin import Home
from protocols.rorze.position import GetPosition, SetPosition
from protocols.rorze.position_table import SetPositionEntry
from protocols.rorze.programs import RunProgram
from protocols.rorze.row import RorzeCommand
from protocols.rorze.status import ClearControllerStatus, GetInformation, SetUserComment
from protocols.table import Ack
from simulator.faults import Direction
from simulator.rorze.controller import Response
from simulator.rorze.world import EMS
from tests.gateway.rorze.full_line import FULL
from tests.plants import Rig, ended, finished, in_virtual_time, lose, rig, start

TO_500, TO_700 = MoveTo(position=500), MoveTo(position=700)
ENTRY = PositionReference(position=5)
WITHOUT_MARK = "power_comment = 0"
BROWN_OUT_S = 0.05
NOTICED_S = 6.0
"""Seconds after which a loss of power at rest has shown in the health poll."""


def now() -> float:
    return asyncio.get_running_loop().time()


def brown_out(rig: Rig, number: int = 0x3F, for_s: float = BROWN_OUT_S) -> None:
    """Take the power of a body away for a moment."""
    rig.machine.brown_out(number, for_s, now())
    rig.wire.turn()


def place(rig: Rig, number: int = 0x3F) -> int:
    """Where the shaft really stands, from where it was built."""
    return rig.axis(number).motor.pulses(now())


def news(rig: Rig) -> list[tuple[str, object]]:
    """The events of its power."""
    return [
        (event.type, event.data.get("certain", event.data.get("by"))) for event in rig.events("body.power_c")
    ]


CUT = ("body.power_cycled", True)
PERHAPS = ("body.power_cycled", False)


# at rest


@pytest.mark.parametrize("mark", ["", WITHOUT_MARK])
@in_virtual_time
async def test_after_a_loss_of_power_at_rest_an_absolute_move_is_refused(mark: str) -> None:
    async with rig(body_options=mark) as it:
        await finished(it, TO_500)
        brown_out(it)
        await asyncio.sleep(BROWN_OUT_S)
        with pytest.raises(PowerCycled, match="1AM was not sent"):
            await start(it, TO_700)
        assert (place(it), len(it.executed("1AM"))) == (500, 1)
        assert news(it) == [PERHAPS if mark else CUT]
        assert (it.body().power.homed, it.body().power.cycled) == ("no", True)


@pytest.mark.parametrize("mark", ["", WITHOUT_MARK])
@in_virtual_time
async def test_a_loss_of_power_at_rest_is_noticed_without_a_move(mark: str) -> None:
    async with rig(body_options=mark) as it:
        await finished(it, TO_500)
        brown_out(it)
        await asyncio.sleep(NOTICED_S)
        assert news(it) == [PERHAPS if mark else CUT]
        refused = len(it.plant.moves.log.of(it.body().address))
        with pytest.raises(PowerCycled):
            await start(it, TO_700)
        assert len(it.plant.moves.log.of(it.body().address)) == refused, (
            "what is refused at once leaves no record"
        )


@in_virtual_time
async def test_reading_a_position_that_fell_to_0_makes_the_gateway_look() -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        await finished(it, TO_500)
        brown_out(it)
        await asyncio.sleep(0.1)
        await it.body().ask(GetPosition())
        await asyncio.sleep(0.1)
        assert news(it) == [PERHAPS]


async def cut_off(it: Rig, number: int) -> None:
    """Lose the line and the power of a body, both for a moment."""
    it.wire.unplug()
    brown_out(it, number)
    await asyncio.sleep(BROWN_OUT_S)
    it.wire.plugged_in = True
    while it.plant.line("line1").state != "ready":  # noqa: ASYNC110  # no event
        await asyncio.sleep(0.01)


async def browned_out(it: Rig, number: int) -> None:
    """Lose the power of a body for a moment."""
    brown_out(it, number)
    await asyncio.sleep(BROWN_OUT_S)


@asynccontextmanager
async def unmarked() -> AsyncIterator[Rig]:
    """A full line that has just begun: it takes long until all its bodies have their marks."""
    async with rig(bodies=FULL, groups={}, baud=9600, beginning=True) as it:
        await finished(it, MoveClockwise(distance=500), "77")
        assert it.body("77").power.mark.text is None
        yield it


@pytest.mark.parametrize("lose_power", [cut_off, browned_out])
@pytest.mark.parametrize("mark_first", [False, True])
@in_virtual_time
async def test_a_mark_that_is_written_after_a_loss_of_power_does_not_hide_it(
    lose_power: Callable[[Rig, int], Awaitable[None]], mark_first: bool
) -> None:
    async with unmarked() as it:
        await lose_power(it, 0x77)
        if mark_first:
            await it.body("77").mark.tend(Lane.VERIFY)
        with pytest.raises(PowerCycled, match="1AM was not sent"):
            await start(it, TO_700, "77")
        assert it.executed("1AM") == []


@in_virtual_time
async def test_a_program_is_not_run_after_a_loss_of_power_that_nobody_has_noticed() -> None:
    async with unmarked() as it:
        await browned_out(it, 0x77)
        with pytest.raises(PowerCycled, match="URG was not sent"):
            await it.plant.rorze.runs.start(it.body("77"), RunProgram(label="A"))
    async with rig() as it:
        brown_out(it)
        await asyncio.sleep(BROWN_OUT_S)
        with pytest.raises(PowerCycled, match="URG was not sent"):
            await it.plant.rorze.runs.start(it.body(), RunProgram(label="A"))
        assert it.executed("URG") == []


@in_virtual_time
async def test_a_body_that_moved_when_the_line_was_lost_and_is_back_at_0_may_have_lost_its_power() -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        await start(it, MoveClockwise(distance=50_000))
        await asyncio.sleep(0.3)
        await cut_off(it, 0x3F)
        await asyncio.sleep(NOTICED_S)
        assert news(it) == [PERHAPS]


@in_virtual_time
async def test_where_position_0_proves_nothing_the_mark_does() -> None:
    async with rig() as it:
        assert place(it) == 0
        brown_out(it)
        await asyncio.sleep(MARK_POLL_S + 1.0)
        assert news(it) == [CUT]


@pytest.mark.parametrize("keeps_position", [False, True])
@in_virtual_time
async def test_the_mark_tells_on_boards_that_keep_their_position_too(keeps_position: bool) -> None:
    async with rig() as it:
        it.axis().keeps_position = keeps_position
        await finished(it, TO_500)
        brown_out(it)
        await asyncio.sleep(BROWN_OUT_S)
        with pytest.raises(PowerCycled):
            await start(it, TO_700)
        assert news(it) == [CUT]


@in_virtual_time
async def test_an_error_bit_that_falls_unasked_is_a_sign_of_a_loss_of_power() -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        it.touch(0x3F, lambda axis: axis.world.forced.update({EMS: True}))
        it.axis().status |= 0x04
        await asyncio.sleep(NOTICED_S)
        it.touch(0x3F, lambda axis: axis.world.forced.pop(EMS))
        brown_out(it)
        await asyncio.sleep(NOTICED_S)
        assert news(it) == [PERHAPS]


@in_virtual_time
async def test_an_error_bit_that_a_command_of_ours_cleared_is_no_sign() -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        it.axis().status |= 0x04
        await asyncio.sleep(NOTICED_S)
        await it.body().ask(ClearControllerStatus())
        await asyncio.sleep(NOTICED_S)
        assert news(it) == []


@in_virtual_time
async def test_motion_by_another_host_is_not_taken_for_a_loss_of_power() -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        await finished(it, TO_500)
        it.axis().execute("1+M200", now())
        it.machine.look_after(0x3F)
        it.wire.turn()
        await asyncio.sleep(NOTICED_S)
        assert it.body().told.position == 700
        assert news(it) == []
        assert (await finished(it, TO_500)).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_a_body_that_was_silent_and_is_back_at_0_seems_to_have_lost_its_power() -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        await finished(it, TO_500)
        brown_out(it, for_s=5.0)
        await asyncio.sleep(15.0)
        assert it.body().online
        assert news(it) == [PERHAPS]


@in_virtual_time
async def test_a_body_that_was_silent_and_kept_its_mark_has_kept_its_power() -> None:
    async with rig() as it:
        await finished(it, TO_500)
        lose(it, Direction.REPLIES, frames=200)
        await asyncio.sleep(10.0)
        it.machine.faults.clear()
        await asyncio.sleep(15.0)
        assert it.types("body.offline")
        assert news(it) == []
        assert (await finished(it, TO_700)).status is MoveStatus.SUCCEEDED


# what is refused, and until when


@pytest.mark.parametrize(
    "command",
    [
        MoveTo(position=700),
        MoveToSlowly(position=700),
        MoveTo(position=ENTRY),
        MoveClockwise(distance=ENTRY),
        StartInterpolation(),
    ],
)
@in_virtual_time
async def test_what_goes_to_a_place_is_refused(command: RorzeCommand[Ack]) -> None:
    async with rig() as it:
        await finished(it, TO_500)
        brown_out(it)
        await asyncio.sleep(NOTICED_S)
        with pytest.raises(PowerCycled, match=re.escape(f"{command.code} was not sent")):
            await start(it, command)
        assert place(it) == 500


@in_virtual_time
async def test_a_program_that_may_go_anywhere_is_refused_too() -> None:
    async with rig() as it:
        await finished(it, TO_500)
        brown_out(it)
        await asyncio.sleep(NOTICED_S)
        with pytest.raises(PowerCycled):
            await it.body().ask(RunProgram())
        assert "&3FURG" not in it.wire.frames()


@in_virtual_time
async def test_a_relative_move_is_allowed_and_true() -> None:
    async with rig() as it:
        await finished(it, TO_500)
        brown_out(it)
        await asyncio.sleep(NOTICED_S)
        move = await finished(it, MoveClockwise(distance=200))
        assert (move.status, move.start_position, move.position) == (MoveStatus.SUCCEEDED, 0, 200)
        assert place(it) == 700


@in_virtual_time
async def test_a_group_is_not_sent_to_a_place_that_one_member_has_lost() -> None:
    async with rig() as it:
        for address in ("00", "01"):
            await finished(it, TO_500, address)
        brown_out(it, 0x01)
        await asyncio.sleep(BROWN_OUT_S)
        with pytest.raises(PowerCycled, match=r"line1\.01"):
            await it.plant.moves.start(it.plant.group("80"), TO_700)
        with pytest.raises(PowerCycled):
            await it.plant.group("80").ask(TO_700)
        assert [place(it, 0x00), place(it, 0x01)] == [500, 500]
        [last] = it.plant.moves.log.of(it.body("00").address, 1)
        assert last.status is MoveStatus.CANCELLED


@in_virtual_time
async def test_homing_ends_the_refusal() -> None:
    async with rig() as it:
        await finished(it, TO_500)
        brown_out(it)
        await asyncio.sleep(NOTICED_S)
        assert (await finished(it, Home())).status is MoveStatus.SUCCEEDED
        assert (it.body().power.homed, it.body().power.cycled) == ("yes", False)
        assert news(it) == [CUT, ("body.power_cycle.acknowledged", "homing")]
        assert (await finished(it, TO_700)).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_homing_that_is_stopped_does_not_end_the_refusal() -> None:
    async with rig() as it:
        await finished(it, TO_500)
        brown_out(it)
        await asyncio.sleep(NOTICED_S)
        move = await start(it, Home())
        await asyncio.sleep(0.1)
        await it.plant.stops.stop([it.body()], "immediate")
        assert (await ended(it, move)).status is MoveStatus.STOPPED
        assert (it.body().power.homed, it.body().power.cycled) == ("no", True)


@in_virtual_time
async def test_setting_its_position_acknowledges_the_loss() -> None:
    async with rig() as it:
        await finished(it, TO_500)
        brown_out(it)
        await asyncio.sleep(NOTICED_S)
        await it.body().ask(SetPosition(position="encoder"))
        assert it.body().power.cycled, "the encoder's count is lost, too"
        await it.body().ask(SetPosition(position=500))
        assert (it.body().power.homed, it.body().power.cycled) == ("unknown", False)
        assert (await finished(it, TO_700)).status is MoveStatus.SUCCEEDED
        assert place(it) == 700


@in_virtual_time
async def test_an_acknowledged_loss_is_not_told_again() -> None:
    async with rig() as it:
        await finished(it, TO_500)
        brown_out(it)
        await asyncio.sleep(NOTICED_S)
        await it.body().acknowledge_power_cycle()
        await it.body().acknowledge_power_cycle()
        assert (await finished(it, TO_700)).status is MoveStatus.SUCCEEDED
        assert news(it) == [CUT, ("body.power_cycle.acknowledged", "request")]
        assert it.body().power.homed == "no"


@in_virtual_time
async def test_an_axis_that_needs_no_origin_is_told_and_not_refused() -> None:
    async with rig(body_options="needs_origin = false") as it:
        await finished(it, TO_500)
        brown_out(it)
        await asyncio.sleep(NOTICED_S)
        assert (news(it), it.body().power.cycled) == ([CUT], False)
        assert (await finished(it, TO_700)).status is MoveStatus.SUCCEEDED


# between the question and the write, and in motion


@pytest.mark.parametrize(("mark", "certain"), [("", True), (WITHOUT_MARK, False)])
@in_virtual_time
async def test_a_loss_between_the_question_and_the_write_is_not_called_success(
    mark: str, certain: bool
) -> None:
    async with rig(baud=9600, body_options=mark) as it:
        await finished(it, MoveTo(position=5000))
        starting = asyncio.create_task(start(it, MoveTo(position=7000)))
        await it.wire.begun("&3F1AM7000")
        it.axis().power_off(now())
        it.axis().power_on(now())
        move = await ended(it, await starting)
        assert place(it) == 12_000, "nobody could prevent that"
        assert (move.status, news(it)) == (MoveStatus.LOST, [("body.power_cycled", certain)])
        assert move.error is not None
        assert "lost its power" in move.error.detail
        with pytest.raises(PowerCycled):
            await start(it, TO_700)


@in_virtual_time
async def test_a_loss_in_motion_on_a_board_that_keeps_its_position_is_seen_by_the_mark() -> None:
    async with rig() as it:
        it.axis().keeps_position = True
        move = await start(it, MoveTo(position=50_000))
        await asyncio.sleep(0.5)
        brown_out(it)
        await ended(it, move)
        assert (move.status, news(it)) == (MoveStatus.LOST, [CUT])


@in_virtual_time
async def test_a_search_broken_off_on_a_board_that_keeps_its_position_has_not_found_the_origin() -> None:
    async with rig() as it:
        it.axis().keeps_position = True
        await finished(it, MoveTo(position=5000))
        move = await start(it, Home())
        await asyncio.sleep(0.5)
        brown_out(it)
        await ended(it, move)
        assert (move.status, it.body().power.homed) == (MoveStatus.LOST, "no")


@in_virtual_time
async def test_a_motion_that_waited_too_long_for_its_turn_is_proved_again_before_it_is_written() -> None:
    async with rig(baud=9600) as it:
        await finished(it, TO_500)
        starting = asyncio.create_task(start(it, TO_700))
        await it.wire.begun("&3F9VD7")
        sent = len(it.wire.sent)
        async with asyncio.TaskGroup() as others:
            for address in ("00", "01"):  # 1.5 s each
                others.create_task(it.body(address).ask(SaveSettings()))
        assert now() - it.body().power.proved_at > PROOF_HOLDS_S
        assert (await ended(it, await starting)).status is MoveStatus.SUCCEEDED
        frames = [frame for frame in it.wire.frames(sent) if frame in ("&3F9VD7", "&3F1AM700")]
        assert frames == ["&3F9VD7", "&3F1AM700", "&3F9VD7"]


@in_virtual_time
async def test_the_mark_is_asked_right_before_a_motion_to_a_place_and_after_it() -> None:
    async with rig() as it:
        await finished(it, TO_500)
        sent = len(it.wire.sent)
        await finished(it, TO_700)
        frames = [it for it in it.wire.frames(sent) if it.startswith("&3F") and "3ND" not in it]
        assert frames[:2] == ["&3F9VD7", "&3F1AM700"]
        assert frames[-1] == "&3F9VD7"


# the mark itself


@in_virtual_time
async def test_a_comment_with_somebodys_own_text_is_left_alone_and_told_once() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        await it.body().ask(SetUserComment(comment_number=7, text="Serial No.152"))
        await asyncio.sleep(2 * MARK_POLL_S)
        assert it.axis().settings.comments[6] == "Serial No.152"
        [event] = it.events("body.power_mark.missing")
        assert "Serial No.152" in str(event.data["detail"])
        assert (await finished(it, TO_500)).status is MoveStatus.SUCCEEDED
        await it.body().ask(SetUserComment(comment_number=7, text=""))
        await asyncio.sleep(1.0)
        assert it.axis().settings.comments[6] == it.body().power.mark.text


@in_virtual_time
async def test_a_mark_in_flash_memory_proves_nothing_and_is_written_anew() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        old = it.body().power.mark.text
        await it.body().ask(SaveSettings())
        await asyncio.sleep(1.0)
        assert it.axis().flash.settings.comments[6] == old
        assert it.body().power.mark.text not in (None, old)
        brown_out(it)
        await asyncio.sleep(MARK_POLL_S + 1.0)
        assert news(it) == [CUT]


@in_virtual_time
async def test_a_garbled_mark_is_written_again_and_another_number_can_be_configured(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with rig(bodies=(0x3F,), groups={}, body_options="power_comment = 2") as it:
        assert it.axis().settings.comments[1] == it.body().power.mark.text
        execute = it.axis().execute
        garbled: list[str] = []

        def once_garbled(text: str, at: float) -> Response:
            if text.startswith("9VS2,GW") and not garbled:
                garbled.append(text)
                return execute("9VS2,QW-00000000", at)
            return execute(text, at)

        monkeypatch.setattr(it.axis(), "execute", once_garbled)
        await it.body().ask(SaveSettings())
        await asyncio.sleep(1.0)
        assert garbled
        assert it.axis().settings.comments[1] == it.body().power.mark.text


@in_virtual_time
async def test_one_garbled_reading_of_the_mark_is_no_loss_of_power(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig() as it:
        await finished(it, TO_500)
        execute = it.axis().execute
        garbled: list[str] = []

        def once_garbled(text: str, at: float) -> Response:
            if text == "9VD7" and not garbled:
                garbled.append(text)
                return Response("GW-0000000x")
            return execute(text, at)

        monkeypatch.setattr(it.axis(), "execute", once_garbled)
        assert (await finished(it, TO_700)).status is MoveStatus.SUCCEEDED
        assert garbled
        assert news(it) == []


@in_virtual_time
async def test_a_controller_without_user_comments_is_done_without(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        execute = it.axis().execute
        monkeypatch.setattr(
            it.axis(),
            "execute",
            lambda text, at: Response("@4A") if text.startswith("9V") else execute(text, at),
        )
        await it.body().ask(SaveSettings())
        await asyncio.sleep(1.0)
        assert it.types("body.power_mark") == ["body.power_mark.missing"]
        move = await finished(it, TO_500)
        assert move.status is MoveStatus.SUCCEEDED
        assert "No mark proves" in move.evidence[-1]


@in_virtual_time
async def test_a_mark_that_is_saved_in_the_middle_of_a_move_is_not_missed() -> None:
    async with rig() as it:
        move = await start(it, MoveTo(position=50_000))
        with pytest.raises(BodyBusy):
            await it.body().ask(SaveSettings())
        assert (await ended(it, move)).status is MoveStatus.SUCCEEDED
        assert move.evidence == []


@in_virtual_time
async def test_nothing_is_written_into_comments_where_the_mark_is_off() -> None:
    async with rig(body_options="power_comment = false") as it:
        await asyncio.sleep(2 * MARK_POLL_S)
        assert not [frame for frame in it.wire.frames() if "9V" in frame]
        text, _ = await it.body().ask(GetInformation(comment_number=7))
        assert text.text == ""


@in_virtual_time
async def test_a_table_entry_that_went_back_to_flash_is_not_driven_to() -> None:
    async with rig() as it:
        await it.body().ask(SetPositionEntry(entry=ENTRY, pulses=5_000))
        assert (await finished(it, MoveTo(position=ENTRY))).position == 5_000
        brown_out(it)
        await asyncio.sleep(BROWN_OUT_S)
        with pytest.raises(PowerCycled):
            await start(it, MoveTo(position=ENTRY))
        assert place(it) == 5_000


LIMITS = SetSoftLimits(lower=-500, upper=9000)


@in_virtual_time
async def test_a_setting_that_went_back_to_flash_is_a_sign_of_a_loss_of_power() -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        body = it.body()
        await body.ask(LIMITS)
        await body.ask(GetSoftLimits())
        await asyncio.sleep(NOTICED_S)
        assert news(it) == []
        it.axis().keeps_position = True
        brown_out(it)
        await asyncio.sleep(0.2)
        await body.ask(GetSoftLimits())
        await asyncio.sleep(NOTICED_S)
        assert news(it) == [PERHAPS]


@in_virtual_time
async def test_a_setting_that_a_command_of_ours_changed_is_no_sign() -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        body = it.body()
        await body.ask(GetSoftLimits())
        await body.ask(LIMITS)
        await body.ask(GetSoftLimits())
        await asyncio.sleep(NOTICED_S)
        assert news(it) == []


@in_virtual_time
async def test_one_garbled_reading_of_a_setting_is_no_loss_of_power() -> None:
    async with rig(body_options=WITHOUT_MARK) as it:
        body = it.body()
        await body.ask(LIMITS)
        reply, _ = await body.ask(GetSoftLimits())
        body.has_replied(GetSoftLimits(), reply.model_copy(update={"upper": 9001}), now())
        await asyncio.sleep(NOTICED_S)
        assert news(it) == []
