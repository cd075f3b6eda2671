"""What is known of controllers that nothing but a gateway can know: kept over reloads and restarts."""

from collections.abc import Callable, Mapping


class Known:
    """By address, each in words of its family."""

    def __init__(self) -> None:
        self._facts: dict[str, str] = {}
        self.on_change: Callable[[str, str], None] = lambda _address, _fact: None
        """Called with an address, and what is known of it now."""

    def resume(self, facts: Mapping[str, str]) -> None:
        """Go on from what an earlier life knew."""
        self._facts.update(facts)

    def of(self, address: str) -> str | None:
        """Give what is known of a controller; None where nothing is."""
        return self._facts.get(address)

    def note(self, address: str, fact: str) -> None:
        """Know something of a controller from now on."""
        if self._facts.get(address) != fact:
            self._facts[address] = fact
            self.on_change(address, fact)
