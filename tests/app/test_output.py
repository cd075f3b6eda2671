"""Output of commands."""

import pytest

from app.output import ProgressLine, json_text, table


def test_columns_are_as_wide_as_what_stands_in_them() -> None:
    assert table(("A", "LONG"), [("body", "x"), ("", "y")]).splitlines() == [
        "A     LONG",
        "body  x",
        "      y",
    ]


def test_a_table_may_have_heads_alone() -> None:
    assert table(("A", "B"), []) == "A  B"


def test_japanese_stands_in_json_as_it_is() -> None:
    assert json_text({"name": "旋回"}) == '{\n  "name": "旋回"\n}'


def test_nothing_is_said_of_what_is_over_soon(capsys: pytest.CaptureFixture[str]) -> None:
    with ProgressLine(clock=iter((0.0, 1.9)).__next__) as progress:
        progress.say("asking")
    assert capsys.readouterr().err == ""


def test_in_a_file_each_sentence_stands_once(capsys: pytest.CaptureFixture[str]) -> None:
    with ProgressLine(clock=iter((0.0, 2.0, 3.0, 4.0)).__next__) as progress:
        progress.say("asking 1")
        progress.say("asking 1")
        progress.say("asking 2")
    told = capsys.readouterr()
    assert (told.err, told.out) == ("asking 1\nasking 2\n", "")


def test_on_a_terminal_one_line_is_written_over_and_taken_away(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("sys.stderr.isatty", lambda: True)
    with ProgressLine(clock=iter((0.0, 2.0, 3.0)).__next__) as progress:
        progress.say("one")
        progress.note("this stays")
        progress.say("two")
    lines = capsys.readouterr().err.replace("\r\x1b[K", "<").splitlines()
    assert lines == ["<one<this stays", "<two<"]
