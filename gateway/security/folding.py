"""Floods in the security log: the first entries of a caller stand singly, the rest are counted in one.

A client that repeats what needs no right to administer therefore pushes nothing out and fills no disk.
"""

from collections import deque
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from ipaddress import IPv6Address, ip_address, ip_network
from typing import Any, Final

SHORTEST_S: Final = 60.0
LONGEST_S: Final = 3600.0
"""A window lasts from a minute to an hour: it doubles as long as a flood goes on."""
SINGLY: Final = 20
"""Entries of one caller at one address in a window that stand singly."""
SINGLY_IN_ALL: Final = 100
"""Entries that stand singly in a window, of all callers together."""
BUSY_WITH_REFUSALS: Final = 20
MOST_SENDERS: Final = 20
"""Senders that are counted each for itself; all others are counted together."""

BURST_S: Final = 60.0
"""A burst is over when no minute was so full for this time."""

Sender = tuple[str | None, str | None]
"""The caller and its address; two times None for all that are counted together."""
OTHERS: Final[Sender] = None, None


@dataclass
class Counted:
    """Entries of one sender that do not stand singly."""

    number: int
    since: datetime
    last: Mapping[str, Any]
    """The members of the last of them."""


@dataclass
class Folding:
    """The window of one type of entries."""

    busy: int = SINGLY_IN_ALL
    """Entries in a window after which the next window is longer, too: refusals need no credential."""
    length_s: float = SHORTEST_S
    began_at: float = float("-inf")
    _singly: dict[Sender, int] = field(default_factory=dict)
    _counted: dict[Sender, Counted] = field(default_factory=dict)
    _is_flood: bool = False
    """True if an entry was counted in this window."""

    @property
    def is_counting(self) -> bool:
        """True if counted entries are not written yet."""
        return bool(self._counted)

    def is_over(self, now: float) -> bool:
        """Say whether the window has ended at `now`, in seconds."""
        return now >= self.began_at + self.length_s

    def begin(self, now: float) -> None:
        """Begin the next window: a longer one if this one has counted, else a shorter one."""
        factor = 2.0 if self._is_flood or sum(self._singly.values()) > self.busy else 0.5
        self.length_s = min(max(self.length_s * factor, SHORTEST_S), LONGEST_S)
        self.began_at, self._is_flood = now, False
        self._singly.clear()
        self._counted.clear()

    def stands_singly(self, sender: Sender, members: Mapping[str, Any]) -> bool:
        """Say whether an entry is written singly; if not, it is counted."""
        sender = sender[0], network_of(sender[1])
        singly = self._singly.get(sender, 0)
        if singly < self._room and sum(self._singly.values()) < SINGLY_IN_ALL:
            self._singly[sender] = singly + 1
            return True
        known = sender in self._counted or len(self._counted) < MOST_SENDERS
        counted = self._counted.setdefault(
            sender if known else OTHERS, Counted(0, datetime.now(UTC), members)
        )
        counted.number, counted.last, self._is_flood = counted.number + 1, members, True
        return False

    @property
    def _room(self) -> int:
        """In a flood that goes on, one of each sender stands singly."""
        return SINGLY if self.length_s == SHORTEST_S else 1

    def taken(self) -> Iterator[tuple[Sender, Counted]]:
        """Give what was counted; it counts from none again."""
        counted, self._counted = self._counted, {}
        yield from counted.items()


class Refusals:
    """Refusals of late: more in a minute than happen by mistake are a burst."""

    def __init__(self, most: int) -> None:
        """`most` refusals in a minute are no burst yet; 0 for none that ever is."""
        self._most = most
        self._newest: deque[float] = deque(maxlen=most or 1)
        self._until = float("-inf")

    def goes_on(self, now: float) -> bool:
        """True while a burst lasts, by a clock of seconds."""
        return now < self._until

    def began_burst(self, now: float) -> float | None:
        """Count a refusal; the seconds in which the others came, where a burst begins with it."""
        if not self._most:
            return None
        took_s = now - self._newest[0] if len(self._newest) == self._most else BURST_S
        self._newest.append(now)
        if took_s >= BURST_S:
            return None
        begins, self._until = not self.goes_on(now), now + BURST_S
        return took_s if begins else None


def network_of(address: str | None) -> str | None:
    """Where a sender is: of IPv6 its network of 64 bits, for it has as many addresses as it likes."""
    try:
        if address is not None and isinstance(ip_address(address), IPv6Address):
            return str(ip_network(f"{address}/64", strict=False).network_address)
    except ValueError:
        pass
    return address
