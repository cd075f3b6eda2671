"""The trial of a JOG, which has no end of its own: bounded on all sides, and ended by a stop that is seen."""

import asyncio
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import pytest

from commissioning.bench import Places
from commissioning.fics_deeds import HARDWARE_STOP, JOG_S
from commissioning.findings import Result
from commissioning.report import Outcome, next_step
from commissioning.run import MAY_MOVE, commission
from gateway.config import parse
from simulator.fics.layout import Layout
from simulator.fics.line import SimulatedFics, build_line
from tests.commissioning.benches import CONFIG, all_allowed, fics, result_of
from tests.commissioning.test_quirks import homed, in_mode_3
from tests.plants import in_virtual_time
from tests.simulated_line import SimulatedCable

NEAR = Places(140, 180)
STOP = b"JOG X\r"
TWO_UNITS = CONFIG + '[[lines.robot.units]]\nnumber = 2\naxes = ["U", "V"]\n'

each_mode = pytest.mark.parametrize("prepare", [homed, in_mode_3])


class Bent:
    """A robot of which a test sees or loses what is written."""

    def __init__(self, machine: SimulatedFics, on_write: Callable[["Bent", bytes], bool]) -> None:
        self.machine, self.cable = machine, SimulatedCable(machine)
        write = self.cable.write

        def written(data: bytes) -> None:
            if on_write(self, data):
                write(data)

        self.cable.write = written  # type: ignore[method-assign]

    async def commissioned(self, text: str = CONFIG) -> Any:
        line: Any = next(table for table in parse(text, "gateway.toml").lines if table.id == "cell")
        return await commission(line, all_allowed(self.machine, NEAR), open_transport=lambda _: self.cable)


def prepared(prepare: Callable[[SimulatedFics], None]) -> SimulatedFics:
    machine = fics()
    prepare(machine)
    return machine


def bounds(machine: SimulatedFics) -> tuple[float, float, float]:
    """The soft limits of the axis that jogs, and its maximum speed."""
    axis = machine.robot.unit.users[0]
    return axis.minus_limit, axis.plus_limit, axis.top_speed


def starts(data: bytes) -> bool:
    return data.startswith(b"JOG") and data != STOP


@each_mode
@in_virtual_time
async def test_a_jog_runs_slowly_between_the_places_and_all_is_as_before_after_it(prepare: Any) -> None:
    seen: list[tuple[float, float, float]] = []

    def note(bent: Bent, data: bytes) -> bool:
        if starts(data):
            seen.append(bounds(bent.machine))
        return True

    bent = Bent(prepared(prepare), note)
    before = bounds(bent.machine)
    here = bent.machine.robot.unit.geometry.to_user(bent.machine.robot.unit.at_rest())[0]
    report = await bent.commissioned()
    assert result_of(report, "jog-mode").result is Result.AGREES
    ((low, high, speed),) = seen
    assert {round(low, 1), round(high, 1)} <= {NEAR.one, round(here, 1), NEAR.other}
    assert speed == pytest.approx(0.05 * before[2], rel=0.01)
    assert bounds(bent.machine) == before
    assert bent.machine.robot.job is None


@in_virtual_time
async def test_a_jog_that_is_told_as_standing_still_contradicts_the_gateway() -> None:
    machine = prepared(in_mode_3)
    machine.robot.settings = replace(machine.robot.settings, jog_mode="standing")
    report = await Bent(machine, lambda *_: True).commissioned()
    told = result_of(report, "jog-mode")
    assert told.result is Result.CONTRADICTS
    assert next_step(told).endswith("Do not run motion.")


@each_mode
@in_virtual_time
async def test_an_axis_that_does_not_take_its_stop_is_stopped_with_all_that_moves(prepare: Any) -> None:
    bent = Bent(prepared(prepare), lambda _, data: data != STOP)
    report = await bent.commissioned()
    assert result_of(report, "jog-mode").result is Result.AGREES
    assert bent.machine.robot.job is None


@each_mode
@in_virtual_time
async def test_a_robot_that_falls_silent_jogs_no_longer_than_its_time(prepare: Any) -> None:
    times: list[float] = []

    def note(bent: Bent, data: bytes) -> bool:
        loop = asyncio.get_running_loop()
        if starts(data):
            output = bent.machine.take_output
            bent.machine.take_output = lambda now: output(now)[:0]  # type: ignore[method-assign]
        if starts(data) or data == STOP:
            times.append(loop.time())
        return True

    bent = Bent(prepared(prepare), note)
    told = result_of(await bent.commissioned(), "jog-mode")
    assert times[1] - times[0] <= JOG_S + 0.01
    assert bent.machine.robot.job is None
    assert (told.result, told.seen.endswith(HARDWARE_STOP)) == (Result.CONTRADICTS, True)


@each_mode
@in_virtual_time
async def test_an_axis_whose_cable_is_pulled_goes_no_farther_than_the_place(prepare: Any) -> None:
    def pull(bent: Bent, data: bytes) -> bool:
        if starts(data):
            asyncio.get_running_loop().call_later(0.02, bent.cable.unplug)
        return True

    bent = Bent(prepared(prepare), pull)
    report = await bent.commissioned()
    assert report.lost is not None
    assert report.lost.endswith(MAY_MOVE)
    now = asyncio.get_running_loop().time()
    bent.machine.take_output(now + 60)
    unit = bent.machine.robot.unit
    assert bent.machine.robot.job is None
    assert NEAR.one <= unit.geometry.to_user(unit.at_rest())[0] <= NEAR.other


@in_virtual_time
async def test_the_axis_is_that_of_the_unit_that_the_robot_has_selected() -> None:
    machine = build_line(Layout(units=2))
    for unit in machine.robot.units.values():
        for motor in unit.motors:
            motor.homed = motor.ever_homed = True
            motor.at = 1.23
    machine.receive(b"UNT 2\r", 0.0)
    asked: list[str] = []

    async def consent(_subject: str, what: str) -> bool:
        asked.append(what)
        return False

    line: Any = next(table for table in parse(TWO_UNITS, "gateway.toml").lines if table.id == "cell")
    terms = replace(all_allowed(machine, NEAR), consent=consent)
    await commission(line, terms, open_transport=lambda _: SimulatedCable(machine))
    moves = [what for what in asked if "axis" in what and "No axis" not in what and "no axis" not in what]
    assert moves
    assert all("axis U of unit 2" in what for what in moves), moves


def test_what_is_right_as_it_is_needs_no_change() -> None:
    told = Outcome(assumption="jog-mode", result=Result.DIFFERS, seen="ACD tells 2.")
    assert next_step(told).endswith("Nothing has to be changed.")
