"""Leases: for seconds at a time a part of a plant is moved and set by one client only.

Each lease has a token, a number that is given once and only grows. Motions and settings show it; it is
looked at when they are admitted, and again in the instant in which their frames are written: a client that
was held up for longer than its lease writes nothing. Stops and reads need none.
"""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any, Final, Literal, Protocol

from pydantic import Field

from gateway.core.admission import boot_time
from gateway.core.errors import GatewayError, NotAllowed, NotFound, NotSent
from gateway.core.exchange import Exchange
from gateway.core.origin import Claim
from gateway.core.parts import Part
from gateway.core.records import Record
from gateway.core.supervisor import Observers, insist
from gateway.core.whole_files import write_whole
from gateway.texts import Text, text
from protocols.table import Effect
from protocols.wording import as_given

FILE: Final = "lease-tokens"
AHEAD: Final = 1000
"""Tokens that are written down as given at once, so that not each takes a write."""


class LeaseTokens:
    """Numbers that are given once. Without a directory they begin anew with each gateway."""

    def __init__(self, directory: Path | None = None) -> None:
        self._path = None if directory is None else directory / FILE
        self._next = 1
        self._end = 1
        self._writing = asyncio.Lock()

    async def next(self) -> int:
        """Give the next number, which is written down as given before.

        :raises NotSent: that cannot be done.
        """
        async with self._writing:
            if self._next >= self._end:
                try:
                    self._next, self._end = await asyncio.to_thread(self._reserve)
                except (OSError, ValueError) as error:
                    raise NotSent(
                        f"No lease was given: its token cannot be written down ({error}).",
                        "Make room in the data directory, or mend the file of tokens.",
                    ) from error
            given, self._next = self._next, self._next + 1
            return given

    def _reserve(self) -> tuple[int, int]:
        if self._path is None:
            return self._end, self._end + AHEAD
        first = int(self._path.read_text("ascii")) if self._path.exists() else 1
        write_whole(self._path, str(first + AHEAD))
        return first, first + AHEAD


LONGEST_S: Final = 30.0
"""Longest duration of a lease that is not renewed, in seconds."""

WAKE: Final = "the end of a lease"

Mode = Literal["off", "optional", "required"]
End = Literal["released", "expired", "taken_over", "broken"]


class LeaseRefused(NotSent):
    """The request takes a lease that its sender does not have."""

    kind = "lease"
    retryable = False


class Lease(Record):
    """A lease: its holder alone moves a part of the plant."""

    lease: str = Field(description="Id of the lease.")
    scope: str = Field(description="Address of the leased line, body, group or robot.")
    covers: list[str] = Field(description="Addresses of the leased bodies and robots, or of the line.")
    holder: str = Field(description="The name of the key that took it.")
    ttl_s: float = Field(description="Seconds that the lease lasts after each renewal.")
    expires_in_s: float = Field(description="Seconds that the lease still lasts, unless it is renewed.")


class Taken(Lease):
    """A lease as its holder sees it."""

    token: int = Field(description="Number for the header Lease-Token of motions and settings.")


@dataclass(frozen=True)
class Holder:
    """A caller who can have leases."""

    name: str
    id: str
    """Empty where all who ask are one, as without access control."""

    @property
    def told_as(self) -> Text:
        """The name in sentences."""
        return Text(self.name, self.name) if self.id else text("phrases.caller-without-key")


@dataclass
class _Held:
    scope: str
    subject: str
    parts: Sequence[Part]
    holder: Holder
    token: int
    ttl_s: float
    until: float

    @property
    def id(self) -> str:
        return f"lease-{self.token}"

    def is_shown_by(self, claim: Claim) -> bool:
        return self.token in claim.tokens and self.holder.id == claim.holder

    def meets(self, part: Part) -> bool:
        return any(own.meets(part) for own in self.parts)

    def contains(self, part: Part) -> bool:
        return any(own.contains(part) for own in self.parts)


class Tokens(Protocol):
    """Numbers that are given once, restarts of the gateway included."""

    async def next(self) -> int:
        """Give the next.

        :raises NotSent: it could not be written down before.
        """


