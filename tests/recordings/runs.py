"""Runs by seed on a bad wire, recorded: clients, faults, losses of power, a cable that is pulled."""

import asyncio
import secrets
from contextlib import suppress
from functools import cache
from pathlib import Path
from random import Random
from typing import Any, Final
from unittest.mock import patch

from gateway.access.principal import EVERYBODY, asking
from gateway.core import origin
from gateway.core.errors import GatewayError
from gateway.core.operation import Operation, names_in
from gateway.core.origin import Origin, acting
from gateway.door.calls import carry_out
from gateway.door.table import operations
from recordings.replaying import run_loop
from simulator.faults import Direction, Switch
from tests.fault_simulator.families import Family, Fics, Rorze, Wish
from tests.fault_simulator.seed import _WORST, BAUD
from tests.recordings.taking import recorded, virtual_clocks
from tests.simulated_line import SimulatedCable
from tests.simulation.test_faulty_line import InOrder
from tests.tested_plant import TestedPlant

WISHES: Final = 60
CLIENTS: Final = 3
SET_UP_S, GET_WELL_S = 1.0, 20.0
PLACES: Final[dict[str, tuple[str, ...]]] = {
    "bodies": ("/bodies/{body_id}",),
    "groups": ("/groups/{group_id}",),
    "robots": ("/robots/{robot_id}/units/{unit}", "/robots/{robot_id}"),
}
BYTE_TIME_S: Final = 10 / BAUD


def family_of(seed: int) -> Family:
    return Rorze(seed) if seed % 4 < 2 else Fics(mode=seed % 4, units=1 + seed // 4 % 2)


@cache
def _operation(places: tuple[str, ...], request: type[Any]) -> Operation:
    fitting = (f"{place}/commands/{request.name()}" for place in places)
    by_path = {operation.path: operation for operation in operations() if operation.verb == "POST"}
    return next(by_path[path] for path in fitting if path in by_path)


@cache
def _named(name: str) -> Operation:
    return next(operation for operation in operations() if operation.name == name)


def asked(wish: Wish) -> tuple[Operation, dict[str, Any]]:
    """The operation that a wish is, and its values."""
    _, kind, *names = wish.path.split("/")
    operation = _operation(PLACES[kind], type(wish.command))
    values: dict[str, Any] = dict.fromkeys(names_in(operation.path)[:1], names[0])
    if "unit" in names_in(operation.path):
        values["unit"] = int(names[-1]) if "units" in names else 1
    return operation, {**values, str(operation.request_name): wish.command}


class Run:
    """One run: it always does the same."""

    def __init__(self, seed: int) -> None:
        self.dice = Random(seed)
        self.family = family_of(seed)
        self.cable = SimulatedCable(self.family.machine, BAUD)
        self.faults = InOrder(Random(seed + 1))
        machine: Any = self.family.machine
        machine.faults = machine._wire._faults = self.faults
        self.plant = TestedPlant(
            self.family.config, open_transport=lambda _: self.cable, rng=Random(seed + 2)
        )
        self.left = WISHES

    async def record(self, folder: Path) -> Path:
        await self.plant.start()
        try:
            await asyncio.sleep(SET_UP_S)
            self._spoil()
            chaos = asyncio.create_task(self._chaos())
            await asyncio.gather(*(self._client(number) for number in range(CLIENTS)))
            chaos.cancel()
            await asyncio.gather(chaos, return_exceptions=True)
            self.faults.clear()
            self.cable.plugged_in = True
            self.family.restore(self._touched(), asyncio.get_running_loop().time())
            await asyncio.sleep(GET_WELL_S)
            return await recorded(self.plant, folder)
        finally:
            await self.plant.close()

    def _touched(self) -> Any:
        cable: Any = self.cable
        cable.turn = cable._turn
        return cable

    def _spoil(self) -> None:
        for fault, worst in _WORST.items():
            for direction, most in zip(Direction, worst, strict=True):
                if most and self.dice.random() < 0.7:
                    share = self.dice.uniform(0.2, 1.0) * most
                    self.faults.set(Switch(fault, direction, share, delay_s=0.03, spread_s=0.5))

    async def _client(self, client: int) -> None:
        while self.left > 0:
            self.left -= 1
            dice, number = self.dice, self.left
            if dice.random() < 0.08:
                operation, values = _named("stopAll"), dict[str, Any]()
            else:
                operation, values = asked(self.family.wish(dice))
            with asking(EVERYBODY), acting(Origin(f"client {client}", f"r{number}")), suppress(GatewayError):
                await carry_out(self.plant, operation, values)
            await asyncio.sleep(dice.uniform(0.0, 0.5))

    async def _chaos(self) -> None:
        while True:
            await asyncio.sleep(self.dice.uniform(1.0, 8.0))
            loop = asyncio.get_running_loop()
            if self.dice.random() < 0.7:
                off_s = self.family.upset(self._touched(), self.dice, loop.time())
                await asyncio.sleep(off_s)
                self.family.restore(self._touched(), loop.time())
            else:
                self.cable.unplug()
                await asyncio.sleep(self.dice.uniform(0.1, 2.0))
                self.cable.plugged_in = True


def record_run(seed: int, folder: Path) -> Path:
    """Record one run in virtual time."""
    drawn = Random(seed)
    with (
        virtual_clocks(),
        patch.object(secrets, "token_hex", lambda size: drawn.randbytes(size).hex()),
        patch.object(origin, "_DIGITS", drawn),
    ):
        return run_loop(Run(seed).record(folder))
