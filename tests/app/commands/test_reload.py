"""The command `reload` and its output."""

from typing import Any

import pytest

from tests.app.fake_gateway import always

LINES = [
    {"line_id": "a", "change": "changed", "keys": ["bodies.3F.name"]},
    {"line_id": "b", "change": "added", "keys": []},
]


@pytest.mark.parametrize(
    ("words", "answer", "said"),
    [
        (
            ["--dry-run"],
            {"lines": LINES, "needs_restart": [], "applied": False, "busy": []},
            ["line a  changed: bodies.3F.name", "line b  added", "Nothing was changed."],
        ),
        (
            ["--dry-run"],
            {"lines": LINES[:1], "needs_restart": [], "applied": False, "busy": ["a.3F", "a.40"]},
            [
                "line a  changed: bodies.3F.name",
                "Refused while a.3F, a.40 moves or is at work.",
                "Nothing was changed.",
            ],
        ),
        ([], {"lines": LINES[1:], "needs_restart": [], "applied": True, "busy": []}, ["line b  added"]),
        (
            [],
            {"lines": [], "needs_restart": ["server.port"], "applied": True, "busy": []},
            ["A restart alone changes server.port.", "All lines are as they were."],
        ),
    ],
)
def test_what_differs_is_said(
    monkeypatch: pytest.MonkeyPatch, words: list[str], answer: dict[str, Any], said: list[str]
) -> None:
    gateway = always(answer)
    done = gateway.run(monkeypatch, "reload", *words)
    assert (done.exit_code, done.stdout.splitlines()) == (0, said)
    assert gateway.posted == [("/system/reload", {"dry_run": bool(words)})]


def test_a_refusal_is_an_exit_code(monkeypatch: pytest.MonkeyPatch) -> None:
    refused = always({"detail": "It has no file; nothing was changed.", "moved": "no"}, 403)
    done = refused.run(monkeypatch, "reload")
    assert done.exit_code == 1
    assert "nothing was changed" in done.stderr


@pytest.mark.parametrize(("status", "code"), [(422, 78), (409, 1), (503, 3)])
def test_a_file_that_is_wrong_is_no_wrong_argument(
    status: int, code: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    problem = {"detail": "gateway.toml:2: server.prot: unknown key; nothing was changed.", "moved": "no"}
    assert always(problem, status).run(monkeypatch, "reload").exit_code == code
