"""The wishes of clients and the answers they got, compared with the truth of the simulators.

The invariants have numbers: I1 at most once on the wire; I2 nothing with an effect without a durable intent;
I3 nothing after a stop that was asked for before it; I4 replies are credited to what they answer; I5 what is
told as not done was not done; I6 what is told as done was done once; I7 nothing is executed that was not
written so, as a whole; I8 no frame begins in another; I9 events are numbered without a hole, and no move ends
before it began; I10 a confirmed stop stands still; I11 no deadline follows the wall clock: without its jumps
the same seed sends the same; I12 nothing that was sent is told to be repeatable; I13 queues are bounded; I14
after the faults every line is well again; I15 no robot is said to have lost its power that never did.
"""

from collections import defaultdict
from dataclasses import dataclass, field
from typing import Literal

from gateway.core.errors import GarbledReply, GatewayError, NoReply
from gateway.core.events import Event
from gateway.core.move_record import MoveRecord, MoveStatus
from gateway.core.targets import AnyCommand
from gateway.fics.errors import NotDone
from protocols.table import Effect, Retry
from simulator.faults import Fault
from simulator.truth import Fact
from tests.fault_simulator.families import Family
from tests.fault_simulator.world import Cable, Written

Told = Literal["nothing", "done", "begun", "refused", "unknown"]
"""`nothing`: the gateway was killed before it answered."""
UNDONE = (MoveStatus.CANCELLED, MoveStatus.REJECTED)
DAMAGING = {Fault.GARBLED, Fault.NOISE}
ORDER = ("queued", "sent", "started")


@dataclass(eq=False)
class Deed:
    """Something that a client wanted."""

    id: str
    path: str
    command: AnyCommand
    asked_at: float
    told: Told = "nothing"
    error: GatewayError | None = None
    moves: list[str] = field(default_factory=list)

    @property
    def is_effective(self) -> bool:
        """Say whether the command changes anything."""
        return self.command.effect is not Effect.READ

    def __str__(self) -> str:
        return f"{self.id} {self.path} {self.command!r} told {self.told} ({self.error})"


