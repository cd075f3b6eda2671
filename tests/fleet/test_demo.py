"""The demo of a plant, started as `make plant` starts it, asked as its guide says, and ended by Ctrl-C."""

import re
import shlex
import signal
import socket
import subprocess
from pathlib import Path
from shutil import which

import httpx
import pytest

from tests.e2e.processes import Program, until
from tests.fleet.plants import needs_engine

pytestmark = needs_engine

GUIDE = Path(__file__).parents[2] / "docs/plant.md"
FIRST = 8430


def four_free_ports() -> int:
    """The first of four consecutive ports that are free now."""
    for first in range(21_000, 31_000, 4):
        taken = []
        for port in range(first, first + 4):
            with socket.socket() as it:
                taken.append(it.connect_ex(("127.0.0.1", port)) == 0)
        if not any(taken):
            return first
    raise AssertionError("there are no four ports")


def commands_of_the_guide() -> list[str]:
    """The curls of its first section."""
    section = GUIDE.read_text("utf-8").partition("## What goes which way")[0]
    return re.findall(r"(?m)^    (curl .*)$", section.replace("\\\n", " "))


@pytest.mark.skipif(which("curl") is None, reason="there is no curl here")
def test_the_demo_answers_as_its_guide_says_and_ends_as_a_whole(tmp_path: Path) -> None:
    port = four_free_ports()
    demo = Program(tmp_path / "demo.log", "plant", "--demo", "--port", str(port))
    demo.said("See the whole plant")

    def ready() -> bool:
        try:
            told = httpx.get(f"http://127.0.0.1:{port}/readyz").json()
        except httpx.HTTPError:
            return False
        return bool(told["ready"] and told["gateways"]["online"] == 2)

    until(ready, "both gateways are heard")
    for gateway in (1, 2):
        url = f"http://127.0.0.1:{port + gateway}/readyz"
        until(lambda it=url: httpx.get(it).is_success, "the gateway is ready")  # type: ignore[misc]
    for command in commands_of_the_guide():
        words = shlex.split(command.replace(str(FIRST), str(port)))
        done = subprocess.run([*words, "-sSf"], capture_output=True, text=True, check=False)  # noqa: S603
        assert done.returncode == 0, (command, done.stdout, done.stderr)
    with socket.create_connection(("127.0.0.1", port + 3)):
        pass
    demo.signal(signal.SIGINT)
    assert demo.ended() == 0
    for offset in range(4):
        with socket.socket() as it:
            assert it.connect_ex(("127.0.0.1", port + offset)) != 0, offset


def test_a_port_that_is_taken_is_told_before_anything_is_started(tmp_path: Path) -> None:
    with socket.socket() as other:
        other.bind(("127.0.0.1", 0))
        other.listen()
        port = other.getsockname()[1]
        demo = Program(tmp_path / "demo.log", "plant", "--demo", "--port", str(port))
        assert demo.ended() == 3
        assert f"Port {port} is taken" in demo.words()
