"""The commands the simulator does not act out: they answer as if they did not exist."""

import pytest

from protocols.rorze.commands import COMMANDS
from protocols.rorze.row import LinkMasterCommand
from tests.contract.hosts import ClockHost

<<<<<<< HEAD
INTERPOLATION = "H+S H-S HFM HMM HMS HNM HRS HXS HYS"
NOT_ACTED_OUT = set(INTERPOLATION.split())
=======
NOT_ACTED_OUT = {"UAD", "UAS", "UND", "URG", "USG"}
>>>>>>> 2d89957 (Play the manual's examples of interpolation against the simulator)


async def _refused_as_unknown(code: str) -> bool:
    """Whether a body answers @49 to the first example of a command."""
    host = ClockHost()
    return await host.ask("&3F" + COMMANDS[code].example[0][3:]) == f">&3F{code}@49"


@pytest.mark.anyio
<<<<<<< HEAD
async def test_only_interpolation_is_not_acted_out() -> None:
=======
async def test_only_program_commands_are_not_acted_out() -> None:
>>>>>>> 2d89957 (Play the manual's examples of interpolation against the simulator)
    unknown = {
        code
        for code, row in COMMANDS.items()
        if not issubclass(row, LinkMasterCommand) and await _refused_as_unknown(code)
    }
    assert unknown == NOT_ACTED_OUT
<<<<<<< HEAD


@pytest.mark.anyio
async def test_the_coordinates_of_a_robot_with_belts_are_not_acted_out() -> None:
    host = ClockHost()
    await host.command("HTS1")
    assert await host.ask("&3FHLD0:1000,1:-2000") == ">&3FHLD@49"
    assert await host.ask("&3FHLSX:200000,Y:100000") == ">&3FHLS@49"
=======
>>>>>>> 2d89957 (Play the manual's examples of interpolation against the simulator)
