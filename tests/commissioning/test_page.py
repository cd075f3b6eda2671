"""The pages are made of the assumptions, and the assumptions name what is there."""

import re
from pathlib import Path

import pytest

from commissioning import page
from commissioning.assumptions import ASSUMPTIONS, Assumption
from gateway.fics import config as fics
from gateway.rorze import config as rorze

ROOT = Path(page.__file__).parent.parent
FILE = re.compile(r"`((?:gateway|protocols|transports)/[\w/]+\.py)`")
CONSTANT = re.compile(r"`([A-Z][A-Z_]+)`")
KEYS = {
    *rorze.RorzeLineTable.model_fields,
    *rorze.BodyTable.model_fields,
    *fics.FicsLineTable.model_fields,
    *fics.RobotTable.model_fields,
}


@pytest.mark.parametrize("name", page.PAGES)
def test_the_pages_are_what_the_rows_say(name: str) -> None:
    text = (ROOT / "docs" / name).read_text("utf-8")
    assert page.written(name) == text, "write it anew: make documents"


@pytest.mark.parametrize("row", ASSUMPTIONS, ids=lambda it: it.slug)
def test_what_holds_an_assumption_is_there(row: Assumption) -> None:
    files = [ROOT / name for name in FILE.findall(row.held)]
    assert [file for file in files if not file.exists()] == []
    text = "".join(file.read_text("utf-8") for file in files)
    assert [name for name in CONSTANT.findall(row.held) if name not in text] == []
    assert not row.key or row.key.rpartition(".")[2] in KEYS
