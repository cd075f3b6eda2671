"""The one hook at which access control refuses a request, before anything but its head is read."""

import asyncio
import logging
import re
from collections.abc import Awaitable, Callable, Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from time import monotonic
from typing import Final
from urllib.parse import parse_qs, parse_qsl, urlencode

from starlette.requests import cookie_parser
from starlette.types import Scope

from api.common.problems import CALLER, path_of
from api.front.certificates import CERTIFIED
from gateway.access import keys
from gateway.access.errors import NotAuthenticated, NothingShown, NotPermitted
from gateway.access.grants import Grant, SessionInfo, Tickets
from gateway.access.limits import Limits, Rates, Usages, Use
from gateway.access.principal import EVERYBODY, PRINCIPAL, Principal
from gateway.access.principal import current as current_principal
from gateway.core.errors import GatewayError, InvalidRequest
from gateway.core.family import Family
from gateway.core.operation import LEASED
from gateway.core.origin import ORIGIN, Claim, Origin, current
from gateway.core.own_faults import survived, twice
from gateway.core.rights import Right
from gateway.plant import Plant
from gateway.security import entries

log = logging.getLogger(__name__)

STREAMS: Final = frozenset({"/events", "/events/stream"})
"""What can be about some bodies only, by its query."""
RECHECK_S: Final = 5.0
"""How often it is asked whether the credential of an event stream is still good."""
SIGN_INS_AT_ONCE: Final = 20
SIGN_INS_PER_S: Final = 1.0
WRONG_SIGN_INS_AT_ONCE: Final = 100
WRONG_SIGN_INS_PER_S: Final = 2.0
CLOSE_NOT_AUTHENTICATED: Final = 4401
_SAFE: Final = frozenset({"GET", "HEAD"})
_TICKET: Final = "ticket"
_AUTHORIZATION: Final = b"authorization"
_COOKIE: Final = b"cookie"
_REFUSAL: Final = "; nothing was sent."
_LEASE_TOKEN: Final = b"lease-token"
_LEASE_TOKENS: Final = re.compile(rb"\s*[1-9][0-9]{0,17}\s*(?:,\s*[1-9][0-9]{0,17}\s*){0,31}")
_STREAM: Final = "/stream"
_HEARTBEAT: Final = "/heartbeat"
"""What keeps a JOG going begins no move."""

_NOT_GOOD: Final = (
    f"The credential is none of this gateway, or has expired, or was revoked{_REFUSAL}",
    "Use a good key: `motion-gateway keys list` tells which are.",
)
_REFUSAL_JA: Final = "。何も送信していません。"
_SEND_KEY_JA: Final = "Authorization: Bearer KEY ヘッダーを送信してください。"
_NOT_GOOD_JA: Final = (
    f"このゲートウェイのキーではないか、期限切れまたは失効したキーです{_REFUSAL_JA}",
    "有効なキーを使用してください（motion-gateway keys list で確認できます）。",
)


class Passage:
    """A request that may go on; within it the code acts in the name of the caller."""

    holds: Callable[[], bool] | None = None
    """Of an event stream, which lasts: whether its credential is still good."""

    def __enter__(self) -> None:
        """Begin."""

    def __exit__(self, *_: object) -> None:
        """It is answered."""


class _Of(Passage):
    """A request of somebody."""

    def __init__(self, principal: Principal, origin: Origin) -> None:
        self._principal, self._origin = principal, origin

    def __enter__(self) -> None:
        self._before = PRINCIPAL.set(self._principal), ORIGIN.set(self._origin)

    def __exit__(self, *raised: object) -> None:
        principal, origin = self._before
        ORIGIN.reset(origin)
        PRINCIPAL.reset(principal)
        if self._principal.scope is not None and isinstance(raised[1], GatewayError):
            raised[1].withhold_names()


class _Counted(_Of):
    """A request of a key, which may have so many."""

    def __init__(self, principal: Principal, origin: Origin, usages: Usages, use: Use) -> None:
        super().__init__(principal, origin)
        self._usages, self._use = usages, use

    def __enter__(self) -> None:
        self._usages.begin(self._principal.id, self._use)
        super().__enter__()

    def __exit__(self, *raised: object) -> None:
        super().__exit__(*raised)
        self._usages.end(self._principal.id, self._use)


