"""For each assumption a line on which it is false: commissioning finds it, and proposes the right change."""

import asyncio
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import pytest

from commissioning.assumptions import ASSUMPTIONS
from commissioning.bench import Places
from commissioning.findings import Result
from gateway.config_file import changed, diff
from simulator.fics.line import SimulatedFics
from simulator.fics.quirks import QUIRKS as FICS_QUIRKS
from simulator.rorze.line import Rc400Line
from simulator.rorze.quirks import QUIRKS as RC400_QUIRKS
from tests.commissioning.benches import (
    CONFIG,
    MAKES,
    Machine,
    all_allowed,
    commissioned,
    rc400,
    result_of,
    unlike,
)
from tests.plants import in_virtual_time

NEVER_TOLD = {"label-answers", "lasting-errors", "por-end", "dpram-map", "dpram-times"}
"""Quirks that a line without labels, errors, holes and RAM does not show."""


class Case(NamedTuple):
    """The finding for one quirk."""

    line_id: str
    slug: str
    result: Result
    proposed: Mapping[str, Any] = {}
    prepare: Callable[[Any], None] | None = None
    """Brings the machine into the state in which the quirk shows."""
    off_s: float = 1.0
    """Seconds for which the power is off, where it is switched."""


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


def away(line: Rc400Line) -> None:
    """Let the bodies be at another place than 0, within the places where they may go."""
    for body in line.axes:
        line.receive(f"&{body:02X}6PS100\r".encode(), 0.0)
    line.take_output(0.0)


def in_mode_3(robot: SimulatedFics) -> None:
    """Home the robot, and have it tell refusals."""
    homed(robot)
    robot.robot.mode = 3


def with_hole(robot: SimulatedFics) -> None:
    """Give the robot a table of positions with a hole."""
    robot.robot.units[1].positions = {1: (1.0, 2.0, 3.0), 2: (1.0, 2.0, 4.0), 4: (5.0, 6.0, 7.0)}


