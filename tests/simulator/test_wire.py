"""How frames travel: whole, in order, at their times, and each on record."""

from functools import partial
from random import Random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.faults import Direction, Fault, Faults, Switch
from simulator.truth import TruthLog
from simulator.wire import Wire

MACHINE = 0x7F
LONGEST = 8


class Bench:
    """A wire, what the machine has heard by it, and a clock turned by hand."""

    def __init__(self) -> None:
        self.now = 0.0
        self.truth = TruthLog()
        self.faults = Faults(Random(0))
        self.heard: list[tuple[int | None, bytes, float]] = []
        self.wire = Wire(lambda *heard: self.heard.append(heard), self.truth, self.faults, MACHINE, LONGEST)

    def fault(self, fault: Fault, direction: Direction, delay_s: float = 0.1) -> None:
        self.faults.set(Switch(fault, direction, next_frames=1, delay_s=delay_s))

    def wait(self, seconds: float) -> None:
        self.now += seconds
        while self.wire.next_at() <= self.now:
            self.wire.step()

    def arrived(self) -> bytes:
        """Bytes that have arrived at either end since the last call."""
        heard = b"".join(data for _, data, _ in self.heard)
        self.heard.clear()
        return heard + self.wire.take_output()


def test_a_frame_is_heard_with_its_number_when_its_cr_has_come() -> None:
    bench = Bench()
    bench.wire.receive(b"&3F", 0.0)
    assert bench.heard == []
    bench.wire.receive(b"6PD\r&00", 1.0)
    bench.wire.receive(b"6PD\r", 2.0)
    assert bench.heard == [(1, b"&3F6PD\r", 1.0), (2, b"&006PD\r", 2.0)]
    assert bench.wire.requests == 2


def test_more_line_ends_that_come_with_a_cr_belong_to_its_frame() -> None:
    bench = Bench()
    bench.wire.receive(b"one\r\r\ntwo\r\nthr", 0.0)
    bench.wire.receive(b"ee\r", 1.0)
    bench.wire.receive(b"\n4\r", 2.0)
    assert [data for _, data, _ in bench.heard] == [b"one\r\r\n", b"two\r\n", b"three\r", b"\n4\r"]


@given(st.lists(st.sampled_from([b"a", b"bc", b"\r", b"\n", b"0123456789"])))
def test_nothing_is_lost_however_it_comes_and_nothing_is_kept_for_ever(pieces: list[bytes]) -> None:
    bench = Bench()
    for piece in pieces:
        bench.wire.receive(piece, 0.0)
        assert len(bench.wire._arriving) <= LONGEST
    assert [number for number, _, _ in bench.heard] == list(range(1, bench.wire.requests + 1))
    assert bench.arrived() + bench.wire._arriving == b"".join(pieces)


def test_what_leaves_is_given_once() -> None:
    bench = Bench()
    bench.wire.send(b">&3F6PD\r", 1, 0.0)
    bench.wire.send(b">&7D\r", None, 0.0)
    assert bench.wire.take_output() == b">&3F6PD\r>&7D\r"
    assert bench.wire.take_output() == b""


def test_a_late_frame_comes_at_its_time_and_others_overtake_it() -> None:
    bench = Bench()
    bench.fault(Fault.LATE, Direction.REQUESTS, delay_s=0.5)
    bench.wire.receive(b"late\r", 0.0)
    bench.wire.receive(b"soon\r", 0.0)
    assert bench.wire.next_at() == 0.5
    bench.wait(0.6)
    assert bench.heard == [(2, b"soon\r", 0.0), (1, b"late\r", 0.5)]


@pytest.mark.parametrize("direction", Direction)
def test_no_frame_comes_between_the_pieces_of_another(direction: Direction) -> None:
    bench = Bench()
    bench.fault(Fault.SPLIT, direction, delay_s=0.2)
    for frame in (b"first\r", b"second\r"):
        if direction is Direction.REQUESTS:
            bench.wire.receive(frame, 0.0)
        else:
            bench.wire.send(frame, None, 0.0)
    arrived = bench.arrived()
    assert 0 < len(arrived) < len(b"first\r")
    bench.wait(0.1)
    assert bench.arrived() == b""
    bench.wait(0.1)
    assert arrived + bench.arrived() == b"first\rsecond\r"


def test_one_direction_does_not_wait_for_the_other() -> None:
    bench = Bench()
    bench.fault(Fault.SPLIT, Direction.REQUESTS, delay_s=1.0)
    bench.wire.receive(b"first\r", 0.0)
    bench.wire.send(b"reply\r", None, 0.0)
    assert bench.wire.take_output() == b"reply\r"


def test_what_is_planned_for_one_moment_happens_in_the_order_it_was_planned() -> None:
    bench = Bench()
    done: list[tuple[str, float]] = []

    def note(name: str, now: float) -> None:
        done.append((name, now))

    for name, at in (("c", 2.0), ("a", 1.0), ("b", 1.0)):
        bench.wire.plan(at, 0.0, partial(note, name))
    bench.wire.plan(0.0, 0.5, partial(note, "overdue"))
    bench.wait(5.0)
    assert done == [("overdue", 0.5), ("a", 1.0), ("b", 1.0), ("c", 2.0)]


def test_without_power_everything_on_its_way_is_lost() -> None:
    bench = Bench()
    bench.fault(Fault.LATE, Direction.REQUESTS)
    bench.wire.receive(b"late\rhalf", 0.0)
    bench.wire.send(b"reply\r", 1, 0.0)
    bench.wire.clear()
    bench.wait(1.0)
    assert bench.wire.take_output() == b""
    bench.wire.receive(b"whole\r", bench.now)
    assert bench.heard == [(2, b"whole\r", 1.0)]


def test_after_a_loss_of_power_nothing_waits_for_the_rest_of_an_old_frame() -> None:
    bench = Bench()
    bench.fault(Fault.SPLIT, Direction.REQUESTS, delay_s=100.0)
    bench.wire.receive(b"first\r", 0.0)
    bench.wire.clear()
    bench.heard.clear()
    bench.wire.receive(b"second\r", 1.0)
    assert bench.heard == [(2, b"second\r", 1.0)]


def test_every_frame_is_on_record_with_the_faults_that_hit_it() -> None:
    bench = Bench()
    bench.fault(Fault.LOST, Direction.REPLIES, delay_s=0.3)
    bench.wire.receive(b"6P\xff\r", 1.0)
    bench.wire.send(b"answer\r\n", 1, 2.0)
    assert bench.truth.request is None
    bench.wire.send(b"unasked\r", None, 3.0)
    assert [(fact.kind, fact.at, fact.body, fact.request, fact.facts) for fact in bench.truth] == [
        ("request", 1.0, MACHINE, 1, {"frame": "6P\\xff"}),
        ("reply", 2.0, MACHINE, 1, {"frame": "answer", "faults": {Fault.LOST: 0.3}}),
        ("message", 3.0, MACHINE, None, {"frame": "unasked"}),
    ]
