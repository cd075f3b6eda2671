"""A line that loses, garbles, doubles and delays frames while motors move: no move twice, and no lie."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import pytest

from tests.e2e.processes import BODIES, PATIENCE_S, Gateway, SimulatedLine, gateway_at, simulated_line, until

MOVES = 6
"""Moves of each body."""
FAULTS = {"lost": 0.03, "garbled": 0.03, "noise": 0.03, "doubled": 0.03, "late": 0.02, "split": 0.03}
OF_REPLIES = ("late",)
"""A request that comes behind later ones no host can tell from one that was lost."""
NEVER_EXECUTED = ("rejected", "cancelled")


@pytest.fixture(scope="module")
def own_line(tmp_path_factory: pytest.TempPathFactory) -> Iterator[SimulatedLine]:
    with simulated_line(tmp_path_factory.mktemp("faulty")) as line:
        yield line


@pytest.fixture(scope="module")
def gateway(own_line: SimulatedLine) -> Iterator[Gateway]:
    with gateway_at(own_line) as gateway:
        yield gateway.wait_until_ready()


@pytest.fixture
def line(own_line: SimulatedLine) -> SimulatedLine:
    own_line.begin_anew()
    return own_line


@pytest.fixture
def faulty_line(line: SimulatedLine) -> Iterator[SimulatedLine]:
    for fault, probability in FAULTS.items():
        for direction in ("replies",) if fault in OF_REPLIES else ("requests", "replies"):
            line.tell(
                "PUT", "/faults", fault=fault, direction=direction, probability=probability, delay_s=0.02
            )
    yield line
    line.tell("DELETE", "/faults")


def lengths_of(body: str) -> list[int]:
    """Lengths of which any two differ in two digits: no flipped bit makes one out of another."""
    first = 10 + MOVES * BODIES.split(",").index(body)
    return [int(f"{number}{number}") for number in range(first, first + MOVES)]


def move_again_and_again(gateway: Gateway, body: str) -> list[Any]:
    """Ask for moves of different lengths one after the other, and give all that came of it."""
    for length in lengths_of(body):
        answer = gateway.move(body, length, wait=PATIENCE_S)
        if answer.is_success:
            assert gateway.ended(body, answer.json()["id"])["ended_at"]
        else:
            assert answer.status_code in (409, 422, 503), answer.text
            assert answer.json()["moved"] in ("no", "unknown")
    return list(gateway.get(f"/bodies/{body}/moves?limit={MOVES}")["moves"])


def test_no_move_is_done_twice_and_none_is_told_otherwise_than_it_was(
    gateway: Gateway, faulty_line: SimulatedLine
) -> None:
    bodies = BODIES.split(",")
    with ThreadPoolExecutor(len(bodies)) as threads:
        told = list(threads.map(lambda body: move_again_and_again(gateway, body), bodies))

    moves = [move for moves_of_a_body in told for move in moves_of_a_body]
    assert len(moves) > MOVES
    for move in moves:
        body, command = move["frame"][1:3], move["frame"][3:].removesuffix("\\r")
        # Any body may have taken it: a flipped bit can make another body's number.
        executed = [fact.body for fact in faulty_line.executed(command) if fact.facts["text"] == command]
        assert len(executed) <= 1, move
        if move["status"] == "succeeded":
            assert executed == [body], move
        if move["status"] in NEVER_EXECUTED or move["end_cause"] == "not_executed":
            assert body not in executed, move


def test_the_line_recovers_when_the_faults_are_over(gateway: Gateway, line: SimulatedLine) -> None:
    line.tell("PUT", "/faults", fault="silence", direction="replies", next_frames=1, delay_s=1.5)
    assert gateway.http.get("/bodies/3F/position").status_code in (200, 409, 503)
    line.tell("DELETE", "/faults")

    def moves() -> bool:
        answer = gateway.move("3F", 55, wait=20)
        return answer.is_success and answer.json()["status"] == "succeeded"

    until(moves, "the line works again")
    assert len(line.executed("1+M55")) == 1
