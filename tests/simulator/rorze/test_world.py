"""Where sensors answer along the axis."""

from hypothesis import given
from hypothesis import strategies as st

from simulator.rorze.motion import Direction
from simulator.rorze.world import CCW, CW, EMS, ORIGIN, STALL, Slits, Span, World

PLACES = st.integers(-300, 300)


def test_a_sensor_is_covered_from_its_first_pulse_to_its_last() -> None:
    world = World(origin=Span(10, 12), slits=Slits(0, 10_000))
    assert [world.levels(pulses) >> ORIGIN & 1 for pulses in range(9, 14)] == [0, 1, 1, 1, 0]


def test_the_disc_covers_half_of_every_period() -> None:
    world = World(slits=Slits(100, 10))
    assert [world.levels(pulses) >> STALL & 1 for pulses in range(95, 106)] == [0] * 5 + [1] * 5 + [0]
    assert sum(world.levels(pulses) >> STALL & 1 for pulses in range(-50, 50)) == 50


def test_a_hand_on_a_sensor_overrules_the_machine() -> None:
    world = World(origin=Span(10, 12), forced={ORIGIN: False, EMS: True})
    assert world.levels(11) & (1 << ORIGIN | 1 << EMS) == 1 << EMS


def test_a_slipped_shaft_meets_the_sensors_later() -> None:
    world = World(origin=Span(10, 12), slipped=100)
    assert (world.shaft(111), world.levels(111) >> ORIGIN & 1) == (11, 1)
    assert world.next_edge(105, CW) == 110


@given(PLACES, st.sampled_from([CW, CCW]), PLACES, st.integers(1, 50), st.integers(2, 60), PLACES)
def test_the_next_edge_is_the_next_change(
    at: int, direction: Direction, first: int, width: int, period: int, slipped: int
) -> None:
    world = World(
        origin=Span(first, first + width - 1),
        cw_limit=Span(200, 250),
        ccw_limit=Span(-250, -200),
        slits=Slits(first, period),
        slipped=slipped,
    )
    edge = world.next_edge(at, direction)
    assert edge is not None
    assert (edge - at) * direction > 0
    stretch = [world.levels(pulses) for pulses in range(at, edge, direction)]
    assert all(levels == stretch[0] for levels in stretch)
