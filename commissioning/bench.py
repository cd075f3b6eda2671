"""A line on the bench: numbered questions to it, and what their answers show together."""

import asyncio
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator, Mapping, Sequence
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass
from math import ceil
from statistics import median
from typing import Any, ClassVar

from commissioning.assumptions import Assumption, Level
from commissioning.conversation import Conversation, Frame, Heard
from commissioning.debts import Debt, Debts
from commissioning.findings import Change, Finding, Unanswered, agrees, cannot_tell, fails

PATIENCE_S = 10.0
"""The first answer of a line is waited for this long."""
OUTAGE = "outage"
"""The loss of power that several trials look at, in the memory of a bench."""
SETTLES_S = 0.1
"""The time in which an answer to bytes that were half said is over."""
LONGEST_ANSWER = 64
"""Bytes of an answer that is waited for."""
QUESTIONS = 40
"""Numbered questions of the sample, divided among all who are asked."""
LEAST_EACH = 3
TRIES = 2
"""Questions after which an answer is missing: one may be lost."""
ALLOWANCE = 2.0
"""Times by which a proposed limit exceeds what was measured."""
MODEL_TURNAROUND_S = 0.003
"""Time in seconds from a question to its reply in the gateway's own plan."""
ROUNDING = 1e-3
LEFT = (
    "A commissioning that was killed has left it otherwise than it was: {command} sets it back. No motor "
    "moves because of it. Do it?"
)
SLOW_SHARE = 0.5
"""A reply that takes this share of the reply timeout leaves too little of it."""

Key = tuple[int, int]
"""A speaker, and the number of a question to it."""


@dataclass(frozen=True, slots=True)
class Places:
    """Two places of one axis, between which a person lets it move, in its own units."""

    one: float
    other: float


Consent = Callable[[str, str], Awaitable[bool]]
"""Asks people whether something may be done: to which body or robot, and a sentence that says it."""


async def nobody(_subject: str, _what: str) -> bool:
    """Refuse consent: there is no person at a terminal to give it."""
    return False


@dataclass(frozen=True, slots=True)
class Terms:
    """The permissions that people give."""

    allowed: frozenset[Level] = frozenset()
    consent: Consent = nobody
    switch: Consent = nobody
    """Asks a person to switch the power off and on, and waits until it is done."""
    places: Places | None = None


