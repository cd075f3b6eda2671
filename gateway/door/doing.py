"""Commands of the tables: the effect of each decides how it is carried out."""

from typing import Any

from gateway.core.errors import NotAllowed
from gateway.core.move_record import START_WITHIN_S
from gateway.core.origin import current
from gateway.core.rights import RIGHT_OF
from gateway.core.targets import AnyCommand, Result, Target
from gateway.door.caller import for_caller, require
from gateway.door.keys import not_honoured
from gateway.plant import Plant
from protocols.table import Effect


@for_caller
async def do(
    plant: Plant,
    target: str,
    command: AnyCommand,
    wait_s: float = 0.0,
    start_within_s: float = START_WITHIN_S,
) -> Result:
    """Carry out a command for a caller who has the right; errors as of `do_admitted`.

    :raises NotPermitted: the caller has it not; nothing was sent.
    :raises LeaseRefused: another caller has a lease there; nothing was sent.
    """
    require(plant.access, RIGHT_OF[command.effect], target)
    return await do_admitted(plant, target, command, wait_s, start_within_s)


async def do_admitted(
    plant: Plant,
    target: str,
    command: AnyCommand,
    wait_s: float = 0.0,
    start_within_s: float = START_WITHIN_S,
) -> Result:
    """Carry out a command: a motion makes a move, a stop is seen through to standstill, all else is asked.

    `wait_s` is how long the end of a move is waited for, `start_within_s` how long it may wait to be sent.

    :raises GatewayError: it was not carried out, or that cannot be known; the error says which.
    """
    if command.effect is Effect.STOP:
        return await plant.target(target).stop_by(command)
    addressed = plant.target(target)
    if not command.starts_motion:
        return await addressed.ask(command)
    plant.require_unlatched(addressed.address)
    return await addressed.start_and_wait(command, wait_s, start_within_s)


def read_text(plant: Plant, target: str, text: str) -> AnyCommand:
    """Read a command as it stands on the line, without frame.

    :raises NotAllowed: the configuration has no plain text.
    :raises InvalidRequest: it is not in the table's form.
    """
    if not plant.config.server.raw_commands:
        raise NotAllowed(
            "Plain text commands are switched off; nothing was sent.",
            "Use the command's own route, or set raw_commands in the configuration.",
        )
    return plant.target(target).read(text)


async def do_text(
    plant: Plant, target: Target, text: str, wait: float | None, *, keyed: bool
) -> tuple[Any, Result]:
    """Carry out what a text says; errors as of `read_text` and `do`.

    :raises InvalidRequest: it is no stop, and its sender relies on a key; nothing was sent.
    """
    command = read_text(plant, target.path, text)
    if keyed and command.effect is not Effect.STOP:
        raise not_honoured()
    return command, await do(plant, current(), target.path, command, wait or 0.0)
