"""Every sentence of the promises has tests, which are there; the page says which run holds each."""

import pytest

from tests.promises import ROOT, Held, held, page, promises, run_by


def test_every_promise_has_its_place_in_the_list_of_tests() -> None:
    told, listed = [promise.text for promise in promises()], [entry.beginning for entry in held()]
    assert [
        text for text, beginning in zip(told, listed, strict=False) if not text.startswith(beginning)
    ] == []
    assert told[len(listed) :] == []
    assert listed[len(told) :] == []


@pytest.mark.parametrize("found", held(), ids=lambda found: found.beginning)
def test_a_promise_is_held_by_tests_that_are_there(found: Held) -> None:
    assert found.tests
    for test in found.tests:
        assert run_by(test)


@pytest.mark.parametrize(
    ("test", "run"),
    [
        ("tests/gateway/test_upgrade.py", "`make test`"),
        ("tests/e2e/test_kills.py", "`make prove`"),
        ("tests/fault_simulator", "both"),
        ("tests/gateway/test_drawn_faults.py::test_a_fault_at_a_drawn_call_is_survived", "`make test`"),
        (
            "tests/gateway/test_drawn_faults.py::test_a_fault_at_a_drawn_call_of_any_function_is_survived",
            "`make prove`",
        ),
        ("tests/fault_simulator/test_switches.py::test_the_fault_simulator_sees_that_a_rule_is_off", "both"),
    ],
)
def test_a_test_is_run_by_what_its_marks_say(test: str, run: str) -> None:
    assert run_by(test) == run


def test_a_test_that_is_not_there_is_named() -> None:
    with pytest.raises(LookupError, match=r"tests/e2e/test_breakdowns\.py has no test_of_nothing"):
        run_by("tests/e2e/test_breakdowns.py::test_of_nothing")


def test_the_page_in_the_docs_is_up_to_date() -> None:
    there = (ROOT / "docs" / "testing.md").read_text("utf-8")
    assert there == page(), "write it anew: python -m tests.promises > docs/testing.md"
