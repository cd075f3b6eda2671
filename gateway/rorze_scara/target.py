"""A SCARA robot as the operations see it."""

from typing import Any, NoReturn

from gateway.core.errors import InvalidRequest
from gateway.core.stops import StopMode
from gateway.core.targets import Stopped, Target, stopped
from gateway.rorze.stops import Stops
from gateway.rorze.targets import STOP_MODES
from gateway.rorze_scara.moves import ScaraMoves
from gateway.rorze_scara.record import ScaraSamples
from gateway.rorze_scara.scara import Scara


class ScaraTarget(Target):
    """A SCARA robot: its commands go to its bodies and its group."""

    stop_modes = STOP_MODES

    def __init__(self, scara: Scara, moves: ScaraMoves, stops: Stops) -> None:
        self.scara = scara
        self.address, self.path, self.log = scara.id, scara.path, moves.log
        self._moves, self._stops = moves, stops

    async def ask(self, command: Any) -> NoReturn:
        """Refuse a single command.

        :raises InvalidRequest: always.
        """
        raise InvalidRequest(
            f"{self.address} takes no single commands ({command.name()}); nothing was sent.",
            f"Send it to a body or to the group {self.scara.group.address}.",
        )

    async def samples(self, move_id: str) -> ScaraSamples:
        """Give where its axes were seen during a move; errors as of `ScaraMoves.samples`."""
        return await self._moves.samples(move_id)

    async def stop(self, mode: StopMode) -> Stopped:
        """Stop all its bodies."""
        return await stopped("bodies", self._stops.stop(self.scara.members, mode))
