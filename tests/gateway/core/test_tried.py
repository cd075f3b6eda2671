"""Assumptions that were tried on a line: read from the report that its configuration names."""

import json
from pathlib import Path

import pytest

from gateway.config import parse
from gateway.core.tables import LineTable
from gateway.core.tried import untried

TEXT = """
[[lines]]
id = "robot"
address = "serial:///dev/ttyUSB0"
{key}
[[lines.bodies]]
id = "00"
"""


def line_with(report: Path | None) -> LineTable:
    key = "" if report is None else f'commissioned = "{report}"'
    return parse(TEXT.format(key=key), "test.toml").lines[0]


@pytest.mark.parametrize(
    ("results", "slugs", "words"),
    [
        ({"a": "agrees", "b": "cannot_tell"}, [["b"]], ["were not tried"]),
        ({"b": "cannot_tell", "a": "differs"}, [["a"], ["b"]], ["or that nothing has to", "were not tried"]),
        (
            {"a": "differs", "b": "contradicts", "c": "contradicts"},
            [["b", "c"], ["a"]],
            ["do not run motion", "or that nothing has to"],
        ),
    ],
)
def test_what_weighs_most_is_told_first(
    tmp_path: Path, results: dict[str, str], slugs: list[list[str]], words: list[str]
) -> None:
    report = tmp_path / "F.json"
    told = [{"assumption": name, "result": result} for name, result in results.items()]
    report.write_text(json.dumps({"results": told}), "utf-8")
    found = untried(line_with(report))
    assert [(told.line_id, list(told.assumptions)) for told in found] == [("robot", names) for names in slugs]
    assert all(word in told.meaning for told, word in zip(found, words, strict=True))


def test_a_line_on_which_all_holds_needs_no_word(tmp_path: Path) -> None:
    report = tmp_path / "F.json"
    report.write_text(json.dumps({"results": [{"assumption": "a", "result": "agrees"}]}), "utf-8")
    assert untried(line_with(report)) == []


@pytest.mark.parametrize("text", [None, "", "[]", "{}", '{"results": [1]}'])
def test_a_report_that_is_missing_or_none_proves_nothing(tmp_path: Path, text: str | None) -> None:
    report = tmp_path / "F.json"
    if text is not None:
        report.write_text(text, "utf-8")
    (found,) = untried(line_with(report))
    assert "nothing is known" in found.meaning


def test_without_a_report_nothing_was_ever_tried() -> None:
    (found,) = untried(line_with(None))
    assert "motion-gateway commission robot" in found.meaning
