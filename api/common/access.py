"""The one hook at which access control refuses a request, before anything but its head is read."""

import asyncio
import logging
import re
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass, replace
from functools import partial
from time import monotonic
from typing import Final
from urllib.parse import parse_qs, parse_qsl, urlencode

from starlette.requests import cookie_parser
from starlette.types import Scope

from api.common.problems import CALLER, path_of
from api.front.certificates import CERTIFIED
from gateway.door.admission import (
    EVERYBODY,
    AccessCheck,
    AuthorizedRequest,
    CallersPassage,
    Grant,
    Principal,
    Use,
    not_good,
)
from gateway.door.caller import Claim, Origin, current
from gateway.door.calls import do_each
from gateway.door.opening import Plant
from gateway.door.problems import (
    CookieAlone,
    InvalidRequest,
    NotAuthenticated,
    NothingShown,
    NotPermitted,
)
from gateway.door.table import LEASED, Right

log = logging.getLogger(__name__)

STREAMS: Final = frozenset({"/events", "/events/stream"})
"""Streams that can be about some bodies only, by their query."""
RECHECK_S: Final = 5.0
"""Seconds between two checks of the credential of an event stream."""
CLOSE_NOT_AUTHENTICATED: Final = 4401
_SAFE: Final = frozenset({"GET", "HEAD"})
_TICKET: Final = "ticket"
_AUTHORIZATION: Final = b"authorization"
_COOKIE: Final = b"cookie"
_REFUSAL: Final = "; nothing was sent."
_PROOF: Final = b"session-proof"
_LEASE_TOKEN: Final = b"lease-token"
_OWNER_EPOCH: Final = b"owner-epoch"
_LEASE_TOKENS: Final = re.compile(rb"\s*[1-9][0-9]{0,17}\s*(?:,\s*[1-9][0-9]{0,17}\s*){0,31}")
_STREAM: Final = "/stream"
_HEARTBEAT: Final = "/heartbeat"
"""The end of a path that keeps a JOG going, which begins no move."""


