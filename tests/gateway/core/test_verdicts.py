"""The tables of verdicts: every finding has one row, and nothing else gives a move a final status."""

import ast
from collections.abc import Iterator, Sequence
from enum import Flag
from itertools import product
from pathlib import Path
from string import Formatter
from typing import get_args, get_type_hints

import pytest

from gateway.core.errors import GatewayError, NoReply
from gateway.core.move_record import MoveStatus
from gateway.core.verdicts import (
    AXES,
    GIVEN,
    TABLES,
    AtRest,
    Begun,
    Finding,
    Place,
    Power,
    Row,
    RowProblem,
    Sight,
    Stop,
    Told,
    Unbegun,
    Unseen,
    Unwatched,
    VerdictWords,
    Worst,
    drawing,
    fits,
    judge,
    row_of,
    worst_of,
)

ROOT = Path(__file__).parents[3]
PAGE = ROOT / "docs" / "verdicts.md"
TABLE = "gateway/core/verdicts.py"
ROWS = [row for rows in TABLES.values() for row in rows]
FINAL = {status.name for status in MoveStatus if status.final}


def findings() -> Iterator[Finding]:
    """Every combination of single facts, of every kind of finding."""
    for kind in get_args(Finding):
        if issubclass(kind, Flag):
            yield from kind
        else:
            yield from (kind(*facts) for facts in product(*get_type_hints(kind).values()))


def test_every_finding_has_exactly_one_row() -> None:
    rows = {finding: [row for row in ROWS if fits(finding, row.finding)] for finding in findings()}
    assert len(rows) > 1_900
    assert {finding: fitting for finding, fitting in rows.items() if len(fitting) != 1} == {}


def test_every_row_has_a_finding() -> None:
    assert {id(row_of(finding)) for finding in findings()} == {id(row) for row in ROWS}


@pytest.mark.parametrize("row", ROWS, ids=lambda it: str(it.finding))
def test_a_row_ends_a_move_and_says_why_it_did_not_succeed(row: Row) -> None:
    assert row.status.final
    if row.status is MoveStatus.SUCCEEDED:
        assert not row.error
    elif row.status is not MoveStatus.STOPPED and row.finding is not Unwatched.FAULT:
        assert row.error


@pytest.mark.parametrize("row", ROWS, ids=lambda it: str(it.finding))
def test_a_row_uses_no_word_that_no_family_can_give(row: Row) -> None:
    problem = row.error if isinstance(row.error, RowProblem) else RowProblem(GatewayError, "", "")
    texts = row.evidence, row.cause or "", problem.detail, problem.remedy, problem.moved
    used = {name for text in texts for _, name, _, _ in Formatter().parse(text) if name}
    assert used <= set(VerdictWords._fields)


@pytest.mark.parametrize("finding", [Unbegun.REFUSED, AtRest(begun=Begun.IN_DOUBT, place=Place.UNKNOWN)])
def test_what_was_told_of_one_command_is_given_on_as_it_is(finding: Finding) -> None:
    error = NoReply("a.00 did not answer.")
    assert row_of(finding).error == GIVEN
    assert judge(finding, given=error).error is error


def test_a_row_speaks_in_the_words_of_the_family() -> None:
    words = AXES._replace(who="r/units/1", position={"X": 1.0}, target={"X": 2.0})
    error = judge(AtRest(place=Place.ELSEWHERE), words).error
    assert error is not None
    assert error.detail == "r/units/1 stands at {'X': 1.0}, not at {'X': 2.0} as was asked."
    alarm = judge(AtRest(Told.ALARM), words).error
    assert alarm is not None
    assert alarm.detail == "An axis of r/units/1 reports an alarm; the axes stand still."


@pytest.mark.parametrize("place", Place)
@pytest.mark.parametrize("begun", Begun)
def test_nothing_succeeds_without_power_or_while_nobody_knows_of_it(begun: Begun, place: Place) -> None:
    lost = judge(AtRest(power=Power.LOST, begun=begun, place=place)).status
    doubted = judge(AtRest(power=Power.UNPROVED, begun=begun, place=place)).status
    assert lost is MoveStatus.LOST
    assert doubted is not MoveStatus.SUCCEEDED


@pytest.mark.parametrize("stop", [Stop.SENT, Stop.CONFIRMED])
@pytest.mark.parametrize("place", [Place.START, Place.ELSEWHERE, Place.WITHOUT_TARGET, Place.UNKNOWN])
def test_a_stop_explains_a_place_that_is_not_the_target(place: Place, stop: Stop) -> None:
    assert judge(AtRest(stop=stop, place=place)).status is MoveStatus.STOPPED
    assert judge(AtRest(stop=stop, place=Place.TARGET)).status is MoveStatus.SUCCEEDED


@pytest.mark.parametrize("sight", Sight)
def test_an_end_that_nobody_saw_is_never_told_as_one(sight: Sight) -> None:
    unseen = [it for it in findings() if isinstance(it, Unseen) and it.stop is not Stop.CONFIRMED]
    assert {judge(it).status for it in unseen} == {MoveStatus.LOST, MoveStatus.UNKNOWN}
    assert judge(Unseen(sight, stop=Stop.CONFIRMED)).status is MoveStatus.STOPPED


@pytest.mark.parametrize(
    ("statuses", "worst"),
    [
        ([MoveStatus.SUCCEEDED, MoveStatus.SUCCEEDED], Worst.SUCCEEDED),
        ([MoveStatus.STOPPED, MoveStatus.SUCCEEDED], Worst.STOPPED),
        ([MoveStatus.FAILED, MoveStatus.UNKNOWN, MoveStatus.STOPPED], Worst.UNKNOWN),
        ([MoveStatus.UNKNOWN, MoveStatus.LOST, MoveStatus.REJECTED], Worst.LOST),
    ],
)
def test_the_worst_member_judges_all(statuses: Sequence[MoveStatus], worst: Worst) -> None:
    assert worst_of(statuses) is worst


def test_nothing_but_the_tables_gives_a_move_a_final_status() -> None:
    files = [path for path in (ROOT / "gateway").rglob("*.py") if not path.as_posix().endswith(TABLE)]
    assert len(files) > 100
    assert {str(path.relative_to(ROOT)): given_in(path) for path in files if given_in(path)} == {}


def given_in(path: Path) -> list[int]:
    """The lines where a final status is passed, returned or assigned; to compare is free."""
    tree = ast.parse(path.read_text("utf-8"))
    compared = {id(it) for node in ast.walk(tree) if isinstance(node, ast.Compare) for it in ast.walk(node)}
    return sorted(
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Attribute)
        and isinstance(node.value, ast.Name)
        and node.value.id == "MoveStatus"
        and node.attr in FINAL
        and id(node) not in compared
    )


def test_the_search_finds_what_is_given_and_passes_over_what_is_compared(tmp_path: Path) -> None:
    module = tmp_path / "module.py"
    module.write_text(
        "if move.status in (MoveStatus.LOST, MoveStatus.UNKNOWN): pass\n"
        "end(MoveStatus.FAILED)\n"
        "status = MoveStatus.SENT\n"
        "status = MoveStatus.STOPPED\n"
    )
    assert given_in(module) == [2, 4]


def test_the_page_shows_the_tables() -> None:
    assert PAGE.read_text("utf-8") == drawing()
