"""Troubles of a line begin, last and are mended."""

import pytest

from simulator.rorze.line import Rc400Line, build_line
from simulator.rorze.troubles import OF_BODIES, break_body, pull_cable

LIFT, OTHER = 0x3F, 0x00
MOVE, BACK, WHERE, FORGOTTEN = "1+M500", "1-M500", "6PD", "9VD"


class Bench:
    def __init__(self) -> None:
        self.now = 0.0
        self.line: Rc400Line = build_line([OTHER, LIFT], self.now)

    def ask(self, text: str, body: int = LIFT) -> str:
        self.line.receive(f"&{body:02X}{text}\r".encode(), self.now)
        return self.line.take_output(self.now).decode().removeprefix(f">&{body:02X}{text[:3]}").rstrip("\r")

    def ended(self) -> None:
        """Let a move come to its end."""
        self.now += 10.0
        self.line.take_output(self.now)


@pytest.mark.parametrize(
    ("kind", "command", "broken"),
    [
        ("ems", MOVE, "@51"),
        ("limit", MOVE, "@55"),
        ("power", MOVE, ""),
        ("driver", MOVE, "@52"),
        ("dead", WHERE, ""),
    ],
)
def test_one_body_is_broken_and_mended_and_the_other_goes_on(kind: str, command: str, broken: str) -> None:
    bench = Bench()
    before = bench.ask(WHERE)
    mend = break_body(bench.line, LIFT, kind, bench.now)
    assert bench.ask(command) == broken
    assert bench.ask(WHERE, OTHER) == before
    mend(bench.now)
    bench.ask("PRS")
    assert bench.ask(WHERE) == before
    assert bench.ask(MOVE) == ""


def test_every_trouble_of_a_body_is_tried() -> None:
    assert set(OF_BODIES) == {"ems", "limit", "power", "driver", "dead"}


def test_a_body_that_is_cut_off_lives_on_unheard() -> None:
    bench = Bench()
    bench.ask(MOVE)
    mend = break_body(bench.line, LIFT, "dead", bench.now)
    bench.ended()
    assert bench.ask("XID", 0x7F) == "00"
    mend(bench.now)
    assert bench.ask(WHERE) == "+000000500"


def test_away_from_the_limit_it_may_move() -> None:
    bench = Bench()
    break_body(bench.line, LIFT, "limit", bench.now)
    assert bench.ask(BACK) == ""


def test_a_cable_that_is_pulled_carries_nothing() -> None:
    bench = Bench()
    mend = pull_cable(bench.line, bench.now)
    assert bench.ask(WHERE) == ""
    mend(bench.now)
    assert bench.ask(WHERE) == "+000000000"
