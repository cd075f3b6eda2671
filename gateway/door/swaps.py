"""Swapped controllers: what answers after a loss of power is compared with its backup of the last night."""

import asyncio
import logging
from collections.abc import Mapping, Sequence
from types import ModuleType
from typing import Final

from gateway.core.backup_record import Difference
from gateway.core.errors import GatewayError, NotFound
from gateway.core.event_types import Swap
from gateway.core.events import Event
from gateway.door.backups import ENDING, folder_of_nights, plan
from gateway.door.doors import doors
from gateway.families import FAMILIES
from gateway.plant import Plant

log = logging.getLogger(__name__)

LOOK_S: Final = 2.0
"""A controller that has lost its power is looked at after this time, and again until it answers."""
TOLD: Final = 5
_BACKUPS: Final[Mapping[str, ModuleType]] = {
    family.collections[0]: module for family in FAMILIES.values() for module in doors("backups", family)
}
"""Modules with the `signs` of backups, by the kind of part that was backed up."""


class Recognition:
    """Looks at each controller that has lost its power: with another one, its settings are others, too."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._due: dict[str, str] = {}
        """Parts to be looked at: the kind, `body` or `robot`, by the path."""
        plant.events.listeners.append(self._note)

    def _note(self, event: Event) -> None:
        if event.type.endswith(".power_cycled"):
            self._due[event.subject] = event.type.partition(".")[0]

    async def watch(self) -> None:
        """Look at all that lose their power, one after the other, until it is cancelled."""
        while True:
            await asyncio.sleep(LOOK_S)
            for subject in sorted(self._due):
                await self._look(subject, self._due.pop(subject))

    async def _look(self, subject: str, what: str) -> None:
        _, among, address = subject.split("/")
        backups = _BACKUPS[among]
        try:
            wanted = await backups.signs(self._plant, address)
        except (GatewayError, OSError) as error:
            if not isinstance(error, NotFound):
                log.warning("%s was not compared with its backup of the last night: %s", address, error)
            return
        try:
            found = await plan(self._plant, wanted)
        except GatewayError:  # it is looked at again, as long as it is configured
            self._due[subject] = what
            return
        if found.differences:
            told = await self._told(address, found.differences, backups.OF_ANOTHER)
            self._plant.events.publish(f"{what}.swapped", subject, told)

    async def _told(self, address: str, differences: Sequence[Difference], certain: str) -> Swap:
        own = folder_of_nights(self._plant) / address.partition(".")[0]
        nights = await asyncio.to_thread(lambda: [file.stem for file in own.glob(f"*{ENDING}")])
        told = [_told(difference) for difference in differences]
        other = any(certain and (difference.wanted or "").startswith(certain) for difference in differences)
        return Swap(night=max(nights), differing=len(differences), told=told[:TOLD], certain=other)


def _told(difference: Difference) -> str:
    """A difference in the words of the controller: the commands of a body have their names in themselves."""
    name = "" if difference.section == "settings" else f"{difference.section}, {difference.name}: "
    return f"{name}{difference.wanted or '-'} -> {difference.held or '-'}"
