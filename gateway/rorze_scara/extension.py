"""SCARA robots made of RC-420 bodies, as the gateway knows of them; it names nothing else of this package."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar, Final, NoReturn

from pydantic import Field

from gateway.core.addresses import none_such
from gateway.core.errors import InvalidRequest
from gateway.core.event_types import move_types
from gateway.core.events import Event
from gateway.core.family import Extension, Site
from gateway.core.move_log import MoveLog
from gateway.core.move_record import RESTARTED
from gateway.core.operation import DocumentSection, RouteWords
from gateway.core.parts import Part
from gateway.core.stops import StopMode
from gateway.core.supervisor import Deed
from gateway.core.targets import Stopped, Target, stopped
from gateway.rorze.family import Rorze, parts_of
from gateway.rorze.line import Line
from gateway.rorze.stops import Stops
from gateway.rorze.targets import STOP_MODES
from gateway.rorze_scara import config
from gateway.rorze_scara.moves import ScaraMoves
from gateway.rorze_scara.record import ScaraMove, ScaraSamples
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


ScaraId = Annotated[str, Field(description="The robot's id in the configuration.", examples=["wafer"])]


class Scaras(Extension):
    """All SCARA robots of a plant."""

    of = Rorze
    table = config.ScaraTable
    collections = ("scaras",)
    called = ("SCARA robots",)
    move_records = (ScaraMove,)
    event_types = tuple(move_types("scara", "/scaras/{scara_id}", ScaraMove))
    sections = (
        DocumentSection(
            "scaras", "SCARA robots of two or three bodies: coordinates, geometry and kinematics.", "backups"
        ),
        DocumentSection(
            "scara moves",
            "Lines, paths, and moves along the arm: all axes start with one command.",
            "backups",
        ),
        DocumentSection("scara paths", "The paths that the bodies of a SCARA robot keep.", "backups"),
    )
    words: ClassVar = {
        "/scaras/{scara_id}": RouteWords(
            begun="The controllers have accepted the move; ask again at Location."
        )
    }
    names: ClassVar = {"scara_id": ScaraId}
    things: ClassVar = {Scara: lambda scaras, scara_id: scaras.find(scara_id)}

    def __init__(self, site: Site, rorze: Rorze) -> None:
        super().__init__(site, rorze)
        self._stops = rorze.stops
        self._scaras: dict[str, Scara] = {}
        self.moves = ScaraMoves(rorze.moves, rorze.stops, self._publish_move)

    def make(self, table: config.ScaraTable) -> None:
        """Build a SCARA robot of bodies that are there, and the group that stands for them."""
        if self.moves not in self.family.listeners:
            self.family.listeners.append(self.moves)
        group = self.family.hold_group(table.line, table.group_number, table.members, table.name or table.id)
        group.keep_for("a SCARA robot", table.tolerance_pulses)
        self._scaras[table.id] = Scara(
            table.id,
            group,
            table.robot,
            table.name or "",
            table.own_path,
            table.keep_out_um,
            table.tolerance_pulses,
            table.on_fault,
        )

    def forget(self, line: Line) -> None:
        """Forget the robots on a line."""
        self._scaras = {name: scara for name, scara in self._scaras.items() if scara.line is not line}

    # finding

    def all(self) -> list[Scara]:
        """All of them, in the order of the configuration."""
        return list(self._scaras.values())

    def find(self, scara_id: str) -> Scara:
        """Find a SCARA robot by its id; upper case will do.

        :raises NotFound: there is none.
        """
        found = self._scaras.get(scara_id.lower())
        if found is None:
            raise none_such("SCARA robot", scara_id, self._scaras, "GET /scaras lists them.")
        return found

    def target(self, _collection: str, names: Sequence[str]) -> Target:
        """Find a SCARA robot; errors as of `find`."""
        return ScaraTarget(self.find("/".join(names)), self.moves, self._stops)

    def addresses(self) -> Sequence[str]:
        """Their ids."""
        return list(self._scaras)

    def parts(self, address: str) -> Sequence[Part]:
        """The members of a robot."""
        return self.parts_in_scope(address.lower())

    def parts_in_scope(self, name: str) -> Sequence[Part]:
        """The members of a robot."""
        scara = self._scaras.get(name)
        return [] if scara is None else parts_of(scara.group)

    def at_work(self, line: Line) -> Iterator[str]:
        """The robots that move."""
        return (scara.id for scara in self.all() if scara.line is line and scara.move is not None)

    # moves

    def move_logs(self) -> Sequence[MoveLog[Any]]:
        """That of all robots."""
        return [self.moves.log]

    def resume(
        self, records: Sequence[Mapping[str, Any]], _begun: Collection[str], since: str = RESTARTED
    ) -> None:
        """Take over the moves of robots that are still configured, once those of the bodies are."""
        self.moves.resume(self._scaras, records, since)

    def _publish_move(self, what: str, scara: Scara, move: ScaraMove) -> Event:
        return self.site.events.publish(f"scara.move.{what}", scara.path, move, correlation=move.id)

    # the end

    async def at_rest(self) -> None:
        """Wait for refusals of moves."""
        await self.moves.begun()

    def letting_go(self) -> tuple[Deed, ...]:
        """Give the waiters for moves what is known now."""
        return (self.moves.let_go,)

    def closing(self) -> tuple[Deed, ...]:
        """Watch over nothing more; the lines are closed."""
        return (self.moves.close,)


EXTENSION: Final = Scaras
