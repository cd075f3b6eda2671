"""The power of a body: the signs that it was lost, the mark that proves it kept, and what is refused then.

A controller that loses its power for 10 ms may begin anew (RC-420 manual 5.4.2): it calls the place where it
stands 0, and takes its settings and its position table from flash memory. The mark is a text in a user
comment, in RAM only: where it still stands, the power was kept.
"""

import logging
from collections.abc import Callable
from dataclasses import dataclass, field
from math import inf
from typing import Any, Final, Literal, NamedTuple, Protocol

from gateway.core.errors import Cancelled, ControllerRefused, GatewayError, NotSent, PowerCycled
from gateway.core.exchange import Lane
from gateway.core.records import AnswerModel
from gateway.rorze.asked_body import Homed, is_mark, new_mark
from gateway.rorze.knowledge import RENAMING, STARTS_PROGRAM, Tell, Tracker
from gateway.rorze.session import Answered, RorzeExchange
from protocols.rorze.commands import COMMANDS
from protocols.rorze.flash import SaveSettings
from protocols.rorze.moves import RelativeMove
from protocols.rorze.notation import PositionReference
from protocols.rorze.origin import CentreStallDog, OriginSearch
from protocols.rorze.position import SetPosition
from protocols.rorze.row import RorzeCommand
from protocols.rorze.status import (
    CONTROLLER_STATUS_BITS,
    ControllerStatus,
    GetInformation,
    SetUserComment,
    names_of,
)
from protocols.table import Effect, Reply

POWER_ON_POSITION = 0
"""An assumption: what a controller calls its position, and the distance of its last homing (0PD), when it
has been switched on; a loss of power of 10 ms may switch it on again (RC-420 manual 5.4.2)."""
PROOF_HOLDS_S = 2.0
"""A motion to a place is not written when its body was last proved to have kept its power longer ago."""
LASTING_ERRORS = 0x76
"""Bits of the controller status (9CD) that stay until they are cleared, and are gone after power-on: limit,
EMS, initialisation, movement range, STALL."""
ACKNOWLEDGE = (
    "Home it; or see where it stands and that its settings are right, and acknowledge the power cycle."
)

NO_SETTINGS: Final = ("UDD", "9VD")
"""Data memories change while a user program runs, and a comment may hold the mark."""

Acknowledgement = Literal["homing", "set_position", "request"]

_ELSEWHERE: Final = frozenset((*STARTS_PROGRAM, *RENAMING))
"""Commands after which it may stand, or say that it stands, at another place."""


class ProofTooOld(NotSent):
    """A motion waited until its body may have lost its power since it was asked."""


def needs_place(command: RorzeCommand[Any]) -> bool:
    """True if a motion ends where a loss of power would not let it end.

    So do moves to a position or by an entry of the position table, interpolated moves, and programs.
    """
    if command.effect is not Effect.MOTION:
        return False
    if isinstance(command, RelativeMove):
        return isinstance(command.distance, PositionReference)
    if isinstance(command, OriginSearch | CentreStallDog):
        return False
    return command.starts_motion or isinstance(command, STARTS_PROGRAM)


def _asks_for_setting(code: str) -> bool:
    query, setter = COMMANDS[code], COMMANDS.get(f"{code[:-1]}S")
    asks = query.effect is Effect.READ and code[-1:] == "D" and code not in NO_SETTINGS
    return asks and setter is not None and setter.effect is Effect.SETTING and not setter.program


SETTINGS_READ: Final = frozenset(filter(_asks_for_setting, COMMANDS))
"""The queries of what only a host can change, and no user program."""


class PowerMemory(AnswerModel):
    """The facts of a body's power that are kept over restarts."""

    comment: int
    mark: str | None
    cycled: bool
    certain: bool
    homed: Homed


class PowerSeen(NamedTuple):
    """The state of a body's power before it does something, to compare with a later one."""

    mark: str | None
    losses: int


