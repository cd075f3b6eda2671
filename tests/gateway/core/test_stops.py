"""A stop is repeated, in good time and for as long as it takes."""

import asyncio
from collections.abc import Callable, Sequence
from typing import Any, Final, cast

import pytest

from gateway.core.errors import NotSent, PortNotOpen
from gateway.core.stops import (
    CONFIRM_WITHIN_S,
    HURRY_S,
    REPEAT_S,
    StopMode,
    Stopping,
    StopsOfOne,
    StopsUnderWay,
)
from gateway.rorze.stops import StopReport
from gateway.texts import Text, text
from tests.gateway.rorze.far_end import until, virtual

DOWN = PortNotOpen("The line is down. Nothing was sent.")


class ScriptedLine:
    """A line that others answer on if a test says so, on a loop that is held for some seconds."""

    others_are_heard, seconds_held = False, 0.0

    @property
    def counters(self) -> dict[str, int]:
        return {"replies": int(now() * 1000) if self.others_are_heard else 0}

    @property
    def admission(self) -> "ScriptedLine":
        return self

    def held_s(self, at: float) -> float:
        return min(at, self.seconds_held)


MOVES: Final = (Text("It moves.", "動いています。"),)


class Scripted(Stopping):
    """A stop of something that stands still when a test says so."""

    def __init__(self, mode: StopMode = "immediate", proof_takes_s: float = 0.0) -> None:
        self.line = ScriptedLine()
        super().__init__(mode, StopReport(body_id="line1.3F"), cast("Any", self.line), self._note_news)
        self._reasons = MOVES
        self.proof_takes_s = proof_takes_s
        self.still = False
        self.submitted_at: list[float] = []
        self.refusal: NotSent | None = None
        self.published: list[tuple[str, str | None]] = []

    def _send_stop(self) -> "asyncio.Future[None]":
        self.submitted_at.append(now())
        if self.refusal is not None:
            raise self.refusal
        return asyncio.get_running_loop().create_future()

    async def _see(self) -> Sequence[Text]:
        await asyncio.sleep(self.proof_takes_s)
        return () if self.still else MOVES

    def _note_news(self, news: str, data: dict[str, Any]) -> None:
        self.published.append((news.removeprefix("stop."), data["detail"]))

    def submitted(self, since: float, until: float) -> list[float]:
        """When it was submitted in a part of its time."""
        return [at for at in self.submitted_at if since < at <= until]


def now() -> float:
    """The time of the running loop."""
    return asyncio.get_running_loop().time()


@virtual
async def test_standstill_ends_it_and_nothing_is_repeated() -> None:
    stop = Scripted()
    stop.still = True
    await stop.see_through()
    assert (stop.report.state, stop.report.detail) == ("confirmed", None)
    assert stop.submitted_at == []
    await asyncio.sleep(2 * CONFIRM_WITHIN_S)
    assert stop.published == []


@virtual
async def test_it_is_repeated_fast_for_a_minute_then_once_a_second_and_only_standstill_ends_it() -> None:
    stop, began_at = Scripted(), now()
    task = asyncio.create_task(stop.see_through())
    await asyncio.sleep(1000.0)
    assert len(stop.submitted(began_at, began_at + 10.0)) == pytest.approx(10.0 / REPEAT_S, abs=1)
    assert len(stop.submitted(began_at + 900.0, began_at + 1000.0)) == pytest.approx(100, abs=1)
    assert not task.done()
    stop.still = True
    await asyncio.sleep(1.1)
    assert task.done()


@virtual
async def test_people_are_warned_once() -> None:
    stop = Scripted()
    task = asyncio.create_task(stop.see_through())
    await asyncio.sleep(10 * HURRY_S)
    assert stop.published == [("unconfirmed", f"It moves. {text('stops.unconfirmed').en}")]
    stop.still = True
    await task


@virtual
async def test_while_nobody_is_heard_it_is_repeated_without_waiting_for_the_proof() -> None:
    stop, began_at = Scripted(proof_takes_s=5.0), now()
    task = asyncio.create_task(stop.see_through())
    await asyncio.sleep(1.0)
    assert len(stop.submitted(began_at, now())) >= 9
    stop.line.others_are_heard = True
    await asyncio.sleep(1.0)
    assert len(stop.submitted(began_at + 1.01, now())) <= 1, "its turn will come"
    stop.still = True
    await task


@virtual
async def test_what_answers_slowly_is_not_taken_for_silent() -> None:
    stop, began_at = Scripted(proof_takes_s=0.4), now()
    stop.silent_after_s = 0.5
    task = asyncio.create_task(stop.see_through())
    await asyncio.sleep(5.0)
    assert len(stop.submitted(began_at, now())) == pytest.approx(10, abs=1), "once for each proof"
    stop.still = True
    await task


@virtual
async def test_who_is_in_reach_again_need_not_wait_for_the_next_repetition() -> None:
    stop = Scripted(proof_takes_s=4.0)
    stop.line.others_are_heard = True
    task = asyncio.create_task(stop.see_through())
    await asyncio.sleep(2 * HURRY_S)
    submitted = len(stop.submitted_at)
    await until(lambda: len(stop.submitted_at) > submitted)
    await asyncio.sleep(5.0)
    asked_at = now()
    stop.repeat_at_once()
    await asyncio.sleep(0)
    await asyncio.sleep(0)
    assert stop.submitted_at[-1] == asked_at
    stop.still = True
    await task


@virtual
async def test_in_the_long_run_others_have_at_least_half_of_the_time() -> None:
    stop = Scripted(proof_takes_s=4.0)
    stop.line.others_are_heard = True
    task = asyncio.create_task(stop.see_through())
    await asyncio.sleep(HURRY_S + 100.0)
    first, second = stop.submitted_at[-2:]
    assert second - first == pytest.approx(8.0)
    stop.still = True
    await task


