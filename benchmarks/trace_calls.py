"""Count how often the gateway passes from one of its files to another: `python -m benchmarks.trace_calls`.

The stories run in virtual time against a simulated robot, and a simulated body. From the request to its
answer, calls are counted whose file is another than that of the call before, and how often each command is
written out.
"""

import re
import sys
from collections import Counter
from inspect import CO_COROUTINE
from itertools import pairwise
from pathlib import Path
from types import FrameType
from typing import Any, Self

from protocols.fics.row import FicsCommand
from protocols.table import Spoken
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell, mm
from tests.api.stand import RELATIVE, Stand, on_stand

ROOT = Path(__file__).parent.parent
GATEWAY = tuple(str(ROOT / package) for package in ("api", "gateway", "transports"))
TRACED = (*GATEWAY, str(ROOT / "protocols"))
FIRST_INSTRUCTIONS = 6
"""A coroutine that is called stands before these."""


LINE = re.compile(
    r"protocols/|transports/|gateway/fics/(copies|exchange|line|session|upload_state)\.|"
    r"gateway/rorze/(exchange|line|session)\.|"
    r"gateway/core/(admission|errors|exchange|false_replies|fence|gate|line|load|origin|scheduler|"
    r"sequence_lock|session)\."
)
"""The files that carry an exchange over a line: its port, its session and its protocol."""


class CallTrace:
    """The calls of a piece of the gateway's work."""

    def __init__(self) -> None:
        self.files: list[str] = []
        """The file of each call, in turn."""
        self.written: Counter[int] = Counter()
        """Number of times that each command was written out, by its identity."""
        self._commands: list[FicsCommand[Any]] = []
        """Kept alive, so that no identity comes twice."""

    def __enter__(self) -> Self:
        sys.setprofile(self._note)
        return self

    def __exit__(self, *_: object) -> None:
        sys.setprofile(None)

    def passes(self) -> Counter[tuple[str, str]]:
        """Count the calls that went to another file than the one before, by both files."""
        return Counter((one, other) for one, other in pairwise(self.files) if one != other)

    def passes_above_the_line(self) -> Counter[tuple[str, str]]:
        """Count the changes of file as `passes` does; all files that carry an exchange count as one."""
        files = ["the line" if LINE.match(file) else file for file in self.files]
        return Counter((one, other) for one, other in pairwise(files) if one != other)

    def _note(self, frame: FrameType, event: str, _: object) -> None:
        code = frame.f_code
        if event != "call" or not code.co_filename.startswith(TRACED):
            return
        if code.co_name.startswith("<") or _is_resumed(frame) or _is_of_the_simulator(frame):
            return
        self.files.append(code.co_filename.removeprefix(f"{ROOT}/"))
        if code is Spoken.written.__code__ and isinstance(command := frame.f_locals["self"], FicsCommand):
            self._commands.append(command)
            self.written[id(command)] += 1


def _is_resumed(frame: FrameType) -> bool:
    """True if a coroutine goes on after a wait, which is no call."""
    return bool(frame.f_code.co_flags & CO_COROUTINE) and frame.f_lasti > FIRST_INSTRUCTIONS


def _is_of_the_simulator(frame: FrameType) -> bool:
    """True if the simulator speaks the protocol, not the gateway."""
    caller = frame.f_back
    while caller is not None and not caller.f_code.co_filename.startswith(str(ROOT / "simulator")):
        if caller.f_code.co_filename.startswith(GATEWAY):
            return False
        caller = caller.f_back
    return caller is not None


async def first_move(cell: Cell) -> CallTrace:
    """Trace the first move of a robot that is homed, from the request to 202."""
    await cell.move(HOME)
    with CallTrace() as trace:
        answer = await cell.post(f"{UNIT}/moves", {"kind": "absolute", "axes": mm(X=250.0)})
    assert answer.status_code == 202, answer.text
    return trace


async def first_move_of_body(stand: Stand) -> CallTrace:
    """Trace the first move of a body, from the request to 202."""
    await stand.teach_speeds("3F")
    with CallTrace() as trace:
        answer = await stand.post("/bodies/3F/moves", {**RELATIVE, "speed": "high"})
    assert answer.status_code == 202, answer.text
    return trace


def print_counts(what: str, trace: CallTrace) -> None:
    """Print the counts of a first move, and where they come from."""
    passes, above = trace.passes(), trace.passes_above_the_line()
    files, commands = len(set(trace.files)), len(trace.written)
    print(f"{what}: {files} files, {passes.total()} changes of file, {above.total()} above the line")
    print(f"{commands} commands of a robot, written out {trace.written.total()} times")
    for (one, other), times in passes.most_common(40):
        print(f"{times:5} {one} -> {other}")


@in_cell()
async def robot(cell: Cell) -> None:
    """Count the first move of a robot."""
    print_counts("a robot", await first_move(cell))


@on_stand()
async def body(stand: Stand) -> None:
    """Count the first move of a body."""
    print_counts("a body", await first_move_of_body(stand))


if __name__ == "__main__":
    robot()
    body()