class Access(AccessCheck):
    """Asks each request for a credential, a right and a scope; with mode `open` none is asked for."""

    def __init__(self, plant: Plant) -> None:
        super().__init__(plant)
        self._refused = 0
        self._told_at = 0.0

    def require(
        self, scope: Scope, right: Right, *, any_scope: bool = False, cookie_suffices: bool = False
    ) -> AuthorizedRequest:
        """Refuse a request or a WebSocket whose sender does not have the right; `scope` is as in ASGI.

        `any_scope` lets keys of every scope pass: the route tells nothing of the plant, or heeds the scope.
        `cookie_suffices` lets sessions pass without their second secret: the route shows a page.

        :raises NotAuthenticated: it has no credential, or one that is not good; nothing was done.
        :raises NotPermitted: the sender does not have the right, or not there; nothing was done.
        """
        if right is Right.OPEN:
            return AuthorizedRequest()
        try:
            if right is Right.STOP:
                return do_each("the check of a stop", partial(self._let_stop, scope)).or_raise()[0]
            return self._let_in(scope, right, any_scope=any_scope, cookie_suffices=cookie_suffices)
        except (NotAuthenticated, NotPermitted) as error:
            self._refuse(scope, error)
            raise

    def permits(self, scope: Scope, right: Right, *, any_scope: bool = False) -> bool:
        """Tell if `require` would let a request pass; nothing is logged or counted."""
        if right is Right.OPEN:
            return True
        try:
            self._let_in(scope, right, any_scope=any_scope)
        except (NotAuthenticated, NotPermitted, InvalidRequest):
            return False
        return True

    def _let_in(
        self, scope: Scope, right: Right, *, any_scope: bool, cookie_suffices: bool = False
    ) -> AuthorizedRequest:
        if self.is_open:
            if scope["query_string"] and _takes_tickets(scope):
                _take_ticket(scope)
            return CallersPassage(EVERYBODY, _with_leases(current(), scope, right))
        grant = self._grant_of(scope, cookie_suffices=cookie_suffices)
        _note_caller(grant.principal, current(), scope)
        targets = None if any_scope else self._targets(scope)
        passage = self.let_in(grant, current(), right, _use_of(scope, right), targets)
        passage.origin = _in_the_name_of(grant.principal, _with_leases(current(), scope, right), scope)
        return passage

    def _let_stop(self, scope: Scope) -> AuthorizedRequest:
        """Let in who has a good credential: with each of them everything may be stopped.

        So nothing else is looked at, and no fault of the gateway itself can refuse a stop there. A page that
        has lost the second secret of its session, or does not have that of a new one yet, still stops.
        """
        if self.is_open:
            return CallersPassage(EVERYBODY, current())
        grant = self._grant_of(scope, self.sessions.grant_to_stop, cookie_suffices=True)
        return CallersPassage(grant.principal, _in_the_name_of(grant.principal, current(), scope))

    def view_of(self, scope: Scope) -> Callable[[str], bool]:
        """Find what the sender of a request that all may make is told of: nothing without a good key."""
        if self.is_open:
            return lambda _: True
        try:
            principal = self._grant_of(scope).principal
        except (NotAuthenticated, NotPermitted):
            return lambda _: False
        return partial(self.territory.covers, principal)

    def caller_of(self, scope: Scope) -> str | None:
        """Name the caller, the same for all its requests; None where none may be answered."""
        if self.is_open:
            return current().caller
        try:
            principal = self._grant_of(scope).principal
        except (NotAuthenticated, NotPermitted):
            return None
        _note_caller(principal, current(), scope)
        return principal.id

    def ticket_for(self, scope: Scope) -> str:
        """Give the sender of a request that has passed a ticket, which ends with its session and its key.

        :raises NotAuthenticated: by then it is no longer good.
        :raises LimitReached: the key, or the address, has had too many.
        """
        grant = Grant(EVERYBODY) if self.is_open else self._grant_of(scope)
        return self.ticket_of(grant, current().address or "")

    def pendant_for(self, scope: Scope, target: str) -> str:
        """Give the sender of a request that has passed the ticket of a pendant of `target`.

        :raises NotPermitted: the sender may not move the target.
        """
        return self.pendant_of(Grant(EVERYBODY) if self.is_open else self._grant_of(scope), target)

    def _targets(self, scope: Scope) -> list[str]:
        """The addresses that a request is about, by its path; those of events by their query."""
        params = scope.get("path_params") or {}
        named = [str(params[name]) for name in self.targets if name in params]
        if named or path_of(scope) not in STREAMS:
            return named
        query = parse_qs(scope["query_string"].decode("latin-1"), keep_blank_values=True)
        wanted = query.get("bodies", [])
        # Which of two is heeded, or whether an empty one means all, is not for this place to guess.
        return [part.strip() for part in wanted[0].split(",")] if len(wanted) == 1 else []

    def _grant_of(
        self,
        scope: Scope,
        of_session: Callable[[str], Grant | None] | None = None,
        *,
        cookie_suffices: bool = False,
    ) -> Grant:
        """Find the caller; `of_session` finds whose a session is."""
        shown = [value for name, value in scope["headers"] if name == _AUTHORIZATION]
        if len(shown) > 1:
            raise NotAuthenticated(f"The request has the header authorization twice{_REFUSAL}")
        if shown:
            return self.by_key(shown[0], _bearer)
        headers = Headers.of(scope)
        if _takes_tickets(scope) and (ticket := _take_ticket(scope)):
            return self.redeemed(ticket)
        session = headers.cookies.get(session_cookie(scope))
        if session is None and CERTIFIED in scope:
            headers.require_no_other_page(scope)
            return self.good(self.credentials.certified(scope[CERTIFIED]))
        if session is None:
            raise NothingShown.worded("key.none")
        found = (of_session or self.sessions.grant_of)(session)
        if found is None:
            raise not_good(NothingShown)
        good = self.good(found)
        headers.require_own_page(scope)
        if not cookie_suffices and not self.sessions.proves(session, headers.proof):
            raise CookieAlone.worded("key.cookie-alone")
        return replace(good, session=session)

    def counts_unknown(self, scope: Scope, detail: str) -> bool:
        """Tell if a refused request came without a good key, and so is counted instead of logged."""
        if self.is_open or CALLER in scope:
            return False
        self._tell(scope, detail)
        return True

    def _refuse(self, scope: Scope, error: NotAuthenticated | NotPermitted) -> None:
        """Write a refusal into the security log, and into the log."""
        target = f"{scope.get('method', 'WebSocket')} {scope['path']}"
        self.note_refusal(target, error, partial(self._name_of, scope))
        self._tell(scope, error.detail)

    def _tell(self, scope: Scope, detail: str) -> None:
        """Log refusals, one a second at most."""
        self._refused += 1
        now = monotonic()
        if now - self._told_at >= 1:
            what = f"{scope.get('method', 'WebSocket')} {scope['path'][:200]!a} from {current().caller}"
            log.warning("refused requests: %d; the last: %s: %a", self._refused, what, detail)
            self._told_at, self._refused = now, 0

    def _name_of(self, scope: Scope) -> str | None:
        try:
            return self._grant_of(scope, cookie_suffices=True).principal.name
        except (NotAuthenticated, NotPermitted):
            return None