class Leases:
    """The leases of a plant; a restart of the gateway ends them all."""

    def __init__(self, mode: Mode, tokens: Tokens, clock: Callable[[], float] = boot_time) -> None:
        self.mode = mode
        self.clock = clock
        """Goes on while the computer sleeps."""
        self.on_taken = Observers[[str, Lease]]("a lease")
        """Called with the path of what was leased, and its lease."""
        self.on_end = Observers[[str, Lease, End]]("the end of a lease")
        """Called with the same, and why it has ended."""
        self.on_loss: Callable[[Lease, Sequence[Part]], object] = lambda _lease, _parts: None
        """Called with a lease that has ended, and the parts that it does not cover any more."""
        self._tokens = tokens
        self._held: dict[str, _Held] = {}
        self._timer: asyncio.TimerHandle | None = None

    # holding

    async def take(
        self, scope: str, subject: str, parts: Sequence[Part], holder: Holder, ttl_s: float, *, over: bool
    ) -> Taken:
        """Give a lease; `over` ends those of others that are in its way.

        :raises NotAllowed: the configuration has no leases.
        :raises LeaseRefused: another caller has a lease on a part of it.
        :raises NotSent: its token could not be written down.
        """
        if self.mode == "off":
            raise NotAllowed(
                "Leases are switched off; nothing was leased.", "Set lease_mode in the configuration."
            )
        token = await self._tokens.next()
        self.expire()
        in_the_way = [held for held in self._held.values() if any(map(held.meets, parts))]
        if in_the_way and not over:
            first = in_the_way[0]
            raise self._is_leased(first, next(filter(first.meets, parts)))
        for other in in_the_way:
            self._end(other, "taken_over")
        held = _Held(scope, subject, parts, holder, token, ttl_s, self.clock() + ttl_s)
        self._wait(held.until)
        self._held[held.id] = held
        self.on_taken(held.subject, self._told(held))
        return self._told_to_holder(held)

    def renew(self, lease_id: str, claim: Claim) -> Taken:
        """Let a lease last for its whole time from now on.

        :raises NotFound: it is over.
        :raises LeaseRefused: its token is not shown, or not by its holder.
        """
        held = self._find(lease_id)
        if not held.is_shown_by(claim):
            raise LeaseRefused.worded("lease.not-yours", lease=held.id)
        held.until = self.clock() + held.ttl_s
        return self._told_to_holder(held)

    def end(self, lease_id: str, holder: Holder) -> Lease:
        """End a lease; one that another holds is broken.

        :raises NotFound: it is over.
        """
        held = self._find(lease_id)
        self._end(held, "released" if held.holder == holder else "broken")
        return self._told(held)

    def is_of(self, lease_id: str, holder: Holder) -> bool:
        """Say whether the holder has a lease; errors as of `get`."""
        return self._find(lease_id).holder == holder

    # what is shown

    def all(self) -> list[Lease]:
        """All that have not ended, in the order of their tokens."""
        self.expire()
        return [self._told(held) for held in self._held.values()]

    def get(self, lease_id: str) -> Lease:
        """Give one.

        :raises NotFound: there is none of this id, or it is over.
        """
        return self._told(self._find(lease_id))

    # what they keep out

    def admit(self, claim: Claim) -> Claim:
        """Look whether a request may move or set the parts it claims; gives what the gate looks at again.

        :raises LeaseRefused: it may not; nothing was sent.
        """
        refusal = self._refusal(claim)
        if refusal is not None:
            raise refusal
        return claim

    def guard(self, line_id: str) -> Callable[[Exchange[Any, Any, Any], float], GatewayError | None]:
        """The guard of a line's gate.

        Frames that follow a move to its end go on after its lease. If a caller has no claim, only motion is
        refused.
        """
        line = Part(line_id, line_id)

        def refuses(exchange: Exchange[Any, Any, Any], _: float) -> GatewayError | None:
            origin, effect = exchange.origin, exchange.command.effect
            if effect is not Effect.MOTION and (effect is Effect.STOP or origin.work != "clients"):
                return None
            if origin.claim.parts:
                return self._refusal(origin.claim)
            return self._refusal(Claim(parts=(line,))) if effect is Effect.MOTION else None

        return refuses

    def _refusal(self, claim: Claim) -> LeaseRefused | None:
        if self.mode == "off" or not (self._held or claim.tokens or self.mode == "required"):
            return None
        self.expire()
        return next((why for part in claim.parts if (why := self._why_not(part, claim))), None)

    def _why_not(self, part: Part, claim: Claim) -> LeaseRefused | None:
        shown, tokens = False, claim.tokens
        for held in self._held.values():
            if held.is_shown_by(claim):
                shown = shown or held.contains(part)
            elif held.meets(part):
                return self._is_leased(held, part)
        if shown or not (tokens or self.mode == "required"):
            return None
        if tokens:
            return LeaseRefused.worded("lease.over", address=part.address)
        return LeaseRefused.worded("lease.needed", address=part.address)

    def _is_leased(self, held: _Held, asked: Part) -> LeaseRefused:
        """Name what was asked for where all of it is leased: the rest may be out of the caller's scope."""
        rest_s = max(0.0, held.until - self.clock())
        scope = asked.address if held.contains(asked) else held.scope
        return LeaseRefused.worded(
            "lease.held", scope=scope, holder=held.holder.told_as, rest_s=f"{rest_s:.1f}"
        )

    # time

    def expire(self) -> None:
        """End what is over."""
        now = self.clock()
        for held in [lease for lease in self._held.values() if now >= lease.until]:
            self._end(held, "expired")

    def close(self) -> None:
        """Look no more."""
        if self._timer is not None:
            self._timer.cancel()

    def _wait(self, until: float = inf) -> None:
        """Keep one timer, for the end of the lease that ends first; another is to end `until` then."""
        if self._timer is not None:
            self._timer.cancel()
            self._timer = None
        first = min([until, *(held.until for held in self._held.values())])
        if first < inf:
            rest_s = first - self.clock()
            self._timer = asyncio.get_running_loop().call_later(max(rest_s, 0.001), insist, WAKE, self._wake)

    def _wake(self) -> None:
        self.expire()
        self._wait()

    def _end(self, held: _Held, why: End) -> None:
        """The only place where a lease ends: what moves is heeded first, so that a fault leaves it to end."""
        told = self._told(held)
        self.on_loss(told, held.parts)
        del self._held[told.lease]
        self.on_end(held.subject, told, why)

    def _find(self, lease_id: str) -> _Held:
        self.expire()
        if lease_id not in self._held:
            raise NotFound(
                f"There is no lease {as_given(lease_id)}, or it is over.",
                "GET /leases lists those that last; what moves goes on to its end. Take a new one.",
            )
        return self._held[lease_id]

    def _told(self, held: _Held) -> Lease:
        return Lease(
            lease=held.id,
            scope=held.scope,
            covers=[part.address for part in held.parts],
            holder=held.holder.name,
            ttl_s=held.ttl_s,
            expires_in_s=round(max(0.0, held.until - self.clock()), 3),
        )

    def _told_to_holder(self, held: _Held) -> Taken:
        return Taken(**self._told(held).model_dump(), token=held.token)