class Access:
    """Asks each request for a credential, a right and a scope; with mode `open` none is asked for."""

    def __init__(self, plant: Plant) -> None:
        settings = plant.config.access
        self.is_open = settings.mode == "open"
        self.credentials = plant.credentials
        self.sessions = plant.sessions
        self.tickets = Tickets()
        self.territory = plant.territory
        self._named_by = _parameters_of(plant.families.values())
        self._usages = Usages(
            Limits(settings.subscribers_per_key, settings.requests_per_key, settings.moves_per_key_and_s)
        )
        self._good_ones: dict[bytes, Grant] = {}
        """By the headers that were good a moment ago."""
        self._forget_at = 0.0
        self._security = plant.security
        self.sessions.on_end = self._session_ended
        self.sign_ins = Rates(SIGN_INS_AT_ONCE, SIGN_INS_PER_S)
        """Of each key."""
        self.wrong_sign_ins = Rates(WRONG_SIGN_INS_AT_ONCE, WRONG_SIGN_INS_PER_S)
        """From each network address."""
        self._refused = 0
        self._told_at = 0.0

    def require(self, scope: Scope, right: Right, *, any_scope: bool = False) -> Passage:
        """Refuse a request or a WebSocket whose sender does not have the right; `scope` is as in ASGI.

        `any_scope` lets keys of every scope pass: the route tells nothing of the plant, or heeds the scope.

        :raises NotAuthenticated: it has no credential, or one that is not good; nothing was done.
        :raises NotPermitted: the sender does not have the right, or not there; nothing was done.
        """
        if right is Right.OPEN:
            return Passage()
        try:
            if right is Right.STOP:
                return twice("the check of a stop", partial(self._let_stop, scope))
            return self._let_in(scope, right, any_scope=any_scope)
        except (NotAuthenticated, NotPermitted) as error:
            self._refuse(scope, error)
            raise

    def permits(self, scope: Scope, right: Right, *, any_scope: bool = False) -> bool:
        """Whether `require` would let a request pass; nothing is logged or counted."""
        if right is Right.OPEN:
            return True
        try:
            self._let_in(scope, right, any_scope=any_scope)
        except (NotAuthenticated, NotPermitted, InvalidRequest):
            return False
        return True

    def _let_in(self, scope: Scope, right: Right, *, any_scope: bool) -> Passage:
        if self.is_open:
            if scope["query_string"] and _takes_tickets(scope):
                _take_ticket(scope)
            return _Of(EVERYBODY, _with_leases(current(), scope, right))
        grant, session = self._grant_of(scope)
        _note_caller(grant.principal, current(), scope)
        if any_scope:
            self.territory.require_right(grant.principal, right)
        else:
            self.territory.require(grant.principal, right, *self._targets(scope))
        use = _use_of(scope, right)
        origin = _in_the_name_of(grant.principal, _with_leases(current(), scope, right), scope)
        passage = _Counted(grant.principal, origin, self._usages, use)
        if use is Use.SUBSCRIBER:
            passage.holds = lambda: self._holds(grant, session)
        return passage

    def _let_stop(self, scope: Scope) -> Passage:
        """Let in who has a good credential: with each of them everything may be stopped.

        So nothing else is looked at, and no fault of the gateway itself can refuse a stop there.
        """
        if self.is_open:
            return _Of(EVERYBODY, current())
        grant, _ = self._grant_of(scope, self.sessions.grant_to_stop)
        return _Of(grant.principal, _in_the_name_of(grant.principal, current(), scope))

    def sees(self, address: str) -> bool:
        """Whether the caller may see this in a list."""
        return self.territory.covers(current_principal(), address)

    def view_of(self, scope: Scope) -> Callable[[str], bool]:
        """Find what the sender of a request that all may make is told of: nothing without a good key."""
        if self.is_open:
            return lambda _: True
        try:
            principal = self._grant_of(scope)[0].principal
        except (NotAuthenticated, NotPermitted):
            return lambda _: False
        return partial(self.territory.covers, principal)

    def caller_of(self, scope: Scope) -> str | None:
        """Name the caller, the same for all its requests; None where none may be answered."""
        if self.is_open:
            return current().caller
        try:
            principal = self._grant_of(scope)[0].principal
        except (NotAuthenticated, NotPermitted):
            return None
        _note_caller(principal, current(), scope)
        return principal.id

    def ticket_for(self, scope: Scope) -> str:
        """Give the sender of a request that has passed a ticket, which ends with its session and its key.

        :raises NotAuthenticated: by then it is no longer good.
        """
        if self.is_open:
            return self.tickets.issue(Grant(EVERYBODY))
        grant, session = self._grant_of(scope)
        return self.tickets.issue(replace(grant, session=session))

    def _targets(self, scope: Scope) -> list[str]:
        """What a request is about, by its path; events by their query."""
        params = scope.get("path_params") or {}
        named = [str(params[name]) for name in self._named_by if name in params]
        if named or path_of(scope) not in STREAMS:
            return named
        query = parse_qs(scope["query_string"].decode("latin-1"), keep_blank_values=True)
        wanted = query.get("bodies", [])
        # Which of two is heeded, or whether an empty one means all, is not for this place to guess.
        return [part.strip() for part in wanted[0].split(",")] if len(wanted) == 1 else []

    def _holds(self, grant: Grant, session: str | None) -> bool:
        return self.credentials.holds(grant) and (session is None or self.sessions.lasts(session))

    def _grant_of(
        self, scope: Scope, of_session: Callable[[str], Grant | None] | None = None
    ) -> tuple[Grant, str | None]:
        """Find the caller, and the session if there is one; `of_session` finds whose a session is."""
        shown = [value for name, value in scope["headers"] if name == _AUTHORIZATION]
        if shown:
            return self._bearer_of(shown), None
        headers = Headers.of(scope)
        if _takes_tickets(scope) and (ticket := _take_ticket(scope)):
            grant = self._good(self.tickets.redeem(ticket))
            if not self._holds(grant, grant.session):
                raise NotAuthenticated(*_NOT_GOOD).in_japanese(*_NOT_GOOD_JA)
            return grant, grant.session
        session = headers.cookies.get(session_cookie(scope))
        if session is None and CERTIFIED in scope:
            headers.require_no_other_page(scope)
            return self._good(self.credentials.certified(scope[CERTIFIED])), None
        if session is None:
            raise NothingShown(
                f"The request has no key{_REFUSAL}", "Send the header Authorization: Bearer KEY."
            ).in_japanese(f"キーがありません{_REFUSAL_JA}", _SEND_KEY_JA)
        found = (of_session or self.sessions.grant_of)(session)
        if found is None:
            raise NothingShown(*_NOT_GOOD).in_japanese(*_NOT_GOOD_JA)
        good = self._good(found)
        headers.require_own_page(scope)
        return good, session

    def _bearer_of(self, shown: list[bytes]) -> Grant:
        """Find whose a header is; one that was good is not read again until the keys are looked at again."""
        now = monotonic()
        if now >= self._forget_at:
            self._forget_at = now + keys.RECHECK_S
            self._good_ones.clear()
        grant = self._good_ones.get(shown[0]) if len(shown) == 1 else None
        if grant is None or not self.credentials.knows(grant):
            grant = self.credentials.verify(_bearer(shown))
            if grant is None:
                raise NotAuthenticated(*_NOT_GOOD).in_japanese(*_NOT_GOOD_JA)
            self._good_ones[shown[0]] = grant
        return grant

    def _good(self, grant: Grant | None) -> Grant:
        if grant is None or not self.credentials.holds(grant):
            raise NotAuthenticated(*_NOT_GOOD).in_japanese(*_NOT_GOOD_JA)
        return grant

    def counts_unknown(self, scope: Scope, detail: str) -> bool:
        """Whether a refused request came without a good key, and so is counted instead of logged."""
        if self.is_open or CALLER in scope:
            return False
        self._tell(scope, detail)
        return True

    def _refuse(self, scope: Scope, error: NotAuthenticated | NotPermitted) -> None:
        """Write a refusal into the security log, and into the log."""
        survived("the security log", partial(self._note, scope, error))
        self._tell(scope, error.detail)

    def _tell(self, scope: Scope, detail: str) -> None:
        """Log refusals, one a second at most."""
        self._refused += 1
        now = monotonic()
        if now - self._told_at >= 1:
            what = f"{scope.get('method', 'WebSocket')} {scope['path'][:200]!a} from {current().caller}"
            log.warning("refused requests: %d; the last: %s: %a", self._refused, what, detail)
            self._told_at, self._refused = now, 0

    def _note(self, scope: Scope, error: NotAuthenticated | NotPermitted) -> None:
        if isinstance(error, NothingShown):
            return
        target = f"{scope.get('method', 'WebSocket')} {scope['path']}"
        if isinstance(error, NotAuthenticated):
            self._security.note(entries.CREDENTIAL_REFUSED, target, why=error.detail)
        else:
            self._security.note(
                entries.REQUEST_REFUSED, target, caller=self._name_of(scope), why=error.detail
            )

    def _name_of(self, scope: Scope) -> str | None:
        try:
            return self._grant_of(scope)[0].principal.name
        except (NotAuthenticated, NotPermitted):
            return None

    def _session_ended(self, session: SessionInfo, why: str) -> None:
        self._security.note(entries.SESSION_ENDED, session.id, why=why, of=session.name)


