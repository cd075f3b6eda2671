"""Lines on the bench: simulators behind a cable, on virtual time, and a configuration that names them."""

import asyncio
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from commissioning.assumptions import Level
from commissioning.bench import Places, Terms
from commissioning.findings import Result
from commissioning.report import Outcome, Report
from commissioning.run import commission
from gateway.config import Config, parse
from simulator.fics.layout import Layout
from simulator.fics.line import SimulatedFics
from simulator.fics.line import build_line as build_fics
from simulator.rorze.line import Rc400Line, build_line
from simulator.truth import TruthLog
from tests.simulated_line import SimulatedCable

CONFIG = """\
[[lines]]
id = "robot"
address = "serial:///dev/ttyUSB0"
# stops are sent at once
[[lines.bodies]]
id = "00"
[[lines.bodies]]
id = "0A"   # lift

[[lines]]
id = "cell"
address = "serial:///dev/ttyUSB1?baud=19200"
protocol = "fics"
[lines.robot]
id = "r1"
[[lines.robot.units]]
number = 1
axes = ["X", "Y", "Z"]
motor_axes = ["A", "B", "Z"]
"""

Machine = Rc400Line | SimulatedFics
BOOT_S = 2.0
QUESTIONS = Terms()
"""Nothing but questions is allowed."""


def rc400() -> Rc400Line:
    """An RC-400 with the bodies of the configuration."""
    return build_line((0x00, 0x0A), 0.0, TruthLog())


def fics() -> SimulatedFics:
    """A robot of one unit, which takes its time to be up."""
    line = build_fics(Layout(units=1))
    line.settings = replace(line.settings, boot_s=BOOT_S)
    return line


MAKES: dict[str, Callable[[], Machine]] = {"robot": rc400, "cell": fics}


OFF_S = 1.0


def all_allowed(machine: Machine, places: Places, off_s: float = OFF_S) -> Terms:
    """People who agree to everything, and switch the power when they are asked to."""

    async def agree(_subject: str, _what: str) -> bool:
        return True

    async def switch(_subject: str, _what: str) -> bool:
        loop = asyncio.get_running_loop()
        await asyncio.sleep(0.3)
        switch_all(machine, loop.time(), on=False)
        await asyncio.sleep(off_s)
        switch_all(machine, loop.time(), on=True)
        await asyncio.sleep(0.3)
        return True

    return Terms(frozenset(Level), agree, switch, places)


def switch_all(machine: Machine, now: float, *, on: bool) -> None:
    """Switch a robot, or a link master with its bodies."""
    (machine.power_on if on else machine.power_off)(now)
    if not isinstance(machine, SimulatedFics):
        for body in machine.axes:
            machine.switch_body(body, on, now)


async def commissioned(
    machine: Machine, terms: Terms = QUESTIONS, text: str = CONFIG, baud: int | None = None
) -> tuple[Report, SimulatedCable]:
    """Commission the line of a machine."""
    line_id = "cell" if isinstance(machine, SimulatedFics) else "robot"
    line: Any = next(it for it in parse(text, "gateway.toml").lines if it.id == line_id)
    cable = SimulatedCable(machine, baud)
    report = await commission(line, terms, open_transport=lambda _: cable)
    return report, cable


def result_of(report: Report, slug: str) -> Outcome:
    """The result of one assumption."""
    return next(it for it in report.results if it.assumption == slug)


def unlike(report: Report) -> dict[str, Result]:
    """All results that are neither agreement nor ignorance."""
    return {
        it.assumption: it.result
        for it in report.results
        if it.result not in (Result.AGREES, Result.CANNOT_TELL)
    }


def config_file(folder: Path, text: str = CONFIG) -> Path:
    """A configuration file."""
    file = folder / "gateway.toml"
    file.write_text(text, "utf-8")
    return file


def with_changes(config: Config, changes: Mapping[str, Any]) -> Config:
    """A configuration with what is proposed for a line or a body, made for all of them."""
    document = config.model_dump(exclude_unset=True, serialize_as_any=True)
    for key, value in changes.items():
        *path, last = key.split(".")
        for line in document["lines"]:
            for table in _tables(line, path):
                table[last] = value
    return Config.model_validate(document)


def _tables(line: dict[str, Any], path: list[str]) -> Iterator[dict[str, Any]]:
    """The tables of a line at a path: the line itself, its robot, or each of its bodies."""
    if not path:
        yield line
    elif path[0] == "bodies":
        yield from line["bodies"]
    else:
        yield line[path[0]]
