"""The write gate: every frame for a controller passes here, in the same instant in which it is written."""

from collections import defaultdict
from collections.abc import Callable
from typing import Generic

from gateway.core.errors import Expired, GatewayError, Overtaking, StoppedFirst
from gateway.core.exchange import Lane, X
from protocols.table import Effect

Guard = Callable[[X, float], GatewayError | None]
"""Looks at an exchange about to be written: None lets it pass, an error refuses it with nothing written."""


class Gate(Generic[X]):
    """The guards of one line, asked in order. The first refusal counts."""

    def __init__(self, set_up_target: int | None = None) -> None:
        self.set_up_target = set_up_target
        """Target of the line's own set-up, which goes on whatever is revoked."""
        self._stops: defaultdict[int, int] = defaultdict(int)
        self._revocations = 0
        self._last: dict[int, Overtaking] = {}
        """Why each target's current epoch began; missing means `_last_of_all`."""
        self._last_of_all: Overtaking = StoppedFirst
        self._guards: list[Guard[X]] = []

    def add(self, guard: Guard[X]) -> None:
        """Add a rule that every frame must pass from now on, unless it is that of a mere question."""
        self._guards.append(guard)

    def epoch(self, target: int) -> int:
        """The target's epoch: what was admitted in an earlier one is not written any more."""
        return self._stops[target] + (0 if target == self.set_up_target else self._revocations)

    def stops(self, target: int) -> int:
        """Number of stops of the target so far."""
        return self._stops[target]

    def all_stops(self) -> int:
        """Number of stops of anything on the line so far."""
        return sum(self._stops.values())

    def stop(self, target: int) -> None:
        """Begin a new epoch: no command admitted earlier can be written any more."""
        self._stops[target] += 1
        self._last[target] = StoppedFirst

    def revoke(self, why: Overtaking) -> None:
        """Begin a new epoch of all targets; the line's own set-up goes on."""
        self._revocations += 1
        self._last.clear()
        self._last_of_all = why

    def overtaken(self, target: int) -> GatewayError:
        """Why what was admitted in an earlier epoch is not written."""
        return self._last.get(target, self._last_of_all)()

    def is_overtaken(self, exchange: X) -> bool:
        """Say whether the exchange was admitted in an earlier epoch that a stop or revocation has ended."""
        return exchange.lane is Lane.COMMAND and exchange.epoch != self.epoch(exchange.target)

    def refuses(self, exchange: X, now: float) -> GatewayError | None:
        """The reason why this must not be written, if there is one."""
        if self.is_overtaken(exchange):
            return self.overtaken(exchange.target)
        if exchange.expires_at is not None and now >= exchange.expires_at:
            return Expired()
        if exchange.command.effect is Effect.READ:
            return None
        for guard in self._guards:
            reason = guard(exchange, now)
            if reason is not None:
                return reason
        return None
