"""The RC-400 link master: the host's line on one side, its RC-420s on the other, a pure state machine."""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from math import inf
from random import Random
from typing import Generic, Literal, Protocol, TypeVar

from protocols.lines import CR
from protocols.rorze.interpolation import StartInterpolation
from protocols.rorze.link import INTRODUCERS, MoveEnded, Request, RequestReader, StatusChanged
from protocols.rorze.link_master import IdentifyControllers, SetGroup, SetReplyFormat
from protocols.rorze.row import EVENT, LINK_MASTER, MOVE_ENDED
from protocols.rorze.stops import StopImmediately
from protocols.table import WireFault
from simulator.faults import Faults
from simulator.rorze.actions import BAD_PARAMETER, CODE_LENGTH, UNKNOWN_CODE
from simulator.rorze.controller import Message, Response
from simulator.truth import TruthLog
from simulator.wire import Wire

TOO_LONG, BUSY = 0x23, 0x4C

PROGRAM_MESSAGE, PROGRAM_MESSAGE_CODE = 0x7C, "USD"
"""An assumption: no manual gives the frame in which a user program's text (SDC, SDD) reaches the host."""

LONGEST_FRAME = 1024
"""Bytes without a CR after which the link master stops waiting for one."""

SWAP_S = 0.02
"""Additional delay in seconds of every second reply where replies are swapped."""
_FILLING = "!"

_EXCESS = re.compile(rb"\r[\r\n]+\Z")
_NO_COMMAND = b"\0"
"""Makes a line that is no command of any line."""

STATUS_DIGITS = {"C": 2, "M": 2, "S": 2, "I": 4, "O": 4}
"""Hexadecimal digits of an event's fields (RC-420 manual 13.11.3)."""


@dataclass(frozen=True, slots=True)
class LinkSettings:
    """Settings that the RC-420 manual leaves open about its link master; each value is an assumption."""

    reply_delay_s: float = 0.0
    """Seconds from a command's end to the start of its reply; messages of the controllers take as long."""
    error_codes: bool = True
    """True if a refusal carries its code: `@4A` or just `@` (RC-420 manual 12)."""
    absent_bodies: Literal["silent", "error"] = "silent"
    """A body or group that is not there does not answer, or answers `@4C`."""
    interjection: Literal["accept", "drop"] = "accept"
    """The fate of a command that arrives before the last reply has left."""
    partners: Literal["go_on", "stop"] = "go_on"
    """The action of the other members when one of them is stopped on an interpolated path."""
    line_end: Literal["\r", "\r\n"] = "\r"
    """Ends every frame to the host; RC-420 manual 17.1 hints that XRS can add the LF."""
    excess_line_ends: Literal["invalid", "ignored"] = "invalid"
    """The effect of another CR, or an LF, on the command whose CR it comes with (RC-420 manual 17.1)."""
    reply_order: Literal["in_turn", "swapped"] = "in_turn"
    """Swapped: every second reply takes longer, so that the next one overtakes it."""
    introducers: str = INTRODUCERS
    """Commands that begin otherwise are not heard: an old link master knows `$` and `#` only (12)."""
    set_up: Literal["forgotten", "kept"] = "forgotten"
    """The rest of a loss of power: XID, XRS and XVS (RC-420 manual 17.2)."""
    overlong: Literal["refused", "executed"] = "refused"
    """The fate of a command of more than 60 characters; executed: `!` behind it are left out (12)."""
    echoes: bool = False
    """True if each frame comes back, as with an adapter's local echo."""


class Axis(Protocol):
    """An RC-420, as its link master sees it."""

    @property
    def powered(self) -> bool:
        """Tell whether it is there at all."""

    def execute(self, text: str, now: float) -> Response:
        """Do a command."""

    def advance(self, now: float) -> None:
        """Let everything happen that is due."""

    def wake_at(self) -> float | None:
        """The next moment at which something happens without a request."""

    def take_messages(self) -> list[Message]:
        """The bytes said since the last call."""

    def text_since(self) -> float | None:
        """Since when a text of its program waits to be collected."""

    def take_text(self, now: float) -> str | None:
        """Collect the text that waits."""

    def power_off(self, now: float) -> None:
        """Cut its power."""

    def power_on(self, now: float) -> None:
        """Give it power again."""


A = TypeVar("A", bound=Axis)


