"""The owner of a line that another gateway may take over, and the epoch since which it has it.

Nothing is decided by a vote, and no gateway is called dead: a person takes a line over (`take`). A line that
was lost to another gateway is not opened again by itself, for that would throw the new owner out.
"""

import json
import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Final

from gateway.core.errors import NotSent
from gateway.core.whole_files import write_whole

log = logging.getLogger(__name__)

FILE: Final = "owners.json"
UNKNOWN: Final = "nobody can tell yet whether another gateway has taken it over"
LOST: Final = "the connection was ended: another gateway may have taken it over"


class OwnerChanged(NotSent):
    """The line belongs to another gateway, or to another epoch, than the sender believes."""

    kind = "owner-changed"
    retryable = False


@dataclass
class Owner:
    """The gateway that has a line."""

    gateway: str | None
    """Name of the gateway; None where the line was lost, and no gateway has said that it has it."""
    epoch: int = 1
    """Grows by one with each take-over."""


class Ownership:
    """The owners of all lines with a spare, kept in a data directory. Lines without one are always ours."""

    def __init__(self, name: str, lines: Mapping[str, Sequence[str]], directory: Path | None = None) -> None:
        self.name = name
        self.owners = {line: owners for line, owners in lines.items() if len(owners) > 1}
        """The lines with a spare, with all who may have them."""
        self._path = None if directory is None else directory / FILE
        self._owners = {line: Owner(owners[0]) for line, owners in self.owners.items()}
        self._forced: set[str] = set()
        """Lines that a person has taken over here: no other gateway is asked about them."""
        self._left: dict[tuple[str, str], Sequence[Mapping[str, Any]]] = {}
        self.is_current = False
        """True while the reports of other gateways are heard."""
        self.on_claim: Callable[[str, int], object] = lambda _line, _epoch: None
        """Called with each line that is taken over here, and its epoch."""
        self.on_loss: Callable[[str, str], object] = lambda _line, _why: None
        """Called with a line that another gateway has taken, and why it has to be given up here."""
        for line, owner in self._read().items():
            if line in self._owners:
                self._owners[line] = owner

    def of(self, line_id: str) -> Owner | None:
        """The owner of a line; None for a line that has no spare."""
        return self._owners.get(line_id)

    def held(self) -> dict[str, int]:
        """The lines that are this gateway's, with their epochs."""
        return {line: owner.epoch for line, owner in self._owners.items() if owner.gateway == self.name}

    def elsewhere(self, line_id: str) -> str | None:
        """The other gateway that has a line, if one is known."""
        owner = self._owners.get(line_id)
        return None if owner is None or owner.gateway == self.name else owner.gateway

    def stands_by(self, line_id: str) -> str | None:
        """Why a line is not to be opened here now; None where it may be."""
        owner = self._owners.get(line_id)
        if owner is None or line_id in self._forced:
            return None
        if owner.gateway != self.name:
            return f"gateway {owner.gateway} has it" if owner.gateway else LOST
        return None if self.is_current else UNKNOWN

    def require_owner(self, line_id: str, epoch: int | None) -> None:
        """Refuse a command for a line that this gateway does not have, or not since that epoch.

        :raises OwnerChanged: nothing was sent.
        """
        owner = self._owners.get(line_id)
        if owner is None or (owner.gateway == self.name and epoch in (None, owner.epoch)):
            return
        raise OwnerChanged.worded(
            "owner-changed", line=line_id, owner=owner.gateway or "?", epoch=owner.epoch
        )

    def take(self, line_id: str) -> int:
        """Have a line from now on, and give its epoch; it is written down before anything else.

        :raises NotSent: it cannot be written down; nothing has changed.
        """
        before = self._owners[line_id]
        self._owners[line_id] = taken = Owner(self.name, before.epoch + 1)
        try:
            self._write()
        except OSError as error:
            self._owners[line_id] = before
            raise NotSent(
                f"Line {line_id} was not taken over: {self._path} cannot be written: {error.strerror}.",
                "Make room in the data directory.",
            ) from error
        self._forced.add(line_id)
        self.on_claim(line_id, taken.epoch)
        return taken.epoch

    def lose(self, line_id: str, to: str | None = None, epoch: int | None = None) -> None:
        """Take note that this gateway does not have a line any more."""
        owner = self._owners[line_id]
        self._forced.discard(line_id)
        if owner.gateway != self.name and to is None:
            return
        self._owners[line_id] = Owner(to, epoch or owner.epoch)
        try:
            self._write()
        except OSError as error:
            log.warning("the owner of line %s cannot be written down: %s", line_id, error)

    def note_left(self, line_id: str, gateway: str, moves: Sequence[Mapping[str, Any]]) -> None:
        """Hear the records of the moves that another gateway has under way on a line."""
        self._left[line_id, gateway] = moves

    def left_by(self, line_id: str, gateway: str) -> Sequence[Mapping[str, Any]]:
        """The moves that a gateway had under way on a line when it was heard last."""
        return self._left.get((line_id, gateway), ())

    def note_claim(self, line_id: str, gateway: str, epoch: int) -> None:
        """Hear that another gateway has a line; what is older than what is known means nothing."""
        known = self._owners.get(line_id)
        if known is None or gateway == self.name:
            return
        if epoch > known.epoch or (epoch == known.epoch and known.gateway is None):
            was_ours = known.gateway == self.name
            self.lose(line_id, gateway, epoch)
            if was_ours:
                self.on_loss(line_id, f"gateway {gateway} has taken it over")

    def _read(self) -> dict[str, Owner]:
        if self._path is None or not self._path.exists():
            return {}
        try:
            told = json.loads(self._path.read_text("utf-8"))
            return {line: Owner(owner["gateway"], int(owner["epoch"])) for line, owner in told.items()}
        except (OSError, ValueError, KeyError, TypeError) as error:
            log.warning("%s cannot be read (%s): no line with a spare is opened by itself", self._path, error)
            return {line: Owner(None, owner.epoch) for line, owner in self._owners.items()}

    def _write(self) -> None:
        if self._path is None:
            return
        write_whole(self._path, json.dumps({line: asdict(owner) for line, owner in self._owners.items()}))