DIFFERS, CONTRADICTS = Result.DIFFERS, Result.CONTRADICTS
CASES = (
    Case("robot", "echo", CONTRADICTS),
    Case("robot", "late-replies", DIFFERS, {"late_reply_s": 4.7, "reply_timeout_s": 4.8}),
    Case("robot", "turnaround", DIFFERS, {"reply_timeout_s": 0.8}),
    Case("robot", "interjection", DIFFERS, {"stop_mode": "after_reply"}),
    Case("robot", "order-per-body", CONTRADICTS),
    Case("robot", "copies-of-replies", DIFFERS, {"late_reply_s": 6.0}),
    Case("robot", "silent-xid", DIFFERS, {"introducer": "$"}),
    Case("robot", "label-answers", CONTRADICTS, prepare=with_label),
    Case("robot", "half-command", DIFFERS, {"half_commands": "line_ends"}),
    Case("robot", "wrong-mode", CONTRADICTS),
    Case("robot", "lasting-errors", DIFFERS, prepare=with_limit_error),
    Case("cell", "echo", CONTRADICTS),
    Case("cell", "late-replies", DIFFERS, {"late_reply_s": 4.7, "reply_timeout_s": 4.8}),
    Case("cell", "turnaround", DIFFERS, {"reply_timeout_s": 0.8}),
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
DEEDS = (
    Case("robot", "link-master-forgets", DIFFERS),
    Case(
        "robot",
        "comment-kept",
        DIFFERS,
        {"bodies.00.power_comment": 0, "bodies.0A.power_comment": 0},
        prepare=away,
    ),
    Case("robot", "power-on-position", DIFFERS, prepare=away),
    Case("robot", "curve-tick", CONTRADICTS),
    Case("robot", "stop-overtakes", DIFFERS),
    Case("cell", "upload-end", CONTRADICTS),
    Case("cell", "upload-end", CONTRADICTS, prepare=in_mode_3),
    Case("cell", "upload-refusal", CONTRADICTS),
    Case("cell", "upload-refusal", CONTRADICTS, prepare=in_mode_3),
    Case("cell", "pos-left-out", CONTRADICTS),
    Case("cell", "pos-left-out", CONTRADICTS, prepare=in_mode_3),
    Case("cell", "numbers-as-set", CONTRADICTS),
    Case("cell", "numbers-as-set", CONTRADICTS, prepare=in_mode_3),
    Case("cell", "power-loss-read", CONTRADICTS, off_s=0.2),
    Case("cell", "power-loss-motion", CONTRADICTS, off_s=0.2),
    Case("cell", "positions-after-power", CONTRADICTS, prepare=homed),
    Case("cell", "error-after-power", CONTRADICTS),
    Case("cell", "homing-outlasts", CONTRADICTS, prepare=homed),
    Case("cell", "jog-mode", DIFFERS, prepare=homed),
    Case("cell", "jog-mode", DIFFERS, prepare=in_mode_3),
    Case("cell", "stop-overtakes", DIFFERS, prepare=in_mode_3),
    Case("cell", "stop-overtakes", DIFFERS, prepare=homed),
)
"""Quirks that show only where more than questions is allowed."""
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


@each_case
@in_virtual_time
async def test_it_is_found_as_well_where_all_is_allowed(case: Case) -> None:
    machine = quirky(case)
    report, _ = await commissioned(machine, all_allowed(machine, places_of(case)))
    assert result_of(report, case.slug).result is case.result
    assert report.changes() == case.proposed


@in_virtual_time
async def test_hidden_positions_are_not_taken_for_other_bits() -> None:
    report, _ = await commissioned(quirky(Case("cell", "hidden-positions", CONTRADICTS, prepare=homed)))
    assert unlike(report) == {"hidden-positions": CONTRADICTS}


@pytest.mark.parametrize("line_id", MAKES)
@in_virtual_time
async def test_among_echoes_nothing_else_is_told(line_id: str) -> None:
    machine = quirky(Case(line_id, "echo", CONTRADICTS))
    report, _ = await commissioned(machine, all_allowed(machine, Places(0, 200)))
    assert unlike(report) == {"echo": CONTRADICTS}
    others = [it for it in report.results if it.assumption != "echo"]
    assert {it.result for it in others} == {Result.CANNOT_TELL}
    assert all((it.needed or "").startswith("See to echo first") for it in others)


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


@pytest.mark.parametrize("case", DEEDS, ids=lambda it: f"{it.line_id}-{it.slug}")
@in_virtual_time
async def test_a_quirk_is_found_where_more_is_allowed(case: Case) -> None:
    machine = quirky(case)
    report, _ = await commissioned(machine, all_allowed(machine, places_of(case), case.off_s))
    assert result_of(report, case.slug).result is case.result
    assert report.changes() == case.proposed


@pytest.mark.parametrize("slug", ["power-loss-read", "power-loss-motion"])
@in_virtual_time
async def test_of_a_robot_that_is_up_at_once_a_long_switch_tells_nothing(slug: str) -> None:
    machine = quirky(Case("cell", slug, CONTRADICTS))
    report, _ = await commissioned(machine, all_allowed(machine, Places(140, 180), off_s=3.0))
    told = result_of(report, slug)
    assert told.result is Result.CANNOT_TELL
    assert "silent for 3" in told.seen
    assert "at the moment in which the robot is switched on" in (told.needed or "")


@in_virtual_time
async def test_a_comment_is_tried_at_each_body_that_somebody_agrees_to() -> None:
    machine = rc400()
    away(machine)
    machine.axes[0x0A].keeps_comments = machine.axes[0x0A].keeps_position = True
    report, cable = await commissioned(machine, all_allowed(machine, Places(0, 200)))
    assert report.changes() == {
        "bodies.0A.power_comment": 0,
        "bodies.0A.silence_needs_acknowledgement": True,
    }
    assert "Comment 1 of body 0A has outlasted" in result_of(report, "comment-kept").seen
    assert all(b"&%02X9VS1,\r" % body in cable.written for body in machine.axes), "they are set back"


@pytest.mark.parametrize(
    "case", [case for case in DEEDS if case.proposed], ids=lambda case: f"{case.line_id}-{case.slug}"
)
@in_virtual_time
async def test_what_was_changed_after_a_loss_of_power_is_not_proposed_again(case: Case) -> None:
    machine = quirky(case)
    text = changed(CONFIG, case.line_id, case.proposed, "gateway.toml")
    report, _ = await commissioned(machine, all_allowed(machine, places_of(case)), text)
    assert unlike(report) == {}
    assert "Nothing rests on it" in result_of(report, case.slug).seen


@in_virtual_time
async def test_a_board_that_keeps_all_is_right_once_its_silence_needs_an_acknowledgement() -> None:
    machine = rc400()
    away(machine)
    machine.axes[0x0A].keeps_comments = machine.axes[0x0A].keeps_position = True
    wanted = {"bodies.0A.power_comment": 0, "bodies.0A.silence_needs_acknowledgement": True}
    text = changed(CONFIG, "robot", wanted, "gateway.toml")
    report, _ = await commissioned(machine, all_allowed(machine, Places(0, 200)), text)
    assert report.changes() == {}


@in_virtual_time
async def test_stored_positions_without_a_hole_do_not_tell_where_they_end() -> None:
    report, _ = await commissioned(MAKES["cell"]())
    told = result_of(report, "por-end")
    assert told.result is Result.CANNOT_TELL
    assert "with a hole" in (told.needed or "")


def places_of(case: Case) -> Places:
    """Between which places the machine of a case may move."""
    return Places(0, 200) if case.line_id == "robot" else Places(140, 180)


PREPARED = (("robot", away), ("cell", homed), ("cell", in_mode_3))


@pytest.mark.parametrize(("line_id", "prepare"), PREPARED)
@in_virtual_time
async def test_all_trials_leave_a_machine_that_is_as_assumed_as_it_was(
    line_id: str, prepare: Callable[[Any], None]
) -> None:
    machine = MAKES[line_id]()
    prepare(machine)
    report, _ = await commissioned(machine, all_allowed(machine, places_of(Case(line_id, "", DIFFERS))))
    assert unlike(report) == {}
    told = {it.assumption: it.seen for it in report.results if it.result is Result.CANNOT_TELL}
    assert told.keys() <= NEVER_TOLD, told


def test_each_assumption_has_its_quirk() -> None:
    at_the_port = {"dpram-map", "dpram-times"}
    assert {it.slug for it in ASSUMPTIONS} == {*RC400_QUIRKS, *FICS_QUIRKS, *at_the_port}


@in_virtual_time
async def test_a_robot_on_a_slow_line_is_asked_no_faster_than_it_answers_while_its_power_is_switched() -> (
    None
):
    """At 4800 baud an answer to VER takes longer than the time between two looks at a robot."""
    machine = prepared(Case("cell", "positions-after-power", DIFFERS, prepare=homed))
    text = CONFIG.replace("baud=19200", "baud=4800")
    terms = all_allowed(machine, Places(140, 180), off_s=1.0)

    async def slowly(subject: str, what: str) -> bool:
        await asyncio.sleep(20.0)
        return await terms.switch(subject, what)

    report, _ = await commissioned(machine, replace(terms, switch=slowly), text, baud=4800)
    assert unlike(report) == {}
    told = [result_of(report, slug).result for slug in ("positions-after-power", "error-after-power")]
    assert told == [Result.AGREES] * 2
