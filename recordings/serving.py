"""A replay to clients: a read-only gateway with the events, states, alarms and traces of a recording."""

import asyncio
import re
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta
from functools import partial
from math import inf
from typing import Any, Final

from pydantic import AwareDatetime, BaseModel, ConfigDict, Field, ValidationError
from starlette.datastructures import MutableHeaders
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from api.app import create_app
from gateway.door.recordings import CONTENT
from gateway.plant import Plant
from gateway.recordings import info_of
from recordings.form import EVENTS, STATES, NotARecording, Recording, line_member
from recordings.line_script import NS
from recordings.replaying import config_of
from transports import Transport
from transports.base import Receiver, TransportLost, TransportUnavailable
from transports.recorder import Recorder
from transports.trace import TraceEntry, wall_ns

FLAG: Final = "Replay"
"""The header of every answer: what tells a client that it is served a recording."""
SLOWEST, FASTEST = 0.01, 1000.0
NEXT_S: Final = 0.05
"""Events within this time are told together."""
LEAD_S: Final = 1.0
"""Seconds by which playing begins before the first record."""
CONTROL: Final = "/replay"
_WHY: Final = "This is a replay of a recording: nothing is sent to a controller, and nothing is changed."
_OWN: Final = re.compile(
    r"/|/(?:events|version|livez|openapi|docs|assets|commands|translations|leases|system/identity)\b.*"
    r"|/lines/[^/]+/trace.*"
)
"""Paths that the application answers itself: streams, traces, and what is always the same."""
_POSTS: Final = ("/tickets",)


class NoPort(Transport):
    """A port that is never opened."""

    async def open(self, _receiver: Receiver) -> None:
        """Refuse.

        :raises TransportUnavailable: always.
        """
        raise TransportUnavailable(_WHY)

    def write(self, _data: bytes) -> None:
        """Refuse.

        :raises TransportLost: always.
        """
        raise TransportLost(_WHY)

    def unsent(self) -> int:
        """Nothing is written."""
        return 0

    async def close(self) -> None:
        """Nothing is open."""


class Control(BaseModel):
    """A change of a replay that a client may ask for."""

    model_config = ConfigDict(extra="forbid")

    paused: bool | None = None
    speed: float | None = Field(default=None, ge=SLOWEST, le=FASTEST)
    to: AwareDatetime | None = None
    """Time of the recording to go on at."""


@dataclass(frozen=True, slots=True)
class _Told:
    """Something of the recording, at its second."""

    at_s: float
    tell: Callable[[], object]


class Playback:
    """A recording as it goes on: its events, states and traces up to now."""

    def __init__(self, recording: Recording, speed: float) -> None:
        """Read a recording of a whole plant.

        :raises NotARecording: it is of some lines only, or a part of it cannot be read.
        """
        self.path, self.manifest = recording.path, recording.manifest
        manifest = self.manifest
        if not manifest.whole_plant:
            raise NotARecording(f"{recording.path} is of some lines only; one of the whole plant is served.")
        config = config_of(manifest, {"mode": "open"})
        self.plant = Plant(config, open_transport=NoPort)
        self.speed, self.paused = speed, False
        self.states: dict[str, Any] = {}
        """The newest state of each address."""
        self._itself = info_of(recording.path).model_dump(mode="json")
        self._moment = manifest.clocks.at, manifest.clocks.monotonic_ns
        self._first_event = next((int(row["sequence"]) for _, row in recording.rows(EVENTS)), 1)
        told = [*self._of_events(recording), *self._of_states(recording), *self._of_lines(recording)]
        self._told = sorted(told, key=lambda told: told.at_s)
        self._next = 0
        # The gateway may have begun later than what was asked for.
        self._at_s = max(self._told[0].at_s - LEAD_S, 0.0) if self._told else 0.0
        self._since = 0.0
        self._woken = asyncio.Event()
        self._rewind()

    @property
    def content(self) -> str:
        """The address of its file."""
        return f"/recordings/{self._itself['id']}/content"

    @property
    def length_s(self) -> float:
        """Seconds from its beginning to its end."""
        return (self.manifest.to - self.manifest.from_).total_seconds()

    @property
    def now_s(self) -> float:
        """Give the present place in the recording, in seconds from its beginning."""
        if self.paused:
            return self._at_s
        gone_s = (asyncio.get_running_loop().time() - self._since) * self.speed
        return min(self._at_s + gone_s, self.length_s)

    def told(self) -> dict[str, Any]:
        """Tell how far it has come."""
        now = self.manifest.from_ + timedelta(seconds=self.now_s)
        return {
            "from": self.manifest.from_.isoformat(),
            "to": self.manifest.to.isoformat(),
            "now": now.isoformat(),
            "speed": self.speed,
            "paused": self.paused,
            "epoch": self.manifest.epoch,
        }

    def change(self, wanted: Control) -> None:
        """Go on otherwise; where it goes back, streams end, and begin anew at their cursors."""
        self._at_s, self._since = self.now_s, asyncio.get_running_loop().time()
        if wanted.paused is not None:
            self.paused = wanted.paused
        if wanted.speed is not None:
            self.speed = wanted.speed
        if wanted.to is not None:
            to_s = (wanted.to - self.manifest.from_).total_seconds()
            to_s = min(max(to_s, 0.0), self.length_s)
            if to_s < self._at_s:
                self._rewind()
            self._at_s = to_s
        self._woken.set()

    async def run(self) -> None:
        """Tell what comes, until it is cancelled."""
        self._since = asyncio.get_running_loop().time()
        while True:
            self._woken.clear()
            self.catch_up()
            due_s = self._told[self._next].at_s if self._next < len(self._told) else inf
            wait_s = NEXT_S if not self.paused and due_s < inf else None
            try:
                async with asyncio.timeout(wait_s):
                    await self._woken.wait()
            except TimeoutError:
                continue

    def catch_up(self) -> None:
        """Tell all that has come."""
        end = bisect_right(self._told, self.now_s, key=lambda told: told.at_s)
        for told in self._told[self._next : end]:
            told.tell()
        self._next = max(self._next, end)

    def _rewind(self) -> None:
        """Begin anew: nothing has been told."""
        self._next = 0
        self.states = {"/recordings": {"recordings": [self._itself]}}
        self.plant.events.resume(self.manifest.epoch, {}, self._first_event - 1, [])
        for line_id in self.manifest.lines:
            self.plant.history.recorders[line_id] = Recorder(100_000)

    def _of_events(self, recording: Recording) -> Iterator[_Told]:
        for _, line, row in recording.objects(EVENTS):
            text = line.decode()
            at_s = (datetime.fromisoformat(row["time"]) - self.manifest.from_).total_seconds()
            yield _Told(at_s, partial(self._happens, row, text))

    def _happens(self, row: Mapping[str, Any], text: str) -> None:
        """Tell an event; that of a move is its record at that time."""
        if "event_cursor" in row["data"]:
            self.states[f"{row['subject']}/moves/{row['data']['id']}"] = row["data"]
        self.plant.events.tell_again(row["type"], row["subject"], text)

    def _of_states(self, recording: Recording) -> Iterator[_Told]:
        for _, row in recording.rows(STATES):
            note = partial(self._note, row["path"], row["state"])
            yield _Told(self._seconds(row["monotonic_ns"]), note)

    def _note(self, path: str, state: object) -> None:
        self.states[path] = state

    def _of_lines(self, recording: Recording) -> Iterator[_Told]:
        for line_id in self.manifest.lines:
            for _, entry in recording.entries(line_member(line_id)):
                yield _Told(self._seconds(entry.monotonic_ns), partial(self._record, line_id, entry))

    def _record(self, line_id: str, entry: TraceEntry) -> None:
        recorder = self.plant.history.recorders[line_id]
        recorder.clocks = lambda: (wall_ns(entry.at), entry.monotonic_ns)
        recorder.sender = entry.caller, entry.request_id
        recorder.record(entry.kind, entry.data)

    def _seconds(self, monotonic_ns: int) -> float:
        """Seconds after the beginning, of a time of the clock that never jumps."""
        at, at_ns = self._moment
        return (at - self.manifest.from_).total_seconds() + (monotonic_ns - at_ns) * NS


