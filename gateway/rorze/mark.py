"""The mark in a body's user comment: written into RAM only, it proves that the body has kept its power."""

import logging
from collections.abc import Callable
from typing import Any, Protocol

from gateway.core.errors import Cancelled, ControllerRefused, GatewayError, NotSent
from gateway.core.lanes import Lane
from gateway.rorze.asked_body import is_mark, new_mark
from gateway.rorze.exchange import Answered, RorzeExchange
from gateway.rorze.power import BodyPower
from protocols.rorze.row import RorzeCommand
from protocols.rorze.status import GetInformation, SetUserComment

log = logging.getLogger(__name__)

TRIES = 3
"""So often a mark is written that was not found again as it should be."""


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
        """Whether it proves that the body has kept its power; None where there is no mark.

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
        """Write one where there is none, unless the comment holds somebody's own text.

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
        """Whether the comment is somebody's own; a single garbled reading does not count."""
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
