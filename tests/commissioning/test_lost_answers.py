"""Answers that are lost, once: no assumption is told as false because of that."""

from collections.abc import Callable
from typing import Any

import pytest

from commissioning.bench import Places
from commissioning.run import commission
from gateway.config import parse
from simulator.fics.line import SimulatedFics
from tests.commissioning.benches import CONFIG, MAKES, all_allowed, unlike
from tests.commissioning.test_quirks import away, homed, in_mode_3
from tests.plants import in_virtual_time
from tests.simulated_line import SimulatedCable

LINES = (
    ("robot", away, Places(0, 200)),
    ("cell", homed, Places(140, 180)),
    ("cell", in_mode_3, Places(140, 180)),
)
STRIDE = 23
"""Answers of which the first is lost, after others that are not."""


class Lossy(SimulatedCable):
    """A cable on which one answer of many is lost."""

    def __init__(self, machine: Any, first: int) -> None:
        super().__init__(machine)
        self._left = first
        take = machine.take_output

        def taken(now: float) -> bytes:
            output: bytes = take(now)
            if output:
                self._left -= 1
            if output and self._left < 0:
                self._left = STRIDE
                return b""
            return output

        machine.take_output = taken


@pytest.mark.parametrize("first", range(0, STRIDE, 4))
@pytest.mark.parametrize(("line_id", "prepare", "places"), LINES)
@in_virtual_time
async def test_a_lost_answer_contradicts_nothing(
    line_id: str, prepare: Callable[[Any], None], places: Places, first: int
) -> None:
    machine = MAKES[line_id]()
    prepare(machine)
    line: Any = next(table for table in parse(CONFIG, "gateway.toml").lines if table.id == line_id)
    terms = all_allowed(machine, places)
    report = await commission(line, terms, open_transport=lambda _: Lossy(machine, first))
    assert unlike(report) == {}
    if isinstance(machine, SimulatedFics):
        assert machine.robot.job is None
