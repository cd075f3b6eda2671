"""The outbox: order, acknowledgements, room, and what is sent again."""

import asyncio
from collections.abc import Awaitable, Callable

from bridges.mqtt.outbox import REPEATED_S, Letter, Outbox
from tests.virtual_time import run_virtual


class Post:
    """Carries letters, and acknowledges them when it is told to."""

    def __init__(self) -> None:
        self.sent: list[str] = []
        self.reached: list[str] = []
        self._open: dict[str, asyncio.Future[None]] = {}

    def letter(self, name: str) -> Letter:
        return Letter(name, b"", "", on_arrival=lambda: self.reached.append(name))

    async def send(self, letter: Letter) -> None:
        self.sent.append(letter.topic)
        self._open[letter.topic] = asyncio.get_running_loop().create_future()
        await self._open[letter.topic]

    async def acknowledge(self, *names: str) -> None:
        for name in names:
            self._open[name].set_result(None)
            await asyncio.sleep(0.01)


def story(tell: Callable[[Outbox, Post], Awaitable[None]], most: int = 3) -> None:
    async def told() -> None:
        await tell(Outbox(most), Post())

    run_virtual(told())


async def ended(task: "asyncio.Task[None]") -> None:
    task.cancel()
    await asyncio.gather(task, return_exceptions=True)


def test_letters_go_out_in_order_without_waiting_and_count_when_all_before_them_have_arrived() -> None:
    async def tell(box: Outbox, post: Post) -> None:
        delivering = asyncio.create_task(box.deliver(post.send))
        for name in "abc":
            await box.put(post.letter(name))
        await asyncio.sleep(0.01)
        assert post.sent == ["a", "b", "c"]
        await post.acknowledge("b", "c")
        assert (post.reached, len(box)) == ([], 3)
        await post.acknowledge("a")
        assert (post.reached, len(box)) == (["a", "b", "c"], 0)
        await box.empty()
        await ended(delivering)

    story(tell)


def test_the_next_connection_sends_what_was_not_acknowledged_from_the_first_on() -> None:
    async def tell(box: Outbox, post: Post) -> None:
        first = asyncio.create_task(box.deliver(post.send))
        for name in "abc":
            await box.put(post.letter(name))
        await asyncio.sleep(0.01)
        await post.acknowledge("a", "c")
        await ended(first)
        second = asyncio.create_task(box.deliver(post.send))
        await asyncio.sleep(0.01)
        assert post.sent == ["a", "b", "c", "b", "c"], "c comes after b, again"
        await post.acknowledge("b", "c")
        assert post.reached == ["a", "b", "c"]
        await ended(second)

    story(tell)


def test_whoever_has_more_waits_for_room() -> None:
    async def tell(box: Outbox, post: Post) -> None:
        for name in "abc":
            await box.put(post.letter(name))
        fourth = asyncio.create_task(box.put(post.letter("d")))
        await asyncio.sleep(10)
        assert not fourth.done(), "nothing grows while there is no connection"
        delivering = asyncio.create_task(box.deliver(post.send))
        await asyncio.sleep(0.01)
        await post.acknowledge("a")
        assert fourth.done()
        assert post.sent[-1] == "d"
        await ended(delivering)

    story(tell)


def test_what_has_arrived_of_late_is_sent_again_in_order_where_its_broker_has_fallen() -> None:
    async def tell(box: Outbox, post: Post) -> None:
        first = asyncio.create_task(box.deliver(post.send))
        await box.put(post.letter("old"))
        await asyncio.sleep(0.01)
        await post.acknowledge("old")
        await asyncio.sleep(REPEATED_S)
        for name in "ab":
            await box.put(post.letter(name))
        await asyncio.sleep(0.01)
        await post.acknowledge("a")
        await ended(first)
        box.repeat()
        second = asyncio.create_task(box.deliver(post.send))
        await asyncio.sleep(0.01)
        assert post.sent == ["old", "a", "b", "a", "b"]
        await post.acknowledge("a", "b")
        assert post.reached == ["old", "a", "b"], "each once"
        await ended(second)

    story(tell)


def test_a_letter_that_cannot_be_sent_ends_the_delivery() -> None:
    async def tell(box: Outbox, post: Post) -> None:
        async def fail(_letter: Letter) -> None:
            raise ConnectionResetError

        await box.put(post.letter("a"))
        outcome = (await asyncio.gather(box.deliver(fail), return_exceptions=True))[0]
        assert isinstance(outcome, ExceptionGroup)
        assert len(box) == 1

    story(tell)
