"""An axis without its commands: what it remembers, and how it counts."""

from dataclasses import replace

import pytest

from simulator.rorze.axis import ENCODER_MODE, Axis, held
from simulator.rorze.motor import Motor
from simulator.rorze.settings import FARTHEST
from simulator.truth import TruthLog


@pytest.fixture
def axis() -> Axis:
    axis = Axis(Motor(0x3F, TruthLog(), lambda _: False, lambda *_: None))
    axis.power_on(0.0)
    return axis


def test_power_brings_back_what_flash_holds_and_counters_of_zero(axis: Axis) -> None:
    axis.settings = replace(axis.settings, mode=ENCODER_MODE)
    axis.positions[7] = 42
    axis.flash.positions = (1, *axis.flash.positions[1:])
    axis.set_pulse_position(500, 0.0)
    axis.set_encoder(600, 0.0)
    axis.power_on(1.0)
    assert axis.settings == axis.flash.settings
    assert (axis.positions[0], axis.positions[7]) == (1, 0)
    assert (axis.pulse_position(1.0), axis.encoder(1.0)) == (0, 0)


def test_each_counter_is_set_for_itself_and_the_mode_tells_which_is_the_position(axis: Axis) -> None:
    axis.settings = replace(axis.settings, encoder_ratio=2.5)
    axis.set_pulse_position(-30, 0.0)
    axis.set_encoder(40, 0.0)
    assert (axis.pulse_position(0.0), axis.encoder(0.0), axis.encoder_in_pulses(0.0)) == (-30, 40, 100)
    assert (axis.position(0.0), axis.to_pulses(8)) == (-30, 8)
    axis.settings = replace(axis.settings, mode=ENCODER_MODE)
    assert (axis.position(0.0), axis.to_pulses(8)) == (40, 20)


@pytest.mark.parametrize(("pulses_a_line", "pulses"), [(4.0, 7), (8.0, 14), (1.0, 2)])
def test_a_coarser_encoder_needs_more_pulses_a_count(axis: Axis, pulses_a_line: float, pulses: int) -> None:
    axis.world.encoder = pulses_a_line
    assert axis.pulses_to_count(7, 0.0) == pulses
    assert axis.pulses_to_count(-7, 0.0) == -pulses
    assert axis.pulses_to_count(0, 0.0) == 0


def test_a_count_too_small_for_a_pulse_still_takes_one(axis: Axis) -> None:
    axis.world.encoder = 0.4
    assert [axis.pulses_to_count(count, 0.0) for count in (1, -1)] == [1, -1]


def test_a_slipped_motor_leaves_the_encoder_behind(axis: Axis) -> None:
    axis.world.slipped = 30
    assert (axis.pulse_position(0.0), axis.encoder(0.0)) == (0, -30)


def test_a_register_holds_nine_digits() -> None:
    assert [held(count) for count in (-FARTHEST - 1, 5, FARTHEST + 1)] == [-FARTHEST, 5, FARTHEST]
