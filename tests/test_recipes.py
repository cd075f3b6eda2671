"""The recipes answer what their pages say, on the demo."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.console.browser import demo_in
from tests.e2e.processes import Gateway, simulated_line, write_config

pytestmark = pytest.mark.prove
ROOT = Path(__file__).parents[1]
PAGES = sorted(page for page in (ROOT / "docs" / "recipes").glob("*.md") if page.name != "index.md")
FENCED = re.compile(r"^```(\w+)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SAVED = re.compile(r"[Ss]ave it as `([\w.]+)`")
DEMO = "http://127.0.0.1:8420"
SLOW = ("swap-a-controller",)
LINES = 24
"""A recipe is short: what is typed, and its program."""


class Call(NamedTuple):
    """A command as typed, and its answer as the page has it."""

    typed: str
    answer: list[str]


def calls_of(text: str) -> list[Call]:
    """The calls of a console block."""
    calls: list[Call] = []
    for line in text.splitlines():
        if line.startswith("$ "):
            calls.append(Call(line[2:], []))
        else:
            calls[-1].answer.append(line)
    return calls


def missing(answer: list[str], told: str) -> list[str]:
    """The lines of a page's answer that were not told, in their order."""
    left = iter(told.splitlines())
    patterns = [".*".join(map(re.escape, line.split("…"))) for line in answer]
    return [pattern for pattern in patterns if not any(re.match(pattern, line) for line in left)]


@contextmanager
def fast_line_in(folder: Path) -> Iterator[str]:
    """A line at 115200 baud: at the 9600 of the demo a backup takes two minutes."""
    with simulated_line(folder) as line:
        gateway = Gateway(write_config(line, "gateway")).wait_until_ready()
        try:
            yield gateway.url
        finally:
            gateway.end()


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_recipe_answers_what_its_page_says(page: Path, tmp_path: Path) -> None:
    with (fast_line_in if page.stem in SLOW else demo_in)(tmp_path) as url:
        run(page, url, tmp_path)


def run(page: Path, demo: str, tmp_path: Path) -> None:
    text = page.read_text("utf-8")
    blocks = FENCED.findall(text)
    if saved := SAVED.search(text):
        [program] = [content for kind, content in blocks if kind == "python"]
        assert len(program.splitlines()) <= LINES
        (tmp_path / saved[1]).write_text(program, "utf-8")
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    environment = {**os.environ, "PATH": path, "MOTION_GATEWAY_URL": demo}
    calls = [call for kind, content in blocks if kind == "console" for call in calls_of(content)]
    assert 1 < len(calls) + text.count("```python") <= LINES
    for call in calls:
        done = subprocess.run(  # noqa: S603  # what our own page says
            ["bash", "-c", call.typed.replace(DEMO, demo)],  # noqa: S607
            cwd=tmp_path,
            env=environment,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            timeout=180,
            check=False,
        )
        assert missing(call.answer, done.stdout) == [], f"{call.typed}\n{done.stdout}"
