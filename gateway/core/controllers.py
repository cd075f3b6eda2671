"""A family with one controller on each of its lines: all that such families do alike."""

import asyncio
from collections.abc import Awaitable, Collection, Iterator, Mapping, Sequence
from functools import partial
from typing import Any, ClassVar, Generic, Protocol, TypeVar

from gateway.core.addresses import none_such
from gateway.core.family import Family, MayMove, Seen, Site, in_doubt, is_within, why_it_moves
from gateway.core.jogs import JogNews
from gateway.core.move_log import MoveLog
from gateway.core.move_record import RESTARTED
from gateway.core.parts import Part
from gateway.core.stops import StopMode
from gateway.core.supervisor import Deed, do_each
from gateway.core.targets import Stopped, stopped


class Controller(Protocol):
    """A controller on a line: a robot, or an axis."""

    id: str
    line: Any
    jogs: Any
    """Jogs of the controller: its `Jogs`."""
    stops: Any
    """Stops of the controller: its `StopsUnderWay`; its `stop` has queued the stop when it returns."""

    @property
    def moving(self) -> bool | None:
        """True while it moves; None if unknown."""

    @property
    def moves_under_way(self) -> Sequence[str]:
        """The ids of its moves that are not over."""

    def closing(self) -> tuple[Deed, ...]:
        """Name what ends all its work, and closes the line."""


C = TypeVar("C", bound=Controller)


class Controllers(Family, Generic[C]):
    """All controllers of a kind, each on a line of its own."""

    kind: ClassVar[str]
    """Singular noun for events and sentences, such as `robot`; the first of `collections` is its plural."""
    moves: Any
    """The `MoveRuns` of all, with `take_over`."""

    def __init__(self, site: Site) -> None:
        super().__init__(site)
        self._all: dict[str, C] = {}

    @classmethod
    def alarmed(cls) -> Sequence[str]:
        """The path of all."""
        return (f"/{cls.collections[0]}/{{{cls.kind}_id}}",)

    def every(self) -> list[C]:
        """All, in the order of the configuration."""
        return list(self._all.values())

    def find(self, name: str) -> C:
        """Find one.

        :raises NotFound: there is none of this id.
        """
        if name not in self._all:
            raise none_such(self.kind, name, self._all, f"GET /{self.collections[0]} lists them.")
        return self._all[name]

    def on_line(self, line: Any) -> C:
        """The one on a line."""
        [found] = (controller for controller in self.every() if controller.line is line)
        return found

    def removing(self, line: Any) -> tuple[Deed, ...]:
        """Name what closes a line, and forgets what is on it."""
        gone = self.on_line(line)
        return gone.closing, partial(self._all.pop, gone.id, None)

    def addresses(self) -> Iterator[str]:
        """Their ids."""
        yield from self._all

    def seen(self) -> Iterator[Seen]:
        """Tell of all, as the `of` of `now` does."""
        told: Any = self.now
        return (Seen(controller.line.id, controller.id, told.of(controller)) for controller in self.every())

    def move_logs(self) -> Iterator[MoveLog[Any]]:
        """Logs of the moves of all controllers."""
        yield self.moves.log

    def resume(
        self, records: Sequence[Mapping[str, Any]], begun: Collection[str], since: str = RESTARTED
    ) -> None:
        """Take over the moves of those that are still configured."""
        there = set(self.addresses())
        own = [
            self.move_records[0].model_validate(record) for record in records if record["body_id"] in there
        ]
        self.moves.log.remember(own)
        for move in own:
            if not move.status.final:
                owner = self.find(move.body_id.partition("/")[0])
                self.moves.take_over(owner, move, begun=move.id in begun, since=since)

    def was_left_alone(self) -> tuple[Deed, ...]:
        """Name what stops what jogs: its heartbeats are too old."""
        return tuple(partial(each.jogs.end_all, JogNews.MISSED) for each in self.every())

    def stop_all(self, mode: StopMode) -> Awaitable[Stopped]:
        """Stop all."""
        stopping = (partial(each.stops.stop, mode) for each in self.every() if not each.line.is_elsewhere())
        return stopped(self.collections[0], asyncio.gather(*do_each("a stop", *stopping).or_raise()))

    def end_motion(self, *, everything: bool, within: Sequence[Part] | None = None) -> tuple[Deed, ...]:
        """Name what stops what jogs, or everything that moves."""
        meant = [
            controller for controller in self.every() if is_within(controller.line.id, controller.id, within)
        ]
        moving = [each for each in meant if everything and in_doubt(partial(_moves, each))]
        return (
            *(partial(each.jogs.end_all, JogNews.CLOSING) for each in meant),
            *(partial(each.stops.stop, "decelerate") for each in moving),
        )

    async def at_rest(self) -> None:
        """Wait for stops, and for refusals of moves."""
        for controller in self.every():
            await controller.jogs.settled()
            await controller.stops.confirmed()
        await self.moves.begun()

    def left_moving(self) -> Iterator[MayMove]:
        """Name those that may move on."""
        for controller in self.every():
            moves = controller.moves_under_way
            why = why_it_moves(
                stopped=controller.stops.is_unconfirmed, moving=controller.moving, under_way=bool(moves)
            )
            if why is not None:
                yield MayMove(
                    self.kind, f"/{self.collections[0]}/{controller.id}", why, next(iter(moves), None)
                )

    def letting_go(self) -> tuple[Deed, ...]:
        """Give the waiters for moves what is known now."""
        return (self.moves.let_go,)

    def closing(self) -> tuple[Deed, ...]:
        """End all work and close the lines."""
        return *(controller.closing for controller in self.every()), self.moves.close


def _moves(controller: Controller) -> bool:
    return bool(controller.moving)
