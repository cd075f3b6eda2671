"""The way in for callers: what their credentials are good for, what they may, and how much; knows no HTTP."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from time import monotonic
from typing import Final

from gateway.access import keys
from gateway.access.credentials import Credentials
from gateway.access.errors import LimitReached, NotAuthenticated, NothingShown, NotPermitted
from gateway.access.grants import PENDANT_S, Grant, SessionInfo, Tickets, handle_of
from gateway.access.limits import KeyLimits, Rates, Usages, Use
from gateway.access.principal import EVERYBODY, PRINCIPAL, Principal, current
from gateway.access.roles import Role
from gateway.core.errors import GatewayError
from gateway.core.origin import ORIGIN, Origin
from gateway.core.rights import Right
from gateway.door.table import operations_of
from gateway.plant import Plant
from gateway.security import entries
from gateway.security.folding import network_of

__all__ = [
    "EVERYBODY",
    "PENDANT_S",
    "AccessCheck",
    "AuthorizedRequest",
    "CallersPassage",
    "Credentials",
    "Grant",
    "Principal",
    "Use",
]

SIGN_INS_AT_ONCE: Final = 20
SIGN_INS_PER_S: Final = 1.0
WRONG_SIGN_INS_AT_ONCE: Final = 100
WRONG_SIGN_INS_PER_S: Final = 2.0
TICKETS_AT_ONCE: Final = 200
TICKETS_PER_S: Final = 20.0


def not_good(kind: type[NotAuthenticated] = NotAuthenticated) -> NotAuthenticated:
    """The error for a credential that is not good, or is good no longer."""
    return kind.worded("key.not-good")


class AuthorizedRequest:
    """A request that may go on; within it the code acts in the name of the caller."""

    holds: Callable[[], bool] | None = None
    """Says whether the credential is still good; only of event streams, which last."""

    def __enter__(self) -> None:
        """Begin."""

    def __exit__(self, *_: object) -> None:
        """End, with the answer."""


class CallersPassage(AuthorizedRequest):
    """A request on behalf of a caller."""

    def __init__(self, principal: Principal, origin: Origin) -> None:
        self._principal, self.origin = principal, origin

    def __enter__(self) -> None:
        self._before = PRINCIPAL.set(self._principal), ORIGIN.set(self.origin)

    def __exit__(self, *raised: object) -> None:
        principal, origin = self._before
        ORIGIN.reset(origin)
        PRINCIPAL.reset(principal)
        if self._principal.scope is not None and isinstance(raised[1], GatewayError):
            raised[1].withhold_names()


class _Counted(CallersPassage):
    """A request of a key, counted against the key's limit."""

    def __init__(self, principal: Principal, origin: Origin, usages: Usages, use: Use) -> None:
        super().__init__(principal, origin)
        self._usages, self._use = usages, use

    def __enter__(self) -> None:
        self._usages.begin(self._principal.id, self._use)
        super().__enter__()

    def __exit__(self, *raised: object) -> None:
        super().__exit__(*raised)
        self._usages.end(self._principal.id, self._use)


