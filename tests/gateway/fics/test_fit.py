"""Commands that fit a unit: its axes and no others, and whole pulses where it counts pulses."""

from typing import Any

import pytest

from gateway.core.errors import InvalidRequest
from gateway.fics.axes import UnitAxes
from gateway.fics.settings import require_fit
from protocols.fics.homing import SetHomingOffsets, SetHomingTypes
from protocols.fics.jog import StartJog, StopJog
from protocols.fics.notation import AxisSystem
from protocols.fics.row import FicsCommand
from protocols.fics.soft_limits import SetUpperSoftLimits
from protocols.fics.speeds import SetMaximumSpeeds, SetSelfStartSpeeds, SetSpeedPercent
from protocols.fics.status import GetAxisStatus
from tests.api.robots.cell import Cell, in_cell


def odd_unit(cell: Cell) -> UnitAxes:
    """A unit whose first axis counts pulses, with one motor."""
    systems = {"W": AxisSystem.PULSE, "@": AxisSystem.DEGREE, "A": AxisSystem.PULSE}
    return UnitAxes("r1", 3, ["W", "@"], ["A"], systems)


FITTING = (
    SetSpeedPercent(percents=[1.5, 2.5]),
    SetMaximumSpeeds(speeds=[1.5, 2.5]),
    SetUpperSoftLimits(coordinates=[7, 1.5]),
    SetHomingTypes(types=[6]),
    SetHomingOffsets(coordinates=[-3]),
    StopJog(axis="A"),
    StartJog(axis="@", direction="+"),
    GetAxisStatus(),
)
UNFIT = (
    (SetSpeedPercent(percents=[1, 2, 3]), "r1/units/3 has the axes W, @, and 3 percents were given"),
    (SetSelfStartSpeeds(speeds_pps=[1, 2]), "r1/units/3 has the axes A, and 2 speeds_pps were given"),
    (SetHomingTypes(types=[None, 1]), "r1/units/3 has the axes A, and 2 types were given"),
    (SetUpperSoftLimits(coordinates=[1.5]), "Axis W: pulses are whole, 1.5 is not"),
    (SetHomingOffsets(coordinates=[0.25]), "Axis A: pulses are whole, 0.25 is not"),
    (StopJog(axis="X"), "axis: r1/units/3 has the axes W, @, A; "),
)


@in_cell()
async def test_what_fits_is_let_through(cell: Cell) -> None:
    for command in FITTING:
        require_fit(odd_unit(cell), command)


@pytest.mark.parametrize(("command", "says"), UNFIT)
def test_what_does_not_fit_is_refused_with_its_field(command: FicsCommand[Any], says: str) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        with pytest.raises(InvalidRequest) as refusal:
            require_fit(odd_unit(cell), command)
        assert refusal.value.detail.startswith(says)
        assert refusal.value.detail.endswith("nothing was sent.")

    story()
