"""The commands the simulator does not act out: they answer as if they did not exist."""

import pytest

from protocols.rorze.commands import COMMANDS
from protocols.rorze.row import LinkMasterCommand
from tests.contract.hosts import ClockHost

ENCODER = "PAD PAS PED PES PJD PJS PKD PKS PLD PLS PRD PRS PSD PSS PTD PTS"
INTERPOLATION = (
    "H+S H-S HAD HAS HCD HCS HDD HDS HFD HFM HFS HLD HLS HMM HMS HNM HPD HPS HRS HTD HTS HXS HYS HZD HZS"
)
PROGRAMS = "UAD UAS UBD UCS UDD UDS UED UND UPD URG USG UWD UWS"
NOT_ACTED_OUT = {*ENCODER.split(), *INTERPOLATION.split(), *PROGRAMS.split()}


async def _refused_as_unknown(code: str) -> bool:
    """Whether a body answers @49 to the first example of a command."""
    return await ClockHost().ask("&3F" + COMMANDS[code].example[0][3:]) == f">&3F{code}@49"


@pytest.mark.anyio
async def test_only_encoder_interpolation_and_program_commands_are_not_acted_out() -> None:
    unknown = {
        code
        for code, row in COMMANDS.items()
        if not issubclass(row, LinkMasterCommand) and await _refused_as_unknown(code)
    }
    assert unknown == NOT_ACTED_OUT
    assert {code[0] for code in unknown} <= set("PQHU")
