"""A motion gateway for programs. For asyncio."""

import asyncio
import os
from collections.abc import AsyncIterator, Callable, Iterable
from contextlib import asynccontextmanager, suppress
from time import monotonic
from types import TracebackType
from typing import Any, Final, Literal, Self, TypeVar, cast

import httpx

from motion_gateway_client.answers import Answer
from motion_gateway_client.async_heart import AsyncHeart
from motion_gateway_client.errors import GatewayError, MoveNotOver, MoveNotSucceeded, NoAnswer, Refused
from motion_gateway_client.generated.async_operations import AsyncOperations
from motion_gateway_client.generated.types import (
    BodyJog,
    Event,
    JogSession,
    Move,
    RobotMove,
    StopResult,
    Taken,
)
from motion_gateway_client.paths import given, path_of
from motion_gateway_client.server_sent import EventReader

URL: Final = "http://127.0.0.1:8420"
TIMEOUT_S: Final = 10.0
LIMITS: Final = httpx.Limits(keepalive_expiry=2.0)
"""The gateway closes a silent connection after 5 s; what is sent at that moment would have no answer."""
MAX_WAIT_S: Final = 20.0
"""One request waits no longer for the end of a move; another one follows."""
SILENT_S: Final = 40.0
"""A stream says something at least every 15 s; one that is silent for longer is dead."""
STOP_TRIES: Final = 3
PAUSES_S: Final = (0.1, 0.2, 0.5, 1.0, 2.0)
"""Before each further try to reach a stream again; the last one from then on."""
UNDER_WAY: Final = frozenset({"queued", "sent", "moving"})
LEASE_S: Final = 10.0
BEATS: Final = 4
"""Heartbeats in the time in which one has to come."""

M = TypeVar("M", Move, RobotMove)
Connection = Callable[[GatewayError | None], object]


