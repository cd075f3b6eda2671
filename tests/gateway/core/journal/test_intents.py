"""Intents: nothing with an effect is written before the disk has it, and a stop waits for no disk."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable
from contextlib import AbstractContextManager, asynccontextmanager
from typing import Any

import pytest

from gateway.core.errors import Cancelled, GatewayError, NoReply, PortNotOpen, QueueFull
from gateway.core.exchange import QUEUE_LIMIT, Lane
from gateway.core.journal.intents import GATHERED_WITHIN_S, Intents
from gateway.core.journal.journal import JournalUnavailable
from gateway.core.origin import POLL, Origin, acting
from gateway.rorze.line import Line
from gateway.rorze.session import Outcome
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from protocols.rorze.row import RorzeCommand
from protocols.rorze.speeds import SetMaximumSpeed
from protocols.rorze.stops import StopImmediately
from tests.gateway.rorze.far_end import LATENCY_S, FarEnd, running_line, virtual
from tests.model_book import ModelBook

MOVE = MoveClockwise(distance=5)
DISK_S = 0.2


class Refusal:
    """Lets no command pass until it is over."""

    over = False

    def __call__(self, *_: object) -> GatewayError | None:
        return None if self.over else Cancelled("not now")


async def after(event: Awaitable[object], deed: Callable[[], Awaitable[object]]) -> None:
    await event
    await deed()


@asynccontextmanager
async def kept_line(disk_s: float = DISK_S) -> AsyncIterator[tuple[Line, FarEnd, ModelBook]]:
    """A line that runs, and the book of what it sends, whose disk takes this time."""
    far, book = FarEnd(), ModelBook(disk_s)
    async with running_line(far) as line:
        line.intents = Intents(book, line.address_of)
        yield line, far, book


@virtual
async def test_the_first_byte_comes_after_the_intent_is_durable() -> None:
    async with kept_line() as (line, far, book):
        with acting(Origin("http 127.0.0.1", "r1")):
            await line.submit(2, MOVE, Lane.COMMAND)
    [(durable_at, intent)] = book.intents()
    [written_at] = far.times_of("&021+M5")
    assert written_at >= durable_at >= DISK_S
    assert (intent["target"], intent["command"], intent["effect"]) == ("line1.02", MOVE.name(), "motion")
    assert (intent["frame"], intent["caller"], intent["request_id"]) == ("&021+M5\r", "http 127.0.0.1", "r1")
    assert book.written() == [intent["id"]]
    assert book.outcomes() == {intent["id"]: "answered"}


@virtual
async def test_what_came_first_goes_first_and_shares_a_commit() -> None:
    async with kept_line() as (line, far, book):
        moves = [MoveClockwise(distance=number) for number in range(1, 9)]
        began_at = asyncio.get_running_loop().time()
        await asyncio.gather(*(line.submit(2, move, Lane.COMMAND) for move in moves))
        took_s = asyncio.get_running_loop().time() - began_at
    assert [frame for frame in far.frames if "+M" in frame] == [f"&021+M{number}" for number in range(1, 9)]
    assert [intent["id"] for _, intent in book.intents()] == book.written()
    assert took_s < 3 * DISK_S


async def send_ahead(line: Line) -> list["asyncio.Future[Outcome]"]:
    """Let two commands wait for body 2, one of them on the wire, durable both."""
    ahead = [line.submit(2, MoveClockwise(distance=number), Lane.COMMAND) for number in (1, 2)]
    await asyncio.sleep(DISK_S + LATENCY_S / 4)
    return ahead


@virtual
async def test_what_has_to_wait_for_its_turn_anyway_shares_a_commit() -> None:
    async with kept_line() as (line, far, book):
        ahead = await send_ahead(line)
        waits = book.waits
        others = [line.submit(2, MoveClockwise(distance=number), Lane.COMMAND) for number in range(3, 9)]
        assert book.waits == waits
        await asyncio.gather(*ahead, *others)
    assert book.waits == waits + 1
    assert [frame for frame in far.frames if "+M" in frame] == [f"&021+M{number}" for number in range(1, 9)]
    assert [intent["id"] for _, intent in book.intents()] == book.written()


@virtual
async def test_a_slow_body_does_not_keep_the_intents_of_others_from_the_disk() -> None:
    async with kept_line() as (line, far, book):
        far.once("&021+M1", (0.4, ">&021+M"))
        ahead = await send_ahead(line)
        asked_at = asyncio.get_running_loop().time()
        await asyncio.gather(line.submit(3, MOVE, Lane.COMMAND), *ahead)
    [durable_at] = [at for at, intent in book.intents() if intent["target"] == "line1.03"]
    assert durable_at == pytest.approx(asked_at + GATHERED_WITHIN_S + DISK_S)


@virtual
async def test_the_disk_has_what_waits_as_soon_as_nothing_goes_before_it() -> None:
    async with kept_line() as (line, far, book):
        far.once("&021+M5", (GATHERED_WITHIN_S / 2, ">&021+M"))
        ahead = [line.submit(body, MOVE, Lane.COMMAND) for body in (2, 4)]
        await asyncio.sleep(DISK_S + GATHERED_WITHIN_S / 4)
        await asyncio.gather(line.submit(3, MOVE, Lane.COMMAND), *ahead)
    [durable_at] = [at for at, intent in book.intents() if intent["target"] == "line1.03"]
    [last_at] = far.times_of("&041+M5")
    assert durable_at == pytest.approx(last_at + DISK_S)


@virtual
async def test_a_series_waits_for_the_disk_only() -> None:
    async with kept_line() as (line, _, book):
        ahead = await send_ahead(line)
        waits = book.waits
        async with line.undivided([3]):
            sent = line.submit(3, MOVE, Lane.COMMAND)
            assert book.waits == waits + 1
            await asyncio.gather(sent, *ahead)


@virtual
async def test_what_is_withdrawn_before_the_disk_has_it_is_not_sent_and_its_intent_is_over() -> None:
    async with kept_line() as (line, far, book):
        ahead = await send_ahead(line)
        unwanted = line.submit(3, MOVE, Lane.COMMAND)
        line.cancel(lambda it: it.target == 3, Cancelled("not wanted"))
        assert book.waits == 3  # first its intent, then what became of it
        assert isinstance(await unwanted, Cancelled)
        await asyncio.gather(*ahead)
        await asyncio.sleep(DISK_S)
    assert far.times_of("&031+M5") == []
    [intent] = [intent for _, intent in book.intents() if intent["target"] == "line1.03"]
    assert book.outcomes()[intent["id"]] == "not_sent"


@virtual
async def test_a_port_that_is_lost_with_the_first_lets_nothing_be_sent_of_what_was_gathered_with_it() -> None:
    async with kept_line() as (line, far, book):
        ahead = await send_ahead(line)
        gathered = [line.submit(body, MOVE, Lane.COMMAND) for body in (3, 4)]
        await asyncio.gather(*ahead)
        far._receiver = None  # it is found out at the next write
        assert {type(outcome) for outcome in await asyncio.gather(*gathered)} == {Cancelled, PortNotOpen}
        await asyncio.sleep(0)
    assert far.times_of("&031+M5") == far.times_of("&041+M5") == []
    assert [book.outcomes()[intent["id"]] for _, intent in book.intents()][-2:] == ["not_sent", "not_sent"]


@virtual
async def test_a_disk_that_fails_meanwhile_lets_nothing_be_sent_of_what_was_gathered() -> None:
    async with kept_line() as (line, far, book):
        ahead = await send_ahead(line)
        gathered = [line.submit(body, MOVE, Lane.COMMAND) for body in (2, 3)]
        book.trouble = "no space left"
        assert {type(outcome) for outcome in await asyncio.gather(*gathered)} == {JournalUnavailable}
        await asyncio.gather(*ahead)
    assert far.times_of("&021+M5") == far.times_of("&031+M5") == []


FASTER = SetMaximumSpeed(speed=2000)


def going_to_send(line: Line, *commands: RorzeCommand[Any]) -> AbstractContextManager[None]:
    return line.undertaking(lambda: [line._session.exchange(2, it, Lane.COMMAND) for it in commands])


@virtual
async def test_an_undertaking_waits_for_the_disk_once() -> None:
    async with kept_line() as (line, _, book):
        with going_to_send(line, FASTER, MOVE):
            await line.submit(2, FASTER, Lane.COMMAND)
            await line.submit(2, MOVE, Lane.COMMAND)
    assert book.waits == 1
    assert [intent["frame"] for _, intent in book.intents()] == ["&02OHS2000\r", "&021+M5\r"]
    assert book.written() == sorted(str(intent["id"]) for _, intent in book.intents())
    assert set(book.outcomes().values()) == {"answered"}


@virtual
async def test_what_comes_first_takes_the_rest_along_though_nobody_has_foreseen_it() -> None:
    async with kept_line() as (line, _, book):
        with going_to_send(line, MOVE):
            await line.submit(2, FASTER, Lane.COMMAND)
            await line.submit(2, MOVE, Lane.COMMAND)
    assert (book.waits, len(book.intents())) == (1, 2)


@virtual
async def test_what_an_undertaking_does_without_was_not_sent() -> None:
    async with kept_line() as (line, _, book):
        with going_to_send(line, FASTER, MOVE):
            await line.submit(2, FASTER, Lane.COMMAND)
    [faster, move] = [intent["id"] for _, intent in book.intents()]
    assert book.outcomes() == {faster: "answered", move: "not_sent"}
    assert book.written() == [faster]


@virtual
async def test_what_was_not_written_is_tried_again_with_the_same_intent() -> None:
    async with kept_line() as (line, far, book):
        line.gate.add(refusal := Refusal())
        with going_to_send(line, MOVE):
            assert isinstance(await line.submit(2, MOVE, Lane.COMMAND), Cancelled)
            refusal.over = True
            await line.submit(2, MOVE, Lane.COMMAND)
    assert (book.waits, len(far.times_of("&021+M5"))) == (1, 1)
    assert list(book.outcomes().values()) == ["answered"]


@virtual
async def test_what_has_come_too_late_for_its_undertaking_has_an_intent_of_its_own() -> None:
    async with kept_line() as (line, _, book):
        with going_to_send(line, FASTER, MOVE):
            await line.submit(2, FASTER, Lane.COMMAND)
            late = asyncio.create_task(asyncio.sleep(1.0, None))
            sending = asyncio.create_task(after(late, lambda: line.submit(2, MOVE, Lane.COMMAND)))
        await sending
    assert book.waits == 2
    assert sorted(map(str, book.outcomes().values())) == ["answered", "answered", "not_sent"]


@virtual
async def test_a_disk_that_fails_in_an_undertaking_lets_nothing_of_it_be_sent() -> None:
    async with kept_line() as (line, far, book):
        with going_to_send(line, FASTER, MOVE):
            faster = line.submit(2, FASTER, Lane.COMMAND)
            book.trouble = "no space left"
            assert isinstance(await faster, JournalUnavailable)
            with pytest.raises(JournalUnavailable):
                line.submit(2, MOVE, Lane.COMMAND)
    assert far.times_of("&021+M5") == []
    assert set(book.outcomes().values()) == {"not_sent"}


@virtual
async def test_a_stop_while_the_disk_writes_keeps_a_whole_undertaking_from_being_sent() -> None:
    async with kept_line() as (line, far, book):
        with going_to_send(line, FASTER, MOVE):
            faster = line.submit(2, FASTER, Lane.COMMAND)
            line.cancel(lambda it: it.target == 2, Cancelled("stopped"))
            assert isinstance(await faster, Cancelled)
        await asyncio.sleep(2 * DISK_S)
    assert [frame for frame in far.frames if frame.startswith("&02")] == []
    assert len(book.outcomes()) == 2
    assert set(book.outcomes().values()) == {"not_sent"}


@virtual
async def test_reads_and_what_the_gateway_says_of_its_own_accord_wait_for_no_disk() -> None:
    async with kept_line(0.005) as (line, _, book):
        await line.submit(2, GetPosition(), Lane.READ)
        with acting(POLL):
            await line.submit(2, SetMaximumSpeed(speed=1000), Lane.COMMAND)
    assert (book.intents(), book.noted) == ([], [])


@virtual
async def test_a_stop_waits_for_no_disk_and_is_written_down_afterwards() -> None:
    async with kept_line() as (line, _, book):
        book.trouble = "no space left"
        await line.submit(2, StopImmediately(), Lane.STOP)
    [stop] = book.stops()
    assert stop["frame"] == "&025IS\r"
    assert (book.written(), book.outcomes()) == ([stop["id"]], {stop["id"]: "answered"})


@virtual
async def test_a_stop_while_the_disk_writes_keeps_the_move_from_being_sent() -> None:
    async with kept_line() as (line, far, book):
        move = line.submit(2, MOVE, Lane.COMMAND)
        await asyncio.sleep(DISK_S / 2)
        line.gate.stop(2)
        outcome = await move
    assert isinstance(outcome, Cancelled)
    assert far.times_of("&021+M5") == []
    assert list(book.outcomes().values()) == ["not_sent"]


@virtual
async def test_what_is_withdrawn_while_the_disk_writes_is_not_sent() -> None:
    async with kept_line() as (line, far, _):
        move = line.submit(2, MOVE, Lane.COMMAND)
        line.cancel(lambda it: it.target == 2, Cancelled("not wanted"))
        assert isinstance(await move, Cancelled)
        await asyncio.sleep(2 * DISK_S)
    assert far.times_of("&021+M5") == []


@virtual
async def test_a_disk_that_is_slower_than_the_command_may_wait_lets_it_expire() -> None:
    async with kept_line() as (line, far, _):
        expires_at = asyncio.get_running_loop().time() + DISK_S / 2
        outcome = await line.submit(2, MOVE, Lane.COMMAND, expires_at=expires_at)
    assert getattr(outcome, "kind", "") == "expired"
    assert far.times_of("&021+M5") == []


@pytest.mark.parametrize("broken_while_it_writes", [False, True])
def test_without_a_disk_nothing_with_an_effect_is_sent(*, broken_while_it_writes: bool) -> None:
    @virtual
    async def story() -> None:
        async with kept_line() as (line, far, book):
            if broken_while_it_writes:
                move = line.submit(2, MOVE, Lane.COMMAND)
                book.trouble = "no space left"
                assert isinstance(await move, JournalUnavailable)
            book.trouble = "no space left"
            with pytest.raises(JournalUnavailable, match="nothing was sent"):
                line.submit(2, MOVE, Lane.COMMAND)
            assert not isinstance(await line.submit(2, GetPosition(), Lane.READ), GatewayError)
        assert far.times_of("&021+M5") == []

    story()


@virtual
async def test_a_disk_that_hangs_is_not_waited_for() -> None:
    async with kept_line(60.0) as (line, far, _):
        outcome = await line.submit(2, MOVE, Lane.COMMAND)
        assert isinstance(outcome, JournalUnavailable)
        assert asyncio.get_running_loop().time() < 10
        await asyncio.sleep(60.0)
    assert far.times_of("&021+M5") == []


@virtual
async def test_no_more_wait_for_the_disk_than_may_wait_for_a_body() -> None:
    async with kept_line() as (line, _, _):
        waiting = [line.submit(2, MOVE, Lane.COMMAND) for _ in range(QUEUE_LIMIT)]
        with pytest.raises(QueueFull):
            line.submit(2, MOVE, Lane.COMMAND)
        line.cancel(lambda _: True, Cancelled("enough"))
        await asyncio.gather(*waiting)
        await asyncio.sleep(DISK_S)


@virtual
async def test_what_nobody_knows_the_outcome_of_is_unknown() -> None:
    async with kept_line(0.005) as (line, far, book):
        far.silent.add(2)
        assert isinstance(await line.submit(2, MOVE, Lane.COMMAND), NoReply)
    assert list(book.outcomes().values()) == ["unknown"]


@virtual
async def test_a_line_that_goes_down_while_the_disk_writes_sends_nothing_when_it_is_back() -> None:
    async with kept_line() as (line, far, _):
        move = line.submit(2, MOVE, Lane.COMMAND)
        far.unplug()
        assert isinstance(await move, Cancelled)
        far.plugged_in = True
        await asyncio.sleep(5.0)
    assert far.times_of("&021+M5") == []