@dataclass(eq=False)
class History:
    """All that happened in the lives of one seed."""

    family: Family
    cable: Cable
    deeds: dict[str, Deed] = field(default_factory=dict)
    stops: list[tuple[float, frozenset[str]]] = field(default_factory=list)
    violations: list[str] = field(default_factory=list)
    final: dict[str, MoveRecord] = field(default_factory=dict)
    """The records of moves as the last life knows them."""
    faults: int = 0
    crashes: int = 0
    upsets: int = 0
    """Times that a machine lost its power."""
    _by_request: defaultdict[str | None, list[Written]] = field(default_factory=lambda: defaultdict(list))
    _last_number: dict[str, int] = field(default_factory=dict)
    _told_by_move: defaultdict[str, list[str]] = field(default_factory=lambda: defaultdict(list))

    def violate(self, invariant: str, what: object) -> None:
        """Note that an invariant does not hold."""
        self.violations.append(f"{invariant}: {what}")

    # as it happens

    def judge_write(self, written: Written, *, has_intent: bool) -> None:
        """Look at a frame right before it is written: I2, I3."""
        effect = self.family.effect_of(written.text)
        if effect in (Effect.READ, Effect.STOP):
            return
        deed = self.deeds.get(written.request_id or "")
        if deed is None:
            if effect is Effect.MOTION:
                self.violate("I2", f"nobody has asked for {written}")
            return
        if not has_intent and (effect is Effect.MOTION or self.family.carries(written.text, deed.command)):
            self.violate("I2", f"{written} has no durable intent")
        reach = self.family.reach(deed.path)
        for at, stopped in self.stops:
            if effect is Effect.MOTION and at > deed.asked_at and reach & stopped:
                self.violate("I3", f"{written} was asked for at {deed.asked_at} and stopped at {at}")

    def judge_credit(
        self, frame: str, *, answered: int | None, numbers: frozenset[int], what: object
    ) -> None:
        """Look at a reply that is being credited to a frame: I4.

        `numbers` are those of the frames whose bytes, or answers, arrived together with it.
        """
        if answered is None:
            self.violate("I4", f"{what} answers nothing, credited to {frame!r}")
            return
        causes = {
            self.cable.frame[number].text for number in numbers | {answered} if number in self.cable.frame
        }
        if frame not in causes:
            self.violate("I4", f"{what} answers {causes}, credited to {frame!r}")

    def judge_event(self, event: Event, epoch: str) -> None:
        """Look at an event: I9, I10, I15."""
        last = self._last_number.get(epoch)
        if last is not None and event.number != last + 1:
            self.violate("I9", f"event {event.number} of {epoch} comes after {last}")
        self._last_number[epoch] = event.number
        if event.type.endswith(".stop.confirmed") and self.family.moving(event.subject):
            self.violate("I10", f"{event.subject} moves, and its stop is confirmed")
        if event.type == "robot.power_cycled" and not self.upsets:
            self.violate("I15", f"{event.subject} has kept its power")
        if ".move." in event.type:
            self._judge_move_event(event)

    def _judge_move_event(self, event: Event) -> None:
        news, move_id = event.type.rpartition(".")[2], str(event.data.get("id"))
        told = self._told_by_move[move_id]
        if news not in ORDER:
            if any(state not in ORDER for state in told) and not self.crashes:
                self.violate("I9", f"{move_id} ends twice: {[*told, news]}")
        elif any(state not in ORDER for state in told) and not self.crashes:
            self.violate("I9", f"{move_id} goes on after its end: {[*told, news]}")
        told.append(news)

    # afterwards

    def judge(self) -> list[str]:
        """Look at everything once more: I1, I5, I6, I7, I8, I12."""
        self.violations += [f"I8: {overlap}" for overlap in self.cable.overlaps]
        self._judge_executed()
        for written in self.cable.history:
            self._by_request[written.request_id].append(written)
        facts = defaultdict(list)
        for fact in self.cable.machine.truth:
            if fact.request is not None and fact.request in self.cable.frame:
                facts[self.cable.frame[fact.request].request_id].append(fact)
        for deed in self.deeds.values():
            if deed.is_effective:
                done = self._times_done(deed, facts[deed.id])
                if done == 0 and any(map(_is_damaged, facts[deed.id])):
                    continue  # no checksum tells a damaged command from another one
                self._judge_deed(deed, min(done, 1) if deed.path.startswith("/groups/") else done)
        return self.violations

    def _times_done(self, deed: Deed, facts: list[Fact]) -> int:
        """Count the times it was carried out: a frame that was doubled, or bent into a group's, is one."""
        return len({fact.request for fact in facts if self.family.has_done(fact, deed.command)})

    def _judge_executed(self) -> None:
        """Nothing that was cut off, or ran into another frame, has become a command."""
        truth = self.cable.machine.truth
        damaged = {fact.request for fact in truth if _is_damaged(fact)}
        for fact in truth:
            written = self.cable.frame.get(fact.request or 0)
            if written is None or fact.request in damaged or not self.family.was_taken(fact):
                continue
            if fact.facts["text"] not in self.family.texts(written.text):
                self.violate("I7", f"{fact.facts['text']!r} was executed at {written}")

    def _judge_deed(self, deed: Deed, done: int) -> None:
        written = self._written(deed)
        if len(written) > 1 and deed.command.retry_class() is not Retry.STOP:
            self.violate("I1", f"{deed} was written {len(written)} times")
        if deed.told == "refused" and done:
            self.violate("I5", f"{deed} was done")
        once = done == 1 or (done == 0 and self.family.reads_back)
        if deed.told == "done" and not once:
            self.violate("I6", f"{deed} was done {done} times")
        if deed.error is not None and deed.error.retryable and written and done:
            self.violate("I12", f"{deed} was done, and may be repeated")
        for move_id in deed.moves:
            self._judge_end(deed, self.final.get(move_id), move_id, done)

    def _judge_end(self, deed: Deed, move: MoveRecord | None, move_id: str, done: int) -> None:
        if move is None:
            self.violate("L", f"{deed} has begun {move_id}, and it is forgotten")
        elif move.status in UNDONE and done and len(deed.moves) == 1:
            self.violate("I5", f"{deed} is {move.status} ({move.error}), and was done")
        elif move.status is MoveStatus.SUCCEEDED and done != 1 and not _was_there(move):
            self.violate("I6", f"{deed} has succeeded, and was done {done} times: {move.evidence}")
        elif move.status is MoveStatus.UNKNOWN and not (move.evidence or move.error):
            self.violate("L", f"{deed} is unknown without a word")

    def _written(self, deed: Deed) -> list[Written]:
        return [
            written
            for written in self._by_request[deed.id]
            if self.family.carries(written.text, deed.command)
        ]


def _was_there(move: MoveRecord) -> bool:
    return any("there was nothing to do" in sentence for sentence in move.evidence)


def _is_damaged(fact: Fact) -> bool:
    faults = fact.facts.get("faults")
    return fact.kind == "request" and isinstance(faults, dict) and bool(DAMAGING & faults.keys())


def told_by(error: GatewayError) -> tuple[Told, GatewayError]:
    """The outcome that a client learns from an error."""
    unknown = error.moved != "no" or isinstance(error, NoReply | GarbledReply | NotDone)
    return ("unknown" if unknown else "refused"), error
