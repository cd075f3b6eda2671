"""A stop on a slow line that sixteen clients keep busy: it leaves next, and nothing moves after it."""

import itertools
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from datetime import datetime
from threading import Event

import httpx
import pytest

from tests.e2e.processes import (
    PATIENCE_S,
    PATIENT_S,
    Gateway,
    SimulatedLine,
    gateway_at,
    group_of,
    simulated_line,
    until,
)

BODIES = [f"{number:02X}" for number in range(8)]
BAUD = 9600
CLIENTS = 16
RUNNERS = ("00", "03", "07")
"""Bodies that move when the stop comes."""
FAR = 900_000_000


@pytest.fixture(scope="module")
def paced_line(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimulatedLine]:
    with simulated_line(tmp_path_factory.mktemp("slow"), ",".join(BODIES), "--baud", str(BAUD)) as line:
        yield line


@pytest.fixture(scope="module")
def gateway(paced_line: SimulatedLine) -> Iterator[Gateway]:
    groups = group_of("00", "07")
    with gateway_at(
        paced_line, bodies=",".join(BODIES), baud=BAUD, groups=groups, reply_timeout_s=PATIENT_S
    ) as gateway:
        yield gateway.wait_until_ready()


@pytest.fixture
def line(paced_line: SimulatedLine) -> SimulatedLine:
    paced_line.begin_anew()
    return paced_line


@contextmanager
def clients_reading_flat_out(gateway: Gateway) -> Iterator[None]:
    """Let many clients read one body after the other, from the time when all of them have had answers."""
    enough = Event()
    answers = [0] * CLIENTS

    def read(client: int) -> None:
        with httpx.Client(base_url=gateway.url, timeout=PATIENCE_S) as http:
            for body in itertools.islice(itertools.cycle(BODIES), client, None):
                http.get(f"/bodies/{body}/position").raise_for_status()
                answers[client] += 1
                if enough.is_set():
                    break

    with ThreadPoolExecutor(CLIENTS) as threads:
        readers = [threads.submit(read, client) for client in range(CLIENTS)]
        try:
            until(lambda: min(answers) > 2, "all clients get answers")
            yield
        finally:
            enough.set()
        for reader in readers:
            reader.result()


def stopped(gateway: Gateway) -> set[str]:
    """The bodies whose stops are confirmed; how soon is the machine's affair."""
    confirmed = gateway.events("body.stop.confirmed")
    return {event["subject"].removeprefix("/bodies/line1.") for event in confirmed}


def test_a_stop_is_the_next_frame_and_nothing_moves_after_it(gateway: Gateway, line: SimulatedLine) -> None:
    gateway.begin_anew()
    for body in RUNNERS:
        assert gateway.move(body, FAR).status_code == 202
    with clients_reading_flat_out(gateway):
        gateway.http.post("/stop", json={"mode": "immediate"}).raise_for_status()

    until(lambda: stopped(gateway) == set(BODIES), "every stop is confirmed")
    requested = {
        event["subject"]: datetime.fromisoformat(event["time"])
        for event in gateway.events("body.stop.requested")
    }
    assert len(requested) == len(BODIES)
    trace = gateway.get("/lines/line1/trace?limit=10000")["entries"]
    sent = [
        (datetime.fromisoformat(record["at"]), record["data"]) for record in trace if record["kind"] == "tx"
    ]
    first_stop = next(place for place, (_, frame) in enumerate(sent) if frame[3:6] == "5IS")
    # A stop for the group and one for each body, and no other frame among them.
    assert [frame for _, frame in sent[first_stop : first_stop + 1 + len(BODIES)]] == [
        f"&{body}5IS\\r" for body in ("80", *BODIES)
    ]
    # The last frame before them was under way, or had been answered, when the first stop was asked for.
    assert sent[first_stop - 1][0] <= min(requested.values())

    stops = [fact.request for fact in line.executed("5IS") if fact.request is not None]
    starts = [fact.request for fact in line.truth("pulses_start") if fact.request is not None]
    assert len(starts) == len(RUNNERS)
    assert max(starts) < min(stops)
    ends = line.truth("pulses_stop")
    assert sorted(end.body for end in ends) == list(RUNNERS)
    # Pulses end in the instant in which the controller takes the first stop it is sent.
    took = {body: min(fact.time_s for fact in line.executed("5IS") if fact.body == body) for body in RUNNERS}
    assert {end.body: end.time_s for end in ends} == took
    for body in RUNNERS:
        move = gateway.get(f"/bodies/{body}/moves")["moves"][0]
        assert gateway.ended(body, move["id"])["status"] == "stopped"


def test_a_move_that_waits_behind_a_stop_is_never_sent(gateway: Gateway, line: SimulatedLine) -> None:
    gateway.begin_anew()
    with clients_reading_flat_out(gateway), ThreadPoolExecutor(1) as thread:
        asked = thread.submit(gateway.move, "01", FAR)
        gateway.http.post("/stop")
        answer = asked.result()
    (confirmed,) = (
        event["time"]
        for event in gateway.events("body.stop.confirmed")
        if event["subject"] == "/bodies/line1.01"
    )
    gateway.http.post("/stop")

    # Which of the two came first is the network's affair, but there is no way in between.
    starts = line.truth("pulses_start")
    if answer.status_code == 409:
        assert answer.json()["moved"] == "no"
        assert not starts
    else:
        move = gateway.ended("01", answer.json()["id"])
        first_stop = min(
            fact.time_s for fact in line.executed("5IS") + line.executed("5SS") if fact.body == "01"
        )
        assert move["status"] == "stopped"
        assert len(starts) == 1
        assert starts[0].time_s < first_stop or move["sent_at"] > confirmed
