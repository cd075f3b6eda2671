"""Every command of the C-HOST manual in both modes, as bytes, at each port: the dialogues in `c-host.txt`.

They are written from the manual. How it writes numbers is lost with its figures: positions have a
point (2-9) and are expected with two decimals, all others in their shortest form. Units 1 and 2 have the axes
X Y Z and @; X and Y of unit 1, a miniSCARA, are converted from the motors A and B, and at their origin stand
at X 150, Y 150.
"""

import re
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import pytest

from protocols.fics.commands import ROWS, read
from protocols.table import WireFault
from simulator.fics.layout import Layout
from simulator.fics.line import LineSettings, build_line
from tests.contract.fics_hosts import CR, PORTS, Host, StoppedClock

STEP = re.compile(r"([23]?)> (.*)|\+([0-9.]+)|(\.\.\.)|(.+)")
PIECES = dict(
    piece.split("\n", 1)
    for piece in Path(__file__).with_name("c-host.txt").read_text("utf-8").split("\n== ")[1:]
)
DIALOGUES = {title: script for title, script in PIECES.items() if not title.startswith("{")}


class Step(NamedTuple):
    """One line of a dialogue: just one of the fields is given, but for `only_in`."""

    only_in: str
    answer: str
    seconds: str
    end: str
    command: str


def steps(script: str) -> Iterator[Step]:
    for line in script.splitlines():
        if line in PIECES:
            yield from steps(PIECES[line])
        elif match := STEP.fullmatch(line):
            yield Step(*match.groups(""))


async def play(host: Host, script: str, mode: str) -> None:
    for step in steps(script):
        if step.command:
            await host.send(step.command.encode() + CR)
        elif step.end:
            await host.finish()
        elif step.seconds:
            await host.wait(float(step.seconds))
        elif step.only_in in ("", mode):
            assert await host.hear() == step.answer.replace("_", " ").encode() + CR


@pytest.mark.anyio
@pytest.mark.parametrize("mode", ["2", "3"])
@pytest.mark.parametrize("port", PORTS)
@pytest.mark.parametrize("title", DIALOGUES)
async def test_it_is_answered_as_the_manual_says(title: str, port: str, mode: str, tmp_path: Path) -> None:
    line = build_line(Layout(units=2, axes="XYZ@"))
    line.robot.inputs[:] = [0x00, 0xA5, 0x0F, 0xFF]
    async with PORTS[port](StoppedClock(line), tmp_path / "fics") as host:
        if mode == "3":
            await play(host, "MOD 3\n> MOD", mode)
        await play(host, DIALOGUES[title], mode)
        # That this answer comes next proves that nothing else was said.
        await play(host, "IDI 2\n> IDI A5", mode)


def test_no_command_is_missing() -> None:
    sent = {step.command for script in DIALOGUES.values() for step in steps(script) if step.command}
    heard: set[type] = set()
    for command in sent:
        with suppress(WireFault):
            heard.add(type(read(command[:3], command[3:].replace(" ", ""))))
    assert set(ROWS) - heard == set()


@pytest.mark.anyio
@pytest.mark.parametrize("ending", ["\r\n", "\r"])
async def test_lines_end_as_set_up_and_may_come_with_either_ending(ending: str, tmp_path: Path) -> None:
    line = build_line(Layout(), settings=LineSettings(terminator="crlf" if "\n" in ending else "cr"))
    async with PORTS["dpram"](StoppedClock(line), tmp_path / "fics") as host:
        await host.send(f"UNT{ending}".encode())
        assert await host.hear() == f"UNT 1,1{ending}".encode()
        await host.send(b"\tU N T 1 \r\n")
        await host.send(b"UNT\r")
        assert await host.hear() == f"UNT 1,1{ending}".encode()
