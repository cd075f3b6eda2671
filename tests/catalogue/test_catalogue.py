"""Every fault of the catalogue has its tests, and these are there."""

import re
from pathlib import Path

import pytest

from tests.catalogue.page import page
from tests.catalogue.rows import ROWS, SIZES

ROOT = Path(__file__).parents[2]


def test_no_number_is_missing() -> None:
    numbers = [f"{part}{number:02}" for part, size in SIZES.items() for number in range(1, size + 1)]
    assert sorted(ROWS) == sorted(numbers)


@pytest.mark.parametrize("number", ROWS)
def test_a_fault_has_tests_that_are_there(number: str) -> None:
    assert ROWS[number].tests
    for test in ROWS[number].tests:
        file, _, name = test.partition("::")
        source = (ROOT / file).read_text("utf-8")
        assert re.search(rf"^ *(async )?def {name}\(", source, re.MULTILINE), f"{file} has no {name}"


def test_a_number_chooses_its_tests(request: pytest.FixtureRequest) -> None:
    chosen = [item.nodeid for item in request.session.items if "J07" in item.extra_keyword_matches]
    here = {item.nodeid.partition("[")[0] for item in request.session.items}
    assert {test.partition("[")[0] for test in chosen} == here.intersection(ROWS["J07"].tests)


def test_the_page_in_the_docs_is_up_to_date() -> None:
    page_there = (ROOT / "docs" / "faults.md").read_text("utf-8")
    assert page_there == page(), "write it anew: python -m tests.catalogue.page > docs/faults.md"