@dataclass(frozen=True)
class Headers:
    """The headers that tell of the sender of a request."""

    found: Mapping[bytes, bytes]

    @classmethod
    def of(cls, scope: Scope) -> "Headers":
        """Read them.

        :raises NotAuthenticated: there is more than one credential, so which is meant is not known.
        """
        found: dict[bytes, bytes] = {}
        for name, value in scope["headers"]:
            if name == _COOKIE and name in found:
                raise NotAuthenticated(f"The request has the header cookie twice{_REFUSAL}")
            found[name] = value
        return cls(found)

    @property
    def cookies(self) -> Mapping[str, str]:
        """The cookies that a browser keeps for us."""
        cookie = self.found.get(_COOKIE)
        return cookie_parser(cookie.decode("latin-1")) if cookie else {}

    @property
    def proof(self) -> str:
        """The second secret of a session, which a browser sends to no other port of our host."""
        return self.found.get(_PROOF, b"").decode("latin-1")

    def _word(self, name: bytes) -> str:
        return self.found.get(name, b"").decode("latin-1").lower()

    def require_no_other_page(self, scope: Scope) -> None:
        """Refuse what a page of another origin makes a browser send; programs send no word of pages.

        :raises NotPermitted: a page sends it that is not the gateway's own.
        """
        if self._word(b"origin") or self._word(b"sec-fetch-site"):
            self.require_own_page(scope)

    def require_own_page(self, scope: Scope) -> None:
        """Refuse a request that a page of another site makes a signed-in browser send.

        :raises NotPermitted: the page is not the gateway's own, or nothing shows that it is.
        """
        safe = scope["type"] == "http" and scope["method"] in _SAFE
        scheme = "https" if is_secure(scope) else "http"
        host, origin, site = self._word(b"host"), self._word(b"origin"), self._word(b"sec-fetch-site")
        own = origin in (f"https://{host}", f"{scheme}://{host}")
        if origin and not own:
            raise NotPermitted.worded("not-from-there")
        typed_in = site == "none" and safe
        if not (site == "same-origin" or typed_in if site else own or safe):
            raise NotPermitted.worded("not-from-there")


def _bearer(shown: bytes) -> str:
    """Read the key in a header Authorization.

    :raises NotAuthenticated: it has another form.
    """
    scheme, _, key = shown.decode("latin-1").partition(" ")
    if scheme.lower() != "bearer" or not key.strip():
        raise NotAuthenticated.worded("key.none-in-header")
    return key.strip()


