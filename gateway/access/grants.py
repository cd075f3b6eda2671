"""What a credential that was found good stands for, and what is lent on it: sessions and tickets."""

import secrets
from collections import OrderedDict
from collections.abc import Callable
from dataclasses import dataclass
from time import monotonic
from typing import Final

from gateway.access.keys import Key
from gateway.access.principal import Principal

IDLE_S: Final = 1800.0
"""A session that was not used for this time has ended."""
LONGEST_S: Final = 12 * 3600.0
"""No session is longer."""
TICKET_S: Final = 10.0
"""A ticket is valid for this time, and once."""
MOST_SESSIONS: Final = 1000
MOST_TICKETS: Final = 1000
"""The oldest make room for new ones."""


@dataclass(frozen=True)
class Grant:
    """Who somebody is, because of what."""

    principal: Principal
    key: Key | None = None
    """The key behind it, whose end is its end too."""
    expires: float | None = None
    """Wall time at which it ends in any case."""
    session: str | None = None
    """The session that a ticket was given in, whose end is its end too."""


@dataclass
class _Lent:
    grant: Grant
    since: float
    used: float


class Sessions:
    """Browsers that have signed in, by random ids that nobody can guess; a restart ends them all."""

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        self._clock = clock
        self._sessions: OrderedDict[str, _Lent] = OrderedDict()

    def begin(self, grant: Grant) -> str:
        """Begin a session, and give its id of 256 random bits."""
        now = self._clock()
        session = secrets.token_urlsafe(32)
        self._sessions[session] = _Lent(grant, now, now)
        if len(self._sessions) > MOST_SESSIONS:
            self._sessions.popitem(last=False)
        return session

    def grant_of(self, session: str) -> Grant | None:
        """Find who a session is of, and note that it is used."""
        lent = self._sessions.get(session)
        if lent is None:
            return None
        now = self._clock()
        if now - lent.used > IDLE_S or now - lent.since > LONGEST_S:
            del self._sessions[session]
            return None
        lent.used = now
        return lent.grant

    def lasts(self, session: str) -> bool:
        """Whether a session has neither been ended nor is too long; an event stream may go on in it."""
        lent = self._sessions.get(session)
        return lent is not None and self._clock() - lent.since <= LONGEST_S

    def end(self, session: str) -> None:
        """End it."""
        self._sessions.pop(session, None)


class Tickets:
    """Tickets for those that can send no header, good once and for seconds, to listen only."""

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        self._clock = clock
        self._tickets: OrderedDict[str, _Lent] = OrderedDict()

    def issue(self, grant: Grant) -> str:
        """Make a ticket of 256 random bits."""
        now = self._clock()
        ticket = secrets.token_urlsafe(32)
        self._tickets[ticket] = _Lent(grant, now, now)
        if len(self._tickets) > MOST_TICKETS:
            self._tickets.popitem(last=False)
        return ticket

    def redeem(self, ticket: str) -> Grant | None:
        """Take a ticket, and with it that it can be taken again."""
        lent = self._tickets.pop(ticket, None)
        return lent.grant if lent is not None and self._clock() - lent.since <= TICKET_S else None