@dataclass(frozen=True)
class Headers:
    """What a request says of its sender."""

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
        """What a browser keeps for us."""
        cookie = self.found.get(_COOKIE)
        return cookie_parser(cookie.decode("latin-1")) if cookie else {}

    def _word(self, name: bytes) -> str:
        return self.found.get(name, b"").decode("latin-1").lower()

    def require_no_other_page(self, scope: Scope) -> None:
        """Refuse what a page of another origin makes a browser send; programs send no word of pages.

        :raises NotPermitted: a page sends it that is not the gateway's own.
        """
        if self._word(b"origin") or self._word(b"sec-fetch-site"):
            self.require_own_page(scope)

    def require_own_page(self, scope: Scope) -> None:
        """Refuse what a page of somebody else makes a signed-in browser send.

        :raises NotPermitted: the page is not the gateway's own, or nothing shows that it is.
        """
        safe = scope["type"] == "http" and scope["method"] in _SAFE
        scheme = "https" if is_secure(scope) else "http"
        host, origin, site = self._word(b"host"), self._word(b"origin"), self._word(b"sec-fetch-site")
        own = origin in (f"https://{host}", f"{scheme}://{host}")
        if origin and not own:
            raise NotPermitted(_NOT_FROM_THERE).in_japanese(_NOT_FROM_THERE_JA)
        typed_in = site == "none" and safe
        if not (site == "same-origin" or typed_in if site else own or safe):
            raise NotPermitted(_NOT_FROM_THERE).in_japanese(_NOT_FROM_THERE_JA)


