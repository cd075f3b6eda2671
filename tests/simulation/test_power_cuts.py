"""The power of a robot is cut at every gap before every kind of motion: no motion goes unnoticed.

The simulator's truth is the judge. A robot that has lost its power has forgotten its unit, its speeds and its
origins, and does not say so: a motion before a person has acknowledged that may hurt people.
"""

import asyncio
from collections.abc import Awaitable, Callable
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import pytest

from gateway.core.errors import GatewayError, PowerCycled
from gateway.core.move_record import MoveStatus
from gateway.fics.watch import HEALTH_POLL_S
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StepAxis
from protocols.fics.macros import RunMacro
from protocols.fics.moves import MoveAbsolute, MoveRelative, MoveToPosition
from protocols.fics.row import FicsCommand
from protocols.fics.speeds import SetSpeedPercent
from tests.drawing import drawn
from tests.fics_plants import FicsRig, fics_rig
from tests.virtual_time import run_virtual

CUTS_S = (0.05, 0.7, 3.0)
"""Shorter than a question waits for its answer, longer than that, and longer than its repetition."""
BAUD = 9600
RECOVERED_WITHIN_S = 4 * HEALTH_POLL_S
AWAY = RunMacro(macro="PCK", arguments=[100.0, 100.0, -20.0])
MOVES: dict[str, FicsCommand[Any]] = {
    "relative": MoveRelative(coordinates=[None, None, -5.0]),
    "absolute": MoveAbsolute(coordinates=[None, None, -20.0]),
    "position": MoveToPosition(position=1),
    "home": HomeRobot(),
    "step": StepAxis(axis="Z", steps=-100),
    "macro": AWAY,
}
Begin = Callable[[FicsRig, int], Awaitable[object]]


async def _jog(rig: FicsRig, unit: int) -> None:
    await rig.robot.jogs.start(unit, "Z", "-")


async def _join(rig: FicsRig, unit: int) -> None:
    await rig.robot.jogs.start(unit, "A" if unit == 1 else "X", "+")


def _move(kind: str) -> Begin:
    async def begin(rig: FicsRig, unit: int) -> object:
        return await rig.move(MOVES[kind], unit)

    return begin


@dataclass
class Motion:
    """One kind of motion, and what comes before it."""

    begin: Begin
    before: Begin | None = None


MOTIONS = {kind: Motion(_move(kind)) for kind in MOVES} | {"jog": Motion(_jog), "join": Motion(_join, _jog)}


@dataclass
class Seen:
    """The course of one attempt."""

    frames: list[str]
    """Frames that were sent in the attempt."""
    unknown: list[str]
    """Frames that moved the robot after a loss of power that was not acknowledged."""
    succeeded: bool
    found: bool
    """True if the gateway knew of the loss when the next motion was wanted."""


async def attempt(motion: Motion, mode: int, units: int, cut: tuple[int, float] | None) -> Seen:
    """Begin a motion of the last unit, and cut the power when a number of its frames have arrived."""
    async with fics_rig(mode=mode, units=units, baud=BAUD) as rig:
        await _get_ready(rig, units)
        if motion.before is not None:
            await motion.before(rig, units)
        sent = len(rig.cable.written)
        if cut is not None:
            frames, for_s = cut
            rig.cable.after(frames, lambda: rig.brown_out(for_s))
        try:
            outcome = await motion.begin(rig, units)
        except GatewayError:
            outcome = None
        frames_sent = rig.cable.frames(sent)
        if cut is not None:
            await asyncio.sleep(RECOVERED_WITHIN_S)
            with suppress(PowerCycled):
                await rig.move(MOVES["relative"], units)
        succeeded = getattr(outcome, "status", None) is MoveStatus.SUCCEEDED
        return Seen(frames_sent, _moved_without_power_known(rig), succeeded, rig.robot.power_cycled)


def _moved_without_power_known(rig: FicsRig) -> list[str]:
    """The commands that have set axes moving since the power was lost."""
    facts = iter(rig.machine.truth.since(0))
    for fact in facts:
        if fact.kind == "power":
            break
    return [str(fact.facts["name"]) for fact in facts if fact.kind == "motion_start"]


async def _get_ready(rig: FicsRig, unit: int) -> None:
    """Home the robot, set a speed, and move it once: so there is something to lose, and answers to mix up."""
    rig.fics.units[unit].positions[1] = (10.0, 10.0, -10.0) if unit == 2 else (200.0, 60.0, -10.0)
    await rig.move(HomeRobot())
    await rig.robot.ask(SetSpeedPercent(percents=[50.0, 50.0, 50.0]), unit)
    if unit == 1:
        await rig.move(MoveAbsolute(coordinates=[200.0, 50.0]), unit)
    await rig.move(MOVES["relative"], unit)


@pytest.mark.parametrize("units", [1, 2])
@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("kind", drawn(MOTIONS, 2, "power cuts"))
def test_nothing_moves_after_a_loss_of_power_that_nobody_has_acknowledged(
    kind: str, mode: int, units: int
) -> None:
    motion = MOTIONS[kind]
    undisturbed = run_virtual(attempt(motion, mode, units, None))
    assert undisturbed.succeeded or kind in ("jog", "join")
    written = 1 + _place_of_motion(undisturbed.frames)
    for for_s in CUTS_S:
        for frames in range(written + 1):
            seen = run_virtual(attempt(motion, mode, units, (frames, for_s)))
            where = f"{for_s} s after {frames} of {undisturbed.frames[:written]}: {seen.frames}"
            assert seen.unknown == [], where
            assert not seen.succeeded, where
            assert seen.found, where


def _place_of_motion(frames: list[str]) -> int:
    names = ("LM", "POM", "ORG", "JTE", "PCK", "JOG")
    return next(place for place, text in enumerate(frames) if text.startswith(names))
