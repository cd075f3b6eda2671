"""Faults by chance and on demand."""

from random import Random
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.faults import MOST_NOISE, Direction, Fault, Faults, Flight, Switch

FRAME = b"&3F1+M500\r"


def hit(fault: Fault, **how: Any) -> tuple[list[Flight], dict[Fault, float]]:
    faults = Faults(Random(7))
    faults.set(Switch(fault, Direction.REQUESTS, next_frames=1, **how))
    return faults.distort(FRAME, Direction.REQUESTS, 0.0)


def test_without_switches_a_frame_arrives_as_it_is() -> None:
    assert Faults(Random(0)).distort(FRAME, Direction.REPLIES, 0.0) == ([Flight(0.0, (FRAME,))], {})


def test_the_next_frames_are_hit_and_no_more_and_only_one_way() -> None:
    faults = Faults(Random(0))
    faults.set(Switch(Fault.LOST, Direction.REQUESTS, next_frames=2))
    ways = [Direction.REQUESTS, Direction.REPLIES, Direction.REQUESTS, Direction.REQUESTS]
    assert [len(faults.distort(FRAME, way, 0.0)[0]) for way in ways] == [0, 1, 0, 1]
    assert faults.switches == []


def test_frames_may_pass_before_the_next_are_hit() -> None:
    faults = Faults(Random(0))
    faults.set(Switch(Fault.LOST, Direction.REQUESTS, next_frames=1, pass_frames=2))
    assert [len(faults.distort(FRAME, Direction.REQUESTS, 0.0)[0]) for _ in range(4)] == [1, 1, 0, 1]


def test_chance_hits_its_share() -> None:
    faults = Faults(Random(1))
    faults.set(Switch(Fault.LOST, Direction.REQUESTS, probability=0.05))
    lost = sum(not faults.distort(FRAME, Direction.REQUESTS, 0.0)[0] for _ in range(10_000))
    assert 400 < lost < 600


def test_a_garbled_frame_differs_in_one_bit() -> None:
    ([flight], hits) = hit(Fault.GARBLED)
    (garbled,) = flight.pieces
    differences = [(a ^ b).bit_count() for a, b in zip(FRAME, garbled, strict=True)]
    assert sum(differences) == 1
    assert list(hits) == [Fault.GARBLED]


def test_a_merged_frame_has_no_end() -> None:
    assert hit(Fault.MERGED)[0] == [Flight(0.0, (FRAME[:-1],))]


def test_noise_stands_before_the_frame() -> None:
    ([flight], _) = hit(Fault.NOISE)
    assert flight.pieces[0].endswith(FRAME)
    assert len(FRAME) < len(flight.pieces[0]) <= len(FRAME) + MOST_NOISE


def test_a_split_frame_is_the_same_in_two_pieces() -> None:
    ([flight], _) = hit(Fault.SPLIT, delay_s=0.25)
    assert len(flight.pieces) == 2
    assert all(flight.pieces)
    assert b"".join(flight.pieces) == FRAME
    assert flight.gap_s == 0.25


def test_late_and_doubled_frames_come_when_they_should() -> None:
    assert hit(Fault.LATE, delay_s=0.5)[0] == [Flight(0.5, (FRAME,))]
    assert hit(Fault.DOUBLED, delay_s=0.5)[0] == [Flight(0.0, (FRAME,)), Flight(0.5, (FRAME,))]


def test_the_spread_lengthens_the_delay_at_random() -> None:
    faults = Faults(Random(3))
    faults.set(Switch(Fault.LATE, Direction.REPLIES, probability=1.0, delay_s=0.5, spread_s=0.2))
    delays = [faults.distort(FRAME, Direction.REPLIES, 0.0)[0][0].delay_s for _ in range(100)]
    assert len(set(delays)) == 100
    assert all(0.5 <= delay <= 0.7 for delay in delays)


def test_a_late_frame_may_hold_up_those_behind_it() -> None:
    faults = Faults(Random(0))
    faults.set(
        Switch(Fault.LATE, Direction.REPLIES, next_frames=1, probability=1e-9, delay_s=2.0, holds_up=True)
    )
    arrivals = [faults.distort(FRAME, Direction.REPLIES, at)[0][0].delay_s + at for at in (0.0, 0.5, 3.0)]
    assert arrivals == [2.0, 2.0, 3.0]
    assert faults.distort(FRAME, Direction.REQUESTS, 0.5)[0] == [Flight(0.0, (FRAME,))]


def test_clearing_ends_everything_at_once() -> None:
    faults = Faults(Random(0))
    faults.set(Switch(Fault.SILENCE, Direction.REPLIES, next_frames=1, delay_s=100.0))
    assert faults.distort(FRAME, Direction.REPLIES, 0.0)[0] == []
    faults.clear()
    assert len(faults.distort(FRAME, Direction.REPLIES, 1.0)[0]) == 1


@pytest.mark.parametrize("direction", Direction)
@given(seed=st.integers(), chances=st.lists(st.floats(0, 1), min_size=len(Fault), max_size=len(Fault)))
def test_the_same_seed_gives_the_same_faults(direction: Direction, seed: int, chances: list[float]) -> None:
    def run() -> list[tuple[list[Flight], dict[Fault, float]]]:
        faults = Faults(Random(seed))
        for fault, chance in zip(Fault, chances, strict=True):
            faults.set(Switch(fault, direction, probability=chance, spread_s=0.1))
        return [faults.distort(FRAME, direction, now / 10) for now in range(20)]

    assert run() == run()
