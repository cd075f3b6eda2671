"""The words of README.md against real processes: a curl moves a motor, and a listener sees it."""

import json
import re
import shlex
import subprocess
from itertools import pairwise
from pathlib import Path
from shutil import which
from typing import Any

import httpx
import pytest
from websockets.sync.client import connect

from protocols.rorze.profile import SpeedParameters
from tests.e2e.processes import PATIENCE_S, Gateway, SimulatedLine, planned, teach

README = Path(__file__).parents[2] / "README.md"
SPEEDS = SpeedParameters(low=5000, high=50_000, acceleration=70_000, rising=30, falling=30)


def words_of_the_first_curl() -> list[str]:
    command = re.search(r"^    (curl -X POST .*?'\n)\n", README.read_text("utf-8"), re.DOTALL | re.MULTILINE)
    assert command
    return shlex.split(command[1].replace("\\\n", " "))


def say(curl: list[str]) -> dict[str, Any]:
    """Run a curl, or do the same where there is none."""
    if which("curl"):
        said = subprocess.run([*curl, "--silent"], capture_output=True, check=True, timeout=PATIENCE_S)  # noqa: S603
        return dict(json.loads(said.stdout))
    method, url, header, content = curl[2], curl[3], curl[5], curl[7]
    name, _, value = header.partition(": ")
    return dict(httpx.request(method, url, headers={name: value}, content=content).json())


@pytest.fixture(scope="module")
def taught(gateway: Gateway) -> Gateway:
    teach(gateway, "3F", 12, SPEEDS)
    return gateway


def test_the_readmes_curl_moves_motor_3f_along_its_curve_in_real_time(
    taught: Gateway, line: SimulatedLine
) -> None:
    curl = [word.replace("http://127.0.0.1:8420", taught.url) for word in words_of_the_first_curl()]
    with connect(f"{taught.websocket}?bodies=3f&types=body.move.*") as client:
        move = say(curl)
        assert move["status"] in ("sent", "moving"), move
        seen: list[int] = []
        while taught.get(f"/bodies/3F/moves/{move['id']}")["ended_at"] is None:
            seen.append(taught.get("/bodies/3F/position")["pulses"])
        told = [json.loads(client.recv(PATIENCE_S)) for _ in range(4)]

    start = move["start_position"]
    under_way = [position for position in seen if start < position < start + 50_000]
    assert under_way
    assert seen == sorted(seen)
    assert [event["type"].removeprefix("body.move.") for event in told] == [
        *("queued", "sent", "started", "succeeded")
    ]
    assert {event["correlationid"] for event in told} == {move["id"]}
    assert told[-1]["data"]["position"] == start + 50_000

    (begin,), (end,) = line.truth("pulses_start", "3F"), line.truth("pulses_stop", "3F")
    assert (begin.facts["at"], end.facts["at"]) == (start, start + 50_000)
    assert end.time_s - begin.time_s == pytest.approx(planned(50_000, SPEEDS).duration_s, abs=1e-6)


def test_the_cursor_of_the_202_leaves_no_hole(taught: Gateway) -> None:
    answer = taught.move("3F", 500)
    assert answer.status_code == 202
    assert answer.headers["Location"] == f"/bodies/line1.3F/moves/{answer.json()['id']}"
    cursor = answer.json()["event_cursor"]
    move = taught.get(answer.headers["Location"] + "?wait=10")

    with connect(f"{taught.websocket}?after={cursor}") as client:
        told = [json.loads(client.recv(PATIENCE_S))]
        while told[-1]["type"] != "body.move.succeeded":
            told.append(json.loads(client.recv(PATIENCE_S)))
    numbers = [int(cursor.rpartition("-")[2]), *(int(event["sequence"]) for event in told)]

    assert move["status"] == "succeeded"
    assert told[-1]["correlationid"] == move["id"]
    assert all(second == first + 1 for first, second in pairwise(numbers))
    listed = taught.get(f"/events?after={cursor}&limit={len(told)}")["events"]
    assert [event["cursor"] for event in listed] == [event["cursor"] for event in told]


def test_a_stream_of_server_sent_events_tells_the_same(taught: Gateway) -> None:
    move = taught.move("01", 300, wait=10).json()
    wanted = {"after": move["event_cursor"], "bodies": "01", "types": "body.move.*"}
    with taught.http.stream("GET", "/events/stream", params=wanted) as stream:
        types = []
        for text in stream.iter_lines():
            if text.startswith("event: "):
                types.append(text.removeprefix("event: body.move."))
            if types[-1:] == ["succeeded"]:
                break
    assert types == ["sent", "started", "succeeded"]


def test_validate_only_says_the_bytes_and_the_time_and_moves_nothing(
    taught: Gateway, line: SimulatedLine
) -> None:
    starts = len(line.truth("pulses_start"))
    plan = taught.move("3F", 20_000, pattern=12, validate_only=True).json()
    assert plan["frame"] == "&3F1+MA[12],20000\\r"
    assert plan["duration_s"] == pytest.approx(planned(20_000, SPEEDS).duration_s, abs=1e-6)
    assert len(line.truth("pulses_start")) == starts


def test_a_group_moves_together_and_every_member_tells_its_end(taught: Gateway, line: SimulatedLine) -> None:
    content = {"kind": "relative", "direction": "ccw", "distance": {"value": 400, "unit": "pulse"}}
    answer = taught.http.post("/groups/80/moves?wait=10", json=content)
    assert [(move["body_id"], move["status"]) for move in answer.json()["moves"]] == [
        ("line1.00", "succeeded"),
        ("line1.3F", "succeeded"),
    ]
    starts = [fact for fact in line.truth("pulses_start") if fact.facts["code"] == "1-M"]
    assert len({fact.time_s for fact in starts}) == 1
    assert [fact.body for fact in starts] == ["00", "3F"]