def _bearer(shown: Sequence[bytes]) -> str:
    """Read the key in a header Authorization.

    :raises NotAuthenticated: there are several, or it has another form.
    """
    if len(shown) > 1:
        raise NotAuthenticated(f"The request has the header authorization twice{_REFUSAL}")
    scheme, _, key = shown[0].decode("latin-1").partition(" ")
    if scheme.lower() != "bearer" or not key.strip():
        raise NotAuthenticated(
            f"The header Authorization has no key{_REFUSAL}", "Send Authorization: Bearer KEY."
        ).in_japanese(f"Authorization ヘッダーにキーがありません{_REFUSAL_JA}", _SEND_KEY_JA)
    return key.strip()


_NOT_FROM_THERE: Final = f"Only the gateway's own pages may use a browser that is signed in{_REFUSAL}"
_NOT_FROM_THERE_JA: Final = f"サインイン済みのブラウザを使えるのは、ゲートウェイのページのみです{_REFUSAL_JA}"


def is_secure(scope: Scope) -> bool:
    """Whether the client speaks TLS, with us or with a proxy that we trust."""
    return scope.get("scheme") in ("https", "wss")


def session_cookie(scope: Scope) -> str:
    """The name of the cookie; over TLS browsers take it from nobody but this host."""
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


def _parameters_of(families: Iterable[Family]) -> Collection[str]:
    """The parameters of paths that name what a request is about: the first of each place."""
    places = {place.path for family in families for place, _ in family.commands}
    return {"line_id", "scara_id", *(path.split("/")[2].strip("{}") for path in places)}


def _with_leases(origin: Origin, scope: Scope, right: Right) -> Origin:
    """Add the tokens of leases that a request shows, where they count.

    :raises InvalidRequest: they are no tokens; nothing was sent.
    """
    if right not in LEASED:
        return origin
    shown = b",".join(value for name, value in scope["headers"] if name == _LEASE_TOKEN)
    if not shown:
        return origin
    if not _LEASE_TOKENS.fullmatch(shown):
        raise InvalidRequest(
            f"The header Lease-Token has no tokens{_REFUSAL}",
            "Send the token that came with the lease, or several with commas.",
        )
    return origin.claiming(Claim(tuple(map(int, shown.split(b",")))))


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
