"""The write gate: every frame for a controller passes here, in the same instant in which it is written."""

from collections.abc import Callable

from gateway.errors import Expired, GatewayError, StoppedFirst
from gateway.exchange import Exchange, Lane

Guard = Callable[[Exchange, float], GatewayError | None]
"""Looks at an exchange about to be written: None lets it pass, an error refuses it with nothing written."""


class Gate:
    """The guards of one line, asked in order. The first refusal counts."""

    def __init__(self) -> None:
        self._epochs: dict[int, int] = {}
        self._guards: list[Guard] = [self._not_stopped_since, not_too_late]

    def add(self, guard: Guard) -> None:
        """Add a rule that every frame must pass from now on."""
        self._guards.append(guard)

    def epoch(self, body: int) -> int:
        """The body's stop epoch: how many stops it has had."""
        return self._epochs.get(body, 0)

    def stop(self, body: int) -> None:
        """Begin a new stop epoch: nothing admitted earlier can be written any more."""
        self._epochs[body] = self.epoch(body) + 1

    def refuses(self, exchange: Exchange, now: float) -> GatewayError | None:
        """The reason why this must not be written, if there is one."""
        for guard in self._guards:
            reason = guard(exchange, now)
            if reason is not None:
                return reason
        return None

    def _not_stopped_since(self, exchange: Exchange, _: float) -> GatewayError | None:
        if exchange.lane is not Lane.COMMAND or exchange.epoch == self.epoch(exchange.body):
            return None
        return StoppedFirst()


def not_too_late(exchange: Exchange, now: float) -> GatewayError | None:
    """No command starts later than its sender allowed."""
    if exchange.expires_at is None or now < exchange.expires_at:
        return None
    return Expired()
