"""Answers that may come a second time: none of them must be taken for the answer to something else.

Answers have no numbers. One that was doubled on its way comes again within `late_reply_s`, unless a fence has
passed since: links keep the order. What it could answer is told by the rule that credits answers, so no row
of the command table has to be named here.
"""

from dataclasses import dataclass
from math import inf
from typing import Any

from protocols.fics.link import Completion, Failure, Frame, Garbage, Refusal, credit
from protocols.fics.row import FicsCommand

MOST_OF_A_NAME = 1000
"""So many different answers of one name are kept before those are looked for that can come no more."""


@dataclass(slots=True)
class _Told:
    """An answer that was given to a command, or will be."""

    command: FicsCommand[Any]
    frame: Frame
    number: int
    """The place of the command's frame among all that were written."""
    until: float
    """A copy may come before this, on the event loop's clock."""


class Copies:
    """The answers of which a copy may still come."""

    def __init__(self, late_reply_s: float) -> None:
        self._late_reply_s = late_reply_s
        self._told: dict[str, dict[tuple[str, type[Frame]], _Told]] = {}
        """By the name of the answer, then by the text of the command and the kind of answer."""
        self._last_deed = 0
        """The number of the last frame that was no mere read: what was asked before may be outdated."""

    def rule_out(self) -> None:
        """A fence has passed: what has not come by now never will."""
        self._told.clear()

    def note_written(self, command: FicsCommand[Any], number: int, now: float, *, silent: bool) -> None:
        """A command was written: the answer to a deed may come at any time."""
        if command.may_repeat():
            return
        self._last_deed = number
        if not silent and not command.is_query():
            self._keep(_Told(command, Completion(command.wire_name()), number, inf), now)

    def note(self, command: FicsCommand[Any], number: int, frame: Frame, now: float) -> None:
        """A command was answered."""
        self._keep(_Told(command, frame, number, now + self._late_reply_s), now)

    def _keep(self, told: _Told, now: float) -> None:
        if isinstance(told.frame, Garbage):
            return
        answers = self._told.setdefault(told.frame.name, {})
        if len(answers) >= MOST_OF_A_NAME:
            _drop_the_late(answers, now)
        answers[told.command.text(), type(told.frame)] = told

    def may_answer(self, command: FicsCommand[Any], now: float, *, fresh: bool = False) -> bool:
        """Whether a copy could be taken for the answer to a command.

        Equal reads are not kept apart, as long as nothing is done in between: a copy tells what was true a
        moment before. What has to be `fresh` is kept apart even from them.
        """
        for name in {command.wire_name(), command.answered_as or command.wire_name(), command.ends_with}:
            answers = self._told.get(name, {})
            _drop_the_late(answers, now)
            if any(self._could_answer(told, command, fresh=fresh) for told in answers.values()):
                return True
        return False

    def _could_answer(self, told: _Told, command: FicsCommand[Any], *, fresh: bool) -> bool:
        same_text = told.command.text() == command.text()
        if isinstance(told.frame, Refusal | Failure):
            return credit(command, told.frame) is not None
        if same_text and command.may_repeat() and not (fresh or told.number < self._last_deed):
            return False
        if not same_text and type(told.command) is type(command) and command.is_told_apart():
            return False
        return credit(command, told.frame) is not None


def _drop_the_late(answers: dict[tuple[str, type[Frame]], _Told], now: float) -> None:
    for key in [key for key, told in answers.items() if told.until <= now]:
        del answers[key]
