"""Every command of the table is acted out: the simulator calls none of them unknown."""

import pytest

from protocols.rorze.commands import COMMANDS
from protocols.rorze.row import LinkMasterCommand
from tests.contract.hosts import ClockHost


async def _refused_as_unknown(code: str) -> bool:
    """Say whether a body of a robot without belts answers @49 to the first example of a command."""
    host = ClockHost()
    return await host.ask("&3F" + COMMANDS[code].example[0][3:]) == f">&3F{code}@49"


@pytest.mark.anyio
async def test_every_command_is_acted_out() -> None:
    unknown = [
        code
        for code, row in COMMANDS.items()
        if not issubclass(row, LinkMasterCommand) and await _refused_as_unknown(code)
    ]
    assert unknown == []
