"""A replay to clients: events, states and traces as then; nothing is opened, sent or changed."""

import asyncio
import json
from collections.abc import Awaitable, Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest
from httpx2 import ASGITransport, AsyncClient

from recordings.form import EVENTS, NotARecording, line_member, opened
from recordings.serving import FLAG, NoPort, Playback, ReplayApp
from tests.api.stand import HOST
from tests.plants import rig
from tests.recordings.taking import bodies_at_work, virtual_clocks
from tests.virtual_time import run_virtual
from transports.base import TransportUnavailable
from transports.trace import TraceEntry

Story = Callable[[Playback, AsyncClient], Awaitable[None]]


@pytest.fixture(name="path", scope="module")
def _path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Bodies at work; wall times are those of the loop, so that events and records have one time."""
    return bodies_at_work(tmp_path_factory.mktemp("recording"))


def played(path: Path, story: Story, speed: float = 1.0) -> None:
    async def run() -> None:
        with opened(path) as recording:
            playback = Playback(recording, speed)
        playing = asyncio.create_task(playback.run())
        transport = ASGITransport(ReplayApp(playback), raise_app_exceptions=False)
        async with AsyncClient(transport=transport, base_url=f"http://{HOST}") as client:
            await story(playback, client)
        playing.cancel()
        await asyncio.gather(playing, return_exceptions=True)

    run_virtual(run())


def events_of(path: Path) -> list[str]:
    with opened(path) as recording:
        return [line.decode() for _, line in recording.lines(EVENTS)]


def test_events_come_as_they_came_to_the_last_byte(path: Path) -> None:
    async def story(playback: Playback, client: AsyncClient) -> None:
        stream = playback.plant.events.subscribe()
        came = [(await anext(stream)).json for _ in range(len(events_of(path)))]
        assert came == events_of(path)
        cursor = stream.cursor
        listed = (await client.get("/events?limit=1000")).json()
        assert [event["id"] for event in listed["events"]] == [text.split('"id":"')[1][:21] for text in came]
        assert listed["cursor"] == cursor

    played(path, story)


@pytest.mark.parametrize("speed", [1.0, 10.0, 100.0])
def test_it_takes_as_long_as_it_took_or_a_part_of_that(speed: float, path: Path) -> None:
    async def story(playback: Playback, _: AsyncClient) -> None:
        loop, begun_s = asyncio.get_running_loop(), playback.now_s
        began_at = loop.time()
        await asyncio.sleep(5)
        assert loop.time() - began_at == pytest.approx(5)
        assert playback.now_s == pytest.approx(min(begun_s + 5 * speed, playback.length_s), abs=0.01)

    played(path, story, speed)


def test_states_and_traces_are_those_of_the_time(path: Path) -> None:
    async def story(playback: Playback, client: AsyncClient) -> None:
        await client.post("/replay", json={"to": playback.manifest.to.isoformat(), "paused": True})
        await asyncio.sleep(1)
        bodies = (await client.get("/bodies")).json()["bodies"]
        assert [body["body_id"] for body in bodies] == ["line1.00", "line1.01", "line1.3F"]
        assert (await client.get("/bodies/3F")).json() == bodies[-1]
        assert (await client.get("/bodies/line1.3F")).json() == bodies[-1]
        assert (await client.get("/lines")).json()["lines"][0]["state"] == "ready"
        assert "alarms" in (await client.get("/alarms")).json()
        trace = (await client.get("/lines/line1/trace?limit=10000")).json()["entries"]
        with opened(path) as recording:
            entries = [entry for _, entry in recording.entries(line_member("line1"))]
        assert [TraceEntry.model_validate(record) for record in trace] == entries
        assert (await client.get("/bodies/3F/position")).status_code == 404

    played(path, story)


def test_the_pages_have_what_they_ask_for(path: Path) -> None:
    """A move is told as it was at the time, the recording itself can be read, and there are no leases."""
    file = path.read_bytes()

    async def story(playback: Playback, client: AsyncClient) -> None:
        moves = [
            event for event in map(json.loads, events_of(path)) if event["type"].startswith("body.move.")
        ]
        sent = next(move for move in moves if move["type"] == "body.move.sent")
        address = f"{sent['subject']}/moves/{sent['data']['id']}"
        ended = [move for move in moves if move["data"]["id"] == sent["data"]["id"]][-1]
        for told, status in ((sent, "sent"), (ended, ended["data"]["status"])):
            await client.post("/replay", json={"to": told["time"], "paused": True})
            await asyncio.sleep(1)
            assert (await client.get(address)).json()["status"] == status
        (listed,) = (await client.get("/recordings")).json()["recordings"]
        assert (await client.get(f"/recordings/{listed['id']}")).json() == listed
        content = await client.get(f"/recordings/{listed['id']}/content")
        assert content.content == file
        assert (await client.get("/leases")).json() == {"leases": []}
        assert (await client.get("/translations")).json()["ja"]

    played(path, story)


def test_every_answer_has_the_flag_and_nothing_can_be_sent(path: Path) -> None:
    async def story(playback: Playback, client: AsyncClient) -> None:
        for method, at, status in (
            ("GET", "/events", 200),
            ("GET", "/version", 200),
            ("GET", "/replay", 200),
            ("POST", "/stop", 403),
            ("POST", "/bodies/3F/moves", 403),
            ("PUT", "/bodies/3F/settings", 403),
            ("DELETE", "/system/scans/current", 403),
            ("POST", "/lines", 403),
        ):
            answer = await client.request(method, at, json={} if method != "GET" else None)
            assert answer.status_code == status, (at, answer.text)
            assert answer.headers[FLAG].startswith(playback.manifest.from_.isoformat())
        assert all(port.state == "down" for port in playback.plant.ports().values())

    with patch.object(NoPort, "open", side_effect=AssertionError("a port was opened")):
        played(path, story)


def test_no_port_can_be_opened() -> None:
    async def story() -> None:
        port: Any = NoPort("tcp://127.0.0.1:1")
        with pytest.raises(TransportUnavailable, match="replay"):
            await port.open(None)

    run_virtual(story())


def test_it_pauses_goes_on_and_goes_back(path: Path) -> None:
    async def story(playback: Playback, client: AsyncClient) -> None:
        end = playback.manifest.to
        await client.post("/replay", json={"to": end.isoformat()})
        await asyncio.sleep(0.2)
        stream = playback.plant.events.subscribe()
        last = playback.plant.events.last
        middle = playback.manifest.from_ + timedelta(seconds=playback.length_s - 20)
        told = (await client.post("/replay", json={"to": middle.isoformat(), "paused": True})).json()
        assert datetime.fromisoformat(told["now"]) == middle
        await asyncio.sleep(5)
        assert (await client.get("/replay")).json() == told
        before = playback.plant.events.last
        assert before < last
        await client.post("/replay", json={"paused": False, "speed": 100})
        assert (await anext(stream)).number == before + 1
        await asyncio.sleep(1)
        assert playback.plant.events.last == last

    played(path, story)


@pytest.mark.parametrize("wrong", [{"speed": 0}, {"speed": 1e6}, {"to": "now"}, {"faster": True}, []])
def test_a_wrong_wish_changes_nothing(wrong: object, path: Path) -> None:
    async def story(playback: Playback, client: AsyncClient) -> None:
        assert (await client.post("/replay", json=wrong)).status_code == 422
        assert (playback.speed, playback.paused) == (1.0, False)

    played(path, story)


def test_a_recording_of_some_lines_is_not_served(tmp_path: Path) -> None:
    async def story() -> Path:
        async with rig(lines=("line1", "line2")) as running:
            running.plant.works.recordings.keep_in(tmp_path)
            record = running.plant.works.recordings.start(["line1"], 100, 0)
            await running.plant.works.recordings.wait(record, 60)
            return running.plant.works.recordings.file_of(record)

    with virtual_clocks():
        path = run_virtual(story())
    with opened(path) as recording, pytest.raises(NotARecording, match="of some lines only"):
        Playback(recording, 1.0)
