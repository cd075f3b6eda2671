"""Grants: the caller behind a verified credential, and the sessions and tickets lent on it."""

import secrets
from collections import Counter, OrderedDict
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from hashlib import sha256
from hmac import compare_digest
from time import monotonic
from typing import Final, Literal

from pydantic import Field

from gateway.access.keys import Key
from gateway.access.principal import Principal
from gateway.access.roles import Role
from gateway.core.records import Record

IDLE_S: Final = 1800.0
"""A session that was not used for this time has ended."""
LONGEST_S: Final = 12 * 3600.0
"""Longest duration of a session, in seconds."""
TICKET_S: Final = 10.0
"""A ticket is valid for this time, and once."""
PENDANT_S: Final = 60.0
"""Seconds for which a ticket for a pendant's session is good: time to hold a phone before the code."""
MOST_SESSIONS: Final = 1000
SESSIONS_PER_KEY: Final = 20
MOST_TICKETS: Final = 1000
TICKETS_PER_KEY: Final = 100
"""Tickets of each key at once: its own oldest makes room first, then that of the key with the most."""


@dataclass(frozen=True)
class Grant:
    """A caller who was let in, and the credential that proved it."""

    principal: Principal
    key: Key | None = None
    """The key behind it, whose end is its end too."""
    expires: float | None = None
    """Wall time at which it ends in any case."""
    session: str | None = None
    """The session that a ticket was given in, whose end is its end too."""


Why = Literal["signed_out", "made_room", "ended"]


class SessionInfo(Record):
    """A session, without what is secret of it."""

    id: str = Field(description="Id of the session, which does not open it.")
    name: str = Field(description="The name of the key, or of the token's holder.")
    role: Role
    address: str | None = Field(description="The network address that it was begun from.")
    began_at: datetime
    used_at: datetime


@dataclass
class _Lent:
    grant: Grant
    since: float
    used: float
    address: str = ""
    proof: bytes = b""
    """The hash of the second secret of a session."""

    @property
    def holder(self) -> str:
        return self.grant.principal.id

    def lasts_at(self, now: float) -> bool:
        return now - self.used <= IDLE_S and now - self.since <= LONGEST_S


