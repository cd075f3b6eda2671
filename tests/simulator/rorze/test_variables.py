"""The operands of a user program, in the memories and at the ports of a controller (RC-420 manual 15.2.5)."""

import pytest

from protocols.rorze.user_program.operands import BankPlace, Constant, Operand, Register, memory_in
from simulator.rorze.actions import Refused
from simulator.rorze.variables import Variables, as_bits, as_number
from simulator.rorze.world import CCW_LIMIT, CW_LIMIT, EMS, IN_POSITION, ORIGIN, STALL
from tests.simulator.rorze.bench import Bench


def memory(name: str) -> BankPlace:
    found = memory_in(name)
    assert found is not None
    return found


@pytest.fixture
def bench() -> Bench:
    return Bench()


@pytest.fixture
def variables(bench: Bench) -> Variables:
    return Variables(bench.axis, bench.now)


@pytest.mark.parametrize(
    "operand", [memory("D7"), memory("C7"), memory("T7"), Register("IX"), Register("RX")]
)
def test_a_number_is_kept(variables: Variables, operand: Operand) -> None:
    variables.store(operand, 123)
    assert variables.value(operand) == 123


def test_an_index_points_into_a_bank(variables: Variables) -> None:
    variables.store(Register("IY"), 7)
    variables.store(memory("DIY"), 5)
    assert variables.value(memory("D7")) == 5
    variables.store(Register("IY"), 30)
    with pytest.raises(Refused):
        variables.value(memory("CIY"))


@pytest.mark.parametrize(
    ("operand", "value"),
    [(memory("C0"), -1), (memory("T0"), 10_000_000), (Register("IX"), 200), (Register("IX"), -1)],
)
def test_what_a_memory_cannot_hold_is_refused(variables: Variables, operand: Operand, value: int) -> None:
    with pytest.raises(Refused):
        variables.store(operand, value)
    assert variables.value(operand) == 0


def test_a_data_memory_has_32_bits(variables: Variables) -> None:
    variables.store(memory("D0"), 0x1_8000_0001)
    assert variables.value(memory("D0")) == as_number(0x8000_0001) == -0x7FFF_FFFF
    assert as_bits(-1) == 0xFFFF_FFFF


def test_the_position_and_the_motor_are_those_of_the_axis(bench: Bench, variables: Variables) -> None:
    bench.sent("6PS-50", "1+MZ")
    assert variables.value(Register("PP")) == -50
    assert variables.is_on(Register("MT"))
    bench.sent("5IS")
    assert not variables.is_on(Register("MT"))


@pytest.mark.parametrize(
    ("name", "sensor"),
    [
        ("SN0", STALL),
        ("SN1", ORIGIN),
        ("SN2", CW_LIMIT),
        ("SN3", CCW_LIMIT),
        ("SN4", EMS),
        ("SN5", IN_POSITION),
    ],
)
def test_sensors_have_the_order_of_programs(
    bench: Bench, variables: Variables, name: str, sensor: int
) -> None:
    for on in (True, False):
        bench.force(sensor, on)
        assert variables.is_on(memory(name)) == on


def test_a_timer_is_on_while_it_counts_and_a_counter_above_0(variables: Variables) -> None:
    for name in ("T1", "C1"):
        assert not variables.is_on(memory(name))
        variables.store(memory(name), 3)
        assert variables.is_on(memory(name))
    variables.now += 0.31
    assert (variables.is_on(memory("T1")), variables.is_on(memory("C1"))) == (False, True)


def test_outputs_are_turned_and_seen(bench: Bench, variables: Variables) -> None:
    variables.turn(memory("OD3"), True)
    assert bench.send("COD") == "H0008"
    assert variables.copy_from(memory("OD2"), 31) == 0b10
    variables.copy_to(memory("OD14"), 31, 0b111)
    assert bench.send("COD") == "HC008"


@pytest.mark.parametrize("operand", [memory("M0"), memory("SN0")])
def test_a_switch_has_no_value(variables: Variables, operand: Operand) -> None:
    with pytest.raises(TypeError):
        variables.value(operand)
    with pytest.raises(TypeError):
        variables.is_on(Constant(1))