class AsyncGateway(AsyncOperations):
    """A gateway: every operation as a method, and what takes more than one request. For asyncio.

    Use it as a context manager. `url` and `key` are taken from MOTION_GATEWAY_URL and MOTION_GATEWAY_KEY
    where they are left out. Errors are `GatewayError`s; nothing that could move a motor is ever sent twice.
    """

    def __init__(
        self,
        url: str | None = None,
        *,
        key: str | None = None,
        timeout: float = TIMEOUT_S,
        http: httpx.AsyncClient | None = None,
    ) -> None:
        url = url or os.environ.get("MOTION_GATEWAY_URL") or URL
        key = key or os.environ.get("MOTION_GATEWAY_KEY")
        self._timeout_s = timeout
        self._tokens: list[str] = []
        """Tokens of the leases that are held, sent with every request."""
        self._http = http or httpx.AsyncClient(base_url=url, timeout=timeout, limits=LIMITS)
        if key:
            self._http.headers["Authorization"] = f"Bearer {key}"

    async def __aenter__(self) -> Self:
        """Begin to use it; nothing is sent."""
        return self

    async def __aexit__(
        self, kind: type[BaseException] | None, error: object, trace: TracebackType | None
    ) -> None:
        """Close the connections; moves go on."""
        await self.aclose()

    async def aclose(self) -> None:
        """Close the connections; moves go on."""
        await self._http.aclose()

    async def call(
        self,
        method: str,
        path: str,
        *,
        query: dict[str, Any] | None = None,
        body: Any = None,
        idempotency_key: str | None = None,
    ) -> Any:
        """Send a request, and give the answer's content.

        :raises Refused: the answer is a problem.
        :raises NoAnswer: there is none; `moved` is `no` only where nothing can have been sent.
        """
        answer = await self.ask(method, path, query=query, body=body, idempotency_key=idempotency_key)
        if not answer.is_success:
            raise _refused(answer.status, answer.content)
        return answer.content

    async def ask(
        self,
        method: str,
        path: str,
        *,
        query: dict[str, Any] | None = None,
        body: Any = None,
        idempotency_key: str | None = None,
        lease_tokens: Iterable[str] = (),
    ) -> Answer:
        """Send a request, and give the answer as it is, for those who hand it on; a problem is one, too.

        Leases that others hold with this key are used by their `lease_tokens`.

        :raises NoAnswer: there is none; `moved` is `no` only where nothing can have been sent.
        """
        query = given(query or {})
        tokens = ", ".join((*self._tokens, *lease_tokens))
        headers = given({"Idempotency-Key": idempotency_key or None, "Lease-Token": tokens or None})
        timeout = self._timeout_s + float(query.get("wait", 0))
        try:
            answer = await self._http.request(
                method, path, params=query, json=body, headers=headers, timeout=timeout
            )
        except httpx.TransportError as error:
            raise _no_answer(method, error) from error
        return Answer(answer.status_code, _content(answer), "Idempotency-Replayed" in answer.headers)

    async def command(self, address: str, name: str, **parameters: Any) -> Any:
        """Send a single command of the controller's table, as GET /commands lists them.

        `address` is that of a body, a group, a robot or a unit: `command("3F", "get-position")`.
        """
        return await self.call("POST", f"{path_of(address)}/commands/{name}", body=parameters)

    # moves

    async def wait_for_move(self, move: M, timeout: float = 60.0) -> M:  # noqa: ASYNC109  # the gateway waits
        """Wait until a move has succeeded, over broken connections too, and give its last state.

        :raises MoveNotSucceeded: it has ended otherwise.
        :raises MoveNotOver: it is still under way after `timeout` seconds.
        """
        give_up_at = monotonic() + timeout
        while move["status"] in UNDER_WAY:
            left_s = give_up_at - monotonic()
            if left_s <= 0:
                raise MoveNotOver(f"The move {move['id']} of {move['body_id']} is not over in {timeout:g} s.")
            move = await self._look_at(move, min(left_s, MAX_WAIT_S))
        if move["status"] != "succeeded":
            raise MoveNotSucceeded(move)
        return move

    async def _look_at(self, move: M, wait_s: float) -> M:
        path = f"{path_of(move['body_id'])}/moves/{move['id']}"
        try:
            seen: M = await self.call("GET", path, query={"wait": round(wait_s, 3)})
        except NoAnswer:
            await asyncio.sleep(min(PAUSES_S[0], wait_s))
            return move
        return seen

    async def stop(
        self, address: str | None = None, mode: Literal["decelerate", "immediate"] = "decelerate"
    ) -> StopResult:
        """Stop by software: a body, a group, a robot, a unit, or everything where no address is given.

        It is sent again where the connection breaks. Look at `confirmed`; it replaces no hardware stop.
        """
        path = "/stop" if address is None else f"{path_of(address)}/stop"
        for _ in range(STOP_TRIES - 1):
            try:
                return cast("StopResult", await self.call("POST", path, body={"mode": mode}))
            except NoAnswer:
                continue
        return cast("StopResult", await self.call("POST", path, body={"mode": mode}))

    @asynccontextmanager
    async def jog(
        self, robot_id: str, *, unit: int, axis: str, direction: Literal["+", "-"]
    ) -> AsyncIterator[JogSession]:
        """Jog a robot's axis while the block runs, with the heartbeats that keep it moving.

        The axis stops when the block ends, and within half a second when the program or its connection dies.

        :raises Refused: the axis was not started, or was stopped before the block had ended.
        """
        session = await self.start_jog(robot_id, {"unit": unit, "axis": axis, "direction": direction})
        async with self._jogging(robot_id, session):
            yield session

    @asynccontextmanager
    async def jog_body(
        self, body_id: str, *, direction: Literal["cw", "ccw"], speed: Literal["low", "high"] = "low"
    ) -> AsyncIterator[BodyJog]:
        """Jog a body while the block runs; errors and ends as of `jog`."""
        session = await self.start_body_jog(body_id, {"direction": direction, "speed": speed})
        async with self._jogging(body_id, session):
            yield session

    @asynccontextmanager
    async def _jogging(self, address: str, session: JogSession | BodyJog) -> AsyncIterator[None]:
        path = f"{path_of(address)}/jogs/{session['id']}"
        try:
            async with self._kept(f"{path}/heartbeat", session["heartbeat_within_ms"] / 1000):
                yield
        finally:
            await self._end(address, f"{path}/stop")

    @asynccontextmanager
    async def _kept(self, path: str, within_s: float) -> AsyncIterator[None]:
        """Post to a path often enough while the block runs.

        :raises Refused: that was refused before the block had ended.
        """
        refusals: list[Refused] = []

        async def beat() -> bool:
            try:
                await self.call("POST", path)
            except Refused as refusal:
                refusals.append(refusal)
            except NoAnswer:
                return True
            return not refusals

        async with AsyncHeart(within_s / BEATS, beat):
            yield
        if refusals:
            raise refusals[0]

    async def _end(self, address: str, path: str) -> None:
        for pause_s in PAUSES_S:
            with suppress(NoAnswer):
                ended: JogSession | BodyJog = await self.call("POST", path)
                if ended["state"] not in ("jogging", "stopping"):
                    return
            await asyncio.sleep(pause_s)
        await self.stop(address)

    # leases

    @asynccontextmanager
    async def lease(
        self, scope: str, *, ttl_s: float = LEASE_S, take_over: bool = False
    ) -> AsyncIterator[Taken]:
        """Let nobody else move a line, a body, a group or a robot while the block runs.

        The lease is renewed meanwhile, and goes with everything that this client sends. It ends with the
        block, or `ttl_s` after the program or its connection has died.

        :raises Refused: somebody else has it, or has taken it over before the block had ended.
        """
        taken = await self.take_lease({"scope": scope, "ttl_s": ttl_s, "take_over": take_over})
        token, path = str(taken["token"]), f"/leases/{taken['lease']}"
        self._tokens.append(token)
        try:
            async with self._kept(f"{path}/renew", ttl_s):
                yield taken
        finally:
            with suppress(GatewayError):  # it ends anyway, or has ended
                await self.call("DELETE", path)
            self._tokens.remove(token)

    # events

    async def events(
        self,
        *,
        bodies: Iterable[str] | None = None,
        types: Iterable[str] | None = None,
        after: str | None = None,
        sample: float | None = None,
        snapshot: bool = False,
        on_connection: Connection | None = None,
    ) -> AsyncIterator[Event]:
        """Follow what happens, without an end; a lost connection is taken up where it was lost.

        `bodies` are addresses of bodies, groups and robots, `types` such as `body.move.*`. It begins when the
        first event is asked for, or after a cursor: `after=move["event_cursor"]`. Where the gateway no longer
        has what happened meanwhile, as after its restart, there is an event `stream.gap`. With `sample`
        there are live values, too, such as `body.position`, each so many times a second at most. With
        `snapshot` the first event is a `stream.snapshot`, all that is known now of what is wanted; after a
        lost connection there is none. `on_connection` is called with None whenever the stream says something,
        every 15 s at least, and with the error whenever it is lost.

        :raises Refused: it is refused, and would be again.
        """
        wanted = given({"bodies": _listed(bodies), "types": _listed(types), "sample": sample})
        begin = {"snapshot": "true"} if snapshot else {}
        tell = on_connection or _unheard
        reader = EventReader(after)
        failures = 0
        while True:
            try:
                async with self._stream({**wanted, **begin}, reader.cursor) as answer:
                    async for text in answer.aiter_text():
                        failures = 0
                        tell(None)
                        for event in reader.take(text):
                            begin = {}
                            yield event
                tell(NoAnswer("The gateway has ended the stream.", moved="no", retryable=True))
            except httpx.TransportError as error:
                tell(_no_answer("GET", error))
            except GatewayError as error:
                if not error.retryable:
                    raise
                tell(error)
            await asyncio.sleep(PAUSES_S[min(failures, len(PAUSES_S) - 1)])
            failures += 1
            reader = EventReader(reader.cursor)

    @asynccontextmanager
    async def _stream(self, wanted: dict[str, Any], cursor: str | None) -> AsyncIterator[httpx.Response]:
        query = {**wanted, **given({"after": cursor})}
        timeout = httpx.Timeout(self._timeout_s, read=SILENT_S)
        async with self._http.stream("GET", "/events/stream", params=query, timeout=timeout) as answer:
            if not answer.is_success:
                await answer.aread()
                raise _refused(answer.status_code, _content(answer))
            yield answer


def _listed(names: Iterable[str] | None) -> list[str] | None:
    return None if names is None else list(names)


def _content(answer: httpx.Response) -> Any:
    return answer.json() if "json" in answer.headers.get("content-type", "") else answer.text


def _refused(status: int, content: Any) -> Refused:
    return Refused(status, content if isinstance(content, dict) else {})


def _unheard(error: GatewayError | None) -> None:
    """Nobody wants to know of the connection."""


def _no_answer(method: str, error: httpx.TransportError) -> NoAnswer:
    reached = not isinstance(error, httpx.ConnectError | httpx.ConnectTimeout | httpx.PoolTimeout)
    if method == "GET" or not reached:
        return NoAnswer(f"The gateway does not answer: {error!r}.", moved="no", retryable=True)
    return NoAnswer(
        f"The connection broke before the gateway had answered: {error!r}.",
        remedy="Look at what the request did before you repeat it.",
    )