class AccessCheck:
    """Access control: lets callers in by their credentials; with mode `open` every caller may come in."""

    def __init__(self, plant: Plant) -> None:
        settings = plant.config.access
        self.is_open = settings.mode == "open"
        self.credentials = plant.access.credentials
        self.sessions = plant.access.sessions
        self.tickets = Tickets()
        self.pendants = Tickets(lasts_s=PENDANT_S)
        """Tickets that a phone begins its session with."""
        self._claims = Tickets(lasts_s=PENDANT_S)
        """Tickets that a page takes the second secret of a new session with."""
        self.territory = plant.access.territory
        self.targets = frozenset(
            row.target for row in operations_of(map(type, plant.packages.registered)) if row.target
        )
        """The parameters that name what a request is about."""
        self._usages = Usages(
            KeyLimits(settings.subscribers_per_key, settings.requests_per_key, settings.moves_per_key_and_s)
        )
        self._good_ones: dict[bytes, Grant] = {}
        """Grants by the credential shown, of those that were good a moment ago."""
        self._forget_at = 0.0
        self._security = plant.access.security
        self.sessions.on_end = self._session_ended
        self.sign_ins = Rates(SIGN_INS_AT_ONCE, SIGN_INS_PER_S)
        """Rates of sign-ins by key."""
        self.wrong_sign_ins = Rates(WRONG_SIGN_INS_AT_ONCE, WRONG_SIGN_INS_PER_S)
        """Rates of wrong sign-ins by network address."""
        self._tickets_given = Rates(TICKETS_AT_ONCE, TICKETS_PER_S)
        """Rates of tickets by key, and by network address."""

    def let_in(
        self, grant: Grant, origin: Origin, right: Right, use: Use, targets: Sequence[str] | None
    ) -> CallersPassage:
        """Let a caller in who has the right on all targets; on None it is looked at later, if at all.

        :raises NotPermitted: the caller has it not, or not there; nothing was done.
        """
        if targets is None:
            self.territory.require_right(grant.principal, right)
        else:
            self.territory.require(grant.principal, right, *targets)
        passage = _Counted(grant.principal, origin, self._usages, use)
        if use is Use.SUBSCRIBER:
            passage.holds = partial(self.holds, grant)
        return passage

    def sees(self, address: str) -> bool:
        """Say whether the caller may see this address in a list."""
        return self.territory.covers(current(), address)

    def holds(self, grant: Grant) -> bool:
        """Say whether a grant is still good, and its session, if it has one."""
        lasts = grant.session is None or self.sessions.lasts(grant.session)
        return self.credentials.holds(grant) and lasts

    def good(self, grant: Grant | None) -> Grant:
        """Give a grant that is still good.

        :raises NotAuthenticated: it is not, or there is none.
        """
        if grant is None or not self.credentials.holds(grant):
            raise not_good()
        return grant

    def redeemed(self, ticket: str) -> Grant:
        """Give what a ticket was given for; errors as of `good`."""
        grant = self.good(self.tickets.redeem(ticket))
        if not self.holds(grant):
            raise not_good()
        return grant

    def by_key(self, shown: bytes, key_in: Callable[[bytes], str]) -> Grant:
        """Find whose a key is; one that was good is not read again until the keys are looked at again.

        :raises NotAuthenticated: it is no key, or no longer.
        """
        now = monotonic()
        if now >= self._forget_at:
            self._forget_at = now + keys.RECHECK_S
            self._good_ones.clear()
        grant = self._good_ones.get(shown)
        if grant is None or not self.credentials.knows(grant):
            grant = self.credentials.verify(key_in(shown))
            if grant is None:
                raise not_good()
            self._good_ones[shown] = grant
        return grant

    def note_refusal(
        self, target: str, error: NotAuthenticated | NotPermitted, name_of: Callable[[], str | None]
    ) -> None:
        """Write a refusal into the security log, unless the caller has shown no credential."""
        if isinstance(error, NothingShown):
            return
        if isinstance(error, NotAuthenticated):
            self._security.note(entries.CREDENTIAL_REFUSED, target, why=error.detail)
        else:
            self._security.note(entries.REQUEST_REFUSED, target, caller=name_of(), why=error.detail)

    def shown_at_sign_in(self, key: str) -> Grant | None:
        """Find the owner of a key that a browser shows at sign-in."""
        try:
            grant = self.credentials.verify(key)
        except NotPermitted:
            return None
        if grant is not None and not self.sign_ins.passes(grant.principal.id):
            raise LimitReached(
                f"{grant.principal.name} has signed in too often; no session was begun, and none has ended.",
                "Try again in a few seconds.",
            )
        return grant

    def sign_in(self, grant: Grant, address: str, former: str) -> str:
        """Begin a session, and end the `former` one: its id may have been chosen by another person."""
        self.sessions.end(former)
        session = self.sessions.begin(grant, address)
        who = grant.principal
        self._security.note(entries.SIGN_IN_ACCEPTED, handle_of(session), caller=who.name, role=who.role)
        return session

    def claim_of(self, grant: Grant, session: str) -> str:
        """Give a ticket for the second secret of a session that has just begun."""
        return self._claims.issue(replace(grant, session=session))

    def claimed(self, claim: str, session: str) -> str:
        """Give the page that has begun a session its second secret, once.

        :raises NotAuthenticated: the ticket is not of this session, is late or was used.
        """
        grant = self._claims.redeem(claim)
        proof = self.sessions.new_proof(session) if grant is not None and grant.session == session else None
        if proof is None:
            raise not_good()
        return proof

    def ticket_of(self, grant: Grant, address: str) -> str:
        """Give a ticket for a stream.

        :raises LimitReached: the key, or the address, has had too many.
        """
        if not all(map(self._tickets_given.passes, {grant.principal.id, network_of(address) or ""})):
            raise LimitReached(
                "Too many tickets were asked for with this key, or from this address; none was given.",
                "Try again in a second.",
            )
        return self.tickets.issue(grant)

    def pendant_of(self, grant: Grant, target: str) -> str:
        """Give a ticket for one session, with the role of the grant, about `target`; it administers nothing.

        :raises NotPermitted: the caller may not move the target.
        """
        who = grant.principal
        self.territory.require(who, Right.OPERATE, target)
        role = Role.SETUP if who.role is Role.ADMIN else who.role
        narrow = replace(who, role=role, scope=frozenset({target}))
        return self.pendants.issue(replace(grant, principal=narrow, session=None))

    def refuse_sign_in(self, place: str, address: str) -> None:
        """Note that a key, or a code, was not good. One that is good passes, however many were not.

        :raises LimitReached: too many were shown from there.
        """
        self._security.note(entries.SIGN_IN_REFUSED, place, why="What was shown is not good.")
        if not self.wrong_sign_ins.passes(network_of(address) or ""):
            raise LimitReached(
                "From this address too many keys were shown that are not good; no session was begun.",
                "Use a good key, or try again in a minute.",
            )

    def _session_ended(self, session: SessionInfo, why: str) -> None:
        self._security.note(entries.SESSION_ENDED, session.id, why=why, of=session.name)
