"""The stop of a plant: by HTTP and by the servers at once, each way as good as the other."""

import asyncio
import json
import logging
from collections.abc import Awaitable, Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Final, Literal, Protocol

from fleet.addresses import outward
from fleet.errors import USE_HARDWARE
from fleet.follower import Follower
from fleet.registry import Gateway, Registry
from fleet.stop_message import StopMessage
from fleet.tasks import end
from fleet.upstream import Caller, Upstream
from gateway.core.errors import GatewayError

log = logging.getLogger(__name__)

ANSWER_S: Final = 2.0
GOES_ON_S: Final = 60.0
AGAIN_S: Final = 0.5
LISTEN_S: Final = 3.0
"""Seconds for which reports of gateways are awaited after the servers took a stop."""
State = Literal["confirmed", "unconfirmed", "unreached"]


@dataclass
class Attempt:
    """The state of the stop at one gateway."""

    gateway: str
    conflict: str | None = None
    """Two gateways have this name: the report of one says nothing of the other."""
    report: dict[str, Any] | None = None
    received: bool = False
    refused: str | None = None
    why: str = "it has not answered"
    done: asyncio.Event = field(default_factory=asyncio.Event)
    """Event that is set by the gateway's report or refusal."""

    @property
    def state(self) -> State:
        """Give the progress of the stop at this gateway."""
        if self.report is not None:
            is_confirmed = self.report["confirmed"] and self.conflict is None
            return "confirmed" if is_confirmed else "unconfirmed"
        return "unconfirmed" if self.received else "unreached"

    @property
    def detail(self) -> str:
        """The state in a sentence, and what to do."""
        if self.state == "confirmed":
            return "Every controller reports standstill."
        if self.conflict is not None:
            return f"{self.conflict} Nobody knows which of them has stopped. {USE_HARDWARE}"
        if self.report is not None:
            return f"Not every controller reports standstill; the gateway goes on stopping. {USE_HARDWARE}"
        if self.received:
            return f"The gateway has the stop, and standstill is not confirmed yet. {USE_HARDWARE}"
        if self.refused is not None:
            return f"Gateway {self.gateway} has refused the stop: {self.refused.rstrip('.')}. {USE_HARDWARE}"
        return (
            f"Gateway {self.gateway} was not reached: {self.why.rstrip('.')}. Use its hardware stop. The "
            f"attempt goes on for {GOES_ON_S:.0f} s."
        )

    def told(self) -> dict[str, Any]:
        """Tell of it, as `POST /stop` does."""
        report = None if self.report is None else outward(self.gateway, self.report)
        return {"gateway": self.gateway, "state": self.state, "detail": self.detail, "report": report}


class PlantStop:
    """Stops all gateways; each stop goes on behind its answer until every gateway has told of it."""

    def __init__(self, registry: Registry, upstream: Upstream, follower: Follower) -> None:
        self._registry, self._upstream, self._follower = registry, upstream, follower
        self._running: set[asyncio.Task[None]] = set()

    async def stop(self, caller: Caller, mode: Literal["decelerate", "immediate"]) -> list[Attempt]:
        """Begin at all gateways at once, and tell after two seconds at most how far it has come."""
        gateways = self._registry.all()
        # Whoever has the lines of others has to stop them, though it was never heard.
        names = {gateway.name for gateway in gateways} | {
            owner for gateway in gateways for owner in gateway.owners.values()
        }
        attempts = {name: Attempt(name, self._registry.conflict_of(name)) for name in names}
        running = asyncio.create_task(self._carry_out(attempts, caller, mode), name="stop of the plant")
        self._running.add(running)
        running.add_done_callback(self._running.discard)
        with suppress(TimeoutError):
            await asyncio.wait_for(_AllOf(attempts).wait(), ANSWER_S)
        return [attempts[name] for name in sorted(attempts)]

    async def aclose(self) -> None:
        """End what still goes on."""
        await end(self._running)

    async def _carry_out(
        self, attempts: dict[str, Attempt], caller: Caller, mode: Literal["decelerate", "immediate"]
    ) -> None:
        prefix, digest = caller.key_digest()
        message = StopMessage(mode=mode, request_id=caller.request_id, key_prefix=prefix, key_sha256=digest)
        content = json.dumps({"mode": mode}).encode()
        headers = {**caller.headers, "Content-Type": "application/json"}

        def note(report: Mapping[str, Any]) -> None:
            name = str(report.get("gateway", ""))
            _take_report(attempts.setdefault(name, Attempt(name)), report)

        ways = [
            self._again(_AllOf(attempts), partial(self._by_servers, message, note)),
            *(
                self._again(
                    attempt.done, partial(self._by_http, self._registry.get(name), attempt, headers, content)
                )
                for name, attempt in attempts.items()
            ),
        ]
        with suppress(TimeoutError):
            async with asyncio.timeout(GOES_ON_S):
                await asyncio.gather(*ways)
        for attempt in attempts.values():
            if attempt.report is None:
                log.error(
                    "the stop of the plant has not reached gateway %s: %s", attempt.gateway, attempt.detail
                )

    async def _again(self, done: "Done", way: Callable[[], Awaitable[None]]) -> None:
        """Go one way again and again until a gateway has told of it; a fault on one way ends no other."""
        while not done.is_set():
            try:
                await way()
            except Exception:
                log.exception("a stop of the plant has met a fault on one of its ways")
            with suppress(TimeoutError):
                await asyncio.wait_for(done.wait(), AGAIN_S)

    async def _by_servers(self, message: StopMessage, note: Callable[[Mapping[str, Any]], None]) -> None:
        """Send it by the servers, and hear for a while what the gateways report."""
        async with self._follower.stopping(message, note):
            await asyncio.sleep(LISTEN_S)

    async def _by_http(
        self, gateway: Gateway | None, attempt: Attempt, headers: Mapping[str, str], content: bytes
    ) -> None:
        """Ask the gateway, and take what it tells."""
        if gateway is None:
            return
        try:
            answer = await self._upstream.ask(
                gateway, "POST", "/stop", headers, content, within_s=4 * ANSWER_S
            )
            told = answer.json()
        except (GatewayError, ValueError) as error:
            attempt.why = getattr(error, "detail", str(error))
            return
        if answer.is_success:
            _take_report(attempt, {"report": told})
        elif answer.status_code in (401, 403):
            attempt.refused = str(told.get("detail", f"status {answer.status_code}"))
            attempt.done.set()
        else:
            attempt.why = str(told.get("detail", f"status {answer.status_code}"))


class Done(Protocol):
    """An attempt, or several: over some day."""

    def is_set(self) -> bool:
        """Tell if it is over."""

    async def wait(self) -> object:
        """Wait for it."""


class _AllOf:
    """Over when all attempts are."""

    def __init__(self, attempts: Mapping[str, Attempt]) -> None:
        self._attempts = attempts

    def is_set(self) -> bool:
        return all(attempt.done.is_set() for attempt in self._attempts.values())

    async def wait(self) -> None:
        await asyncio.gather(*(attempt.done.wait() for attempt in self._attempts.values()))


def _take_report(attempt: Attempt, told: Mapping[str, Any]) -> None:
    """Take what a gateway tells; a confirmed standstill is not taken back by what comes later."""
    if told.get("received"):
        attempt.received = True
    report = told.get("report")
    if isinstance(report, dict) and "confirmed" in report:
        if attempt.report is None or not attempt.report["confirmed"]:
            attempt.report = report
        if attempt.conflict is None:
            attempt.done.set()
    elif why := told.get("refused") or told.get("failed"):
        attempt.why = str(why)  # by HTTP the whole of what the caller shows is looked at
