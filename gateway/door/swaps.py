"""Swapped controllers: what answers after a loss of power is compared with its backup of the last night."""

import asyncio
import logging
from collections.abc import Sequence
from typing import Final

from gateway.core.aside import aside
from gateway.core.errors import GatewayError, NotFound
from gateway.core.event_types import Swap
from gateway.core.events import Event
from gateway.core.restore_record import Difference
from gateway.door.backups import (
    ENDING,
    LAST,
    Wanted,
    check_bodies,
    check_robot,
    folder_of_nights,
    for_body,
    for_robot,
    plan,
    text_of_night,
)
from gateway.plant import Plant
from gateway.rorze.backup import Contents
from gateway.rorze.family import Rorze
from protocols.rorze.inputs_outputs import SetOutputs
from protocols.rorze.status import SetUserComment

log = logging.getLogger(__name__)

LOOK_S: Final = 2.0
"""A controller that has lost its power is looked at after this time, and again until it answers."""
TOLD: Final = 5
SPEEDS: Final = ("speed_percent", "motor_speed_percent")
"""Settings of a robot that each loss of power sets to 100 %."""


class Recognition:
    """Looks at each controller that has lost its power: with another one, its settings are others, too."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._due: set[str] = set()
        """The paths of those that are to be looked at."""
        plant.events.listeners.append(self._note)

    def _note(self, event: Event) -> None:
        if event.type in ("body.power_cycled", "robot.power_cycled"):
            self._due.add(event.subject)

    async def watch(self) -> None:
        """Look at all that lose their power, one after the other, until it is cancelled."""
        while True:
            await asyncio.sleep(LOOK_S)
            for subject in sorted(self._due):
                self._due.discard(subject)
                await self._look(subject)

    async def _look(self, subject: str) -> None:
        _, kind, address = subject.split("/")
        is_body = kind == "bodies"
        try:
            wanted = await (_signs_of_body if is_body else _signs_of_robot)(self._plant, address)
        except (GatewayError, OSError) as error:
            if not isinstance(error, NotFound):
                log.warning("%s was not compared with its backup of the last night: %s", address, error)
            return
        try:
            found = await plan(self._plant, wanted)
        except GatewayError:  # it is looked at again, as long as it is configured
            self._due.add(subject)
            return
        if found.differences:
            told = await self._told(address, found.differences)
            self._plant.events.publish(f"{'body' if is_body else 'robot'}.swapped", subject, told)

    async def _told(self, address: str, differences: Sequence[Difference]) -> Swap:
        own = folder_of_nights(self._plant) / address.partition(".")[0]
        nights = await asyncio.to_thread(lambda: [it.stem for it in own.glob(f"*{ENDING}")])
        told = [_told(it) for it in differences]
        other = [it for it in differences if (it.wanted or "").startswith(SetUserComment.code)]
        return Swap(night=max(nights), differing=len(differences), told=told[:TOLD], certain=bool(other))


def _told(it: Difference) -> str:
    """A difference in the words of the controller: the commands of a body have their names in themselves."""
    name = "" if it.section == "settings" else f"{it.section}, {it.name}: "
    return f"{name}{it.wanted or '-'} -> {it.held or '-'}"


async def _signs_of_body(plant: Plant, address: str) -> Wanted:
    """Give a body's settings of the last night, but for the states of its outputs."""
    body = plant.family(Rorze).body(address)
    held = await aside(check_bodies, await text_of_night(plant, body.line.id, LAST))
    if body.number not in held:
        raise NotFound(f"The backup has nothing of {address}.")
    settings = held[body.number].places.get("settings", {})
    kept = {key: it for key, it in settings.items() if not isinstance(it, SetOutputs)}
    return for_body(plant, address, {body.number: Contents({"settings": kept})}, None)


async def _signs_of_robot(plant: Plant, address: str) -> Wanted:
    """Give a robot's settings and positions of the last night, but for the speeds in percent."""
    found = (await aside(check_robot, plant, address, await text_of_night(plant, address, LAST))).without(
        ["variables"]
    )
    for unit in found.units.values():
        unit.settings = {name: it for name, it in (unit.settings or {}).items() if name not in SPEEDS}
    return for_robot(plant, address, found)
