"""The share of each client where there are many connections."""

from dataclasses import dataclass, field
from itertools import count

import pytest

from api.front.connections import IDLE_S, Admitted, ConnectionLimit


@dataclass(eq=False)
class Peer:
    """A connection."""

    name: int
    gone: list[int] = field(default_factory=list)

    def give_way(self) -> None:
        self.gone.append(self.name)


class Door:
    """A limit of two connections, with a reserve of two, and all who are connected."""

    def __init__(self) -> None:
        self.now = 0.0
        self.gone: list[int] = []
        self.inside: list[Peer] = []
        self._names = count()
        self.limit = ConnectionLimit(2, 2, lambda: self.now)

    def come(self) -> tuple[Peer, Admitted]:
        peer = Peer(next(self._names), self.gone)
        self.inside.append(peer)
        admitted = self.limit.admit(peer, len(self.inside))
        self.inside = [it for it in self.inside if it.name not in self.gone]
        if admitted is Admitted.NOTHING:
            self.inside.remove(peer)
        return peer, admitted

    def leave(self, peer: Peer) -> None:
        self.inside.remove(peer)
        self.limit.leave(peer)

    def fill(self) -> list[Peer]:
        """Let in as many as may ask for everything, and let them ask."""
        peers = [self.come()[0] for _ in range(2)]
        for peer in peers:
            self.limit.ask(peer)
        return peers


def test_within_the_limit_everybody_may_ask_for_everything() -> None:
    door = Door()
    assert [door.come()[1] for _ in range(2)] == [Admitted.EVERYTHING] * 2


def test_beyond_the_limit_there_are_only_stops_and_then_nothing() -> None:
    door = Door()
    door.fill()
    stopping = [door.come() for _ in range(2)]
    assert [admitted for _, admitted in stopping] == [Admitted.STOPS] * 2
    for peer, _ in stopping:
        door.limit.stop(peer)
    assert door.come()[1] is Admitted.NOTHING
    assert door.gone == []


def test_who_has_not_asked_for_a_stop_yet_makes_room_for_who_may() -> None:
    door = Door()
    door.fill()
    waiting = [door.come()[0] for _ in range(2)]
    assert door.come()[1] is Admitted.STOPS
    assert door.gone == [waiting[0].name]


def test_the_one_that_is_idle_longest_makes_room() -> None:
    door = Door()
    first, second = door.fill()
    door.limit.rest(second)
    door.now = 0.5
    door.limit.rest(first)
    door.now = 0.5 + IDLE_S
    assert door.come()[1] is Admitted.EVERYTHING
    assert door.gone == [second.name]


def test_who_was_idle_for_a_moment_only_does_not() -> None:
    door = Door()
    first, _ = door.fill()
    door.limit.rest(first)
    door.now = IDLE_S / 2
    assert door.come()[1] is Admitted.STOPS
    assert door.gone == []


def test_stops_beyond_the_limit_take_no_place_within_it() -> None:
    door = Door()
    first, _ = door.fill()
    door.limit.stop(door.come()[0])
    door.come()
    door.leave(first)
    assert door.come()[1] is Admitted.EVERYTHING


def test_a_full_gateway_says_so_once(caplog: pytest.LogCaptureFixture) -> None:
    door = Door()
    door.fill()
    for _ in range(4):
        door.come()
    assert len(caplog.records) == 1
    for peer in list(door.inside):
        door.leave(peer)
    door.fill()
    door.come()
    assert len(caplog.records) == 2
