"""Every promise names tests, which are there; the page of tests says which run holds each."""

import pytest

from tests.promises import ROOT, named_tests, page, run_by


@pytest.mark.parametrize("title", named_tests())
def test_a_promise_names_tests_that_are_there(title: str) -> None:
    tests = named_tests()[title]
    assert tests
    for test in tests:
        assert (ROOT / test).exists(), f"{title}: {test} is not there"


def test_a_file_is_run_by_what_its_marks_say() -> None:
    assert run_by("tests/gateway/test_upgrade.py") == "`make test`"
    assert run_by("tests/e2e/test_kills.py") == "`make prove`"
    assert run_by("tests/fault_simulator") == "both"


def test_the_page_in_the_docs_is_up_to_date() -> None:
    there = (ROOT / "docs" / "testing.md").read_text("utf-8")
    assert there == page(), "write it anew: python -m tests.promises > docs/testing.md"
