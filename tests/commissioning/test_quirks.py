"""For each assumption a line on which it is false: commissioning finds it, and proposes the right change."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import pytest

from commissioning.assumptions import ASSUMPTIONS
from commissioning.findings import Result
from commissioning.proposals import changed, diff
from simulator.fics.line import SimulatedFics
from simulator.fics.quirks import QUIRKS as FICS_QUIRKS
from simulator.rorze.line import Rc400Line
from simulator.rorze.quirks import QUIRKS as RC400_QUIRKS
from tests.commissioning.benches import CONFIG, MAKES, Machine, commissioned, result_of, unlike
from tests.plants import in_virtual_time

BOTH = ("echo", "late-replies", "turnaround", "stop-overtakes")


class Case(NamedTuple):
    """What is found of one quirk."""

    line_id: str
    slug: str
    result: Result
    proposed: Mapping[str, Any] = {}
    prepare: Callable[[Any], None] | None = None
    """What the machine has to be like for the quirk to show."""


def with_label(line: Rc400Line) -> None:
    """Give a body a program with a label."""
    for instruction in ("*TS", "WAT5", "END"):
        line.receive(f"&00UWS{instruction}\r".encode(), 0.0)
    line.take_output(0.0)


def with_limit_error(line: Rc400Line) -> None:
    """Give a body an error that stands."""
    line.axes[0].status |= 2


def homed(robot: SimulatedFics) -> None:
    """Home the robot, away from 0."""
    for unit in robot.robot.units.values():
        for motor in unit.motors:
            motor.homed = motor.ever_homed = True
            motor.at = 1.23
        unit.motors[-1].at = 2.0


def with_hole(robot: SimulatedFics) -> None:
    """Give the robot a table of positions with a hole."""
    robot.robot.units[1].positions = {1: (1.0, 2.0, 3.0), 2: (1.0, 2.0, 4.0), 4: (5.0, 6.0, 7.0)}


DIFFERS, CONTRADICTS = Result.DIFFERS, Result.CONTRADICTS
CASES = (
    Case("robot", "echo", CONTRADICTS),
    Case("robot", "late-replies", DIFFERS, {"late_reply_s": 5.5, "reply_timeout_s": 9.0}),
    Case("robot", "turnaround", DIFFERS, {"reply_timeout_s": 1.2}),
    Case("robot", "interjection", DIFFERS, {"stop_mode": "after_reply"}),
    Case("robot", "order-per-body", CONTRADICTS),
    Case("robot", "copies-of-replies", DIFFERS, {"late_reply_s": 6.0}),
    Case("robot", "silent-xid", DIFFERS, {"introducer": "$"}),
    Case("robot", "label-answers", CONTRADICTS, prepare=with_label),
    Case("robot", "half-command", CONTRADICTS),
    Case("robot", "wrong-mode", CONTRADICTS),
    Case("robot", "lasting-errors", DIFFERS, prepare=with_limit_error),
    Case("cell", "echo", CONTRADICTS),
    Case("cell", "late-replies", DIFFERS, {"late_reply_s": 5.5, "reply_timeout_s": 9.0}),
    Case("cell", "turnaround", DIFFERS, {"reply_timeout_s": 1.2}),
    Case("cell", "half-robot-command", CONTRADICTS),
    Case("cell", "robot-terminator", DIFFERS, {"terminator": "crlf"}),
    Case("cell", "robot-decimals", CONTRADICTS, prepare=homed),
    Case(
        "cell",
        "status-bits",
        DIFFERS,
        {"robot.status_bits": ["moving", "alarm", "origin_done", "servo_ready"]},
        prepare=homed,
    ),
    Case("cell", "hidden-positions", CONTRADICTS, prepare=homed),
    Case("cell", "por-end", CONTRADICTS, prepare=with_hole),
    Case("cell", "displayed-hundredths", CONTRADICTS, prepare=homed),
    Case("cell", "copies-of-answers", DIFFERS, {"late_reply_s": 6.0}),
)
each_case = pytest.mark.parametrize("case", CASES, ids=lambda it: f"{it.line_id}-{it.slug}")


def prepared(case: Case) -> Machine:
    """A machine as assumed, on which the quirk of a case would show."""
    machine = MAKES[case.line_id]()
    if case.prepare is not None:
        case.prepare(machine)
    return machine


def quirky(case: Case) -> Machine:
    """A machine on which the assumption of a case is false."""
    machine = prepared(case)
    if isinstance(machine, SimulatedFics):
        FICS_QUIRKS[case.slug](machine)
    else:
        RC400_QUIRKS[case.slug](machine)
    return machine


@each_case
@in_virtual_time
async def test_a_quirk_is_found_and_the_change_proposed(case: Case) -> None:
    report, _ = await commissioned(quirky(case))
    assert result_of(report, case.slug).result is case.result
    assert report.changes() == case.proposed
    assert not report.is_right()


@pytest.mark.parametrize(
    "case", [it for it in CASES if it.proposed], ids=lambda it: f"{it.line_id}-{it.slug}"
)
@in_virtual_time
async def test_with_the_proposed_change_the_line_is_as_configured(case: Case) -> None:
    text = changed(CONFIG, case.line_id, case.proposed, "gateway.toml")
    report, _ = await commissioned(quirky(case), text=text)
    assert unlike(report) == {}
    assert all(key.rpartition(".")[2] in diff(CONFIG, text, "gateway.toml") for key in case.proposed)


@pytest.mark.parametrize("case", [it for it in CASES if it.prepare is not None], ids=lambda it: it.slug)
@in_virtual_time
async def test_without_the_quirk_the_same_machine_agrees(case: Case) -> None:
    machine = prepared(case)
    report, _ = await commissioned(machine)
    assert result_of(report, case.slug).result is Result.AGREES
    assert unlike(report) == {}


def test_each_assumption_has_its_quirk() -> None:
    at_the_port = {"dpram-map", "dpram-times"}
    assert {it.slug for it in ASSUMPTIONS} == {*RC400_QUIRKS, *FICS_QUIRKS, *at_the_port}