@dataclass(eq=False)
class PowerMark:
    """A text in a user comment, in RAM only: where it still stands, the power was kept."""

    comment: int = 0
    """Number of the user comment (9VS) that holds the mark, 1-7; 0: there is no mark."""
    text: str | None = None
    """The comment; None while none was written and read back."""
    candidate: str | None = None
    """The comment that is being written."""
    due: bool = True
    """True while the mark is to be written or looked at."""
    taken: bool = False
    """True if the comment holds a user's own text, or does not exist."""
    vouches: bool = False
    """True if it stood already when the body was last seen at rest."""
    saved: bool = False
    """True if it may be in flash memory, where it proves nothing later."""

    @property
    def is_written(self) -> bool:
        """True if it stands, or cannot be written."""
        return self.text is not None or not self.comment or self.taken

    def is_overwritten_by(self, command: RorzeCommand[Any]) -> bool:
        """True if it proves nothing after a command."""
        if type(command) is SaveSettings:
            return True
        if not isinstance(command, SetUserComment) or command.comment_number != self.comment:
            return False
        return command.text not in (self.text, self.candidate)

    def was_written(self, text: str) -> None:
        """It was written and read back."""
        self.text, self.candidate, self.due, self.vouches, self.saved = text, None, False, False, False

    def forget(self) -> None:
        """It is to be written anew."""
        self.text, self.candidate, self.due, self.taken = None, None, True, False


@dataclass(eq=False)
class PowerSigns:
    """A body's answers that show a loss of power, where they do not follow from what it said before."""

    changed: RorzeCommand[Any] | None = None
    """A question for a setting that was answered otherwise than before, without a command that changed it."""
    seen: bool = False
    """True if it was seen at rest."""
    _silent: bool = False
    _settings: dict[str, str] = field(default_factory=dict)
    """Settings as they were last read, by the texts of their questions."""
    _position: int | None = None
    _sure: bool = False
    """True if that place was read twice, or is where it was sent: one garbled digit proves nothing."""
    _errors: int = 0
    _errors_once: int = 0
    """Errors of the last reading; `_errors` has those that two readings in a row told of."""

    def forget_the_told(self) -> None:
        """A command may change settings and errors."""
        self._errors = self._errors_once = 0
        self._settings.clear()

    def forget_place(self) -> None:
        """It moves, or has moved."""
        self._position = None

    def forget_all(self) -> None:
        """It begins anew."""
        self.forget_the_told()
        self._position, self._silent, self.changed = None, False, None

    def differs(self, question: RorzeCommand[Any], reply: Reply) -> bool:
        """True if a setting is not what it was when it was first read."""
        told = reply.written()
        return self._settings.setdefault(question.code + question.written(), told) != told

    def note_status(self, bits: int) -> None:
        """Its status was read once more: an error that was told twice was no garbled digit."""
        self._errors |= self._errors_once & bits

    def note_silence(self) -> None:
        """It does not answer: it may be without power."""
        self._silent = True

    def note_kept(self) -> None:
        """Its mark explains the silence."""
        self._silent = False

    def note_rest(self, position: int, bits: int, target: int | None) -> None:
        """It stands there, and that is believed, the more where it was sent there."""
        self._sure, self._position = position in (self._position, target), position
        lasting = bits & LASTING_ERRORS
        self._errors, self._errors_once = lasting & (self._errors | self._errors_once), lasting
        self.seen, self._silent = True, False
        if self.changed is not None:  # settings count from now on
            self.changed = None
            self._settings.clear()

    def contradicts(self, position: int, bits: int, tolerance: int = 0) -> bool:
        """True if what a body at rest says does not follow from what it said before."""
        back_from_silence = self._silent and self.seen and self._position is None
        jumped = self.jumped(position, bits, tolerance) is not None
        return jumped or back_from_silence or self.changed is not None

    def jumped(self, position: int, bits: int, tolerance: float = 0) -> str | None:
        """Say how position or status of a body at rest have changed though nothing here has changed them."""
        is_known = self._sure or position == POWER_ON_POSITION
        if is_known and self._position is not None and abs(position - self._position) > tolerance:
            return f"its position went from {self._position} to {position}"
        gone = names_of(self._errors & ~bits, CONTROLLER_STATUS_BITS)
        return f"{', '.join(gone)} went from its status" if gone else None

    def looks_switched_on(self, position: int) -> bool:
        """True if a body stands where one stands that was switched on, and stood elsewhere before."""
        return position == POWER_ON_POSITION and self._position != POWER_ON_POSITION


