"""The write gate: every frame for a controller passes here, in the same instant in which it is written."""

from collections import Counter
from collections.abc import Callable
from typing import Any, Generic

from gateway.core.errors import Expired, GatewayError, Overtaking, StoppedFirst
from gateway.core.exchange import Exchange, X
from gateway.core.lanes import Lane

Guard = Callable[[X, float], GatewayError | None]
"""Looks at an exchange about to be written: None lets it pass, an error refuses it with nothing written."""


class Gate(Generic[X]):
    """The guards of one line, asked in order. The first refusal counts."""

    def __init__(self, set_up_target: int | None = None) -> None:
        self.set_up_target = set_up_target
        """What the line's own set-up is for: it goes on whatever is revoked."""
        self._stops: Counter[int] = Counter()
        self._revocations = 0
        self._last: dict[int, Overtaking] = {}
        """What has begun the present epoch of a target, if not that of all."""
        self._last_of_all: Overtaking = StoppedFirst
        self._guards: list[Guard[X]] = [self._not_overtaken, not_too_late]

    def add(self, guard: Guard[X]) -> None:
        """Add a rule that every frame must pass from now on."""
        self._guards.append(guard)

    def epoch(self, target: int) -> int:
        """The target's epoch: what was admitted in an earlier one is not written any more."""
        return self._stops[target] + (0 if target == self.set_up_target else self._revocations)

    def stops(self, target: int) -> int:
        """How many stops there have been."""
        return self._stops[target]

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
        """Whether it was admitted in an earlier epoch, and that concerns it."""
        return exchange.lane is Lane.COMMAND and exchange.epoch != self.epoch(exchange.target)

    def refuses(self, exchange: X, now: float) -> GatewayError | None:
        """The reason why this must not be written, if there is one."""
        for guard in self._guards:
            reason = guard(exchange, now)
            if reason is not None:
                return reason
        return None

    def _not_overtaken(self, exchange: X, _: float) -> GatewayError | None:
        return self.overtaken(exchange.target) if self.is_overtaken(exchange) else None


def not_too_late(exchange: Exchange[Any, Any, Any], now: float) -> GatewayError | None:
    """No command starts later than its sender allowed."""
    if exchange.expires_at is None or now < exchange.expires_at:
        return None
    return Expired()
