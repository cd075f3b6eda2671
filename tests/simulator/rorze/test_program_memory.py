"""The room of a user program, and its memories."""

from simulator.rorze.program_memory import Memories, fits, free_steps


def test_an_empty_program_leaves_all_room() -> None:
    assert free_steps(()) == 6039
    assert free_steps(("*TEST", "WAT5", "END")) == 6039 - 3 - 2 - 1


def test_a_program_ends_where_its_room_does() -> None:
    program = ("WAT5",) * 3019
    assert fits(program, "END")
    assert not fits(program, "WAT5")


def test_short_instructions_fill_every_address() -> None:
    assert fits(("END",) * 6038, "END")
    assert not fits(("END",) * 6039, "END")


def test_five_hundred_labels_are_enough() -> None:
    labels = tuple(f"*L{number}" for number in range(500))
    assert fits(labels[:499], "*L499")
    assert not fits(labels, "*L500")
    assert fits(labels, "END")


def test_a_timer_runs_out() -> None:
    memories = Memories()
    memories.set("T0", 3, 10.0)
    told = [memories.get("T0", now) for now in (10.0, 10.09, 10.11, 10.29, 10.31, 99.0)]
    assert told == [3, 3, 2, 1, 0, 0]
    memories.set("D0", -7, 10.0)
    assert (memories.get("D0", 99.0), memories.get("C0", 99.0)) == (-7, 0)
