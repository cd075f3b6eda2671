"""Words for people who wait: none at first, then each once."""

import pytest

from app.progress import ProgressLine


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
