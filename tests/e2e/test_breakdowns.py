"""Programs, boxes and ports that go away during a move: what people read, and what is not repeated."""

import json
from collections.abc import Iterator

import httpx
import pytest
from websockets.sync.client import connect

from tests.e2e.processes import (
    PATIENCE_S,
    Gateway,
    SimulatedLine,
    gateway_at,
    group_of,
    simulated_line,
    until,
)

LONG = 60_000
"""Pulses of a move that takes 1.7 s at the speeds of a new controller."""
FAR = 900_000_000
MOTION = "1+M"
GOING_AWAY = 1001


@pytest.fixture(scope="module")
def broken_line(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimulatedLine]:
    with simulated_line(tmp_path_factory.mktemp("broken")) as line:
        yield line


@pytest.fixture(scope="module")
def gateway_of_the_line(broken_line: SimulatedLine) -> Iterator[Gateway]:
    with gateway_at(broken_line, groups=group_of("00", "3F")) as gateway:
        yield gateway


@pytest.fixture
def line(broken_line: SimulatedLine) -> SimulatedLine:
    """Each test leaves a line that works, and knows nothing of what was before it."""
    broken_line.begin_anew()
    return broken_line


@pytest.fixture
def gateway(gateway_of_the_line: Gateway) -> Gateway:
    if not gateway_of_the_line.program.runs():
        gateway_of_the_line.start()
    return gateway_of_the_line.wait_until_ready().begin_anew()


def test_a_box_that_is_killed_in_a_move(line: SimulatedLine, gateway: Gateway) -> None:
    with connect(f"{gateway.websocket}?types=line.*") as client:
        move = gateway.moving("3F", FAR)
        line.kill()
        told = json.loads(client.recv(PATIENCE_S))
        assert told["type"] == "line.down"
        assert gateway.http.get("/readyz").status_code == 503

        refused = gateway.move("00", 4321)
        assert refused.status_code == 503
        assert refused.json()["moved"] == "no"
        assert "Nothing was sent" in refused.json()["detail"]
        assert gateway.get("/lines/line1")["down_reason"]

        line.start()
        assert json.loads(client.recv(PATIENCE_S))["type"] == "line.up"
    gateway.wait_until_ready()
    ended = gateway.ended("3F", move["id"])

    # The new box stands at 0 and knows of no move: that it succeeded, or was stopped, would be a lie.
    assert ended["status"] == "lost"
    assert "power" in ended["error"]["detail"]
    assert [frame for frame in line.requests() if MOTION in frame] == [f"&3F1+M{FAR}"]
    assert gateway.move("3F", 300, wait=10).json()["status"] == "succeeded"


def test_a_gateway_that_is_killed_in_a_move(line: SimulatedLine, gateway: Gateway) -> None:
    move = gateway.moving("3F", FAR)
    gateway.kill()
    known = len(line.requests())
    gateway.start()
    gateway.wait_until_ready()

    poison, *later = line.requests()[known:]
    assert set(poison) == {"!"}
    assert later[:3] == ["&7FXID", "&7FXRSM1", "&7FXVS80,00,3F"]
    refused = gateway.move("3F", 10)
    assert refused.status_code == 409
    assert refused.json()["moved"] == "no"
    # The new gateway follows the move in its own record, and can stop it.
    assert gateway.get(f"/bodies/3F/moves/{move['id']}")["status"] in ("sent", "moving")
    assert gateway.http.post("/bodies/3F/stop").json()["confirmed"]
    assert gateway.ended("3F", move["id"])["status"] == "stopped"
    assert [fact.facts["text"] for fact in line.executed(MOTION)] == [f"1+M{FAR}"]
    (stop,) = line.truth("pulses_stop")
    assert gateway.get("/bodies/3F/position")["pulses"] == stop.facts["at"]


def test_a_move_outlives_the_gateway_that_began_it(line: SimulatedLine, gateway: Gateway) -> None:
    cursor = gateway.now()
    key = {"Idempotency-Key": "once"}
    content = {"kind": "relative", "direction": "cw", "distance": {"value": LONG, "unit": "pulse"}}
    move = gateway.http.post("/bodies/3F/moves", json=content, headers=key).json()
    gateway.kill()
    gateway.start()
    gateway.wait_until_ready()
    again = gateway.http.post("/bodies/3F/moves", json=content, headers=key)
    assert (again.headers["idempotency-replayed"], again.json()["id"]) == ("true", move["id"])
    end = gateway.ended("3F", move["id"])
    assert (end["status"], end["position"]) == ("succeeded", end["target_position"])
    assert [fact.facts["text"] for fact in line.executed(MOTION)] == [f"1+M{LONG}"]
    told = gateway.get(f"/events?after={cursor}&limit=1000")["events"]
    sequence = [int(event["sequence"]) for event in told]
    assert sequence == list(range(int(cursor[9:]) + 1, int(cursor[9:]) + 1 + len(told)))
    (crash,) = [event for event in told if event["type"] == "gateway.crashed"]
    assert crash["data"]["moves"] == [move["id"]]
    assert move["id"] in gateway.program.words()


