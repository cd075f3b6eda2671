"""An engine that is killed (kill -9) again and again, in processes that share one warm parent.

`python -m tests.e2e.killed_engine CONFIG DATA LIVES SEED` runs the lives; each request that was answered
leaves a line in DATA/answered.
"""

import asyncio
import logging
import os
import signal
import sys
import time
from contextlib import suppress
from pathlib import Path
from random import Random

from gateway.access.principal import EVERYBODY, asking
from gateway.config import Config, load
from gateway.core.errors import GatewayError
from gateway.core.journal.opening import open_journal
from gateway.core.move_record import MoveStatus
from gateway.core.origin import Origin
from gateway.core.targets import AnyCommand, Begun
from gateway.operations import commands
from gateway.plant import Plant
from gateway.rorze.family import Rorze
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import SetPositionEntry

LIVES_S = (0.12, 0.4)
"""From the fork to the kill."""
PER_LIFE = 1_000
"""No life wants more than this."""
LAST_MOVES_S = 60.0


async def live(config: Config, data: Path, life: int) -> None:
    """Want one thing after the other of each body, none of them twice, until it is killed."""
    plant = Plant(config, journal=open_journal(data))
    await plant.start()
    await _ready(plant)
    bodies = plant.family(Rorze).bodies()
    answered = os.open(data / "answered", os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
    await asyncio.gather(
        *(_want(plant, f"/bodies/{body.address}", life, place, answered) for place, body in enumerate(bodies))
    )


async def _ready(plant: Plant) -> None:
    while any(port.state != "ready" for port in plant.ports().values()):  # noqa: ASYNC110  # no event
        await asyncio.sleep(0.005)


async def _want(plant: Plant, path: str, life: int, first: int, answered: int) -> None:
    for number in range(first, PER_LIFE, 8):
        unique = life * PER_LIFE + number
        command: AnyCommand = SetPositionEntry(entry=PositionReference(position=number % 8), pulses=unique)
        if number % 16 == first:
            command = MoveClockwise(distance=unique)
        with suppress(GatewayError):
            told = await commands.do(plant, Origin("killed", f"k{unique}"), path, command)
            moves = [move.id for move in told.moves] if isinstance(told, Begun) else []
            os.write(answered, f"{unique} {' '.join(moves)}\n".encode())
        await asyncio.sleep(0.002)


async def end(config: Config, data: Path) -> None:
    """The last life only looks what has become of the moves of the others."""
    plant = Plant(config, journal=open_journal(data))
    await plant.start()
    await _ready(plant)
    moves = plant.family(Rorze).moves
    for body in plant.family(Rorze).bodies():
        await plant.family(Rorze).stops.stop([body], "immediate")
        for move in moves.log.of(body.address):
            await moves.wait(move.id, LAST_MOVES_S)
            if move.status is MoveStatus.UNKNOWN and not (move.evidence and move.error):
                sys.stdout.write(f"{move.id} is unknown without evidence\n")
    await plant.close()


def main(config_file: str, folder: str, lives: str, seed: str) -> None:
    """Fork and kill."""
    logging.disable(logging.CRITICAL)
    config, data, dice = load(Path(config_file)), Path(folder), Random(int(seed))  # a test's dice
    for life in range(1, int(lives) + 1):
        child = os.fork()
        if not child:
            with asking(EVERYBODY):
                asyncio.run(live(config, data, life))
            os._exit(0)
        time.sleep(dice.uniform(*LIVES_S))
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)
    asyncio.run(end(config, data))


if __name__ == "__main__":
    main(*sys.argv[1:])
