"""Troubles of a Fics begin, last and are mended."""

import pytest

from simulator.fics.troubles import OF_ROBOTS, break_robot
from tests.simulator.fics.bench import Bench

MOVE = "LMA ,,1"


@pytest.mark.parametrize(
    ("kind", "broken", "still"),
    [
        ("ems", ["LMA E02"], ["LMA E02"]),
        ("driver", ["LMA E02"], ["LMA E02"]),
        ("cable", [], ["LMA"]),
        ("power", [], ["LMA E10"]),
    ],
)
def test_a_robot_is_broken_and_what_is_left_after_the_mending(
    kind: str, broken: list[str], still: list[str]
) -> None:
    bench = Bench()
    bench.home()
    mend = break_robot(bench.line, kind, bench.now)
    bench.heard()
    assert bench.do(MOVE) == broken
    mend(bench.now)
    bench.heard()
    bench.ask("MOD 3")
    assert bench.do(MOVE) == still
    bench.ask("DRT")
    bench.home()
    assert bench.do(MOVE) == ["LMA"]


def test_every_trouble_of_a_robot_is_tried() -> None:
    assert set(OF_ROBOTS) == {"ems", "driver", "cable", "power"}
