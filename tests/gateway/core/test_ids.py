"""Ids: of the length that is asked for, and no two alike."""

import os

from gateway.core.ids import go_on_after, hex_digits, sorted_by_time


def test_no_two_ids_are_alike() -> None:
    made = [hex_digits(32) for _ in range(1000)]
    assert {len(it) for it in made} == {32}
    assert all(int(it, 16) >= 0 for it in made)
    assert len(set(made)) == len(made)


def test_ids_sort_by_time() -> None:
    made = [sorted_by_time(at_ms) for at_ms in (1, 255, 256, 1_800_000_000_000)]
    assert made == sorted(made)
    assert {len(it) for it in made} == {20}


def test_ids_of_one_millisecond_sort_as_they_were_drawn() -> None:
    made = [sorted_by_time(1_800_000_000_000) for _ in range(1000)]
    assert (made, len(set(made))) == (sorted(made), 1000)


def test_a_clock_that_is_set_back_leaves_their_order() -> None:
    made = [sorted_by_time(at_ms) for at_ms in (1_900_000_000_000, 1_800_000_000_000, 1_900_000_000_001)]
    assert made == sorted(made)


def test_a_clock_that_was_ahead_in_an_earlier_life_leaves_their_order() -> None:
    go_on_after(f"{2_000_000_000_000 << 32:020x}")
    assert f"{2_000_000_000_000 << 32:020x}" < sorted_by_time(1_800_000_000_000) < sorted_by_time(1)


def test_a_fork_draws_its_own() -> None:
    read, write = os.pipe()
    if os.fork() == 0:
        os.write(write, hex_digits(32).encode())
        os._exit(0)
    os.close(write)
    assert os.read(read, 32).decode() != hex_digits(32)
    os.close(read)
    os.wait()
