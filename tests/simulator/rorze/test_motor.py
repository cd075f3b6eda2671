"""The motor: moves of several legs, and what ends them."""

from collections.abc import Callable

import pytest

from protocols.rorze.profile import SpeedParameters, steady
from simulator.rorze.motion import Direction
from simulator.rorze.motor import Edge, Halted, Leg, Motor, Pause, Task
from simulator.rorze.world import CCW, CW, CW_LIMIT, ORIGIN
from simulator.truth import TruthLog

PARAMETERS = SpeedParameters(100, 1_000, 10_000, 50, 50)


class Cell:
    """A motor at 100 pps with sensors switched by hand."""

    def __init__(self) -> None:
        self.truth = TruthLog()
        self.on: set[int] = set()
        self.ends: list[tuple[str, int, float]] = []
        self.motor = Motor(1, self.truth, self.on.__contains__, lambda *end: self.ends.append(end))

    def switch(self, sensor: int, now: float) -> None:
        self.on.add(sensor)
        self.motor.sensor_changed(Edge(sensor, True), now)

    def notes(self) -> list[object]:
        return [fact.facts["why"] for fact in self.truth.of("pulses_stop")]


def leg(direction: Direction, distance: int | None = None, until: Edge | None = None) -> Leg:
    return Leg(direction, steady(distance, 100, PARAMETERS, PARAMETERS), until)


@pytest.fixture
def cell() -> Cell:
    return Cell()


def test_legs_follow_each_other_without_a_gap(cell: Cell) -> None:
    moments = []

    def there_and_back() -> Task:
        moments.append((yield leg(CW, 300)))
        moments.append((yield leg(CCW, 100)))

    cell.motor.start("00M", there_and_back(), 10.0)
    cell.motor.leg_over(13.0)
    assert cell.motor.moving
    assert cell.motor.pulses(13.5) == 250
    cell.motor.leg_over(14.0)
    assert moments == [13.0, 14.0]
    assert cell.ends == [("00M", 0, 14.0)]
    assert cell.motor.pulses(99.0) == 200


def test_an_edge_ends_its_leg_at_that_pulse(cell: Cell) -> None:
    def to_the_dog() -> Task:
        yield leg(CCW, until=Edge(ORIGIN, True))
        yield leg(CCW, 5)

    cell.motor.start("00M", to_the_dog(), 0.0)
    cell.switch(ORIGIN, 1.0)
    assert cell.motor.pulses(1.0) == -100
    cell.motor.leg_over(1.05)
    assert cell.motor.pulses(1.05) == -105


def test_an_edge_that_is_already_there_costs_no_pulse(cell: Cell) -> None:
    cell.on.add(ORIGIN)

    def to_the_dog() -> Task:
        yield leg(CW, until=Edge(ORIGIN, True))

    cell.motor.start("00M", to_the_dog(), 0.0)
    assert cell.ends == [("00M", 0, 0.0)]
    assert cell.motor.pulses(0.0) == 0


def test_a_move_that_does_not_catch_its_limit_ends_there(cell: Cell) -> None:
    def straight() -> Task:
        yield leg(CW)

    cell.motor.start("1+M", straight(), 0.0)
    cell.switch(CW_LIMIT, 2.0)
    assert cell.ends == [("1+M", 0x02, 2.0)]
    assert cell.notes() == ["limit"]


def test_a_move_that_catches_its_limit_goes_on(cell: Cell) -> None:
    def and_back() -> Task:
        with pytest.raises(Halted, match="02"):
            yield leg(CW)
        yield leg(CCW, 50)

    cell.motor.start("00M", and_back(), 0.0)
    cell.switch(CW_LIMIT, 2.0)
    cell.motor.leg_over(2.5)
    assert cell.ends == [("00M", 0, 2.5)]
    assert cell.motor.pulses(2.5) == 150


def test_a_stop_ends_all_legs(cell: Cell) -> None:
    def many() -> Task:
        while True:
            yield leg(CW, 100)

    cell.motor.start("00M", many(), 0.0)
    cell.motor.decelerate(None, 0.5)
    assert cell.ends == [("00M", 0x10, 0.5)]
    assert not cell.motor.moving
    assert cell.notes() == ["stop"]


def test_a_loss_of_power_is_not_reported(cell: Cell) -> None:
    def straight() -> Task:
        yield leg(CW)

    cell.motor.start("1+M", straight(), 0.0)
    cell.motor.cut_power(1.0)
    assert (cell.ends, cell.motor.moving, cell.motor.pulses(5.0)) == ([], False, 100)


def with_a_rest() -> Task:
    now = yield leg(CW, 100)
    yield Pause(now + 0.5)
    yield leg(CW, 10)


def test_a_pause_belongs_to_the_move_and_gives_no_pulse(cell: Cell) -> None:
    cell.motor.start("1+M", with_a_rest(), 0.0)
    cell.motor.leg_over(1.0)
    assert (cell.motor.moving, cell.motor.pause, cell.motor.train) == (True, Pause(1.5), None)
    assert cell.motor.pulses(1.4) == 100
    cell.motor.leg_over(1.5)
    cell.motor.leg_over(1.6)
    assert (cell.ends, cell.motor.pulses(9.0), cell.notes()) == ([("1+M", 0, 1.6)], 110, ["done", "done"])


@pytest.mark.parametrize(
    "stop", [lambda motor: motor.stop(0x08, 1.2), lambda motor: motor.decelerate(None, 1.2)]
)
def test_a_stop_ends_a_pause_at_once(cell: Cell, stop: Callable[[Motor], None]) -> None:
    cell.motor.start("1+M", with_a_rest(), 0.0)
    cell.motor.leg_over(1.0)
    stop(cell.motor)
    assert [(code, at) for code, _, at in cell.ends] == [("1+M", 1.2)]
    assert (cell.motor.moving, cell.motor.pulses(9.0)) == (False, 100)
