"""A reading that decides something is repeated while the line errs."""

import asyncio
from collections.abc import Awaitable, Callable, Coroutine, Iterable
from contextlib import aclosing

import pytest

from gateway.core.errors import NotSent
from gateway.rorze.asked_body import AHEAD, believed, closely
from protocols.rorze.moves import MoveTo
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import SetPositionEntry
from simulator.rorze.controller import Response
from tests.gateway.rorze.far_end import FarEnd, running_line, virtual
from tests.plants import Rig, finished, in_virtual_time, rig


def readings(of: Iterable[int]) -> Callable[[], Awaitable[int]]:
    left = iter(of)

    async def read() -> int:
        return next(left)

    return read


@virtual
async def test_a_single_reading_is_believed_on_a_clean_line() -> None:
    async with running_line(FarEnd()) as line:
        assert await believed(line, readings([7])) == 7
        line._session.last_error_at = asyncio.get_running_loop().time()
        await asyncio.sleep(10.0)
        assert await believed(line, readings([7])) == 7


@virtual
async def test_two_equal_readings_in_a_row_are_believed_on_a_line_that_errs() -> None:
    async with running_line(FarEnd()) as line:
        line._session.last_error_at = asyncio.get_running_loop().time()
        assert await believed(line, readings([5, 7, 7])) == 7
        assert await believed(line, readings([5, 6]), agree=lambda one, other: abs(one - other) < 2) == 6
        with pytest.raises(NotSent, match="no two readings agree"):
            await believed(line, readings(range(100)))


def garble_once(rig: Rig, monkeypatch: pytest.MonkeyPatch, question: str, answer: str) -> list[str]:
    """Answer one question wrongly, in a form that cannot be told from a right answer."""
    execute = rig.axis().execute
    garbled: list[str] = []

    def once(text: str, now: float) -> Response:
        if text == question and not garbled:
            garbled.append(text)
            return Response(answer)
        return execute(text, now)

    monkeypatch.setattr(rig.axis(), "execute", once)
    return garbled


ENTRY = PositionReference(position=3)


@pytest.mark.parametrize(
    ("question", "answer"), [("6PD", "+000000501"), ("9CD", "H04"), ("3PDP[3]", "+000000701")]
)
@in_virtual_time
async def test_start_and_target_of_a_move_are_read_twice_while_the_line_garbles(
    question: str, answer: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig() as it:
        await it.body().ask(SetPositionEntry(entry=ENTRY, pulses=700))
        await finished(it, MoveTo(position=500))
        it.plant.line("line1")._session.last_error_at = asyncio.get_running_loop().time()
        garbled = garble_once(it, monkeypatch, question, answer)
        move = await finished(it, MoveTo(position=ENTRY))
        assert garbled
        assert (move.start_position, move.target_position, move.position) == (500, 700, 700)
        assert move.status == "succeeded"


def line_of(asked: list[int], silent: int = -1) -> Callable[[int], Coroutine[None, None, int]]:
    """A line that answers one question after the other, but never one of them."""
    wire = asyncio.Lock()

    async def ask(number: int) -> int:
        asked.append(number)
        async with wire:
            await asyncio.sleep(1.0)
        if number == silent:
            raise NotSent("nobody answers")
        return number

    return ask


@virtual
async def test_answers_come_in_order_and_the_next_question_is_at_the_line_meanwhile() -> None:
    asked: list[int] = []
    answers = closely(map(line_of(asked), range(9)))
    async with aclosing(answers):
        async for answer in answers:
            assert len(asked) == answer + AHEAD
            if answer == 3:
                break
    await asyncio.sleep(9.0)
    assert asked == [0, 1, 2, 3, 4]


@virtual
async def test_after_a_question_that_is_not_answered_none_is_asked() -> None:
    asked: list[int] = []
    with pytest.raises(NotSent):
        [answer async for answer in closely(map(line_of(asked, silent=1), range(9)))]
    await asyncio.sleep(9.0)
    assert asked == [0, 1, 2]
