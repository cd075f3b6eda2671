"""A session carried over its port: a frame at a time, and no caller keeps the line waiting."""

import asyncio
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from types import SimpleNamespace
from typing import Any, cast

import pytest

from gateway.core.admission import SUSPENDED_S, Admission, LoopWatch
from gateway.core.errors import GatewayError, HeldUp, InvalidRequest, Overtaking, PortNotOpen
from gateway.core.exchange import ExpectedReply, Lane
from gateway.core.gate import Gate
from gateway.core.line import GAP_S, LineDriver
from gateway.core.line_state import PortNews
from gateway.core.load import Load
from gateway.core.origin import current
from gateway.core.session import Session, SessionTerms
from gateway.rorze.line import Line, LineState
from protocols.rorze.link import Answer, GroupAnswer, Refusal
from protocols.rorze.position import GetPosition
from tests.gateway.rorze.far_end import FarEnd, running_line, until, virtual
from transports.base import TransportRefused

BAUD = 9600
FRAME_S = len("&026PD\r") * 10 / BAUD
TIMEOUT_S = 0.3
LONGEST = 20


class Port(FarEnd):
    """A port that carries no long frames."""

    def write(self, data: bytes) -> None:
        if len(data) > LONGEST:
            raise TransportRefused(f"scripted:// carries no more than {LONGEST} bytes.")
        super().write(data)


class Said:
    """A frame and what became of it."""

    def __init__(self, text: str) -> None:
        self.frame = f"{text}\r".encode()
        self.reply = ExpectedReply(TIMEOUT_S)
        self.origin = current()
        self.lane = Lane.READ
        self.outcome: GatewayError | None = None

    def settle(self, outcome: GatewayError, /) -> None:
        self.outcome = outcome


class Speech:
    """Says one thing after the other, as soon as it may, and waits for no answer."""

    def __init__(self) -> None:
        self.counters: Counter[str] = Counter()
        self.gate: Gate[Any] = Gate()
        self.load = Load()
        self.terms = SessionTerms(TIMEOUT_S, TIMEOUT_S, interject_stops=True, set_up_target=0)
        self.echo, self.order = SimpleNamespace(), SimpleNamespace()
        self.in_step = True
        self.waiting: list[Said] = []
        self.asked: list[float] = []
        """Times at which the line asked for the next frame to write."""
        self.revoked: list[Overtaking] = []
        self.fences = 0
        self.said: list[tuple[bytes, float, float]] = []
        """Frames, with the time of writing and the time until which the answer is waited for."""
        self.passed: list[tuple[float, float | None]] = []
        """Times at which deadlines were looked at, and until which a reply that has begun may go on."""

    def awaits_replies(self) -> bool:
        return bool(self.deadline())

    def revoke(self, why: Overtaking) -> None:
        self.revoked.append(why)
        self.waiting.clear()

    def fence(self) -> None:
        self.fences += 1

    def has_something(self) -> bool:
        return bool(self.waiting)

    def next(self, now: float, *, ready: bool) -> Said | None:
        self.asked.append(now)
        return self.waiting.pop(0) if ready and self.waiting else None

    def written(self, exchange: Said, now: float, deadline: float) -> bool:
        self.said.append((exchange.frame, now, deadline))
        return self.has_something()

    def deadline(self) -> float | None:
        return None

    def pass_deadlines(self, now: float, resumes_at: float | None) -> None:
        self.passed.append((now, resumes_at))


class Words:
    """Cuts at each CR."""

    def __init__(self) -> None:
        self._begun = b""

    def feed(self, data: bytes, /) -> list[bytes]:
        *words, self._begun = (self._begun + data).split(b"\r")
        return words

    def pending(self) -> int:
        return len(self._begun)


class Speaker(LineDriver[Any, bytes, bytes]):
    """A line that is ready when a test says so, and only listens."""

    _unasked = (bytes,)

    def __init__(self, port: Port) -> None:
        self.speech = Speech()
        super().__init__("line1", port, cast("Session[Any, bytes]", self.speech), Words)
        self.heard: list[bytes] = []
        self.broken_off: list[str] = []

    async def _set_up(self, *, fresh: bool) -> None:
        self._life.take(PortNews.ANSWERED if fresh else PortNews.SET_UP)

    def _break_off(self, reason: str) -> None:
        self.broken_off.append(reason)

    def _hear(self, message: bytes) -> None:
        self.heard.append(message)

    def say(self, *texts: str, first: bool = False) -> list[Said]:
        sayings = [Said(text) for text in texts]
        at = 0 if first else len(self.speech.waiting)
        self.speech.waiting[at:at] = sayings
        self._pump()
        return sayings


@asynccontextmanager
async def speaking(port: Port) -> AsyncIterator[Speaker]:
    """A line that is ready."""
    line = Speaker(port)
    line.start()
    await until(lambda: line.state is LineState.READY)
    yield line
    await line.close()


class Clock:
    """A clock that goes on only when a test says so, as the time of a suspended computer."""

    now = 0.0

    def __call__(self) -> float:
        return self.now


def now() -> float:
    return asyncio.get_running_loop().time()


# writing