class Rc400(Generic[A]):
    """The link master and the line in front of it, faults included.

    Every frame of the host has a running number, from 1, in the order of their CRs. Its effects in the truth
    log carry that number, the reply included.
    """

    def __init__(
        self,
        axes: Mapping[int, A],
        truth: TruthLog,
        faults: Faults | None = None,
        settings: LinkSettings | None = None,
    ) -> None:
        self.axes = dict(axes)
        self.truth = truth
        self.faults = faults or Faults(Random(0))  # noqa: S311  # dice of a simulation
        self.settings = settings or LinkSettings()
        self._wire = Wire(self._hear, truth, self.faults, LINK_MASTER, LONGEST_FRAME)
        self.cut_off: set[int] = set()
        """Bodies whose RS-485 line is broken: they live on, hear nothing and are not heard."""
        self._now = -inf
        self._wakes = {body: at for body, axis in self.axes.items() if (at := axis.wake_at()) is not None}
        self._brown_outs: dict[int, float] = {}
        """Ends of the brown-outs of bodies, as times."""
        self._events_on = self._move_ends_on = False
        self._groups: dict[int, list[int]] = {}
        self._boot()

    @property
    def requests(self) -> int:
        """The number of frames that the host has sent."""
        return self._wire.requests

    # Power

    def _boot(self) -> None:
        """Start with nothing set: XID, XRS and XVS are assumed to be lost with the power."""
        if self.settings.set_up == "forgotten":
            self._events_on = self._move_ends_on = False
            self._groups.clear()
        self._collecting: set[int] = set()
        """Bodies whose text is on its way."""
        self._together: list[set[int]] = []
        """Members that have started an interpolated move at one command and are still in it."""
        self._reader = RequestReader()
        self._unanswered = 0
        self._at_once = -1
        """Commands heard so far of what came in one piece; -1 when nothing is being received."""
        self.powered = True

    def power_off(self, now: float) -> None:
        """Cut the power of the link master; the RC-420s keep theirs, and their moves go on."""
        self._advance(now)
        if self.powered:
            self._wire.clear()
            self.powered = False
            self.truth.log("power", self._now, LINK_MASTER, on=False)

    def power_on(self, now: float) -> None:
        """Give the link master power again."""
        self._advance(now)
        if not self.powered:
            self._boot()
            self.truth.log("power", self._now, LINK_MASTER, on=True)

    def switch_body(self, body: int, on: bool, now: float) -> None:
        """Cut or restore the power of one RC-420."""
        self._advance(now)
        self._brown_outs.pop(body, None)
        self._switch(body, on=on)

    def brown_out(self, body: int, for_s: float, now: float) -> None:
        """Cut the power of one RC-420 for a while."""
        self.switch_body(body, on=False, now=now)
        self._brown_outs[body] = self._now + for_s

    def _switch(self, body: int, *, on: bool) -> None:
        axis = self.axes[body]
        if axis.powered != on:
            (axis.power_on if on else axis.power_off)(self._now)
            self.truth.log("power", self._now, body, on=on)
            self._leave(body, stopped=True, now=self._now)
        self.look_after(body)

    # The host's side

    def receive(self, data: bytes, now: float) -> None:
        """Take bytes from the host."""
        self._advance(now)
        if not self.powered:
            return
        if self.settings.echoes:
            self._wire.send(data, None, self._now)
        self._at_once = 0
        self._wire.receive(data, self._now)
        self._at_once = -1

    def take_output(self, now: float) -> bytes:
        """Give the bytes that have left for the host by now."""
        self._advance(now)
        return self._wire.take_output()

    def wake_at(self) -> float | None:
        """The next moment at which something happens without a request."""
        at = self._next()
        return None if at == inf else at

    def send_program_message(self, body: int, text: str, now: float) -> None:
        """Send the text of a user program to the host, which has to have asked for it by XID."""
        self._advance(now)
        if self.powered and self._events_on:
            self._send_text(body, text, self._now)

    # Time

    def _next(self) -> float:
        return min(
            self._wire.next_at(),
            min(self._wakes.values(), default=inf),
            min(self._brown_outs.values(), default=inf),
        )

    def _advance(self, now: float) -> None:
        """Let everything happen that is due, in the order of time; a time gone by already counts as now."""
        while (at := self._next()) <= now:
            if self._power_returns(at):
                continue
            woken = [body for body, wake in self._wakes.items() if wake <= at]
            for body in woken:
                self.axes[body].advance(at)
            if woken:
                self.look_after(*woken)
            else:
                self._wire.step()
        self._now = max(self._now, now)

    def _power_returns(self, at: float) -> bool:
        """Tell whether brown-outs end now."""
        over = [body for body, until in self._brown_outs.items() if until <= at]
        for body in over:
            self._now = max(self._now, self._brown_outs.pop(body))
            self._switch(body, on=True)
        return bool(over)

    def _send(self, text: str, request: int | None, now: float) -> None:
        self._wire.send((text + self.settings.line_end).encode("ascii"), request, now)

    # Commands

    def _hear(self, number: int | None, piece: bytes, now: float) -> None:
        if self.settings.excess_line_ends == "invalid":
            piece = _EXCESS.sub(_NO_COMMAND + CR, piece)
        for request in self._reader.feed(piece):
            if not isinstance(request, Request) or len(request.text) < CODE_LENGTH:
                continue  # an assumption: what has no code cannot be answered
            if self._interjects() and self.settings.interjection == "drop":
                continue
            if request.introducer not in self.settings.introducers:
                continue
            self.truth.request = number
            self._obey(request, number, now)
            self.truth.request = None

    def _interjects(self) -> bool:
        """Tell whether a command comes before the last reply, as one does that comes with another."""
        self._at_once += self._at_once >= 0
        return bool(self._unanswered) or self._at_once > 1

    def _obey(self, request: Request, number: int | None, now: float) -> None:
        answer = self._answer(request, now)
        if answer is None:
            answer = self._refusal(BUSY) if self.settings.absent_bodies == "error" else None
        if answer is not None:
            address = f"{request.body:02X}" if request.introducer == "&" else f"{request.body:X}"
            reply = f">{request.introducer}{address}{request.text[:CODE_LENGTH]}{answer.payload}"
            self._unanswered += 1
            is_slow = self.settings.reply_order == "swapped" and self.requests % 2
            leaves_at = now + self.settings.reply_delay_s + answer.delay_s + is_slow * SWAP_S
            self._wire.plan(leaves_at, now, partial(self._reply, reply, number))
        self.look_after(*self._members(request.body))

    def _reply(self, text: str, number: int | None, now: float) -> None:
        self._unanswered -= 1
        self._send(text, number, now)

    def _answer(self, request: Request, now: float) -> Response | None:
        """The answer of the addressed body, group or link master; None if the address is vacant."""
        if request.too_long():
            if self.settings.overlong == "refused":
                return self._refusal(TOO_LONG)
            request = replace(request, text=request.text.rstrip(_FILLING))
        if request.body == LINK_MASTER:
            return self._link_command(request.text)
        if request.body in self._groups:
            return self._group_command(request, now)
        axis = self._reached(request.body)
        return None if axis is None else self._shown(axis.execute(request.text, now))

    def _reached(self, body: int) -> A | None:
        """The controller of a body, if it is there and hears."""
        axis = self.axes.get(body)
        return axis if axis is not None and axis.powered and body not in self.cut_off else None

    def _members(self, body: int) -> Iterable[int]:
        """The bodies a command may have touched; XID lets the texts of all be collected."""
        return self.axes if body == LINK_MASTER else self._groups.get(body, (body,))

    def _refusal(self, error: int) -> Response:
        return self._shown(Response(f"@{error:02X}"))

    def _shown(self, response: Response) -> Response:
        """The response, without its error code if that is the setting."""
        if self.settings.error_codes or not re.fullmatch("@[0-9A-F]{2}", response.payload):
            return response
        return Response("@", response.delay_s)

    def _group_command(self, request: Request, now: float) -> Response | None:
        """Let every member do the command; one that is not there is left out, or refuses by the setting."""
        answers: dict[int, Response] = {}
        for body in self._groups[request.body]:
            axis = self._reached(body)
            if axis is not None:
                answers[body] = self._shown(axis.execute(request.text, now))
            elif self.settings.absent_bodies == "error":
                answers[body] = self._refusal(BUSY)
        if not answers:
            return None
        if request.text.startswith(StartInterpolation.code):
            self._together.append({body for body, answer in answers.items() if not answer.payload})
        mark = "@" if any(answer.payload.startswith("@") for answer in answers.values()) else ""
        payload = "".join(f"[{body:02X}:{answer.payload}]" for body, answer in answers.items())
        return Response(mark + payload, max(answer.delay_s for answer in answers.values()))

    def _link_command(self, text: str) -> Response:
        code, arguments = text[:CODE_LENGTH], text[CODE_LENGTH:]
        act = {
            IdentifyControllers.code: self._identify,
            SetReplyFormat.code: self._set_reply_format,
            SetGroup.code: self._set_group,
        }.get(code)
        if act is None:
            return self._refusal(UNKNOWN_CODE)
        try:
            return Response(act(arguments))
        except WireFault:
            return self._refusal(BAD_PARAMETER)

    def _identify(self, arguments: str) -> str:
        IdentifyControllers.read(arguments)
        self._events_on = True
        return ",".join(f"{body:02X}" for body in sorted(self.axes) if self._reached(body))

    def _set_reply_format(self, arguments: str) -> str:
        self._move_ends_on = bool(SetReplyFormat.read(arguments).end_of_move)
        return ""

    def _set_group(self, arguments: str) -> str:
        command = SetGroup.read(arguments)
        self._groups[int(command.group, 16)] = [int(member, 16) for member in command.members]
        return ""

    # The controllers' side

    def look_after(self, *bodies: int) -> None:
        """After these bodies were touched: pass on what they have said, and note when they wake next."""
        messages: list[Message] = []
        for body in bodies:
            axis = self.axes.get(body)
            if axis is None:
                continue
            messages += axis.take_messages()
            self._plan_collection(body, axis)
            wake = axis.wake_at()
            if wake is None:
                self._wakes.pop(body, None)
            else:
                self._wakes[body] = wake
        heard = [message for message in messages if message.frame.body not in self.cut_off]
        if heard and self.powered:
            self._pass_on(sorted(heard, key=lambda message: message.at))
        for message in messages:
            if isinstance(message.frame, MoveEnded) and message.frame.code == StartInterpolation.code:
                self._leave(message.frame.body, stopped=message.frame.cause != 0, now=message.at)

    def _leave(self, body: int, *, stopped: bool, now: float) -> None:
        """An interpolated move is over for a member; one that was stopped may stop the others."""
        for partners in [partners for partners in self._together if body in partners]:
            partners.discard(body)
            if stopped and self.settings.partners == "stop":
                self._together.remove(partners)
                for partner in partners:
                    self.axes[partner].execute(StopImmediately.code, now)
                self.look_after(*partners)
        self._together = [partners for partners in self._together if partners]

    def _pass_on(self, messages: list[Message]) -> None:
        """Send what the host has asked for; members whose moves end together share a frame."""
        ends: dict[tuple[float, str], list[MoveEnded]] = {}
        for message in messages:
            if isinstance(message.frame, MoveEnded):
                ends.setdefault((message.at, message.frame.code), []).append(message.frame)
            elif self._events_on:
                self._announce(_event(message.frame), message.at)
        for (at, code), ended in ends.items() if self._move_ends_on else ():
            members = "".join(f"[{end.body:02X}:{end.cause:02X}]" for end in ended)
            self._announce(f">&{MOVE_ENDED:02X}{code}{members}", at)

    def _plan_collection(self, body: int, axis: A) -> None:
        """Plan to collect a user program's text once the host wants events; until then it waits (JMG)."""
        since = axis.text_since()
        if since is None or body in self._collecting or not (self.powered and self._events_on):
            return
        self._collecting.add(body)
        at = max(since, self._now)
        self._wire.plan(at + self.settings.reply_delay_s, at, partial(self._collect, body))

    def _collect(self, body: int, now: float) -> None:
        self._collecting.discard(body)
        text = self.axes[body].take_text(now)
        if text is not None:
            self._send_text(body, text, now)
        self.look_after(body)

    def _send_text(self, body: int, text: str, now: float) -> None:
        self._send(f">&{PROGRAM_MESSAGE:02X}{PROGRAM_MESSAGE_CODE}[{body:02X}:{text}]", None, now)

    def _announce(self, text: str, at: float) -> None:
        leaves_at = at + self.settings.reply_delay_s
        self._wire.plan(leaves_at, max(at, self._now), partial(self._send, text, None))


def _event(change: StatusChanged) -> str:
    fields = (
        f"{name}:{value:+010d}" if name == "P" else f"{name}:H{value:0{STATUS_DIGITS[name]}X}"
        for name, value in change.fields.items()
    )
    return f">&{EVENT:02X}XED[{change.body:02X}:{','.join(fields)}]"