def is_secure(scope: Scope) -> bool:
    """True if the client speaks TLS, with us or with a proxy that we trust."""
    return scope.get("scheme") in ("https", "wss")


def session_cookie(scope: Scope) -> str:
    """The name of the cookie; over TLS browsers take it from this host alone."""
    return "__Host-mg-session" if is_secure(scope) else "mg-session"


def _note_caller(principal: Principal, origin: Origin, scope: Scope) -> str:
    """Name the caller for the log, should the request be refused later."""
    scope[CALLER] = caller = f"{principal.name} ({origin.caller})"
    return caller


def _in_the_name_of(principal: Principal, origin: Origin, scope: Scope) -> Origin:
    caller = _note_caller(principal, origin, scope)
    return Origin(caller, origin.request_id, origin.key, origin.work, origin.claim, origin.address)


def _use_of(scope: Scope, right: Right) -> Use:
    if right is Right.OPERATE:
        return Use.REQUEST if scope["path"].endswith(_HEARTBEAT) else Use.MOVE
    listens = scope["type"] == "websocket" or scope["path"].endswith(_STREAM)
    return Use.SUBSCRIBER if listens else Use.REQUEST


def _with_leases(origin: Origin, scope: Scope, right: Right) -> Origin:
    """Add the tokens of leases that a request shows, where they count.

    :raises InvalidRequest: they are no tokens; nothing was sent.
    """
    if right not in LEASED:
        return origin
    shown = b",".join(value for name, value in scope["headers"] if name == _LEASE_TOKEN)
    epoch = _owner_epoch(scope)
    if not shown:
        return origin if epoch is None else origin.claiming(Claim(owner_epoch=epoch))
    if not _LEASE_TOKENS.fullmatch(shown):
        raise InvalidRequest(
            f"The header Lease-Token has no tokens{_REFUSAL}",
            "Send the token that came with the lease, or several with commas.",
        )
    return origin.claiming(Claim(tuple(map(int, shown.split(b","))), owner_epoch=epoch))


def _owner_epoch(scope: Scope) -> int | None:
    """Since when the sender believes that this gateway has the line, if it says so.

    :raises InvalidRequest: it is no number; nothing was sent.
    """
    shown = next((value for name, value in scope["headers"] if name == _OWNER_EPOCH), None)
    if shown is None:
        return None
    if not re.fullmatch(rb"[1-9][0-9]{0,8}", shown):
        raise InvalidRequest(
            f"The header Owner-Epoch is no number{_REFUSAL}", "Send the `epoch` of the line's `owner`."
        )
    return int(shown)


def _takes_tickets(scope: Scope) -> bool:
    """Tell if a request opens a stream: of events, or of a line's trace."""
    path = path_of(scope)
    return path in STREAMS or path.endswith(_STREAM)


def _take_ticket(scope: Scope) -> str | None:
    """Take the ticket out of the query, so that it stands in no log and no answer."""
    if b"ticket=" not in scope["query_string"]:
        return None
    query = parse_qsl(scope["query_string"].decode("latin-1"), keep_blank_values=True)
    tickets = [value for name, value in query if name == _TICKET]
    scope["query_string"] = urlencode([pair for pair in query if pair[0] != _TICKET]).encode()
    return tickets[0] if len(tickets) == 1 else None


async def while_it_holds(holds: Callable[[], bool], handling: Awaitable[None]) -> bool:
    """Serve an event stream, and end it soon after its credential; give whether that was the end."""
    task = asyncio.ensure_future(handling)
    try:
        while not (await asyncio.wait({task}, timeout=RECHECK_S))[0]:
            if not holds():
                return False
        await task
    finally:
        task.cancel()
        await asyncio.gather(task, return_exceptions=True)
    return True
