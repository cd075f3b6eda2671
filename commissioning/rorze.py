"""The trials of an RC-400 and the RC-420s behind it."""

from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from itertools import count
from types import MappingProxyType
from typing import Any, Final

from commissioning.assumptions import Assumption
from commissioning.bench import SETTLES_S, TRIES, Bench, Key, Terms, copies, echo, late_replies, turnaround
from commissioning.conversation import Conversation, Heard
from commissioning.debts import Debt
from commissioning.findings import Change, Finding, Unanswered, agrees, cannot_tell, fails
from gateway.rorze.power import LASTING_ERRORS
from protocols.lines import CR, Garbage
from protocols.rorze.commands import BY_NAME
from protocols.rorze.encoder import GetAdjustmentLimit
from protocols.rorze.inputs_outputs import GetClearPulseTime
from protocols.rorze.link import (
    HALF_COMMAND_ENDS,
    INTRODUCERS,
    Answer,
    Frame,
    GroupAnswer,
    HalfCommandEnd,
    LinkReader,
    Refusal,
    encode,
)
from protocols.rorze.link_master import IdentifyControllers
from protocols.rorze.modes import GetOperatingMode
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import GetNumberedPositionEntry, NumberedPositionEntry
from protocols.rorze.programs import GetLastProgramAddress, GetProgramInstruction, GetProgramLine
from protocols.rorze.row import LINK_MASTER, WRONG_MODE, RorzeCommand
from protocols.rorze.status import CONTROLLER_STATUS_BITS, GetControllerStatus, GetInformation, names_of
from protocols.table import WireFault

ENTRIES: Final = 2048
"""Position entries, whose numbers come back in the answers to 3ND."""
IN_ONE_GO: Final = 3
"""Questions that are sent without waiting: two would do, if the second were never the one that is late."""
LINES_READ: Final = 200
"""Instructions of a program that are read in search of a label."""
ASKED_FIRST: Final = 3
"""Bodies that are asked in each form: one of them is there."""
OLDEST_BODY: Final = 0xF
"""The last that one digit can address."""
READ_TWICE_S: Final = 1.0


class RorzeBench(Bench):
    """An RC-400 with its bodies."""

    rows = BY_NAME
    kind = "an RC-420"

    def __init__(self, line: Any, talk: Conversation, terms: Terms) -> None:
        super().__init__(line, talk, terms)
        self._entries = count()
        self.introducer: str = line.introducer
        """The introducer of a command that the link master understands."""

    @property
    def speakers(self) -> Sequence[int]:
        """The configured bodies."""
        return [body.number for body in self.line.bodies]

    def table(self, body: int) -> Any:
        """The table of a body in the configuration."""
        return next(table for table in self.line.bodies if table.number == body)

    async def reach(self) -> None:
        """Find what begins a command that is understood, the configured one first."""
        for introducer in sorted(INTRODUCERS, key=lambda introducer: introducer != self.line.introducer):
            asked = [body for body in self.speakers if introducer == "&" or body <= OLDEST_BODY]
            for body in asked[:ASKED_FIRST]:
                if await self.ask(body, _entry(next(self._entries)), introducer=introducer):
                    self.introducer = introducer
                    return
                self.patience_s = max(self.line.reply_timeout_s, 1.0)  # it may not be there

    def numbered(self, speaker: int) -> tuple[Key, bytes]:
        """Ask for the next position entry."""
        entry = next(self._entries) % ENTRIES
        return (speaker, entry), self.frame(speaker, _entry(entry))

    def key_of(self, heard: bytes) -> Key | None:
        """Read the number of an answer to 3ND."""
        for frame in LinkReader().feed(heard):
            if isinstance(frame, Answer) and frame.code == GetNumberedPositionEntry.code:
                try:
                    return frame.body, NumberedPositionEntry.read(frame.payload).position
                except WireFault:
                    return None
        return None

    def frame_of(self, debt: Debt) -> bytes:
        """The frame that pays a debt."""
        return self.frame(debt.place, self.command_of(debt))

    def subject_of(self, debt: Debt) -> str:
        """The number of the body."""
        return f"{debt.place:02X}"

    async def set_back(self, place: int, command: RorzeCommand[Any]) -> None:
        """Restore a setting.

        :raises Unanswered: it was not taken, or that is not known.
        """
        if not isinstance(await self.ask(place, command), Answer):
            raise Unanswered(f"{command.code} was not taken by body {place:02X}.")

    def frame(self, body: int, command: RorzeCommand[Any], introducer: str | None = None) -> bytes:
        """Write a command as this line is spoken to."""
        return encode(body, command, introducer or self.introducer)

    async def ask(
        self, body: int, command: RorzeCommand[Any], *, introducer: str | None = None, within_s: float = 0.0
    ) -> Answer | Refusal | None:
        """Send a command and give its answer; None if none came."""
        frame = self.frame(body, command, introducer)
        since = len(self.talk.heard)
        self.talk.send(frame)
        wait_s = self.within_s(frame) + command.takes_s + within_s

        def answers(lines: list[Heard]) -> Iterator[Answer | Refusal]:
            for frame in _frames(lines):
                if isinstance(frame, Answer | Refusal) and (frame.body, frame.code) == (body, command.code):
                    yield frame

        return next(answers(await self.talk.hear(lambda lines: any(answers(lines)), wait_s, since)), None)

    async def read(self, body: int, command: RorzeCommand[Any]) -> Any:
        """Ask, and give the reply as the command's row reads it; None if none came or it is another."""
        for _ in range(TRIES):
            answer = await self.ask(body, command)
            if answer is not None:
                break
        try:
            return command.read_reply(answer.payload) if isinstance(answer, Answer) else None
        except WireFault:
            return None

    async def answers(self, group: int) -> bool:
        """Tell whether a virtual body answers a question."""
        command = GetControllerStatus()
        frame, since = self.frame(group, command), len(self.talk.heard)
        self.talk.send(frame)

        def told(lines: Sequence[Heard]) -> bool:
            return any(isinstance(frame, GroupAnswer) and frame.body == group for frame in _frames(lines))

        return told(await self.talk.hear(told, self.within_s(frame), since))

    async def someone(self) -> int | None:
        """A body that answers."""
        await self.sample()
        return min(self.present, default=None)

    async def describe(self) -> None:
        """Ask each body that answers for its version."""
        for body in sorted(self.present):
            reply = await self.read(body, GetInformation())
            if reply is not None:
                self.serial_numbers[f"{body:02X}"] = reply.text


