"""The fault simulator on lines that are otherwise than is assumed: never wrong, and right with the change.

Each assumption has its quirk. With the change that `commission` proposes the seeds find nothing; without it
the gateway is honest: what it tells is true, though it may not get on.
"""

import logging
import re
from collections.abc import Callable, Iterator, Mapping
from itertools import count, islice
from types import MappingProxyType
from typing import Any, Final

import pytest

from commissioning.assumptions import BY_SLUG
from simulator.faults import Switch
from simulator.fics.quirks import QUIRKS as FICS_QUIRKS
from simulator.rorze.quirks import QUIRKS as RC400_QUIRKS
from tests.commissioning.benches import with_changes
from tests.commissioning.test_quirks import CASES, DEEDS, Case
from tests.fault_simulator.families import Family, Rorze
from tests.fault_simulator.seed import Seed, run
from tests.simulation import test_faulty_line

SEEDS: Final = 50
"""Seeds with the proposed change."""
WANTED: Final = 50
"""Commands that clients ask for in each."""
HONEST_SEEDS: Final = 10
"""Seeds without the change."""
LATEST_S: Final = 4.0
"""A reply, or a copy of one, is no later on a line that is otherwise than is assumed."""


class OldRorze(Rorze):
    """The plant that an old link master knows: no groups, and no body beyond 0F."""

    BODIES = (0x00, 0x01, 0x0F)
    GROUPS = MappingProxyType({})


SLOW: Final = frozenset({"I14"})
"""The violation of a line that is too slow: answers come too late, or reads wait."""
MAY: Final[Mapping[str, frozenset[str]]] = MappingProxyType(
    {
        "echo": SLOW,
        "late-replies": SLOW,
        "turnaround": SLOW,
        "copies-of-replies": SLOW,
        "copies-of-answers": SLOW,
        "silent-xid": SLOW,
        "robot-terminator": SLOW,
        # told as unknown, and done as the robot does it
        "numbers-as-set": frozenset({"I12"}),
        # told as a loss of power that was none, and to be acknowledged
        "homing-outlasts": frozenset({"I15"}),
        # half a command is executed: these contradict the gateway, and nothing may be moved there; what was
        # cut off is told as unknown (test_half_commands.py)
        "half-command": frozenset({"I7"}),
        "half-robot-command": frozenset({"I7"}),
    }
)
"""Violations that seeds may find on a line whose quirk no change makes up for yet."""
STILL: Final[Mapping[str, frozenset[str]]] = MappingProxyType(
    dict.fromkeys(("late-replies", "turnaround", "copies-of-replies", "copies-of-answers"), SLOW)
)
"""Violations that they may find with the change: a line with replies, or copies of them, so late is slow."""

ALL: Final = {(it.line_id, it.slug): it for it in (*CASES, *DEEDS)}

pytestmark = [pytest.mark.prove, pytest.mark.long]


@pytest.fixture(autouse=True)
def _quiet(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL, "gateway")


def seeds_of(case: Case) -> Iterator[int]:
    """The seeds whose line is of the family of a case."""
    wanted = (0, 1) if case.line_id == "robot" else (2, 3)
    return (seed for seed in count() if seed % 4 in wanted)


def violations(
    monkeypatch: pytest.MonkeyPatch, case: Case, seed: int, changes: Mapping[str, Any]
) -> set[str]:
    """Violations that a seed finds, by the names of the rules."""
    draw, spoil, mend = Seed._draw_family, Seed._spoil, Seed._mend
    always: list[Switch] = []

    def drawn(self: Seed, number: int) -> Family:
        family = OldRorze(number) if case.slug == "silent-xid" else draw(self, number)
        quirks: Mapping[str, Any] = RC400_QUIRKS if case.line_id == "robot" else FICS_QUIRKS
        quirks[case.slug](family.machine)
        always.extend(family.machine.faults.switches)
        if changes:
            family.config = with_changes(family.config, changes)
        return family

    def faulty(change: Callable[[Seed], None]) -> Callable[[Seed], None]:
        """Faults that a seed turns on or off leave those of the quirk."""

        def changed(self: Seed) -> None:
            change(self)
            for it in always:
                self._wire_faults.set(it)

        return changed

    with monkeypatch.context() as patch:
        patch.setattr(Seed, "_draw_family", drawn)
        patch.setattr(Seed, "_spoil", faulty(spoil))
        patch.setattr(Seed, "_mend", faulty(mend))
        patch.setattr(test_faulty_line, "LATEST_S", LATEST_S)
        found = run(seed, WANTED).violations
    return {match[0] for it in found if (match := re.match(r"\w+", it))}


@pytest.mark.parametrize("case", ALL.values(), ids=lambda it: f"{it.line_id}-{it.slug}")
def test_without_the_change_the_gateway_is_honest(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    found = {seed: violations(monkeypatch, case, seed, {}) for seed in islice(seeds_of(case), HONEST_SEEDS)}
    assert set().union(*found.values()) <= MAY.get(case.slug, frozenset()), found


@pytest.mark.parametrize(
    "case",
    [it for it in ALL.values() if it.proposed],
    ids=lambda it: f"{it.line_id}-{it.slug}",
)
def test_with_the_change_the_seeds_pass(case: Case, monkeypatch: pytest.MonkeyPatch) -> None:
    found = {
        seed: violations(monkeypatch, case, seed, case.proposed) for seed in islice(seeds_of(case), SEEDS)
    }
    assert set().union(*found.values()) <= STILL.get(case.slug, frozenset()), found


def test_the_page_tells_what_is_left_with_a_change() -> None:
    assert {slug for slug in STILL if not BY_SLUG[slug].rest} == set()


def test_the_seeds_know_each_quirk() -> None:
    assert {("robot", it) for it in RC400_QUIRKS} | {("cell", it) for it in FICS_QUIRKS} == ALL.keys()
