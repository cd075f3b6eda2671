"""Settings for the points that the C-HOST manual leaves open about the robot: each switch, turned."""

from dataclasses import replace
from itertools import permutations

import pytest

from protocols.fics.status import SENSOR_BITS, STATUS_BITS
from simulator.fics.axes import Sensor
from simulator.fics.layout import Layout
from simulator.fics.settings import RobotSettings
from tests.simulator.fics.bench import Bench


def bench_with(units: int = 1, **settings: object) -> Bench:
    bench = Bench(Layout(units=units))
    bench.robot.settings = replace(RobotSettings(), **settings)  # type: ignore[arg-type]  # as they come
    return bench


@pytest.mark.parametrize("order", list(permutations(STATUS_BITS)))
def test_the_second_digit_of_acd_has_its_bits_in_any_order(order: tuple[str, ...]) -> None:
    bench = bench_with(status_bits=order)
    ready = 1 << order.index("servo_ready")
    assert bench.ask("ACD") == [f"ACD 0{ready:X}00,0{ready:X}00,0{ready:X}00"]
    bench.home()
    homed = ready | 1 << order.index("origin_done")
    bench.ask("JOG A+")
    bench.wait(0.1)
    moving = homed | 1 << order.index("moving")
    assert bench.ask("ACD") == [f"ACD 1{moving:X}00,1{homed:X}00,1{homed:X}00"]


@pytest.mark.parametrize("order", list(permutations(SENSOR_BITS)))
def test_the_digit_of_asd_has_its_bits_in_any_order(order: tuple[str, ...]) -> None:
    bench = bench_with(sensor_bits=order)
    bench.motor("Z").held = {sensor: sensor is Sensor.PLUS_LIMIT for sensor in Sensor}
    assert bench.ask("ASD")[0].endswith(f",{1 << order.index('plus_limit')}")


@pytest.mark.parametrize("bits", [("origin_done",), ("origin_done",) * 4, ("a", "b", "c", "d")])
def test_every_bit_is_named_once(bits: tuple[str, ...]) -> None:
    with pytest.raises(ValueError, match="origin_done, servo_ready, moving, alarm, each of them once"):
        RobotSettings(status_bits=bits)


@pytest.mark.parametrize(("origin_bit", "digit"), [("homed", "2"), ("lasting", "3")])
def test_the_origin_bit_may_not_tell_of_a_loss_of_power_and_positions_do(origin_bit: str, digit: str) -> None:
    """C-HOST manual 2-9, 2-10: `#####` is the certain sign."""
    bench = bench_with(origin_bit=origin_bit)
    assert bench.ask("ACD") == ["ACD 0200,0200,0200"]
    bench.home()
    bench.line.power_off(bench.now)
    bench.line.power_on(bench.now)
    assert bench.ask("ACD") == [f"ACD {f'0{digit}00,' * 3}".rstrip(",")]
    assert bench.ask("MPS") == ["MPS #####,#####,#####"]
    bench.ask("MOD 3")
    bench.home()
    assert bench.ask("ACD") == ["ACD 0300,0300,0300"]
    assert bench.ask("MPS") == ["MPS 0.00,0.00,0.00"]


@pytest.mark.parametrize(
    ("hidden", "units", "is_hidden"),
    [
        ("several_units", 1, False),
        ("several_units", 2, True),
        ("always", 1, True),
        ("always", 2, True),
    ],
)
def test_positions_may_be_hidden_while_a_macro_runs(hidden: str, units: int, is_hidden: bool) -> None:
    bench = bench_with(units, hidden_positions=hidden)
    bench.home()
    bench.ask("PCK 140,150,5")
    bench.wait(0.01)
    assert ("#####" in bench.ask("APS")[0]) is is_hidden
    bench.finish()
    assert "#####" not in bench.ask("APS")[0]


@pytest.mark.parametrize(
    ("mode_change", "to_3", "to_2"), [("new_mode", ["MOD"], []), ("old_mode", [], ["MOD"])]
)
def test_a_change_of_mode_is_answered_as_either_mode_has_it(
    mode_change: str, to_3: list[str], to_2: list[str]
) -> None:
    bench = bench_with(mode_change=mode_change)
    assert bench.ask("MOD 2") == to_2
    assert bench.ask("MOD 3") == to_3
    assert bench.ask("MOD") == ["MOD 3"]
