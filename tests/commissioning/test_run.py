"""A line that is as assumed: everything agrees, nothing but questions is sent, every frame is told."""

import pytest

from commissioning.assumptions import ASSUMPTIONS, of_family
from commissioning.findings import Result
from protocols.fics.link import Ver3Reader
from protocols.rorze.commands import COMMANDS
from protocols.rorze.link import POISON, Request, RequestReader
from protocols.table import Retry
from tests.commissioning.benches import MAKES, commissioned, result_of, unlike
from tests.plants import in_virtual_time
from transports.trace import escape

QUESTIONS_OF_ROBOTS = ("VER", "VAR V", "APS", "MPS", "ACD", "ERD", "POR", "!")
XID = "XID"


@pytest.mark.parametrize("line_id", MAKES)
@in_virtual_time
async def test_a_line_that_is_as_assumed_agrees(line_id: str) -> None:
    report, _ = await commissioned(MAKES[line_id]())
    assert unlike(report) == {}
    assert report.is_right()
    assert [it.assumption for it in report.results] == [it.slug for it in of_family(report.protocol)]
    assert all(it.needed for it in report.results if it.result is Result.CANNOT_TELL)


@in_virtual_time
async def test_only_questions_go_to_a_link_master() -> None:
    report, cable = await commissioned(MAKES["robot"]())
    for request in RequestReader().feed(b"".join(cable.written)):
        if isinstance(request, Request) and request.text and not request.too_long():
            row = COMMANDS[request.text[:3]]
            assert row.retry is Retry.READ or row.code == XID, request
    assert escape(POISON) in [it.data for it in report.frames]


@in_virtual_time
async def test_only_questions_go_to_a_robot() -> None:
    _, cable = await commissioned(MAKES["cell"]())
    assert [it for it in cable.written if not it.decode().startswith(QUESTIONS_OF_ROBOTS)] == []
    assert b"=" not in b"".join(cable.written)


@pytest.mark.parametrize("line_id", MAKES)
@in_virtual_time
async def test_every_frame_is_in_the_report(line_id: str) -> None:
    report, cable = await commissioned(MAKES[line_id]())
    assert [it.data for it in report.frames if it.dir == "tx"] == [escape(it) for it in cable.written]
    answers = [it.data for it in report.frames if it.dir == "rx"]
    assert answers
    assert [it.at for it in report.frames] == sorted(it.at for it in report.frames)
    assert all(Ver3Reader().feed(it.encode()) == [] for it in answers)  # each ends with its CR, escaped


@in_virtual_time
async def test_a_line_without_anybody_tells_what_is_needed() -> None:
    machine = MAKES["robot"]()
    machine.power_off(0.0)
    report, _ = await commissioned(machine)
    assert {it.result for it in report.results} == {Result.CANNOT_TELL}


@in_virtual_time
async def test_the_report_tells_the_versions_of_controllers() -> None:
    report, _ = await commissioned(MAKES["robot"]())
    assert set(report.controllers) == {"00", "0A"}
    assert "RC-420" in report.controllers["0A"]
    assert "RC-420" in report.markdown()
    assert result_of(report, "silent-xid").seen in report.markdown()


def test_all_assumptions_of_the_decision_are_there_once() -> None:
    slugs = [it.slug for it in ASSUMPTIONS]
    assert len(set(slugs)) == len(slugs) == 36
