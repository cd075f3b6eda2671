"""People decide what is done to a machine: nothing is set or moved that was not allowed and agreed to."""

import asyncio
from dataclasses import replace
from typing import Any

import pytest

from commissioning.assumptions import Level
from commissioning.bench import Places, Terms
from commissioning.findings import Result
from commissioning.run import commission
from gateway.config import parse
from protocols.rorze.commands import COMMANDS
from protocols.rorze.link import Request, RequestReader
from protocols.table import Effect
from simulator.fics.line import SimulatedFics
from simulator.fics.quirks import QUIRKS as FICS_QUIRKS
from simulator.rorze.quirks import QUIRKS as RC400_QUIRKS
from tests.commissioning.benches import CONFIG, Machine, all_allowed, commissioned, fics, rc400, result_of
from tests.commissioning.test_quirks import away, homed, in_mode_3
from tests.plants import in_virtual_time
from tests.simulated_line import SimulatedCable

MOVES = (b"LMA", b"LMI", b"JOG", b"JTE", b"POM", b"ORG", b"MMA", b"MMI")
NEAR = Places(0, 200)
PROTOCOLS: dict[Any, str] = {rc400: "rorze", fics: "fics"}


def effects(cable: SimulatedCable) -> set[Effect]:
    """Effects of the commands that were sent to an RC-400."""
    requests = RequestReader().feed(b"".join(cable.written))
    return {
        COMMANDS[it.text[:3]].effect
        for it in requests
        if isinstance(it, Request) and it.text[:3] in COMMANDS and it.text[:3] != "XID"
    }


def agreeing_to(*subjects: str) -> Any:
    """People who agree for some bodies only, and write down what they were asked."""
    asked: list[tuple[str, str]] = []

    async def consent(subject: str, what: str) -> bool:
        asked.append((subject, what))
        return subject in subjects

    return consent, asked


@in_virtual_time
async def test_without_an_answer_nothing_is_set_or_moved() -> None:
    consent, asked = agreeing_to()
    report, cable = await commissioned(rc400(), Terms(frozenset(Level), consent, places=NEAR))
    assert effects(cable) == {Effect.READ}
    assert {subject for subject, _ in asked} == {"00", "0A"}
    assert all(what.endswith("Do it?") for _, what in asked)
    assert result_of(report, "comment-kept").result is Result.CANNOT_TELL


@in_virtual_time
async def test_an_answer_is_for_one_body() -> None:
    consent, _ = agreeing_to("0A")
    _, cable = await commissioned(rc400(), Terms(frozenset(Level), consent, places=NEAR))
    changing = [it for it in cable.written if it[3:6] in (b"9VS", b"2AM", b"5SS", b"5IS", b"XVS")]
    assert changing
    assert {it[1:3] for it in changing} == {b"0A"}


@in_virtual_time
async def test_settings_alone_move_nothing() -> None:
    machine = fics()
    homed(machine)
    terms = replace(all_allowed(machine, Places(140, 180)), allowed=frozenset({Level.SETTINGS}))
    _, cable = await commissioned(machine, terms)
    assert any(it.startswith(b"POF 1") for it in cable.written)
    assert not any(it.startswith(MOVES) for it in cable.written)


@pytest.mark.parametrize("prepare", [homed, in_mode_3])
@in_virtual_time
async def test_a_robot_is_left_as_it_was(prepare: Any) -> None:
    machine = fics()
    prepare(machine)
    robot = machine.robot
    robot.variables[99], robot.unit.positions[5], robot.unit.users[0].percent = 12.5, (1.0, 2.0, 3.0), 70.0
    terms = replace(all_allowed(machine, Places(140, 180)), switch=Terms().switch)
    await commissioned(machine, terms)
    assert robot.variables[99] == 12.5
    assert robot.unit.positions == {5: (1.0, 2.0, 3.0)}
    assert robot.unit.users[0].percent == 70.0
    assert (robot.upload, robot.alarm, robot.job) == (None, None, None)


@in_virtual_time
async def test_a_body_is_left_as_it_was() -> None:
    machine = rc400()
    away(machine)
    before = [axis.settings.comments for axis in machine.axes.values()]
    await commissioned(machine, replace(all_allowed(machine, NEAR), switch=Terms().switch))
    assert [axis.settings.comments for axis in machine.axes.values()] == before
    assert not any(axis.motor.moving for axis in machine.axes.values())


@in_virtual_time
async def test_after_a_contradiction_nothing_is_set_or_moved() -> None:
    machine = rc400()
    RC400_QUIRKS["wrong-mode"](machine)
    report, cable = await commissioned(machine, all_allowed(machine, NEAR))
    assert effects(cable) == {Effect.READ}
    assert "wrong-mode" in (result_of(report, "comment-kept").needed or "")


@in_virtual_time
async def test_with_a_setting_to_be_changed_nothing_moves() -> None:
    machine = fics()
    homed(machine)
    FICS_QUIRKS["turnaround"](machine)
    report, cable = await commissioned(machine, all_allowed(machine, Places(140, 180)))
    assert not any(it.startswith(MOVES) for it in cable.written)
    assert "turnaround" in (result_of(report, "homing-outlasts").needed or "")


@pytest.mark.parametrize("places", [Places(300, 400), Places(0, 1), Places(-100_000, 100_000)])
@in_virtual_time
async def test_a_motor_goes_nowhere_but_between_the_places_and_slowly(places: Places) -> None:
    machine = rc400()
    report, cable = await commissioned(machine, all_allowed(machine, places))
    assert not any(b"2AM" in it for it in cable.written)
    assert result_of(report, "curve-tick").result is Result.CANNOT_TELL


@in_virtual_time
async def test_moves_stay_between_the_places() -> None:
    machine = rc400()
    _, cable = await commissioned(machine, all_allowed(machine, NEAR))
    targets = {int(it[6:]) for it in cable.written if it[3:6] == b"2AM"}
    assert targets == {0, 200}


@pytest.mark.parametrize(
    ("make", "prepare", "places", "moves", "stop"),
    [
        (rc400, away, NEAR, b"2AM", b"5IS"),
        (fics, homed, Places(140, 180), b"LMA", b"AES"),
        (fics, in_mode_3, Places(140, 180), b"LMA", b"AES"),
        (fics, homed, Places(140, 180), b"JOG", b"JOG X\r"),
        (fics, in_mode_3, Places(140, 180), b"JOG", b"JOG X\r"),
    ],
)
@in_virtual_time
async def test_a_trial_that_is_broken_off_leaves_nothing_moving(
    make: Any, prepare: Any, places: Places, moves: bytes, stop: bytes
) -> None:
    machine = make()
    prepare(machine)
    cable = SimulatedCable(machine)
    line = next(it for it in parse(CONFIG, "gateway.toml").lines if it.protocol == PROTOCOLS[make])
    terms = all_allowed(machine, places)
    trying = asyncio.create_task(commission(line, terms, open_transport=lambda _: cable))
    while not (trying.done() or any(moves in it for it in cable.written)):  # noqa: ASYNC110  # no event
        await asyncio.sleep(0.01)
    await asyncio.sleep(0.1)
    assert is_moving(machine)
    trying.cancel()
    await asyncio.gather(trying, return_exceptions=True)
    assert any(stop in it for it in cable.written)
    assert not is_moving(machine)


def is_moving(machine: Machine) -> bool:
    if isinstance(machine, SimulatedFics):
        return machine.robot.job is not None
    return any(axis.motor.moving for axis in machine.axes.values())