class Sessions:
    """Sessions of signed-in browsers, by random ids that cannot be guessed. A restart ends them all.

    A session that has made room for another lets its browser in no more, but still takes stops until it
    would have ended: a page that does not know it yet loses no stop.
    """

    def __init__(self, clock: Callable[[], float] = monotonic) -> None:
        self._clock = clock
        self._sessions: OrderedDict[str, _Lent] = OrderedDict()
        """The one that was not used for the longest time first."""
        self._stop_only: OrderedDict[str, _Lent] = OrderedDict()
        self.on_end: Callable[[SessionInfo, Why], None] = lambda _session, _why: None
        """Called with each session that ends before its time."""

    def begin(self, grant: Grant, address: str = "") -> str:
        """Begin a session, and give its id of 256 random bits."""
        now = self._clock()
        session = secrets.token_urlsafe(32)
        self._sessions[session] = _Lent(grant, now, now, address)
        for crowded in _crowded(self._sessions, grant, SESSIONS_PER_KEY, MOST_SESSIONS):
            self._stop_only[crowded] = self._end(crowded, "made_room")
        for crowded in _crowded(self._stop_only, grant, MOST_SESSIONS, MOST_SESSIONS):
            del self._stop_only[crowded]
        return session

    def new_proof(self, session: str) -> str | None:
        """Give the second secret of a session, of 256 random bits; None where it is over."""
        lent = self._sessions.get(session)
        if lent is None:
            return None
        proof = secrets.token_urlsafe(32)
        lent.proof = _hash_of(proof)
        return proof

    def proves(self, session: str, proof: str) -> bool:
        """Say whether `proof` is the second secret of a session; a session without one proves nothing."""
        lent = self._sessions.get(session)
        return lent is not None and bool(lent.proof) and compare_digest(lent.proof, _hash_of(proof))

    def grant_of(self, session: str) -> Grant | None:
        """Find who a session is of, and note that it is used."""
        lent = self._sessions.get(session)
        if lent is None:
            return None
        now = self._clock()
        if not lent.lasts_at(now):
            del self._sessions[session]
            return None
        lent.used = now
        self._sessions.move_to_end(session)
        return lent.grant

    def grant_to_stop(self, session: str) -> Grant | None:
        """Find who a session is of that lasts, or has made room for another."""
        lent = self._stop_only.get(session)
        if lent is not None and lent.lasts_at(self._clock()):
            return lent.grant
        return self.grant_of(session)

    def lasts(self, session: str) -> bool:
        """Say whether a session is open: not ended, not past its longest time. Event streams go on in it."""
        lent = self._sessions.get(session)
        return lent is not None and self._clock() - lent.since <= LONGEST_S

    def end(self, session: str) -> None:
        """End it, for its user has signed out."""
        if session in self._sessions:
            self._end(session, "signed_out")
        self._stop_only.pop(session, None)

    def end_by(self, *, id: str | None = None, name: str | None = None) -> Sequence[SessionInfo]:  # noqa: A002
        """End one by what names it, or all of a key; gives those that have ended."""
        named = {session: self._told(session, lent) for session, lent in self._sessions.items()}
        found = [session for session, lent in named.items() if id == lent.id or name == lent.name]
        for session in found:
            self._end(session, "ended")
        for session, lent in list(self._stop_only.items()):
            if id == handle_of(session) or name == lent.grant.principal.name:
                del self._stop_only[session]
        return [named[session] for session in found]

    def all(self) -> Sequence[SessionInfo]:
        """Sessions that are still open, the one used most recently first."""
        now = self._clock()
        return [
            self._told(session, lent)
            for session, lent in reversed(self._sessions.items())
            if lent.lasts_at(now)
        ]

    def _end(self, session: str, why: Why) -> _Lent:
        lent = self._sessions.pop(session)
        if lent.lasts_at(self._clock()):
            self.on_end(self._told(session, lent), why)
        return lent

    def _told(self, session: str, lent: _Lent) -> SessionInfo:
        now, wall = self._clock(), datetime.now(UTC)
        return SessionInfo(
            id=handle_of(session),
            name=lent.grant.principal.name,
            role=lent.grant.principal.role,
            address=lent.address or None,
            began_at=wall - timedelta(seconds=now - lent.since),
            used_at=wall - timedelta(seconds=now - lent.used),
        )


def _hash_of(proof: str) -> bytes:
    return sha256(proof.encode()).digest()


def handle_of(session: str) -> str:
    """Name a session for lists and logs; the name does not open it."""
    return sha256(session.encode()).hexdigest()[:16]


def _crowded(lent: Mapping[str, _Lent], newest: Grant, most_of_one: int, most: int) -> Sequence[str]:
    """The one that has to go, if one has: of the newest's own key, or of the key that has the most."""
    of_each = Counter(one.holder for one in lent.values())
    holder = newest.principal.id
    if of_each[holder] <= most_of_one:
        if len(lent) <= most:
            return ()
        [(holder, _)] = of_each.most_common(1)
    return [next(handle for handle, those in lent.items() if those.holder == holder)]


class Tickets:
    """Tickets for those that can send no header, good once and for `lasts_s` seconds."""

    def __init__(self, clock: Callable[[], float] = monotonic, lasts_s: float = TICKET_S) -> None:
        self._clock, self._lasts_s = clock, lasts_s
        self._tickets: OrderedDict[str, _Lent] = OrderedDict()

    def issue(self, grant: Grant) -> str:
        """Make a ticket of 256 random bits."""
        now = self._clock()
        ticket = secrets.token_urlsafe(32)
        self._tickets[ticket] = _Lent(grant, now, now)
        for crowded in _crowded(self._tickets, grant, TICKETS_PER_KEY, MOST_TICKETS):
            del self._tickets[crowded]
        return ticket

    def redeem(self, ticket: str) -> Grant | None:
        """Take a ticket, and with it that it can be taken again."""
        lent = self._tickets.pop(ticket, None)
        return lent.grant if lent is not None and self._clock() - lent.since <= self._lasts_s else None
