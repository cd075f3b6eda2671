"""A simulator that behaves as a real line did when it was commissioned: read from the report."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any, Final

from protocols.fics.status import STATUS_BITS
from simulator.faults import Direction, Fault, Switch
from simulator.fics.layout import Layout
from simulator.fics.line import SimulatedFics
from simulator.fics.line import build_line as build_fics
from simulator.fics.quirks import QUIRKS as FICS_QUIRKS
from simulator.rorze.line import Rc400Line, build_line
from simulator.rorze.quirks import QUIRKS as RC400_QUIRKS

OTHERWISE: Final = ("differs", "contradicts")
MEASURED: Final = ("late-replies", "turnaround", "copies-of-replies", "copies-of-answers")
"""Differences that are made as they were measured, not as a quirk makes them."""
LATEST_S: Final = 600.0
"""No reply is later in seconds."""
LATE_TIMES: Final = 3.0
"""Multiple of the usual reply time beyond which a reply was a late one."""


@dataclass(frozen=True)
class Likeness:
    """A line, as a report tells of it."""

    report: Mapping[str, Any]

    @property
    def is_robot(self) -> bool:
        """Tell whether the line has a robot."""
        return bool(self.report["protocol"] == "fics")

    @property
    def title(self) -> str:
        """How the simulator is called."""
        return f"{'Fics' if self.is_robot else 'RC-400'} like line {self.report['line']}"

    def bodies(self) -> list[int]:
        """The body numbers of the line."""
        return [int(body["id"], 16) for body in self.report["table"]["bodies"]]

    def layout(self) -> Layout:
        """The units of the robot, all with the axes of the first."""
        units: Sequence[Any] = self.report["table"]["robot"]["units"]
        return Layout(units=max(unit["number"] for unit in units), axes="".join(units[0]["axes"]))

    def turn_rc400(self, line: Rc400Line) -> Rc400Line:
        """Let a line be as the report tells."""
        self._turn(line, RC400_QUIRKS)
        line.settings = replace(line.settings, reply_delay_s=self._usual_s())
        if (introducer := self._right("introducer")) not in (None, "&"):
            line.settings = replace(line.settings, introducers=introducer)
        if self._right("stop_mode") == "after_reply":
            RC400_QUIRKS["interjection"](line)
        if self._right("half_commands") == "line_ends":
            RC400_QUIRKS["half-command"](line)
        return line

    def turn_fics(self, line: SimulatedFics) -> SimulatedFics:
        """Let a robot be as the report tells."""
        self._turn(line, FICS_QUIRKS)
        line.settings = replace(line.settings, reply_delay_s=self._usual_s())
        if bits := self._right("robot.status_bits"):
            if sorted(bits) != sorted(STATUS_BITS):
                raise ValueError("these are no status bits")
            line.robot.settings = replace(line.robot.settings, status_bits=tuple(bits))
        if self._right("terminator") == "crlf":
            FICS_QUIRKS["robot-terminator"](line)
        return line

    def try_out(self) -> None:
        """Make a machine, and turn it: a report of nonsense fails in that.

        :raises LookupError: as TypeError, AttributeError and ValueError: no machine can be so.
        """
        if self.is_robot:
            self.turn_fics(build_fics(self.layout()))
        else:
            self.turn_rc400(build_line(self.bodies(), 0.0))

    def _turn(self, line: Any, quirks: Mapping[str, Callable[[Any], None]]) -> None:
        for result in self.report["results"]:
            slug = result["assumption"]
            if result["result"] in OTHERWISE and slug in quirks and slug not in MEASURED:
                quirks[slug](line)
        for switch in self.faults():
            line.faults.set(switch)

    def faults(self) -> list[Switch]:
        """The faults that make replies late or doubled as often, and by as much, as was measured."""
        times, copies = self._times("replies_s"), self._times("copies_s")
        usual = self._usual_s()
        late = [time_s > LATE_TIMES * usual + 0.05 for time_s in times]
        first = sum(now and not before for before, now in pairwise([False, *late]))
        faults = []
        if first:  # those behind it were held up by it
            switch = Switch(Fault.LATE, Direction.REPLIES, first / len(times), holds_up=True)
            faults.append(replace(switch, delay_s=max(times) - usual))
        if copies:
            switch = Switch(Fault.DOUBLED, Direction.REPLIES, len(copies) / len(times), delay_s=min(copies))
            faults.append(replace(switch, spread_s=max(copies) - min(copies)))
        return faults

    def _usual_s(self) -> float:
        times = sorted(self._times("replies_s"))
        return times[len(times) // 2] if times else 0.0

    def _times(self, name: str) -> list[float]:
        times = [float(time_s) for time_s in self.report["measured"][name]]
        if not all(0.0 <= time_s <= LATEST_S for time_s in times):
            raise ValueError(f"{name} are no times")
        return times

    def _right(self, key: str) -> Any:
        """The value of a setting that is right on the line: as proposed, or as the line's table has it."""
        settings = (result["setting"] for result in self.report["results"] if result["setting"] is not None)
        table: Any = self.report["table"]
        for part in key.split("."):
            table = table.get(part)
        return next(
            (
                setting["proposed"]
                for setting in settings
                if setting["key"] == key and setting["proposed"] is not None
            ),
            table,
        )


def read_likeness(path: Path) -> Likeness:
    """Read a report of `motion-gateway commission`.

    :raises ValueError: it cannot be read, or is none.
    """
    try:
        likeness = Likeness(json.loads(path.read_text("utf-8")))
        _ = likeness.title
        likeness.try_out()
    except OSError as error:
        raise ValueError(f"{path} cannot be read: {error.strerror}") from None
    except (LookupError, TypeError, AttributeError, ValueError, RecursionError):
        raise ValueError(f"{path} is no report of motion-gateway commission") from None
    return likeness
