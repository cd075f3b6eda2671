"""The dashboards of `examples/` show another client's move; the clients' READMEs run as they are printed."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from shutil import which
from textwrap import dedent
from typing import IO

import httpx
import pytest
from motion_gateway_client import Gateway
from motion_gateway_client.generated.types import RelativeMoveRequest

from tests.clients.conftest import running_demo
from tests.clients.node import node
from tests.e2e.processes import until

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(ROOT / "clients" / "python")}
STEP: RelativeMoveRequest = {
    "kind": "relative",
    "direction": "cw",
    "distance": {"value": 5, "unit": "pulse"},
}


@contextmanager
def running(command: list[str], output: IO[str]) -> Iterator[subprocess.Popen[bytes]]:
    program = subprocess.Popen(command, stdout=output, stderr=output, env=ENVIRONMENT)  # noqa: S603
    try:
        yield program
    finally:
        program.kill()
        program.wait()


@pytest.mark.parametrize("name", ["mes_dashboard.py", "mes_dashboard.mts"])
def test_a_dashboard_shows_how_moves_have_ended(demo: str, tmp_path: Path, name: str) -> None:
    program = sys.executable if name.endswith(".py") else node()
    shown = tmp_path / "shown"

    def moved_and_seen() -> bool:
        # The first ones may be over before the dashboard follows.
        gateway.wait_for_move(gateway.start_move("01", STEP))
        return re.search(r"^line1\.01 +succeeded +\d+ +[1-9]", shown.read_text(), re.MULTILINE) is not None

    with shown.open("w") as output, Gateway(demo) as gateway:
        command = [str(program), str(EXAMPLES / name), demo]
        with running(command, output) as dashboard:
            until(lambda: "axis" in shown.read_text(), "the dashboard begins")
            until(moved_and_seen, "it shows the end of a move")
            assert dashboard.poll() is None


@pytest.mark.parametrize("language", ["python", "typescript"])
def test_what_a_readme_shows_runs_as_it_stands(demo: str, tmp_path: Path, language: str) -> None:
    folder = ROOT / "clients" / language
    shown = re.findall(r"^    (.*)$|^$", (folder / "README.md").read_text("utf-8"), re.MULTILINE)
    text = "\n".join(shown).replace("http://127.0.0.1:8420", demo)
    if language == "python":
        command = [sys.executable, "-u", "-c", text]
    else:
        package = f'"{folder / "src" / "index.ts"}"'
        program = tmp_path / "readme.mts"
        program.write_text(text.replace('"motion-gateway-client"', package), "utf-8")
        command = [str(node()), str(program)]
    said = tmp_path / "said"
    with said.open("w") as output, running(command, output):
        until(lambda: "body.move.succeeded" in said.read_text(), "it follows the move")


def test_the_tour_shows_a_client_that_runs_as_make_has_installed_it(demo: str) -> None:
    page = (ROOT / "docs" / "tour.md").read_text("utf-8")
    shown = re.search(r"^    from motion_gateway_client .*\n(?:    .*\n|\n)*", page, re.MULTILINE)
    assert shown
    text = dedent(shown[0]).replace("http://127.0.0.1:8420", demo)
    done = subprocess.run(  # noqa: S603
        [sys.executable, "-c", text], env=ENVIRONMENT, capture_output=True, text=True, check=True, timeout=60
    )
    assert "500" in done.stdout
    assert "-e . -e clients/python" in (ROOT / "Makefile").read_text("utf-8")


PAGES = {
    "README.md": ("\n## Try it", "\n## ", 1),
    "docs/api.md": ("# ", "\n## Limits", 10),
    "docs/backup.md": ("# ", "\n## The text", 6),
    "docs/body-settings.md": ("# ", "\n**A change", 2),
    "docs/programs.md": ("\n## Check", "\n## Memories", 9),
    "docs/recovery.md": ("# ", "\n## The stop circuit", 3),
    "docs/scara.md": ("\n## Configuration", "\n**The record**", 5),
    "docs/tour.md": ("\n## Try it", "\n## ", 20),
}
"""The part of a page whose commands are tried with a demo, and how many there are at least."""
STEP_OF_A_PAGE = re.compile(
    r"^(?: {4})?((?:curl|jq|printf) .*|(?:\.venv/bin/)?motion-gateway [a-z].*)$", re.MULTILINE
)
WITH_KEYS = re.compile("https://|motion-gateway keys ")
"""The demo knows no keys: tests/app/commands/test_keys.py has these."""
ELSEWHERE = (
    "docs/install.md",
    "docs/proxy.md",
    "docs/promises.md",
    "docs/configuration.md",
    "docs/simulator.md",
    "docs/plant.md",
    "docs/mqtt.md",
    "docs/opcua.md",
    "docs/recordings.md",
)
"""Their commands install, or are of the simulator, a plant, a bridge or recordings: others test these."""


LONGEST_S = 240.0
"""A restore to the demo takes a minute, on a machine with other work more."""
IN_ANOTHER_TEST = re.compile("motion-gateway (init|check|serve|keys) ")
"""Commands for hardware and for a machine: tests/app/commands and tests/e2e have them."""


def steps_in(text: str) -> list[str]:
    """The commands of a text, in their order, each in one line."""
    joined = re.sub(r"\|\n +", "| ", text.replace("\\\n", " "))
    return [step for step in STEP_OF_A_PAGE.findall(joined) if not WITH_KEYS.search(step)]


def steps_of(page: str) -> list[str]:
    """The commands of the part of a page that is tried."""
    begin, end, least = PAGES[page]
    text = (ROOT / page).read_text("utf-8")
    begun = text.index(begin)
    steps = steps_in(text[begun : text.index(end, begun + 1)])
    assert len(steps) >= least
    return steps


@pytest.mark.parametrize(
    "page", ["README.md", *sorted(f"docs/{page.name}" for page in (ROOT / "docs").glob("*.md"))]
)
def test_no_command_of_a_page_is_left_out(page: str) -> None:
    shown = [] if page in ELSEWHERE else steps_in((ROOT / page).read_text("utf-8"))
    tried = steps_of(page) if page in PAGES else []
    assert [step for step in shown if step not in tried and not IN_ANOTHER_TEST.search(step)] == []


def program_of_the_page() -> str:
    page = (ROOT / "docs/programs.md").read_text("utf-8")
    return dedent(page[page.index("    ; example 2") : page.index("Addresses count")])


class Learnt(dict[str, str]):
    """Values that only an answer tells, such as ID, by the placeholder that a page has for them."""

    def note(self, answer: str) -> None:
        """Note what an answer tells."""
        for shown, pattern in (("/ID/", r'"id": ?"(\w+)"'), ('"5c6f..."', r'(?im)^etag: (".*")')):
            if found := re.search(pattern, answer):
                self[shown] = f"/{found[1]}/" if shown[0] == "/" else found[1]

    def filled_in(self, step: str) -> str:
        """Fill the values of earlier answers into a command, as a reader would."""
        for shown, told in self.items():
            step = step.replace(shown, told)
        return step


@pytest.mark.prove
@pytest.mark.skipif(which("curl") is None, reason="there is no curl here")
@pytest.mark.parametrize("page", PAGES)
def test_each_command_of_a_page_does_what_it_shows(tmp_path: Path, page: str) -> None:
    """One that follows what happens is left after a while; each of the others succeeds."""
    (tmp_path / "lift.txt").write_text(program_of_the_page(), "utf-8")
    with running_demo(tmp_path) as demo:
        try_out(steps_of(page), demo, tmp_path)


def try_out(steps: list[str], demo: str, folder: Path) -> None:
    environment = {**ENVIRONMENT, "MOTION_GATEWAY_URL": demo}
    command_line, learnt = str(Path(sys.executable).with_name("motion-gateway")), Learnt()
    for step in steps:
        follows = step.endswith((" watch", "/events/stream"))
        if not re.search("/position|/jogs/", step):
            until(lambda: httpx.get(f"{demo}/bodies/3F").json()["moving"] is False, "the motor stands")
        shown = re.sub(r"^(\.venv/bin/)?motion-gateway", command_line, learnt.filled_in(step))
        shown = shown.replace("http://127.0.0.1:8420", demo)
        words = shown.replace("curl", "curl --fail-with-body --silent", 1)
        done = subprocess.run(  # noqa: S602
            f"timeout 3 {words}" if follows else words,
            shell=True,
            cwd=folder,
            env=environment,
            capture_output=True,
            text=True,
            timeout=LONGEST_S,
        )
        assert done.returncode == (124 if follows else 0), (step, done.stdout, done.stderr)
        learnt.note(done.stdout)
