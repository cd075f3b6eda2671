"""Count how often the gateway passes from one of its files to another: `python -m benchmarks.trace_calls`.

The stories run in virtual time against a simulated robot. From the request to its answer, calls are counted
whose file is another than that of the call before, and how often each command is written out.
"""

import sys
from collections import Counter
from inspect import CO_COROUTINE
from pathlib import Path
from types import FrameType
from typing import Any, Self

from protocols.fics.row import FicsCommand
from protocols.table import Spoken
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell, mm

ROOT = Path(__file__).parent.parent
GATEWAY = tuple(str(ROOT / package) for package in ("api", "gateway", "transports"))
TRACED = (*GATEWAY, str(ROOT / "protocols"))
FIRST_INSTRUCTIONS = 6
"""A coroutine that is called stands before these."""


class CallTrace:
    """The calls of a piece of the gateway's work."""

    def __init__(self) -> None:
        self.calls: Counter[str] = Counter()
        """By file and function."""
        self.passes: Counter[tuple[str, str]] = Counter()
        """From file to file."""
        self.written: Counter[int] = Counter()
        """How often each command was written out, by its identity."""
        self._last = ""
        self._commands: list[FicsCommand[Any]] = []
        """Kept alive, so that no identity comes twice."""

    def __enter__(self) -> Self:
        sys.setprofile(self._note)
        return self

    def __exit__(self, *_: object) -> None:
        sys.setprofile(None)

    @property
    def changes_of_file(self) -> int:
        """How often a call went to another file than the one before."""
        return self.passes.total()

    @property
    def files(self) -> int:
        """How many files had a part in it."""
        return len({file for one in self.passes for file in one})

    def _note(self, frame: FrameType, event: str, _: object) -> None:
        code = frame.f_code
        if event != "call" or not code.co_filename.startswith(TRACED):
            return
        if code.co_name.startswith("<") or _is_resumed(frame) or _is_of_the_simulator(frame):
            return
        file = code.co_filename.removeprefix(f"{ROOT}/")
        if self._last not in ("", file):
            self.passes[self._last, file] += 1
        self._last = file
        self.calls[f"{file} {code.co_name}"] += 1
        if code is Spoken.written.__code__ and isinstance(command := frame.f_locals["self"], FicsCommand):
            self._commands.append(command)
            self.written[id(command)] += 1


def _is_resumed(frame: FrameType) -> bool:
    """Whether a coroutine goes on after it was waiting, which is no call."""
    return bool(frame.f_code.co_flags & CO_COROUTINE) and frame.f_lasti > FIRST_INSTRUCTIONS


def _is_of_the_simulator(frame: FrameType) -> bool:
    """Whether the simulator speaks the protocol, not the gateway."""
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


@in_cell()
async def main(cell: Cell) -> None:
    """Print the counts of a first move, and where they come from."""
    trace = await first_move(cell)
    print(f"{trace.files} files, {trace.changes_of_file} changes of file")
    print(f"{len(trace.written)} commands, written out {trace.written.total()} times")
    for (one, other), times in trace.passes.most_common(25):
        print(f"{times:5} {one} -> {other}")
    for call, times in trace.calls.most_common(50):
        print(f"{times:5} {call}")


if __name__ == "__main__":
    main()