@dataclass(eq=False)
class BodyPower(Tracker):
    """The power of a body, as far as it is known, and what is refused where it was lost."""

    mark: PowerMark = field(default_factory=PowerMark)
    needs_origin: bool = True
    """True if a loss of power makes its position worthless."""
    doubts_silence: bool = False
    """True if each silence counts as a loss of power: nothing on the wire tells where a board keeps all."""
    on_news: Tell = lambda _kind, _facts: None
    on_memory: Callable[[], None] = lambda: None
    """Called when there is something else to remember."""
    signs: PowerSigns = field(default_factory=PowerSigns)
    homed: Homed = "unknown"
    cycled: bool = False
    """True if it has lost its power, and was neither homed nor acknowledged since."""
    certain: bool = True
    """True if that loss is certain."""
    losses: int = 0
    """Counts the losses of power that were noticed."""
    proved_at: float = -inf
    """Time when it was last known to have kept its power, on the event loop's clock."""
    _was_homed: Homed | None = None
    """The state of homing in an earlier life, until the mark has shown that this is still so."""

    # over restarts

    def memory(self) -> str:
        """Give what is to be remembered; a mark that may be in flash memory proves nothing later."""
        mark = None if self.mark.saved else self.mark.text
        homed = self._was_homed or self.homed
        kept = PowerMemory(
            comment=self.mark.comment, mark=mark, cycled=self.cycled, certain=self.certain, homed=homed
        )
        return kept.model_dump_json()

    def recall(self, memory: str) -> None:
        """Go on from what was remembered; what the mark does not prove is believed when it does.

        :raises ValueError: it cannot be read.
        """
        told = PowerMemory.model_validate_json(memory)
        if told.comment == self.mark.comment and self.mark.comment:
            self.mark.text, self.mark.vouches = told.mark, True
            self._was_homed = told.homed if told.mark else None
        cycled = told.cycled or self.doubts_silence  # no gateway has asked it meanwhile
        self.cycled, self.certain = cycled and self.needs_origin, told.cycled and told.certain
        if self.cycled:
            self.homed = "no"

    @property
    def is_vouched(self) -> bool:
        """True if the mark, where there is one, stood already when the body was last seen at rest.

        One that was written later proves nothing of the time before.
        """
        return self.mark.text is None or self.mark.vouches

    @property
    def seen(self) -> PowerSeen:
        """Give what is known now, to compare with what is known later."""
        return PowerSeen(self.mark.text, self.losses)

    def kept_since(self, before: PowerSeen) -> bool | None:
        """True if it has kept its power since then, as far as is known; None where no mark vouches for it."""
        if self.losses != before.losses:
            return False
        return True if before.mark is not None and self.mark.text == before.mark else None

    # what it hears

    def sent(self, command: RorzeCommand[Any], *, is_known: bool) -> None:
        """Settings and errors may change, and some commands let it stand elsewhere."""
        self.signs.forget_the_told()
        if type(command) is SaveSettings:
            self.mark.saved = True
            self.on_memory()
        if command.starts_motion or not is_known or type(command) in _ELSEWHERE:
            self.signs.forget_place()

    def done(self, command: RorzeCommand[Any], *, certain: bool) -> None:
        """A mark that is saved to flash memory proves nothing any more."""
        if self.mark.is_overwritten_by(command):
            self._forget_mark()
        if certain and type(command) is SetPosition:
            self._was_placed(command)

    def _forget_mark(self) -> None:
        self.mark.forget()
        self.on_memory()

    def _was_placed(self, command: SetPosition) -> None:
        """A caller has said where it stands; the encoder's count, too, is lost with the power."""
        if command.position == "encoder" or not self.mark.is_written:
            return
        if self.homed == "no":
            self.homed = "unknown"
        self.acknowledge("set_position")

    def replied(self, question: RorzeCommand[Any], reply: Reply, at: float) -> None:  # noqa: ARG002
        """A setting that differs without a command is a sign."""
        if question.code in SETTINGS_READ and self.signs.differs(question, reply):
            self.signs.changed, self.mark.due = question, True
        if type(reply) is ControllerStatus and reply.bits is not None:
            self.signs.note_status(reply.bits)

    def may_move(self) -> None:
        """The mark is to be looked at."""
        self.mark.due = True

    def silent(self) -> None:
        """It may be without power."""
        if self.doubts_silence and self.signs.seen and not self.cycled:
            self.lost(certain=False, why="it was out of reach")
        self.signs.note_silence()
        self.mark.due = True

    def rests(self, position: int, bits: int, at: float, target: int | None = None) -> None:
        """It stands there, and that is believed, the more where it was sent there."""
        self.signs.note_rest(position, bits, target)
        self.mark.vouches = self.mark.text is not None
        if self.mark.text is None:
            self.proved_at = at

    # the verdict

    def was_marked(self, text: str) -> None:
        """A mark was written and read back."""
        self.mark.was_written(text)
        self.on_memory()

    def was_kept(self, at: float) -> None:
        """Its mark stands."""
        if self.mark.vouches:
            self.proved_at = at
            self.signs.note_kept()
        if self._was_homed is not None:
            self.homed, self._was_homed = self._was_homed, None

    def lost(self, *, certain: bool, why: str = "its mark is gone") -> None:
        """Keep it from going to places: it has been switched off and on, or seems to have been, and `why`."""
        self.losses += 1
        self.homed, self.cycled, self.certain = "no", self.needs_origin, certain
        self._was_homed = None
        self._forget_mark()
        self.signs.forget_all()
        self.on_news("body.power_cycled", {"certain": certain, "why": why})

    def found_origin(self) -> None:
        """An origin search has ended well."""
        if not self.mark.is_written:
            return
        self.homed, self._was_homed = "yes", None
        self.acknowledge("homing")

    def acknowledge(self, by: Acknowledgement) -> None:
        """Let it go to places again."""
        if self.cycled:
            self.cycled = False
            self.on_news("body.power_cycle.acknowledged", {"by": by})
        self.on_memory()

    # what is refused

    def refusal(self, address: str, command: RorzeCommand[Any]) -> PowerCycled | None:
        """Why a motion to a place must not be sent."""
        if not self.cycled or not needs_place(command):
            return None
        has_been = "has been" if self.certain else "seems to have been"
        return PowerCycled(
            f"{address} {has_been} switched off and on: its position and its position table mean nothing "
            f"now; {command.code} was not sent.",
            ACKNOWLEDGE,
        )

    def lost_again(self, address: str) -> PowerCycled:
        """Why a loss of power cannot be acknowledged: there was another one."""
        return PowerCycled(f"{address} has been switched off and on once more.", ACKNOWLEDGE)

    def refuses_write(self, address: str, command: RorzeCommand[Any], now: float) -> GatewayError | None:
        """Why a command must not be written in this instant, whatever was true when it was queued."""
        if not self.needs_origin or not needs_place(command):
            return None
        refusal = self.refusal(address, command)
        if refusal is None and command.starts_motion and now - self.proved_at > PROOF_HOLDS_S:
            return ProofTooOld(
                f"{address} was not asked right before whether it has kept its power; {command.code} was not "
                "sent.",
                "Try again.",
            )
        return refusal


