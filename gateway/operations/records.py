"""The records of long work: found by what the work is done to, and cancelled where it is under way."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, TypeVar

from gateway.core.origin import Origin, acting
from gateway.core.rights import Right
from gateway.core.works import Recorded, Works
from gateway.operations.caller import require
from gateway.plant import Plant

R = TypeVar("R", bound=Recorded)


@dataclass(frozen=True)
class Records(Generic[R]):
    """The records of one kind of long work, for callers."""

    find: Callable[[Plant, str], tuple[Works[R], str]]
    """Finds the work by the path of what it is done to, and what that is called there."""
    may_cancel: Right
    leased: bool = True
    """Whether a lease of somebody else keeps a caller from cancelling."""

    async def get(self, plant: Plant, path: str, record_id: str, wait_s: float) -> R:
        """Give a record, or the `current` one; errors as of `Works.get`."""
        require(plant, Right.VIEW, path)
        works, subject = self.find(plant, path)
        return await works.get(subject, record_id, wait_s)

    async def cancel(self, plant: Plant, caller: Origin, path: str) -> R:
        """End what is under way, and give its record.

        :raises NotFound: there is no such thing, or nothing is under way.
        """
        with acting(caller):
            require(plant, self.may_cancel, path, leased=self.leased)
            works, subject = self.find(plant, path)
            return await works.cancel(subject)
