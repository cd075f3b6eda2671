"""The write gate: every frame for a controller passes here, in the same instant in which it is written."""

from collections import Counter
from collections.abc import Callable

from gateway.core.errors import Expired, GatewayError, Overtaking, StoppedFirst
from gateway.core.lanes import Lane
from gateway.rorze.exchange import Exchange
from protocols.rorze.row import LINK_MASTER

Guard = Callable[[Exchange, float], GatewayError | None]
"""Looks at an exchange about to be written: None lets it pass, an error refuses it with nothing written."""


class Gate:
    """The guards of one line, asked in order. The first refusal counts."""

    def __init__(self) -> None:
        self._stops: Counter[int] = Counter()
        self._revocations = 0
        self._last: dict[int, Overtaking] = {}
        """What has begun the present epoch of a body, if not that of all."""
        self._last_of_all: Overtaking = StoppedFirst
        self._guards: list[Guard] = [self._not_overtaken, not_too_late]

    def add(self, guard: Guard) -> None:
        """Add a rule that every frame must pass from now on."""
        self._guards.append(guard)

    def epoch(self, body: int) -> int:
        """The body's epoch: what was admitted in an earlier one is not written any more."""
        return self._stops[body] + (0 if body == LINK_MASTER else self._revocations)

    def stop(self, body: int) -> None:
        """Begin a new epoch: no command admitted earlier can be written any more."""
        self._stops[body] += 1
        self._last[body] = StoppedFirst

    def revoke(self, why: Overtaking) -> None:
        """Begin a new epoch of all bodies; the link master's set-up goes on."""
        self._revocations += 1
        self._last.clear()
        self._last_of_all = why

    def overtaken(self, body: int) -> GatewayError:
        """Why what was admitted in an earlier epoch is not written."""
        return self._last.get(body, self._last_of_all)()

    def refuses(self, exchange: Exchange, now: float) -> GatewayError | None:
        """The reason why this must not be written, if there is one."""
        for guard in self._guards:
            reason = guard(exchange, now)
            if reason is not None:
                return reason
        return None

    def _not_overtaken(self, exchange: Exchange, _: float) -> GatewayError | None:
        if exchange.lane is not Lane.COMMAND or exchange.epoch == self.epoch(exchange.body):
            return None
        return self.overtaken(exchange.body)


def not_too_late(exchange: Exchange, now: float) -> GatewayError | None:
    """No command starts later than its sender allowed."""
    if exchange.expires_at is None or now < exchange.expires_at:
        return None
    return Expired()
