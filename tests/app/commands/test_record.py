"""`record`: a recording of a running gateway, as a file."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from app import http
from tests.app.fake_gateway import FakeGateway

BEGUN = {"id": "r1", "status": "running", "since": "A", "until": None, "error": None}
OVER = BEGUN | {"status": "finished", "until": "B"}


class Content:
    """A download, whole or broken off."""

    is_success, status_code = True, 200

    def __init__(self, *pieces: bytes | OSError) -> None:
        self._pieces = pieces

    def iter_bytes(self) -> Iterator[bytes]:
        for piece in self._pieces:
            if isinstance(piece, OSError):
                raise piece
            yield piece


def sending(monkeypatch: pytest.MonkeyPatch, *pieces: bytes | OSError) -> None:
    @contextmanager
    def stream(*_: object, **__: object) -> Iterator[Content]:
        yield Content(*pieces)

    monkeypatch.setattr(http, "stream", stream)


def gateway(over: object = OVER) -> FakeGateway:
    finish = "/recordings/r1/finish"
    return FakeGateway(
        {"/recordings": [(202, BEGUN)], "/recordings/r1": [(200, over)], finish: [(200, OVER)]}
    )


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        (("--for", "30s"), {"last_s": 0.0, "for_s": 30.0}),
        (("--last", "5m"), {"last_s": 300.0, "for_s": 0.0}),
        (
            ("--last", "1.5h", "--for", "2s", "--line", "arm"),
            {"last_s": 5400.0, "for_s": 2.0, "lines": ["arm"]},
        ),
    ],
)
def test_a_time_is_recorded_into_a_file(
    words: tuple[str, ...], wanted: object, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sending(monkeypatch, b"PK", b"...")
    asked, out = gateway(), tmp_path / "plant.mgrec"
    said = asked.run(monkeypatch, "record", *words, "--out", str(out))
    assert said.exit_code == 0, said.output
    assert asked.posted == [("/recordings", wanted)]
    assert out.read_bytes() == b"PK..."
    assert out.stat().st_mode & 0o777 == 0o600
    assert said.stdout == f"A to B was recorded in {out}.\n"


@pytest.mark.parametrize("words", [(), ("--for", "30"), ("--last", "0s"), ("--last", "-5m"), ("--for", "1d")])
def test_a_time_that_is_none_is_refused(
    words: tuple[str, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    asked = gateway()
    said = asked.run(monkeypatch, "record", *words, "--out", str(tmp_path / "a.mgrec"))
    assert (said.exit_code, asked.asked) == (2, [])


def test_no_file_is_written_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "a.mgrec").write_bytes(b"mine")
    asked = gateway()
    said = asked.run(monkeypatch, "record", "--last", "5m", "--out", str(tmp_path / "a.mgrec"))
    assert (said.exit_code, asked.asked) == (2, [])
    assert "exists already; nothing was recorded" in said.stderr


@pytest.mark.parametrize("broken", [http.AnswerLost("it breaks off"), OSError(28, "No space left on device")])
def test_a_download_that_breaks_off_leaves_no_file(
    broken: OSError, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    sending(monkeypatch, b"PK", broken)
    said = gateway().run(monkeypatch, "record", "--last", "5m", "--out", str(tmp_path / "a.mgrec"))
    assert said.exit_code == 1
    assert "GET /recordings/r1/content" in said.stderr
    assert list(tmp_path.iterdir()) == []


def test_a_recording_that_failed_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    failed = gateway(BEGUN | {"status": "failed", "error": "The disk is full."})
    said = failed.run(monkeypatch, "record", "--for", "9s", "--out", str(tmp_path / "a.mgrec"))
    assert said.exit_code == 1
    assert "The disk is full." in said.stderr


def test_an_interruption_ends_it_and_keeps_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    sending(monkeypatch, b"PK")
    asked = gateway(KeyboardInterrupt())
    said = asked.run(monkeypatch, "record", "--for", "1h", "--out", str(tmp_path / "a.mgrec"))
    assert said.exit_code == 0
    assert asked.paths[-1] == "/recordings/r1/finish"
    assert (tmp_path / "a.mgrec").read_bytes() == b"PK"
