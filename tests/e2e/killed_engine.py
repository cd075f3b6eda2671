"""An engine that is killed (kill -9) again and again, in processes that share one warm parent.

`python -m tests.e2e.killed_engine CONFIG DATA LIVES SEED` runs the lives, with bodies and a robot. Each
request that was answered leaves a line in DATA/answered.
"""

import asyncio
import gc
import logging
import os
import select
import signal
import sys
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from random import Random
from typing import NamedTuple

from gateway.access.principal import EVERYBODY, asking
from gateway.config import Config, load
from gateway.core.errors import GatewayError
from gateway.core.journal.opening import open_journal
from gateway.core.move_record import MoveRecord, MoveStatus
from gateway.core.origin import Origin
from gateway.core.targets import AnyCommand, BegunMoves
from gateway.door import doing, stopping
from gateway.fics.family import Fics
from gateway.plant import Plant
from gateway.rorze.family import Rorze
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveAbsolute
from protocols.fics.variables import SetVariable
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import SetPositionEntry

START_S = 0.08
"""Within this from its fork one life in ten is killed; a life may or may not have begun to work then."""
WORK_S = 0.08
"""Within this from the first answer of its robot the others are killed."""
PATIENCE_S = 2.0
"""A robot may be busy for this time."""
PAUSE_S = 0.002
BUSY_S = 0.02
"""Seconds to wait after a refusal."""
PER_LIFE = 1_000
"""No life wants more than this of the bodies."""
PER_LIFE_OF_ROBOT = 80
STROKE_UM = 40_000
LAST_MOVES_S = 60.0
ROBOT, UNIT = "/robots/r1", "/robots/r1/units/1"


class Wish(NamedTuple):
    """A command that a client sends once, and never again."""

    unique: str
    path: str
    command: AnyCommand


def of_body(path: str, life: int, first: int) -> Iterator[Wish]:
    """Entries of the position table, and moves between them."""
    for number in range(first, PER_LIFE, 8):
        unique = life * PER_LIFE + number
        command: AnyCommand = SetPositionEntry(entry=PositionReference(position=number % 8), pulses=unique)
        if number % 16 == first:
            command = MoveClockwise(distance=unique)
        yield Wish(str(unique), path, command)


def of_robot(life: int) -> Iterator[Wish]:
    """Moves, each to a place of its own, and variables between them."""
    for number in range(PER_LIFE_OF_ROBOT):
        unique = life * PER_LIFE_OF_ROBOT + number
        if number % 2:
            yield Wish(f"r{unique}", ROBOT, SetVariable(number=unique % 100, value=unique))
        else:
            z = unique * 7919 % STROKE_UM / -1000  # far from the last one
            yield Wish(f"r{unique}", UNIT, MoveAbsolute(coordinates=[None, None, z]))


async def live(config: Config, data: Path, life: int, at_work: int) -> None:
    """Want one thing after the other of bodies and robot, none of them twice, until it is killed."""
    plant = Plant(config, journal=open_journal(data))
    await plant.start()
    bodies = [f"/bodies/{body.address}" for body in plant.family(Rorze).bodies()]
    wishes = [of_body(path, life, place) for place, path in enumerate(bodies)]
    answered = os.open(data / "answered", os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o600)
    await asyncio.gather(
        *(_want(plant, "line1", wish, [answered]) for wish in wishes),
        _want(plant, "cell", of_robot(life), [answered, at_work]),
    )
    await asyncio.Event().wait()


async def _ready(plant: Plant, *lines: str) -> None:
    while any(plant.ports()[line].state != "ready" for line in lines):  # noqa: ASYNC110  # no event
        await asyncio.sleep(0.005)


async def _want(plant: Plant, line: str, wishes: Iterator[Wish], told_to: Sequence[int]) -> None:
    await _ready(plant, line)
    for unique, path, command in wishes:
        try:
            told = await doing.do(plant, Origin("killed", f"k{unique}"), path, command)
        except GatewayError:
            await asyncio.sleep(BUSY_S)
            continue
        moves = [move.id for move in told.moves] if isinstance(told, BegunMoves) else []
        for file in told_to:
            os.write(file, f"{unique} {' '.join(moves)}\n".encode())
        await asyncio.sleep(PAUSE_S)


async def begin(config: Config, data: Path) -> None:
    """The first life homes the robot: it moves to no place before."""
    plant = Plant(config, journal=open_journal(data))
    await plant.start()
    await _ready(plant, "line1", "cell")
    told = await doing.do(plant, Origin("killed", "home"), ROBOT, HomeRobot())
    assert isinstance(told, BegunMoves)
    for move in told.moves:
        await plant.family(Fics).moves.log.wait(move.id, LAST_MOVES_S)
    await plant.close()


async def end(config: Config, data: Path) -> None:
    """The last life only looks what has become of the moves of the others."""
    plant = Plant(config, journal=open_journal(data))
    await plant.start()
    await _ready(plant, "line1", "cell")
    await stopping.stop_all(plant, Origin("killed", "stop"), "immediate")
    for family in plant.packages.families.values():
        for log in family.move_logs():
            for place in family.addresses():
                for move in log.of(place):
                    _tell_unless_known(await log.wait(move.id, LAST_MOVES_S))
    await plant.close()


def _tell_unless_known(move: MoveRecord) -> None:
    if not move.status.final:
        sys.stdout.write(f"{move.id} never ends\n")
    if move.status is MoveStatus.UNKNOWN and not (move.evidence and move.error):
        sys.stdout.write(f"{move.id} is unknown without evidence\n")


def main(config_file: str, folder: str, lives: str, seed: str) -> None:
    """Fork and kill."""
    logging.disable(logging.CRITICAL)
    config, data, dice = load(Path(config_file)), Path(folder), Random(int(seed))  # a test's dice
    with asking(EVERYBODY):
        asyncio.run(begin(config, data))
        gc.freeze()  # children share what is there
        killed = 0
        for life in range(1, int(lives) + 1):
            seen, at_work = os.pipe()
            child = os.fork()
            if not child:
                asyncio.run(live(config, data, life, at_work))
                os._exit(1)
            if dice.random() < 0.1:
                time.sleep(dice.uniform(0.0, START_S))
            else:
                select.select([seen], [], [], PATIENCE_S)
                time.sleep(dice.uniform(0.0, WORK_S))
            os.kill(child, signal.SIGKILL)
            killed += os.WIFSIGNALED(os.waitpid(child, 0)[1])
            os.close(seen)
            os.close(at_work)
        asyncio.run(end(config, data))
    sys.stdout.write(f"{killed} killed\n")


if __name__ == "__main__":
    main(*sys.argv[1:])