def test_a_gateway_that_is_told_to_end_while_clients_listen(line: SimulatedLine, gateway: Gateway) -> None:
    move = gateway.moving("3F", LONG)
    with (
        connect(gateway.websocket) as client,
        httpx.Client(base_url=gateway.url) as http,
        http.stream("GET", "/events/stream") as stream,
    ):
        lines = stream.iter_lines()
        next(lines)
        assert gateway.end() == 0
        # Both streams end as streams do, not as if a wire had been cut.
        assert {json.loads(text)["subject"] for text in client} <= {"/bodies/line1.3F", "/gateway"}
        assert client.close_code == GOING_AWAY
        for _ in lines:
            pass
    assert move["status"] in ("sent", "moving")
    # What the motor was told to do it does: to end the gateway is no way to stop a motor.
    (stop,) = until(lambda: line.truth("pulses_stop"), "the move runs to its end")
    assert stop.facts["why"] == "done"


def test_a_second_gateway_at_the_same_port(line: SimulatedLine, gateway: Gateway) -> None:
    known = len(line.requests())
    with gateway_at(line, "second") as second:
        until(lambda: second.get("/lines/line1")["down_reason"] != "not opened yet", "it tries the port")
        info = second.get("/lines/line1")
        assert info["state"] == "down"
        assert "another program is using it" in info["down_reason"]
        assert second.http.get("/readyz").status_code == 503
        assert second.move("3F", 100).status_code == 503
    assert not [frame for frame in line.requests()[known:] if frame.startswith("!") or MOTION in frame]
    assert gateway.move("3F", 200, wait=10).json()["status"] == "succeeded"


def test_a_controller_that_loses_its_power_in_a_move(line: SimulatedLine, gateway: Gateway) -> None:
    move = gateway.moving("3F", FAR)
    line.tell("PUT", "/bodies/3F/power", on=False)
    until(lambda: gateway.events("body.offline"), "the gateway notices")
    assert gateway.move("3F", 10).status_code in (409, 503)
    assert gateway.move("01", 300, wait=10).json()["status"] == "succeeded"
    line.tell("PUT", "/bodies/3F/power", on=True)
    ended = gateway.ended("3F", move["id"])
    assert ended["status"] == "lost"
    assert "Home it" in ended["error"]["remedy"]
    assert len(line.executed(f"1+M{FAR}")) == 1


def test_a_link_master_that_loses_its_power_for_a_moment(line: SimulatedLine, gateway: Gateway) -> None:
    """Nothing tells of it but the end of a move that is not announced, or a group that is not known."""

    def moves_before_the_gateway_looks() -> int:
        line.tell("PUT", "/link/power", on=False)
        line.tell("PUT", "/link/power", on=True)
        known = len(line.requests())
        return known if gateway.move("3F", 300, wait=10).json()["completion"] == "polling" else 0

    known = until(moves_before_the_gateway_looks, "a move's end is not announced")
    until(lambda: {"&7FXRSM1", "&7FXVS80,00,3F"} <= set(line.requests()[known:]), "it is set up again")
    assert gateway.move("3F", 300, wait=10).json()["completion"] == "frame"

    content = {"kind": "relative", "direction": "cw", "distance": {"value": FAR, "unit": "pulse"}}
    moves = gateway.http.post("/groups/80/moves", json=content).json()["moves"]
    stopped = gateway.http.post("/groups/80/stop", json={"mode": "immediate"}).json()
    assert stopped["confirmed"]
    assert "&805IS" in line.requests()
    ends = line.truth("pulses_stop")[-2:]
    assert sorted(fact.body for fact in ends) == ["00", "3F"]
    assert ends[0].time_s == ends[1].time_s
    assert {gateway.ended(move["body_id"], move["id"])["status"] for move in moves} == {"stopped"}


def test_a_link_master_that_is_without_power_for_a_while(line: SimulatedLine, gateway: Gateway) -> None:
    move = gateway.moving("3F", LONG)
    line.tell("PUT", "/link/power", on=False)
    until(lambda: len(gateway.events("body.offline")) == 3, "all bodies go silent")
    known = len(line.requests())
    line.tell("PUT", "/link/power", on=True)
    ended = gateway.ended("3F", move["id"])
    # The controllers kept their power: the motor went where it was sent, and nobody sent it twice.
    assert ended["position"] == ended["start_position"] + LONG
    assert len(line.executed(MOTION)) == 1
    assert ended["status"] == "succeeded"
    until(lambda: "&7FXRSM1" in line.requests()[known:], "the link master is set up again")
