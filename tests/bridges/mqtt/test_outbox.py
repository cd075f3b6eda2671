"""The outbox: order, acknowledgements, room, and what is sent again."""

import asyncio
from collections.abc import Awaitable, Callable

from bridges.mqtt.outbox import KEPT_S, MOST_KEPT, Letter, Outbox
from tests.virtual_time import run_virtual


class Post:
    """Carries letters, and acknowledges them when it is told to."""

    def __init__(self) -> None:
        self.sent: list[str] = []
        self.reached: list[str] = []
        self._open: dict[str, asyncio.Future[None]] = {}

    def letter(self, name: str) -> Letter:
        return Letter(name, b"", "", on_settled=lambda: self.reached.append(name))

    async def send(self, letter: Letter) -> None:
        self.sent.append(letter.topic)
        self._open[letter.topic] = asyncio.get_running_loop().create_future()
        await self._open[letter.topic]

    async def acknowledge(self, *names: str) -> None:
        for name in names:
            self._open[name].set_result(None)
            await asyncio.sleep(0.01)


def story(tell: Callable[[Outbox, Post], Awaitable[None]], kept_s: float = 0) -> None:
    async def told() -> None:
        await tell(Outbox(3, kept_s=kept_s), Post())

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


def test_what_was_acknowledged_of_late_is_sent_again_in_order_and_settles_later() -> None:
    async def tell(box: Outbox, post: Post) -> None:
        first = asyncio.create_task(box.deliver(post.send))
        await box.put(post.letter("old"))
        await asyncio.sleep(0.01)
        await post.acknowledge("old")
        assert not post.reached
        await asyncio.sleep(KEPT_S)
        for name in "ab":
            await box.put(post.letter(name))
        await asyncio.sleep(0.01)
        await post.acknowledge("a")
        assert post.reached == ["old"]
        await ended(first)
        await asyncio.sleep(100)  # without a broker time does not count
        second = asyncio.create_task(box.deliver(post.send))
        await asyncio.sleep(0.01)
        assert post.sent == ["old", "a", "b", "a", "b"]
        await post.acknowledge("a", "b")
        await asyncio.sleep(KEPT_S)
        box.settle()
        assert post.reached == ["old", "a", "b"]
        await ended(second)

    story(tell, KEPT_S)


def test_of_those_kept_there_are_so_many_at_most() -> None:
    async def tell(box: Outbox, post: Post) -> None:
        async def send(_letter: Letter) -> None:
            """Is acknowledged at once."""

        delivering = asyncio.create_task(box.deliver(send))
        for number in range(MOST_KEPT + 10):
            await box.put(post.letter(str(number)))
        await asyncio.sleep(0.01)
        assert post.reached == [str(number) for number in range(10)]
        await ended(delivering)

    story(tell, KEPT_S)


def test_a_letter_that_cannot_be_sent_ends_the_delivery() -> None:
    async def tell(box: Outbox, post: Post) -> None:
        async def fail(_letter: Letter) -> None:
            raise ConnectionResetError

        await box.put(post.letter("a"))
        outcome = (await asyncio.gather(box.deliver(fail), return_exceptions=True))[0]
        assert isinstance(outcome, ExceptionGroup)
        assert len(box) == 1

    story(tell)


def test_a_letter_for_which_brokers_end_the_connection_is_left_out_at_last() -> None:
    async def told() -> None:
        box, sent = Outbox(3, kept_s=0, most_tries=2), list[str]()

        async def send(letter: Letter) -> None:
            if letter.topic == "bad":
                raise ConnectionResetError
            sent.append(letter.topic)

        await box.put(Letter("bad", b"", ""))
        for _ in range(2):
            await asyncio.gather(box.deliver(send), return_exceptions=True)
        await box.put(Letter("good", b"", ""))
        delivering = asyncio.create_task(box.deliver(send))
        await box.empty()
        assert sent == ["good"]
        await ended(delivering)

    run_virtual(told())


def test_of_those_that_wait_to_be_acknowledged_there_are_so_many_at_once() -> None:
    async def told() -> None:
        box, post = Outbox(10, kept_s=0, at_once=2), Post()
        delivering = asyncio.create_task(box.deliver(post.send))
        for name in "abcd":
            await box.put(post.letter(name))
        await asyncio.sleep(0.01)
        assert post.sent == ["a", "b"], "there is room for others at the broker"
        await post.acknowledge("b")
        assert post.sent == ["a", "b"]
        await post.acknowledge("a")
        assert post.sent == ["a", "b", "c", "d"]
        await ended(delivering)

    run_virtual(told())
