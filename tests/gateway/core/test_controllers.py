"""The common part of families with one controller on each line."""

import asyncio
from collections.abc import Awaitable, Callable
from functools import partial
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest

from gateway.core.controllers import Controllers
from gateway.core.errors import NotFound
from gateway.core.events import EventHub
from gateway.core.family import ENDS_ITSELF, NOT_OURS, MayMove, Site
from gateway.core.jogs import JogNews
from gateway.core.parts import Part
from gateway.core.supervisor import Deed, do_each, do_in_turn
from tests.plants import in_virtual_time


class Thing:
    """A controller that notes what it is told."""

    def __init__(self, name: str, *, moving: bool | None = False, moves: tuple[str, ...] = ()) -> None:
        self.id, self.moving, self.moves_under_way = name, moving, list(moves)
        self.line = SimpleNamespace(id=f"line-{name}", is_elsewhere=lambda: False)
        self.done: list[object] = []
        self.jogs = SimpleNamespace(end_all=self.done.append, settled=self._noting("settled"))
        self.stops = SimpleNamespace(
            stop=self._stopped, is_unconfirmed=False, confirmed=self._noting("confirmed")
        )

    def _stopped(self, mode: str) -> Awaitable[str]:
        self.done.append(mode)
        future = asyncio.get_running_loop().create_future()
        future.set_result(self.id)
        return future

    def _noting(self, what: str) -> Callable[[], Awaitable[None]]:
        async def noted() -> None:
            self.done.append(what)

        return noted

    def closing(self) -> tuple[Deed, ...]:
        return (self._noting("closed"),)


class Things(Controllers[Thing]):
    """Three of them."""

    kind = "thing"
    collections: ClassVar = ("things",)

    def __init__(self, *things: Thing) -> None:
        super().__init__(Site(EventHub()))
        self._all = {it.id: it for it in things}
        self.moves: Any = SimpleNamespace(begun=things[0]._noting("begun"), close=things[0]._noting("ended"))

    def add(self, _table: object, _port: object) -> Any:
        raise NotImplementedError

    def target(self, _collection: str, names: Any) -> Any:
        return self.find(names[0])

    def info(self, line: Any) -> Any:
        return {"line_id": line.id}


def test_one_is_found_by_its_id_and_by_its_line() -> None:
    a, b = Thing("a"), Thing("b")
    things = Things(a, b)
    assert (things.find("b"), things.on_line(a.line), list(things.addresses())) == (b, a, ["a", "b"])
    with pytest.raises(NotFound, match="There is no thing c"):
        things.find("c")
    assert list(Things.alarmed()) == ["/things/{thing_id}"]


@in_virtual_time
async def test_one_whose_line_goes_is_closed_and_forgotten() -> None:
    a, b = Thing("a"), Thing("b")
    things = Things(a, b)
    await do_in_turn("the end of a line", partial(things.removing, a.line))
    assert (a.done, things.every()) == (["closed"], [b])


@in_virtual_time
async def test_all_are_stopped_but_those_that_another_gateway_has() -> None:
    a, b = Thing("a"), Thing("b")
    b.line.is_elsewhere = lambda: True
    await Things(a, b).stop_all("immediate")
    assert (a.done, b.done) == (["immediate"], [])


@in_virtual_time
async def test_at_the_end_jogs_end_always_and_what_moves_is_stopped_where_everything_is_to_end() -> None:
    still, moving, elsewhere = Thing("a"), Thing("b", moving=True), Thing("c", moving=True)
    things = Things(still, moving, elsewhere)
    within = [Part("line-a", "a"), Part("line-b", "b")]
    assert len(do_each("the end", *things.end_motion(everything=False, within=within))) == 2
    assert [it.done for it in things.every()] == [[JogNews.CLOSING], [JogNews.CLOSING], []]
    assert len(do_each("the end", *things.end_motion(everything=True, within=within))) == 3
    assert moving.done == [JogNews.CLOSING, JogNews.CLOSING, "decelerate"]
    await things.at_rest()
    assert still.done[-3:] == ["settled", "confirmed", "begun"]


def test_what_may_move_on_is_named_with_why() -> None:
    things = Things(Thing("a"), Thing("b", moving=True), Thing("c", moving=True, moves=("m1",)))
    assert list(things.left_moving()) == [
        MayMove("thing", "/things/b", NOT_OURS, None),
        MayMove("thing", "/things/c", ENDS_ITSELF, "m1"),
    ]


@in_virtual_time
async def test_at_the_end_each_is_closed_though_another_meets_a_fault_and_then_the_moves_end() -> None:
    def fails() -> None:
        raise RuntimeError

    a, b = Thing("a"), Thing("b")
    a.closing = lambda: (fails,)  # type: ignore[method-assign]
    things = Things(a, b)
    await do_in_turn("the end", things.closing)
    assert (b.done, a.done) == (["closed"], ["ended"])
