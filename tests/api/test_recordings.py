"""Recordings over HTTP: taken, listed, downloaded, deleted; each caller sees those of the own scope."""

import asyncio
import errno
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gateway.access.roles import Role
from gateway.config import Config
from gateway.plant import Plant
from gateway.recordings import FOLDER
from recordings import form
from tests.api.access.guarded import Keys, guarded
from tests.api.stand import BODIES, RELATIVE, Stand, build_stand, on_stand
from tests.virtual_time import run_virtual

MEMBERS = {
    *("manifest.json", "events.jsonl", "journal.jsonl", "samples.csv", "requests.jsonl"),
    *("lines/arm.jsonl", "before/arm.jsonl"),
}


@pytest.fixture(autouse=True)
def _kept(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Give each plant of these stories a place for its recordings."""
    from tests.tested_plant import TestedPlant

    start = TestedPlant.start

    async def started(plant: TestedPlant) -> None:
        plant.works.recordings.keep_in(tmp_path)
        await start(plant)

    monkeypatch.setattr(TestedPlant, "start", started)


async def taken(stand: Stand, tmp_path: Path, **wanted: object) -> form.Recording:
    answer = await stand.post("/recordings?wait=60", {"last_s": 60, **wanted})
    assert answer.status_code == 200, answer.text
    record = answer.json()
    assert record["status"] == "finished", record
    content = await stand.get(f"/recordings/{record['id']}/content")
    path = tmp_path / "downloaded.mgrec"
    path.write_bytes(content.content)
    assert record["bytes"] == len(content.content)
    return form.Recording(path)


def test_a_recording_has_every_frame_and_every_event(tmp_path: Path) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        await stand.teach_speeds("3F")
        await stand.post("/bodies/3F/moves?wait=60", RELATIVE, **{"X-Request-Id": "job-17"})
        written = list(stand.port.written)
        recording = await taken(stand, tmp_path)
        entries = [it for _, it in recording.entries("lines/arm.jsonl")]
        assert [it.data for it in entries if it.kind == "tx"][: len(written)] == written
        assert any(it.request_id == "job-17" for it in entries)
        events = [row for _, row in recording.rows("events.jsonl")]
        listed = (await stand.get("/events?limit=1000")).json()["events"]
        assert events == listed[: len(events)]
        assert events[-1]["type"] == "body.move.succeeded"
        assert recording.manifest.epoch == stand.plant.events.epoch
        assert {it["operation"] for _, it in recording.rows("requests.jsonl")} >= {"startMove"}
        samples = recording.text("samples.csv").splitlines()
        assert samples[0] == "time,body_id,move_id,time_s,axis,position"
        assert samples[-1].endswith(",50000")
        assert set(recording._zip.namelist()) == MEMBERS

    story()


def test_what_comes_is_recorded_until_it_is_finished(tmp_path: Path) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        answer = await stand.post("/recordings", {"for_s": 3600})
        assert answer.status_code == 202
        record = answer.json()
        assert answer.headers["Location"] == f"/recordings/{record['id']}"
        before = len(stand.port.written)
        await asyncio.sleep(30)
        expected = stand.port.written[before:]
        ended = (await stand.post(f"/recordings/{record['id']}/finish")).json()
        assert ended["status"] == "finished"
        with form.opened(
            stand.plant.works.recordings.file_of(stand.plant.works.recordings.list()[0])
        ) as recording:
            entries = [it for _, it in recording.entries("lines/arm.jsonl")]
            assert [it.data for it in entries if it.kind == "tx"][: len(expected)] == expected
            before_it = [it.data for _, it in recording.entries("before/arm.jsonl") if it.kind == "tx"]
            assert b"&7FXID\r" in before_it  # how it was set up
        types = [it["type"] for it in (await stand.get("/events")).json()["events"]]
        assert types[-1] == "gateway.recording.finished"

    story()


def test_a_recording_is_deleted_also_while_it_is_taken(tmp_path: Path) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        for wanted in ({"last_s": 1}, {"for_s": 100}):
            record = (await stand.post("/recordings", wanted)).json()
            await asyncio.sleep(2)
            assert (await stand.client.delete(f"/recordings/{record['id']}")).status_code == 200
            assert (await stand.get(f"/recordings/{record['id']}")).status_code == 404
        assert list((tmp_path / FOLDER).iterdir()) == []

    story()


@pytest.mark.parametrize(
    ("wanted", "status"),
    [({}, 422), ({"last_s": 1, "lines": ["leg"]}, 404), ({"last_s": -1}, 422), ({"for_s": 1e9}, 422)],
)
def test_a_wrong_request_records_nothing(wanted: dict[str, Any], status: int, tmp_path: Path) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        answer = await stand.post("/recordings", wanted)
        assert answer.status_code == status, answer.text
        assert (await stand.get("/recordings")).json() == {"recordings": []}

    story()


def test_a_full_disk_ends_a_recording_and_nothing_else(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(*_: object) -> Iterator[None]:
        raise OSError(errno.ENOSPC, "No space left on device")
        yield

    monkeypatch.setattr(form, "pack", full)

    @on_stand()
    async def story(stand: Stand) -> None:
        record = (await stand.post("/recordings?wait=9", {"last_s": 9})).json()
        assert (record["status"], record["bytes"]) == ("failed", None)
        assert "No space left on device" in record["error"]
        assert (await stand.get(f"/recordings/{record['id']}/content")).status_code == 404
        assert list((tmp_path / FOLDER).iterdir()) == []
        await stand.teach_speeds("3F")
        assert (await stand.post("/bodies/3F/moves?wait=60", RELATIVE)).json()["status"] == "succeeded"

    story()


def test_the_oldest_go_and_requests_push_no_alarm_out(tmp_path: Path) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        recordings = stand.plant.works.recordings
        kept = recordings.start(None, 60, 0, cause="alarm")
        await recordings.wait(kept, 60)
        recordings._most_bytes = 2 * 3 * (kept.bytes or 0)
        ids = []
        for _ in range(6):
            record = recordings.start(None, 60, 0)
            await recordings.wait(record, 60)
            ids.append(record.id)
        listed = [it.id for it in recordings.list()]
        assert kept.id in listed
        assert 1 <= len(listed) - 1 <= 3
        assert set(listed) == {kept.id, *ids[-(len(listed) - 1) :]}
        files = {path.stem: path.stat().st_size for path in (tmp_path / FOLDER).iterdir()}
        assert set(files) == set(listed)

    story()


def test_an_alarm_begins_a_recording_and_another_lets_it_go_on(tmp_path: Path) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        recordings = stand.plant.works.recordings
        recordings._before_s, recordings._after_s = 60.0, 10.0
        stand.plant.events.listeners.append(recordings.note)
        stand.port.unplug()
        await asyncio.sleep(15)
        (alarm,) = (await stand.get("/alarms")).json()["alarms"]
        (record,) = (await stand.get("/recordings")).json()["recordings"]
        assert (record["status"], record["cause"]) == ("finished", "alarm")
        assert record["alarm_id"] == alarm["id"]
        with form.opened(recordings.file_of(recordings.list()[0])) as recording:
            kinds = [it.kind for _, it in recording.entries("lines/arm.jsonl")]
            assert {"opened", "tx", "rx", "lost"} <= set(kinds)
            assert "alarm.raised" in [row["type"] for _, row in recording.rows("events.jsonl")]

    story()


@pytest.mark.parametrize("seconds", [{"before_alarm_s": 60.0}, {"after_alarm_s": 30.0}, {}])
def test_alarms_begin_recordings_where_that_is_configured(seconds: dict[str, float]) -> None:
    tables = {"lines": [{"id": "arm", "address": "tcp://127.0.0.1:1", "bodies": [{"id": "3F"}]}]}
    plant = Plant(Config.model_validate({**tables, "recordings": seconds}))
    assert (plant.works.recordings.note in plant.events.listeners) is bool(seconds)


def test_what_a_killed_gateway_had_on_the_disk_is_a_recording_afterwards(tmp_path: Path) -> None:
    @on_stand()
    async def killed(stand: Stand) -> None:
        stand.plant.works.recordings.start(None, 60, 3600)
        await asyncio.sleep(10)
        (part,) = (tmp_path / FOLDER).iterdir()
        assert {it.stat().st_mode & 0o777 for it in (part, part.parent)} == {0o700}
        with (part / "lines/arm.jsonl").open("ab") as file:
            file.write(b'{"at":"2026-')  # a record that was cut off

    @on_stand()
    async def next_life(stand: Stand) -> None:
        await asyncio.sleep(1)
        (record,) = (await stand.get("/recordings")).json()["recordings"]
        assert (record["status"], record["complete"]) == ("finished", False)
        assert record["until"] == record["ended_at"] > record["since"]
        with form.opened(
            stand.plant.works.recordings.file_of(stand.plant.works.recordings.list()[0])
        ) as recording:
            assert not recording.manifest.complete
            assert len([it for _, it in recording.entries("lines/arm.jsonl")]) > 20

    killed()
    next_life()


def test_no_secret_and_no_host_is_in_the_configuration(tmp_path: Path) -> None:
    async def story() -> None:
        server = {"allowed_hosts": ["secret-host"], "latch": True}
        async with build_stand({"arm": BODIES}, server) as stand:
            configuration = (await taken(stand, tmp_path)).manifest.configuration
        assert set(configuration) == {"server", "lines", "scaras"}
        assert configuration["server"] == {"latch": True, "allow_endless_moves": False, "on_exit": "leave"}
        assert "secret" not in json.dumps(configuration)

    run_virtual(story())


def test_callers_with_a_scope_have_the_recordings_of_their_lines(tmp_path: Path) -> None:
    @guarded()
    async def story(stand: Stand, keys: Keys) -> None:
        everybody, of_leg = keys.header(Role.VIEWER), keys.header(Role.VIEWER, "leg")
        whole = await asked(stand, everybody, "POST", "/recordings?wait=9", {"last_s": 60})
        for body in ("arm.3F", "leg.70"):
            await asked(stand, everybody, "GET", f"/bodies/{body}/position")
        own = await asked(stand, of_leg, "POST", "/recordings?wait=9", {"last_s": 60})
        assert (own["lines"], own["whole_plant"]) == (["leg"], False)
        listed = await asked(stand, of_leg, "GET", "/recordings")
        assert [it["id"] for it in listed["recordings"]] == [own["id"]]
        await asked(stand, of_leg, "GET", f"/recordings/{whole['id']}", status=404)
        await asked(stand, of_leg, "GET", f"/recordings/{whole['id']}/content", status=404)
        await asked(stand, of_leg, "POST", "/recordings", {"last_s": 9, "lines": ["arm"]}, status=403)
        await asked(stand, of_leg, "DELETE", f"/recordings/{own['id']}", status=403)
        with form.opened(tmp_path / FOLDER / f"{own['id']}.mgrec") as recording:
            assert "lines/arm.jsonl" not in recording._zip.namelist()
            assert "arm" not in json.dumps(recording.manifest.configuration)
            requests = [row["values"] for _, row in recording.rows("requests.jsonl")]
            assert requests == [{"body_id": "leg.70"}]
            subjects = [row["subject"] for _, row in recording.rows("events.jsonl")]
            assert subjects
            assert all("leg" in it for it in subjects)

    story()


async def asked(
    stand: Stand, key: dict[str, str], method: str, path: str, content: object = None, status: int = 200
) -> Any:
    answer = await stand.client.request(method, path, json=content, headers=key)
    assert answer.status_code == status, answer.text
    return answer.json() if answer.headers["content-type"] == "application/json" else answer.content
