"""Facts about controllers that only a gateway can know: kept over reloads and restarts."""

import logging
from collections.abc import Callable, Mapping
from typing import Protocol

log = logging.getLogger(__name__)


class Remembering(Protocol):
    """An object with facts about a controller that are worth keeping."""

    def memory(self) -> str:
        """Give what is to be kept, in words of its own."""

    def recall(self, memory: str) -> None:
        """Go on from what was kept.

        :raises ValueError: it cannot be read; nothing was taken from it.
        """


class FactStore:
    """Facts by address, each in words of its family."""

    def __init__(self) -> None:
        self._facts: dict[str, str] = {}
        self.on_change: Callable[[str, str], None] = lambda _address, _fact: None
        """Called with an address, and what is known of it now."""

    def resume(self, facts: Mapping[str, str]) -> None:
        """Go on from what an earlier life knew."""
        self._facts.update(facts)

    def keep(self, address: str, knower: Remembering) -> Callable[[], None]:
        """Let it go on from what is known of its controller; what is given back keeps what it knows then."""
        if (fact := self._facts.get(address)) is not None:
            try:
                knower.recall(fact)
            except ValueError:
                log.warning("what was known of %s cannot be read, and is forgotten: %r", address, fact)
        return lambda: self._note(address, knower.memory())

    def _note(self, address: str, fact: str) -> None:
        if self._facts.get(address) != fact:
            self._facts[address] = fact
            self.on_change(address, fact)
