"""`simulate --like`: what was found on a line is found on the simulator that is like it."""

import json
from collections.abc import Iterator
from contextlib import suppress
from copy import deepcopy
from functools import reduce
from operator import getitem
from pathlib import Path
from typing import Any

import pytest

from gateway.config_file import changed
from simulator.fics.layout import Layout
from simulator.fics.line import SimulatedFics
from simulator.fics.line import build_line as build_fics
from simulator.likeness import read_likeness
from simulator.rorze.line import build_line
from simulator.truth import TruthLog
from tests.commissioning.benches import CONFIG, MAKES, Machine, commissioned, unlike
from tests.commissioning.test_quirks import CASES, Case, quirky
from tests.plants import in_virtual_time

LIKE = [case for case in CASES if case.prepare is None]


def like(report: Path, case: Case) -> Machine:
    """A simulator like the line in a report."""
    likeness = read_likeness(report)
    if likeness.is_robot:
        return likeness.turn_fics(build_fics(likeness.layout()))
    return likeness.turn_rc400(build_line(likeness.bodies(), 0.0, TruthLog()))


@pytest.mark.parametrize("case", LIKE, ids=lambda case: f"{case.line_id}-{case.slug}")
@in_virtual_time
async def test_the_simulator_is_as_the_line_was(case: Case, tmp_path: Path) -> None:
    found, _ = await commissioned(quirky(case))
    report = tmp_path / "F.json"
    report.write_text(found.model_dump_json(), "utf-8")
    again, _ = await commissioned(like(report, case))
    assert unlike(again) == unlike(found)
    assert again.changes().keys() == found.changes().keys()


SLUGS = ("interjection", "silent-xid", "half-command", "robot-terminator", "status-bits")
SETTLED = [it for it in CASES if it.slug in SLUGS]


@pytest.mark.parametrize("case", SETTLED, ids=lambda it: it.slug)
@in_virtual_time
async def test_a_line_whose_settings_are_right_already_is_as_odd(case: Case, tmp_path: Path) -> None:
    right = changed(CONFIG, case.line_id, case.proposed, "gateway.toml")
    found, _ = await commissioned(quirky(case), text=right)
    assert unlike(found) == {}
    (tmp_path / "F.json").write_text(found.model_dump_json(), "utf-8")
    machine = like(tmp_path / "F.json", case)
    if case.prepare is not None:
        case.prepare(machine)
    again, _ = await commissioned(machine)
    assert unlike(again).keys() == {case.slug}
    assert again.changes() == case.proposed


@in_virtual_time
async def test_units_and_axes_are_those_of_the_line(tmp_path: Path) -> None:
    found, _ = await commissioned(build_fics(Layout(units=1)))
    (tmp_path / "F.json").write_text(found.model_dump_json(), "utf-8")
    machine = like(tmp_path / "F.json", CASES[0])
    assert isinstance(machine, SimulatedFics)
    assert [axis.name for axis in machine.robot.unit.users] == ["X", "Y", "Z"]


@pytest.mark.parametrize(
    "text", ["", "{}", "[]", '{"protocol": "rorze", "table": {"bodies": [{"id": "zz"}]}}']
)
def test_what_is_no_report_is_refused(text: str, tmp_path: Path) -> None:
    (tmp_path / "F.json").write_text(text, "utf-8")
    with pytest.raises(ValueError, match="no report"):
        read_likeness(tmp_path / "F.json")
    with pytest.raises(ValueError, match="cannot be read"):
        read_likeness(tmp_path / "G.json")


JUNK: tuple[object, ...] = (None, -1, 1e308, "", "xx", [], [[]], {}, {"a": 1}, True, ["00"])


def places(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    """Every place in a report, of lists the first entry alone."""
    yield path
    entries = (
        value.items()
        if isinstance(value, dict)
        else [(0, value[0])]
        if isinstance(value, list) and value
        else []
    )
    for key, entry in entries:
        yield from places(entry, (*path, key))


@pytest.mark.parametrize("line_id", MAKES)
@in_virtual_time
async def test_nonsense_at_any_place_of_a_report_is_refused_or_does_no_harm(
    line_id: str, tmp_path: Path
) -> None:
    found, _ = await commissioned(MAKES[line_id]())
    report = found.model_copy(update={"frames": []}).model_dump(mode="json")
    file = tmp_path / "F.json"
    for path in [path for path in places(report) if path]:
        for junk in JUNK:
            odd = deepcopy(report)
            *before, last = path
            reduce(getitem, before, odd)[last] = junk
            file.write_text(json.dumps(odd), "utf-8")
            with suppress(ValueError):
                read_likeness(file)
