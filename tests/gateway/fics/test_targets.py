"""Targets of moves, and the moves that need to know where the axes stand."""

import pytest

from gateway.fics.targets import axes_it_needs, furthest_miss, target_of
from protocols.fics.homing import HomeRobot
from protocols.fics.jog import StepAxis
from protocols.fics.motor_axes import MoveMotorsAbsolute, MoveMotorsRelative
from protocols.fics.moves import MoveAbsolute, MoveRelative, MoveToPosition
from protocols.fics.row import FicsCommand
from protocols.table import Ack
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time


@pytest.mark.parametrize(
    ("command", "axes"),
    [
        (MoveAbsolute(coordinates=[1.0, None, 2.0]), "XZ"),  # C-HOST manual 2-6
        (MoveMotorsAbsolute(coordinates=[None, 1.0]), "B"),  # 4-3
        (MoveToPosition(position=1), "XYZ"),  # 2-16
        (MoveRelative(coordinates=[1.0]), ""),  # 2-5
        (MoveMotorsRelative(coordinates=[1.0]), ""),  # 4-2
        (StepAxis(axis="X", steps=1), "X"),  # 2-3: converted
        (StepAxis(axis="A", steps=1), ""),
        (StepAxis(axis="Z", steps=1), ""),
        (HomeRobot(), ""),  # 2-4
    ],
)
def test_h11_a_move_needs_the_axes_whose_places_it_starts_from(command: FicsCommand[Ack], axes: str) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig() as rig:
            unit = rig.robot.unit(1)
            start = dict.fromkeys(unit.names(unit.coordinates_of(command)), 0.0)
            assert axes_it_needs(unit, command, target_of(unit, command, start)) == list(axes)

    story()


@in_virtual_time
async def test_targets_are_given_for_axes_that_are_named() -> None:
    async with fics_rig() as rig:
        unit, start = rig.robot.unit(1), {"X": 1.0, "Y": None, "Z": 3.0}
        assert target_of(unit, MoveAbsolute(coordinates=[None, 5.0]), start) == {"Y": 5.0}
        assert target_of(unit, MoveRelative(coordinates=[1.0, 1.0]), start) == {"X": 2.0, "Y": None}
        assert target_of(unit, MoveToPosition(position=1), start, [None, 7.0]) == {"Y": 7.0}
        assert target_of(unit, MoveToPosition(position=1), start) is None
        assert target_of(unit, HomeRobot(), start) is None


def test_a_miss_is_known_only_where_every_place_is() -> None:
    assert furthest_miss({"X": 1.0, "Y": 2.0}, {"X": 1.5, "Y": 2.0, "Z": 9.0}) == 0.5
    assert furthest_miss({"X": 1.0}, {"X": None}) is None
    assert furthest_miss({"X": 1.0}, None) is None
    assert furthest_miss(None, {"X": 1.0}) is None


def test_a_miss_has_no_noise_of_binary_numbers() -> None:
    assert furthest_miss({"X": 0.1 + 0.2}, {"X": 0.3}) == 0


@pytest.mark.parametrize(("start", "amount"), [(0.865, 0.01), (0.875, 0.01), (-0.995, -0.01), (1.005, 0.005)])
def test_what_is_rounded_for_display_at_both_ends_is_no_miss(start: float, amount: float) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(units=2) as rig:
            await rig.move(HomeRobot())
            await rig.move(MoveAbsolute(coordinates=[start]), unit=2)
            move = await rig.move(MoveRelative(coordinates=[amount]), unit=2)
            assert (move.status, move.end_cause) == ("succeeded", "normal")

    story()