def _entry(number: int) -> GetNumberedPositionEntry:
    return GetNumberedPositionEntry(entry=PositionReference(position=number))


def _frames(lines: Sequence[Heard]) -> Iterator[Frame]:
    for line in lines:
        yield from LinkReader().feed(line.data)


# Questions


async def interjection(row: Assumption, bench: RorzeBench) -> Finding:
    """Ask several questions in one go."""
    body = await bench.someone()
    if body is None:
        return cannot_tell(row, "No body has answered.")
    answered = await _in_one_go(bench, body)
    seen = f"{answered} of {IN_ONE_GO} questions in one go were answered."
    careful = bench.line.stop_mode == "after_reply"
    if answered == IN_ONE_GO or careful:
        return agrees(f"{seen} A stop waits for the reply under way, as is configured." if careful else seen)
    return fails(row, seen, Change(row.key, "after_reply"))


async def _in_one_go(bench: RorzeBench, body: int) -> int:
    """Send questions without waiting, and count the answers."""
    keyed = [bench.numbered(body) for _ in range(IN_ONE_GO)]
    frame = b"".join(question for _, question in keyed)
    since = len(bench.talk.heard)
    sent_at = bench.talk.send(frame)
    bench.asked.update((key, sent_at) for key, _ in keyed)
    wanted = {key for key, _ in keyed}

    def found(lines: Sequence[Heard]) -> set[Key]:
        return wanted & {key for line in lines if (key := bench.key_of(line.data)) is not None}

    heard = await bench.talk.hear(
        lambda lines: found(lines) == wanted, IN_ONE_GO * bench.within_s(frame) + SETTLES_S, since
    )
    return len(found(heard))


async def order_per_body(row: Assumption, bench: RorzeBench) -> Finding:
    """Compare the order of answers with that of the questions."""
    body = await bench.someone()
    if body is None:
        return cannot_tell(row, "No body has answered.")
    answered = await _in_one_go(bench, body)
    mixed = [f"{body:02X}" for body in sorted(bench.present) if bench.out_of_order(body)]
    if mixed:
        return fails(row, f"Replies of {', '.join(mixed)} came in another order than the questions.")
    if answered < 2:
        return cannot_tell(row, "The line takes one frame at a time: no reply could overtake another.")
    return agrees(f"{len(bench.times)} replies came in the order of their questions.")


async def silent_xid(row: Assumption, bench: RorzeBench) -> Finding:
    """Ask the link master who is there, and bodies in every form where it is silent."""
    await bench.sample()
    master = await bench.ask(LINK_MASTER, IdentifyControllers(), introducer="&")
    if isinstance(master, Answer):
        return agrees(f"XID is answered: {master.payload or 'without a list'}.")
    if isinstance(master, Refusal):
        return agrees("XID is refused: there is a link master, and its bodies are asked one by one.")
    body = await bench.someone()
    if body is None:
        return cannot_tell(row, "Neither XID nor a body is answered.")
    if bench.introducer != bench.line.introducer:
        seen = f"XID is not answered, and body {body:02X} answers {bench.introducer!r} only."
        return fails(row, seen, Change(row.key, bench.introducer))
    return agrees("XID is not answered, and bodies are: they are served as those of an old link master.")


async def label_answers(row: Assumption, bench: RorzeBench) -> Finding:
    """Look for a label in the program of each body, and ask for it."""
    await bench.sample()
    for body in sorted(bench.present):
        label = await _first_label(bench, body)
        if label is None:
            continue
        line = await bench.read(body, GetProgramLine(label=label))
        instruction = await bench.read(body, GetProgramInstruction(label=label))
        told = [answer.instruction if answer is not None else None for answer in (line, instruction)]
        seen = f"Body {body:02X} answers UPD and UWD of label {label} by {told[0]} and {told[1]}."
        return agrees(seen) if told == [f"*{label}"] * 2 else fails(row, seen)
    return cannot_tell(row, "No body has a program with a label.")