@virtual
async def test_what_is_urgent_leaves_at_the_next_frame_boundary() -> None:
    port = Port(BAUD)
    async with speaking(port) as line:
        began_at = now()
        line.say("&026PD", "&036PD")
        await asyncio.sleep(FRAME_S / 2)
        line.say("&025IS", first=True)
        await asyncio.sleep(1)
        assert port.frames == ["&026PD", "&025IS", "&036PD"]
        assert [at for at, _ in port.written] == pytest.approx(
            [began_at, began_at + FRAME_S, began_at + 2 * FRAME_S]
        )


@virtual
async def test_a_suspension_is_noticed_before_anything_is_written_after_it() -> None:
    port = Port(BAUD)
    clock = Clock()
    watch = LoopWatch(clock)
    async with speaking(port) as line:
        line.admission = Admission(watch)
        watch.on_held = lambda _: line.revoke(HeldUp)
        watch.start()
        line.say("&026PD", "&021+M100")  # the second one waits for the first one's last bit
        clock.now += SUSPENDED_S + 1.0
        await asyncio.sleep(FRAME_S)
        watch.close()
        await asyncio.sleep(1.0)
        assert line.speech.revoked == [HeldUp]
        assert port.frames == ["&026PD"]


@virtual
async def test_only_a_line_that_is_set_up_is_fenced() -> None:
    async with speaking(Port()) as line:
        line.fence()
        assert line.speech.fences == 1
        line._begins_set_up()
        line.fence()
        assert line.speech.fences == 1


@virtual
async def test_an_answer_is_waited_for_from_the_frames_last_bit() -> None:
    port = Port(BAUD)
    async with speaking(port) as line:
        line.say("&026PD")
        ((frame, at, deadline),) = line.speech.said
        assert frame == b"&026PD\r"
        assert deadline - at == pytest.approx(FRAME_S + TIMEOUT_S)
        await asyncio.sleep(1)
        ((looked_at, resumes_at),) = line.speech.passed
        assert looked_at == pytest.approx(deadline)
        assert resumes_at is None


@virtual
async def test_a_frame_the_port_does_not_carry_is_refused_and_the_next_one_goes() -> None:
    port = Port()
    async with speaking(port) as line:
        long, short = line.say("&029VS1," + "x" * LONGEST, "&026PD")
        assert isinstance(long.outcome, InvalidRequest)
        assert "no more than 20 bytes. Nothing was sent." in long.outcome.detail
        assert (short.outcome, port.frames) == (None, ["&026PD"])
        assert [frame for frame, *_ in line.speech.said] == [b"&026PD\r"]
        assert line.state is LineState.READY


@virtual
async def test_a_frame_for_a_port_that_has_gone_is_not_called_sent() -> None:
    port = Port()
    async with speaking(port) as line:
        port._receiver = None
        (lost,) = line.say("&026PD")
        assert isinstance(lost.outcome, PortNotOpen)
        assert "Nothing was sent." in lost.outcome.detail
        assert (line.speech.said, line.state) == ([], LineState.DOWN)


@virtual
async def test_a_line_that_is_down_asks_for_nothing_to_say() -> None:
    port = Port()
    async with speaking(port) as line:
        port.unplug()
        (kept,) = line.say("&026PD")
        assert (line.speech.waiting, kept.outcome, line.speech.asked) == ([kept], None, [])
        assert line.broken_off == ["the cable was pulled"]


# reading


@virtual
async def test_a_reply_that_has_begun_may_pause_for_a_moment() -> None:
    port = Port()
    async with speaking(port) as line:
        port.say(b">&026PD+0000", 0.25)
        line.say("&026PD")
        await asyncio.sleep(TIMEOUT_S + 0.001)
        ((_, resumes_at),) = line.speech.passed
        assert resumes_at == pytest.approx(now() - 0.051 + GAP_S)


@virtual
async def test_several_frames_at_once_are_heard_in_their_order() -> None:
    port = Port()
    async with speaking(port) as line:
        port.say(b">&02")
        port.say(b"6PD\r>&7D1+M[02:00]\r>&03", 0.001)
        await asyncio.sleep(0.01)
        assert line.heard == [b">&026PD", b">&7D1+M[02:00]"]


def note_what_was_sent_when_told(line: Line, far: FarEnd) -> list[list[str]]:
    """Keep, for each reply, the frames that had gone out when the first person heard of it."""
    hear, kept = line._session.receive, []

    def heard(frame: Answer | Refusal | GroupAnswer, at: float) -> Callable[[], None] | None:
        tell = hear(frame, at)

        def note_and_tell() -> None:
            kept.append(far.frames)
            assert tell is not None
            tell()

        return None if tell is None else note_and_tell

    line._session.receive = heard  # type: ignore[method-assign,assignment]  # between hearing and telling
    return kept


@virtual
async def test_the_next_frame_leaves_before_anybody_hears_of_a_reply() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        sent_when_told = note_what_was_sent_when_told(line, far)
        first = line.submit(2, GetPosition(), Lane.READ)
        second = line.submit(3, GetPosition(), Lane.READ)
        await asyncio.gather(first, second)
        assert sent_when_told == [["&026PD", "&036PD"]] * 2