# the mark, written and read

log = logging.getLogger(__name__)

TRIES = 3
"""Attempts to write a mark that is not found again as it was written."""


class MarkedBody(Protocol):
    """A body, as far as its mark is concerned."""

    power: BodyPower

    @property
    def address(self) -> str:
        """Its unique address."""

    @property
    def on_news(self) -> Callable[[str, dict[str, object]], None]:
        """Called with what happens to it: the kind of event, and its data."""

    async def ask(self, command: RorzeCommand[Any], *, lane: Lane | None = None) -> tuple[Any, Answered]:
        """Send a command and give its reply."""

    def drop(self, unwanted: Callable[[RorzeExchange], bool], reason: GatewayError) -> None:
        """Take commands out of its queue."""


class _StandsAlready(Cancelled):
    """Another has written the mark meanwhile."""

    def __init__(self) -> None:
        super().__init__("The mark stands already; nothing was sent.")


class Mark:
    """Writes the mark of one body, and looks at it."""

    def __init__(self, body: MarkedBody) -> None:
        self._body = body

    async def stands(self, lane: Lane) -> bool | None:
        """True if it proves that the body has kept its power; None where there is no mark.

        One reading proves that it stands, two equal ones that it does not.

        :raises GatewayError: the body did not tell.
        """
        power = self._body.power
        mark = power.mark.text
        if mark is None:
            return None
        before, (text, at) = None, await self._read(lane)
        while text not in (mark, before):
            before, (text, at) = text, await self._read(lane)
        if power.mark.text != mark:  # renewed meanwhile
            return None
        if text == mark:
            power.was_kept(at)
        else:
            power.lost(certain=True)
        return text == mark

    async def tend(self, lane: Lane) -> None:
        """See that it still stands, or write one, behind everything that people want.

        :raises GatewayError: the body did not tell, or take it.
        """
        power = self._body.power
        power.mark.due = False
        try:
            if await self.stands(lane) is None:
                await self.ensure(lane)
        except GatewayError:
            power.mark.due = True
            raise

    async def ensure(self, lane: Lane) -> None:
        """Write one where there is none, unless the comment holds a user's own text.

        :raises GatewayError: the body did not tell, or take it.
        """
        power = self._body.power
        if power.mark.is_written or await self._is_taken(lane):
            return
        for _ in range(TRIES):
            if not power.mark.is_written:  # another may have been quicker
                await self._write(lane)
        if not power.mark.is_written:
            raise NotSent(
                f"{self._body.address} did not keep a mark in user comment {power.mark.comment}, by which a "
                "loss of power would be seen; nothing was moved.",
                "Try again.",
            )

    async def _write(self, lane: Lane) -> None:
        """Write a mark, and accept it when it is found again; all who write one now write the same."""
        body, power = self._body, self._body.power
        candidate = power.mark.candidate = power.mark.candidate or new_mark()
        written = SetUserComment(comment_number=power.mark.comment, text=candidate)
        try:
            await body.ask(written, lane=lane)
        except _StandsAlready:
            return
        text, _ = await self._read(lane)
        if power.mark.text is None and written.text == power.mark.candidate == text:
            power.was_marked(text)
            # A copy that still waits would hide a loss of power.
            body.drop(self._is_a_copy, _StandsAlready())

    def _is_a_copy(self, exchange: RorzeExchange) -> bool:
        row = exchange.command
        if not isinstance(row, SetUserComment) or row.comment_number != self._body.power.mark.comment:
            return False
        return bool(row.text) and is_mark(row.text)

    async def _is_taken(self, lane: Lane) -> bool:
        """True if the comment is a user's own; a single garbled reading does not count."""
        try:
            found, _ = await self._read(lane)
            if is_mark(found) or found != (await self._read(lane))[0]:
                return False
            why = f"User comment {self._body.power.mark.comment} of {self._body.address} holds {found!r}."
        except ControllerRefused as refusal:
            why = refusal.detail
        detail = f"{why} The gateway writes no mark there, so a loss of power is told by its signs only."
        log.warning("%s", detail)
        self._body.power.mark.taken = True
        self._body.on_news(
            "body.power_mark.missing", {"comment": self._body.power.mark.comment, "detail": detail}
        )
        return True

    async def _read(self, lane: Lane) -> tuple[str, float]:
        question = GetInformation(comment_number=self._body.power.mark.comment)
        reply, answer = await self._body.ask(question, lane=lane)
        return reply.text, answer.at