class Bench:
    """A line with all that a trial needs of it."""

    rows: ClassVar[Mapping[str, Any]] = {}
    """The rows of its family's commands, by their names."""
    kind: ClassVar[str] = ""
    """The kind of its controllers, as a sentence names one."""

    def __init__(self, line: Any, talk: Conversation, terms: Terms) -> None:
        self.line = line
        self.talk = talk
        self.terms = terms
        self.debts = Debts()
        self.patience_s = PATIENCE_S
        self.asked: dict[Key, float] = {}
        """Times at which numbered questions were on the wire, in seconds of the port's clock."""
        self.serial_numbers: dict[str, str] = {}
        """Versions and serial numbers that controllers tell."""
        self.memory: dict[str, Any] = {}
        """Results that several trials share, by name."""
        self._agreed: dict[tuple[str, str], bool] = {}
        self._sampled = False

    # what families say

    async def reach(self) -> None:
        """Find the form in which the line understands what it is asked."""

    async def describe(self) -> None:
        """Note the versions and serial numbers that controllers tell."""

    def numbered(self, speaker: int) -> tuple[Key, bytes]:
        """Make a question with a number that was not used yet."""
        raise NotImplementedError

    def key_of(self, heard: bytes) -> Key | None:
        """Give the speaker and number of the question that a received line answers; None for other lines."""
        raise NotImplementedError

    @property
    def speakers(self) -> Sequence[int]:
        """All who are asked."""
        raise NotImplementedError

    def command_of(self, debt: Debt) -> Any:
        """The command that pays a debt.

        :raises ValueError: there is none such.
        """
        if debt.command not in self.rows:
            raise ValueError(f"{debt.command} is no command of {self.kind}")
        return self.rows[debt.command].model_validate(debt.fields)

    def frame_of(self, debt: Debt) -> bytes:
        """The frame that pays a debt."""
        raise NotImplementedError

    def subject_of(self, debt: Debt) -> str:
        """The body or robot that is owed something, by its name in the configuration."""
        raise NotImplementedError

    async def set_back(self, place: int, command: Any) -> None:
        """Restore a setting.

        :raises Unanswered: it was not taken, or that is not known.
        """
        raise NotImplementedError

    # what is set and has to be set back

    @asynccontextmanager
    async def owing(self, place: int, command: Any) -> AsyncIterator[None]:
        """Set something back when the block ends; for one that is killed it is written down before.

        :raises Unanswered: it cannot be written down; nothing was set.
        """
        debt = Debt(place=place, command=command.name(), fields=command.model_dump(mode="json"))
        try:
            self.debts.note(debt)
        except OSError as error:
            raise Unanswered(f"{self.debts.file} cannot be written ({error.strerror}).") from error
        try:
            yield
        finally:
            await self._pay(debt, command)

    async def _pay(self, debt: Debt, command: Any) -> None:
        """Set something back, and again where that was not seen; else the debt stands."""
        for _ in range(TRIES):
            with suppress(Unanswered, OSError):
                await self.set_back(debt.place, command)
                self.debts.cross_out(debt)
                break

    async def pay_all(self) -> None:
        """Set back what a commissioning has left that was killed, where people agree."""
        for debt in self.debts.left():
            command = self.command_of(debt)
            subject, what = self.subject_of(debt), LEFT.format(command=self._in_words(debt))
            await self.sample()
            if self.terms.allowed and await self.consents(subject, f"{subject}: {what}"):
                await self._pay(debt, command)

    def left(self) -> list[str]:
        """The commands that have yet to set something back, each in words."""
        return [f"{self.subject_of(debt)}: {self._in_words(debt)}" for debt in self.debts.left()]

    def _in_words(self, debt: Debt) -> str:
        return self.frame_of(debt).decode("ascii").strip()

    # questions

    async def ask_number(self, speaker: int) -> bool:
        """Ask a numbered question; whether it was answered in time."""
        key, frame = self.numbered(speaker)
        since = len(self.talk.heard)
        self.asked[key] = self.talk.send(frame)
        heard = await self.talk.hear(
            lambda lines: any(self.key_of(line.data) == key for line in lines), self.within_s(frame), since
        )
        answered = any(self.key_of(line.data) == key for line in heard)
        if answered and self.patience_s == PATIENCE_S:
            self.patience_s = max(self.line.reply_timeout_s, 3 * max(self.times))
        return answered

    def within_s(self, frame: bytes) -> float:
        """Longest wait for the answer to a frame, in seconds."""
        return (len(frame) + LONGEST_ANSWER) * self.talk.port.byte_time_s + self.patience_s

    async def consents(self, subject: str, what: str) -> bool:
        """Ask people once for each body or robot and each sentence."""
        if (subject, what) not in self._agreed:
            self._agreed[subject, what] = await self.terms.consent(subject, what)
        return self._agreed[subject, what]

    def background(self, deed: Awaitable[bool]) -> "asyncio.Future[bool]":
        """Begin something that goes on beside the questions."""
        return asyncio.ensure_future(deed)

    async def pause(self, seconds: float) -> None:
        """Let time pass."""
        await asyncio.sleep(seconds)

    async def settle(self) -> None:
        """Wait until nothing more comes of what was asked."""
        await self.pause(SETTLES_S + self.patience_s / 2)

    # the sample

    async def sample(self) -> None:
        """Ask many numbered questions, once; then listen for what comes late or twice."""
        if self._sampled:
            return
        self._sampled = True
        await self.reach()
        speakers = self.speakers
        for turn in range(max(LEAST_EACH, QUESTIONS // max(len(speakers), 1))):
            for speaker in speakers:
                if turn and speaker not in self.present:
                    continue
                await self.ask_number(speaker)
                if not turn and self.patience_s == PATIENCE_S and speaker == speakers[0]:
                    self.patience_s = max(self.line.reply_timeout_s, 1.0)  # it may not be there
        listen_s = 2 * self.line.late_reply_s + self.line.reply_timeout_s
        if self.present:
            await self.talk.hear(lambda _: False, listen_s)

    def first_replies(self) -> Iterator[tuple[Key, Heard]]:
        """The first answer to each numbered question, as they came."""
        seen: set[Key] = set()
        for line in self.talk.heard:
            key = self.key_of(line.data)
            if key in self.asked and key not in seen:
                seen.add(key)
                yield key, line

    @property
    def present(self) -> set[int]:
        """The speakers that have answered."""
        return {speaker for (speaker, _), _ in self.first_replies()}

    @property
    def times(self) -> list[float]:
        """Seconds from the end of each numbered question to its answer, the bytes of the answer left out."""
        byte_s = self.talk.port.byte_time_s
        return [
            max(reply.at - self.asked[key] - len(reply.data) * byte_s, 0.0)
            for key, reply in self.first_replies()
        ]

    @property
    def copies(self) -> list[float]:
        """Seconds from an answer to each of its copies."""
        first: dict[Key, float] = {}
        late = []
        for line in self.talk.heard:
            key = self.key_of(line.data)
            if key not in self.asked:
                continue
            if key in first:
                late.append(line.at - first[key])
            first.setdefault(key, line.at)
        return late

    def out_of_order(self, speaker: int) -> bool:
        """Tell whether its answers came in another order than the questions."""
        numbers = [key for key, _ in self.first_replies() if key[0] == speaker]
        order = list(self.asked)
        places = [order.index(key) for key in numbers]
        return places != sorted(places)


# The trials that both families have in common


async def echo(row: Assumption, bench: Bench) -> Finding:
    """Compare what is heard with what was sent."""
    await bench.sample()
    sent = {_bare(frame) for frame in bench.talk.frames if frame.dir == "tx"}
    echoes = sum(frame.dir == "rx" and _bare(frame) in sent for frame in bench.talk.frames)
    if echoes:
        return fails(row, f"{echoes} frames came back as they were sent.")
    if not bench.talk.heard:
        return cannot_tell(row, "Nothing was heard.")
    return agrees("No frame came back as it was sent.")


def _bare(frame: Frame) -> str:
    return frame.data.replace("\\r", "").replace("\\n", "")


async def late_replies(row: Assumption, bench: Bench) -> Finding:
    """Compare the latest reply with the time in which one may still come."""
    await bench.sample()
    times = bench.times
    if not times:
        return cannot_tell(row, "Nobody has answered.")
    latest, limit = max(times), bench.line.reply_timeout_s + bench.line.late_reply_s
    seen = f"The latest of {len(times)} replies took {latest:.3f} s, {limit:g} s are allowed."
    if latest <= limit:
        return agrees(seen)
    return fails(row, seen, Change(row.key, _limit(ALLOWANCE * latest - bench.line.reply_timeout_s)))


async def turnaround(row: Assumption, bench: Bench) -> Finding:
    """Compare the usual reply with the time after which a command counts as unanswered."""
    await bench.sample()
    times = sorted(bench.times)
    if not times:
        return cannot_tell(row, "Nobody has answered.")
    usual, slow = median(times), times[int(0.9 * (len(times) - 1))]
    limit = bench.line.reply_timeout_s
    seen = (
        f"From question to reply: {usual * 1000:.1f} ms as a rule, 90 % within {slow * 1000:.1f} ms; "
        f"the gateway plans {MODEL_TURNAROUND_S * 1000:g} ms and waits {limit * 1000:g} ms."
    )
    if slow <= max(SLOW_SHARE * limit, MODEL_TURNAROUND_S):
        return agrees(seen)
    return fails(row, seen, Change(row.key, _limit(3 * slow)))


async def copies(row: Assumption, bench: Bench) -> Finding:
    """Look for answers that came twice."""
    await bench.sample()
    if not bench.present:
        return cannot_tell(row, "Nobody has answered.")
    late, limit = bench.copies, bench.line.late_reply_s
    if not late:
        return agrees(f"None of {len(bench.times)} replies came twice.")
    seen = f"{len(late)} of {len(bench.times)} replies came twice, the last copy {max(late):.3f} s later."
    if max(late) <= limit:
        return agrees(f"{seen} Within {limit:g} s they are expected.")
    return fails(row, seen, Change(row.key, _limit(ALLOWANCE * max(late))))


def _limit(seconds: float) -> float:
    """A limit of the configuration, in tenths of a second."""
    return min(max(ceil(10 * seconds - ROUNDING) / 10, 0.1), 60.0)