async def _first_label(bench: RorzeBench, body: int) -> str | None:
    end = await bench.read(body, GetLastProgramAddress())
    if end is None or end.address == 0:
        return None
    place: GetProgramLine = GetProgramLine(address=0)
    for _ in range(min(end.address, LINES_READ)):
        line = await bench.read(body, place)
        if line is None or line.instruction is None:
            return None
        if line.instruction.startswith("*"):
            return str(line.instruction[1:])
        place = GetProgramLine()
    return None


async def half_command(row: Assumption, bench: RorzeBench) -> Finding:
    """Send half a question, and what ends it: first as is configured, then otherwise."""
    body = await bench.someone()
    if body is None:
        return cannot_tell(row, "No body has answered.")
    configured: HalfCommandEnd = bench.line.half_commands
    ended, seen = await _ended_half(bench, body, configured)
    if ended:
        return agrees(seen)
    for other in HALF_COMMAND_ENDS:
        if other != configured and (await _ended_half(bench, body, other))[0]:
            return fails(row, seen, Change(row.key, other))
    return fails(row, seen)


async def _ended_half(bench: RorzeBench, body: int, end: HalfCommandEnd) -> tuple[bool, str]:
    """Send half a question and an end of it: whether nothing was executed, and what was seen."""
    key, frame = bench.numbered(body)
    ending = HALF_COMMAND_ENDS[end]
    since = len(bench.talk.heard)
    bench.talk.send(frame.removesuffix(CR))
    await bench.pause(SETTLES_S)
    bench.talk.send(ending)
    await bench.talk.hear(lambda _: False, bench.within_s(ending), since)
    lines = bench.talk.heard[since:]
    if any(isinstance(frame, Answer) and frame.body == body for frame in _frames(lines)):
        return False, f"Half a question was answered, and what ended it with it: {key[1]}."
    if not await bench.ask_number(body):
        return False, "Nothing is answered any more after half a question and what ends it."
    told = next((frame for frame in _frames(lines) if not isinstance(frame, Garbage)), None)
    code = f"@{told.error:02X}" if isinstance(told, Refusal) and told.error is not None else "nothing"
    return True, f"Half a question and what ends it were answered by {code}."


async def wrong_mode(row: Assumption, bench: RorzeBench) -> Finding:
    """Ask a question of another operating mode."""
    body = await bench.someone()
    if body is None:
        return cannot_tell(row, "No body has answered.")
    reply = await bench.read(body, GetOperatingMode())
    mode = None if reply is None else reply.mode
    if mode is None:
        return cannot_tell(row, f"Body {body:02X} does not tell its operating mode.")
    other: RorzeCommand[Any] = GetClearPulseTime() if mode == "encoder" else GetAdjustmentLimit()
    answer = await bench.ask(body, other)
    asked = f"{other.code} in {mode} mode"
    if answer is None:
        return fails(row, f"{asked} is not answered.")
    if isinstance(answer, Answer):
        return fails(row, f"{asked} is done: {answer.payload}.")
    if answer.error is None:
        return cannot_tell(row, f"{asked} is refused without a code.")
    seen = f"{asked} is refused with {answer.error:02X}h."
    return agrees(seen) if answer.error == WRONG_MODE else fails(row, seen)


async def lasting_errors(row: Assumption, bench: RorzeBench) -> Finding:
    """Read the status of each body twice."""
    await bench.sample()
    standing = {}
    for body in sorted(bench.present):
        before = await _errors(bench, body)
        if before:
            standing[body] = before
    if not standing:
        return cannot_tell(row, "No body has an error that could last.")
    await bench.pause(READ_TWICE_S)
    for body, before in standing.items():
        gone = before & ~(await _errors(bench, body))
        if gone:
            names = ", ".join(names_of(gone, CONTROLLER_STATUS_BITS))
            return fails(row, f"Body {body:02X} has forgotten {names} by itself.")
    bodies = ", ".join(f"{body:02X}" for body in standing)
    return agrees(f"The errors of {bodies} have lasted from one reading to the next.")


async def _errors(bench: RorzeBench, body: int) -> int:
    reply = await bench.read(body, GetControllerStatus())
    if reply is None:
        raise Unanswered(f"Body {body:02X} does not tell its status.")
    return 0 if reply.bits is None else reply.bits & LASTING_ERRORS


Trial = Callable[[Assumption, RorzeBench], Awaitable[Finding]]

QUESTIONS: Final[Mapping[str, Trial]] = MappingProxyType(
    {
        "echo": echo,
        "late-replies": late_replies,
        "turnaround": turnaround,
        "interjection": interjection,
        "order-per-body": order_per_body,
        "copies-of-replies": copies,
        "silent-xid": silent_xid,
        "label-answers": label_answers,
        "half-command": half_command,
        "wrong-mode": wrong_mode,
        "lasting-errors": lasting_errors,
    }
)