class ReplayApp:
    """The application of a replay: what is played is answered, all else is refused."""

    def __init__(self, playback: Playback) -> None:
        self._playback = playback
        self._app: ASGIApp = create_app(playback.plant)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer, with the flag on every answer."""
        flagged = self._flagging(send)
        if scope["type"] == "http" and not self._is_own(scope):
            response = await self._answer(Request(scope, receive))
            await response(scope, receive, flagged)
        else:
            await self._app(scope, receive, flagged)

    def _flagging(self, send: Send) -> Send:
        told = self._playback.told()

        async def flagged(message: Message) -> None:
            if message["type"] in ("http.response.start", "websocket.accept"):
                message.setdefault("headers", [])
                MutableHeaders(scope=message)[FLAG] = f"{told['from']}/{told['to']}"
            await send(message)

        return flagged

    @staticmethod
    def _is_own(scope: Scope) -> bool:
        if scope["method"] == "POST":
            return scope["path"] in _POSTS
        return scope["method"] == "GET" and _OWN.fullmatch(scope["path"]) is not None

    async def _answer(self, request: Request) -> Response:
        path, playback = request.url.path, self._playback
        if path == CONTROL:
            return await self._control(request)
        if path == playback.content:
            return FileResponse(playback.path, media_type=CONTENT, filename=playback.path.name)
        if request.method not in ("GET", "HEAD"):
            return _problem(403, "replay", _WHY, "Ask a gateway that serves lines.")
        found = state_at(playback.states, path)
        if found is None:
            return _problem(
                404, "not-found", f"The recording has no {path}.", "It has lists, events and traces."
            )
        return JSONResponse(found)

    async def _control(self, request: Request) -> Response:
        if request.method == "POST":
            try:
                self._playback.change(Control.model_validate_json(await request.body()))
            except ValidationError as error:
                first = error.errors()[0]
                place = ".".join(map(str, first["loc"]))
                return _problem(
                    422, "invalid-request", f"{place}: {first['msg']}.", "Give paused, speed or to."
                )
        return JSONResponse(self._playback.told())


_IDS: Final = {
    "lines": "line_id",
    "bodies": "body_id",
    "groups": "group_id",
    "scaras": "scara_id",
    "robots": "robot_id",
}


def state_at(states: Mapping[str, Any], path: str) -> Any:
    """Find a list or a move, or a member of a list by its whole address, or by the short one of a body."""
    if (told := states.get(path)) is not None:
        return told
    collection, *names = path.strip("/").split("/")
    listed = states.get(f"/{collection}")
    if not names or listed is None:
        return listed
    members: Sequence[Mapping[str, Any]] = listed.get(collection, [])
    key, name = _IDS.get(collection, "id"), names[0]
    if len(names) > 1:
        return None
    return next(
        (member for member in members if name in (member.get(key), str(member.get(key)).rpartition(".")[2])),
        None,
    )


def _problem(status: int, kind: str, detail: str, remedy: str) -> Response:
    told = {
        "type": f"urn:motion-gateway:problem:{kind}",
        "title": "A replay",
        "status": status,
        "detail": detail,
        "moved": "no",
        "remedy": remedy,
        "retryable": False,
    }
    return JSONResponse(told, status, media_type="application/problem+json")
