"""Collections of garbage: what survived one is not looked through again, and what is dropped is freed."""

import gc
import weakref
from typing import Any

from app.garbage import THRESHOLDS, short_collections


class Kept:
    """Something that the collector looks through."""

    other: "Kept"


def test_what_survived_is_not_looked_through_again() -> None:
    with short_collections():
        kept = [[number] for number in range(50_000)]
        gc.collect()
        assert len(gc.get_objects()) < 1_000
        assert len(kept) == 50_000


def test_so_many_objects_are_looked_through_at_most_before_they_are_set_aside() -> None:
    with short_collections():
        kept: list[object] = []
        longest = 0
        for number in range(200_000):
            kept.append([number])
            if number % 100 == 0:
                longest = max(longest, len(gc.get_objects()))
        young, middle, old = THRESHOLDS
        assert longest <= (young + 1) * (middle + 2) * (old + 2)


def test_what_was_there_at_the_start_puts_no_collection_off() -> None:
    full: list[int] = []

    def note(phase: str, info: dict[str, Any]) -> None:
        if phase == "start" and info["generation"] == 2:
            full.append(len(kept))

    at_the_start = [[number] for number in range(400_000)]
    gc.collect()
    kept: list[object] = []
    with short_collections():
        gc.callbacks.append(note)
        kept += ([number] for number in range(50_000))
        gc.callbacks.remove(note)
    assert len(at_the_start) == 400_000
    assert full[0] <= 25_000


def test_what_was_set_aside_is_freed_when_it_is_dropped() -> None:
    with short_collections():
        kept = Kept()
        gc.collect()
        seen = weakref.ref(kept)
        del kept
        assert seen() is None


def test_a_new_circle_is_collected() -> None:
    with short_collections():
        one, other = Kept(), Kept()
        one.other, other.other = other, one
        seen = weakref.ref(one)
        del one, other
        gc.collect()
        assert seen() is None


def test_afterwards_collections_are_as_before() -> None:
    before, callbacks = gc.get_threshold(), list(gc.callbacks)
    with short_collections():
        assert gc.get_threshold() == THRESHOLDS
    assert gc.get_threshold() == before
    assert gc.callbacks == callbacks