@virtual
async def test_a_motor_that_decelerates_is_given_two_seconds() -> None:
    stop, began_at = Scripted("decelerate"), now()
    stop.report.state = "acknowledged"
    task = asyncio.create_task(stop.see_through())
    await asyncio.sleep(CONFIRM_WITHIN_S - 0.05)
    assert stop.submitted_at == []
    await asyncio.sleep(1.0)
    assert len(stop.submitted(began_at, now())) >= 8
    stop.still = True
    await task


@virtual
async def test_cancelling_it_gives_it_up() -> None:
    stop = Scripted()
    task = asyncio.create_task(stop.see_through())
    await asyncio.sleep(1.0)
    task.cancel()
    await asyncio.wait({task})
    submitted = len(stop.submitted_at)
    await asyncio.sleep(HURRY_S)
    assert len(stop.submitted_at) == submitted
    assert stop.published == []
    assert stop.report.state != "confirmed"


@virtual
async def test_a_stop_that_was_not_sent_says_so_until_it_is() -> None:
    stop = Scripted()
    stop.note_not_sent(DOWN)
    assert (stop.report.state, stop.report.detail) == ("not_sent", DOWN.detail)
    stop.note_written(now())
    stop.tell()
    assert (stop.report.state, stop.report.detail) == ("sent", "It moves.")
    stop.note_not_sent(DOWN)
    assert (stop.report.state, stop.report.detail) == ("sent", "It moves."), "the first one is on its way"


@virtual
async def test_a_proof_that_was_under_way_disproves_the_call_for_the_hardware_stop() -> None:
    stop = Scripted(proof_takes_s=CONFIRM_WITHIN_S + 0.5)
    stop.still = True
    await stop.see_through()
    assert [what for what, _ in stop.published] == ["unconfirmed"]
    assert stop.disproves_its_alarm


@virtual
async def test_a_motor_that_came_to_rest_after_the_call_does_not_disprove_it() -> None:
    stop = Scripted()
    task = asyncio.create_task(stop.see_through())
    await asyncio.sleep(CONFIRM_WITHIN_S + 1.0)
    stop.still = True
    await task
    assert [what for what, _ in stop.published] == ["unconfirmed"]
    assert not stop.disproves_its_alarm


@virtual
async def test_the_time_in_which_the_loop_was_held_does_not_count() -> None:
    stop = Scripted()
    stop.line.seconds_held = 5.0
    task = asyncio.create_task(stop.see_through())
    await asyncio.sleep(5.0 + CONFIRM_WITHIN_S - 0.1)
    assert stop.published == []
    await asyncio.sleep(0.2)
    assert [what for what, _ in stop.published] == ["unconfirmed"]
    stop.still = True
    await task


class Stops(StopsUnderWay[str, Scripted]):
    """Stops of one motor."""

    def __init__(self) -> None:
        super().__init__()
        self.counted: list[int] = []

    def stop(self) -> Scripted:
        if "motor" not in self._running:
            self._begin("motor", Scripted(), "the stop of the motor")
        return self._running["motor"]

    def _count(self, _: Scripted) -> None:
        self.counted.append(len(self._tasks))


@virtual
async def test_a_stop_is_told_and_counted_until_it_is_confirmed() -> None:
    stops = Stops()
    stop = stops.stop()
    assert stops.stop() is stop
    await asyncio.sleep(0.5)
    stop.still = True
    await stops.confirmed()
    await asyncio.sleep(0)
    assert [what for what, _ in stop.published] == ["requested", "confirmed"]
    assert stops.counted == [1, 0]
    assert stops.stop() is not stop
    await stops.close()
    await asyncio.sleep(0)
    assert stops.counted[-1] == 0


@virtual
async def test_a_controller_has_one_stop_of_each_kind_and_all_else_is_forbidden_before() -> None:
    forbidden: list[float] = []

    class Forbidding(StopsOfOne[Scripted]):
        def _before(self) -> Sequence[Callable[[], object]]:
            return (lambda: forbidden.append(now()),)

    stops = Forbidding("the motor", Scripted)
    stops.stop("decelerate")
    began_at, stopping = now(), stops.stop("decelerate")
    assert forbidden == [began_at, began_at]
    [decelerating] = stops._running.values()
    assert decelerating.submitted_at == [began_at, began_at]
    stops.stop("immediate")
    assert [stop.mode for stop in stops._running.values()] == ["decelerate", "immediate"]
    assert (await stopping).state == "requested"
    assert now() == pytest.approx(began_at + CONFIRM_WITHIN_S)
    for stop in stops._running.values():
        stop.still = True
    assert (await stops.stop("immediate")).state == "confirmed"
    await stops.confirmed()
    assert stops.unconfirmed_among(stops._tasks) is None


@virtual
async def test_a_stop_whose_outcome_is_awaited_is_not_sent_twice() -> None:
    stop = Scripted()
    stop.submit()
    stop.submit()
    assert len(stop.submitted_at) == 2
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(Scripted, "one_at_a_time", True)
        stop.submit()
    assert len(stop.submitted_at) == 2


@virtual
async def test_a_stop_that_cannot_be_queued_says_so_and_is_tried_again() -> None:
    stops = Stops()
    stop = stops.stop()
    stop.refusal = NotSent("The line is down; nothing was sent.", "Look.")
    stop.submit()
    assert "The line is down" in str(stop.report.detail)
    await stops.close()


@virtual
async def test_what_comes_after_standstill_changes_nothing_any_more() -> None:
    stop = Scripted()
    stop.still = True
    await stop.see_through()
    for outcome in (object(), DOWN):
        stop._note(outcome)
        assert (stop.report.state, stop.report.detail) == ("confirmed", None)
