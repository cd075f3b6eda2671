"""Settings of axes: each keeps its own values, and takes none that cannot be."""

import pytest

from tests.simulator.fics.bench import Bench, cartesian

OF_ALL_AXES = ["VAO", "VSO", "VST", "VSS", "SLP", "SLM", "MAO", "MSO", "MST", "MSS", "MSP", "MSM"]
OF_MOTORS = ["VSB", "HMT", "HMO", "HMV", "HMB"]


@pytest.fixture
def bench() -> Bench:
    return Bench()


def values(bench: Bench, name: str) -> list[float]:
    (answer,) = bench.ask(name)
    return [float(value) for value in answer.removeprefix(f"{name} ").split(",")]


@pytest.mark.parametrize("name", OF_ALL_AXES + OF_MOTORS)
def test_a_setting_changes_what_it_is_given_and_no_other_setting(bench: Bench, name: str) -> None:
    before = {other: values(bench, other) for other in OF_ALL_AXES + OF_MOTORS if other[1:] != name[1:]}
    first, second, third = values(bench, name)
    bench.asked(f"{name} ,3")
    assert values(bench, name) == [first, 3.0, third] != [first, second, third]
    assert {other: values(bench, other) for other in before} == before


@pytest.mark.parametrize("name", OF_ALL_AXES + OF_MOTORS)
def test_more_values_than_axes_change_nothing(bench: Bench, name: str) -> None:
    before = values(bench, name)
    assert bench.ask(f"{name} 1,1,1,1") == [f"{name} E06"]
    assert values(bench, name) == before


@pytest.mark.parametrize(("user", "motor"), [("VSO", "MSO"), ("VST", "MST"), ("VSS", "MSS"), ("SLP", "MSP")])
def test_an_axis_of_both_kinds_has_one_value_and_a_converted_one_its_own(
    bench: Bench, user: str, motor: str
) -> None:
    x, y, _ = values(bench, motor)
    bench.asked(f"{user} 7,8,9")
    assert values(bench, motor) == [x, y, 9.0]


def test_an_axis_has_one_percentage_for_its_moves_as_a_user_axis_and_one_as_a_motor(bench: Bench) -> None:
    """C-HOST manual 2-15, 4-5."""
    bench.asked("VAO 7,8,9", "MAO 1,2,3")
    assert (values(bench, "VAO"), values(bench, "MAO")) == ([7.0, 8.0, 9.0], [1.0, 2.0, 3.0])
    bench.line.power_off(bench.now)
    bench.line.power_on(bench.now)
    bench.asked("MOD 3")
    assert (values(bench, "VAO"), values(bench, "MAO")) == ([100.0] * 3, [100.0] * 3)


@pytest.mark.parametrize(("upper", "lower"), [("SLP", "SLM"), ("MSP", "MSM")])
def test_soft_limits_may_meet_and_not_cross(bench: Bench, upper: str, lower: str) -> None:
    bench.asked(f"{lower} ,,-10", f"{upper} ,,10")
    assert bench.ask(f"{upper} ,,-10.01") == [f"{upper} E05"]
    assert bench.ask(f"{lower} ,,10.01") == [f"{lower} E05"]
    assert (values(bench, lower)[2], values(bench, upper)[2]) == (-10.0, 10.0)
    bench.asked(f"{lower} ,,10", f"{upper} ,,10")
    bench.asked(f"{lower} ,,-10", f"{upper} ,,-10")


def test_one_value_that_cannot_be_keeps_all_from_being_set(bench: Bench) -> None:
    before = values(bench, "SLP")
    assert bench.ask("SLP 299,299,-999") == ["SLP E05"]
    assert values(bench, "SLP") == before


def test_the_s_curve_is_switched_for_one_unit() -> None:
    bench = Bench(cartesian(units=2))
    assert bench.ask("SCV") == ["SCV 0"]
    bench.asked("SCV 1")
    assert bench.ask("SCV") == ["SCV 1"]
    bench.asked("UNT 2")
    assert bench.ask("SCV") == ["SCV 0"]
