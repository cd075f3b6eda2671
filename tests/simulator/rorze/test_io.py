"""Inputs, outputs, sensors, interrupts and error outputs of a controller, told as stories."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from simulator.rorze.world import CCW_LIMIT, EMS, IN_POSITION, ORIGIN
from tests.simulator.rorze.bench import Bench

SERVO = "EAS2"


@pytest.fixture
def bench() -> Bench:
    return Bench()


def connect(bench: Bench, inputs: int) -> None:
    bench.axis.world.inputs = inputs
    bench.axis.sense(bench.now)


def move(bench: Bench, text: str = "1+M Z") -> None:
    """Start a move that is well under way after a second."""
    bench.sent(text)
    bench.wait(1.0)


# Inputs and sensors


def test_inputs_are_read_one_by_one_and_together(bench: Bench) -> None:
    connect(bench, 0x03C)
    assert bench.send("CID5") == "1"
    assert bench.send("CID6") == "0"
    assert bench.send("CID") == "H003C"
    assert bench.send("CID10") == "@4A"


def test_a_closed_contact_reads_the_other_way_round(bench: Bench) -> None:
    bench.sent("DIS 0,1", "DIS 9,1")
    assert bench.send("DID") == "H0201"
    assert bench.send("CID") == "H0201"
    connect(bench, 0x001)
    assert bench.send("CID") == "H0200"


def test_sensors_are_read_one_by_one_and_together(bench: Bench) -> None:
    bench.force(ORIGIN, True)
    bench.force(CCW_LIMIT, True)
    assert bench.send("CLD5") == "0"
    assert bench.send("CLD3") == "1"
    assert bench.send("CLD") == "H0A"


def test_a_normally_closed_ems_that_opens_stops_the_move(bench: Bench) -> None:
    bench.force(EMS, True)
    bench.sent("DLS 5,1")
    assert bench.send("CLD5") == "0"
    move(bench)
    bench.force(EMS, False)
    assert bench.ends()[0].cause == 0x08
    assert bench.send("1+M 100") == "@51"


def test_changing_the_logic_while_moving_is_an_edge_like_any_other(bench: Bench) -> None:
    move(bench)
    bench.sent("DLS 5,1")
    assert bench.send("9MD") == "H08"


def test_noise_on_ems_is_cancelled_and_a_real_signal_comes_through_late(bench: Bench) -> None:
    bench.sent("DCS 14,5")
    move(bench)
    bench.wait(0.0005)
    bench.force(EMS, True)
    bench.wait(0.003)
    bench.force(EMS, False)
    bench.wait(0.1)
    assert bench.send("9CD0") == "1"
    bench.force(EMS, True)
    bench.wait(0.0044)
    assert bench.send("9CD0") == "1"
    bench.wait(0.0002)
    assert bench.send("9CD0") == "0"
    halted = bench.truth.of("pulses_stop")[-1]
    assert halted.at == pytest.approx(1.108, abs=1e-6)  # the fifth sample after the edge


def test_one_command_sets_all_noise_filters(bench: Bench) -> None:
    bench.sent("DCS 7", "DCS 3,9")
    assert [bench.send(f"DCD {bit}") for bit in (0, 3, 8, 14)] == ["007", "009", "007", "007"]
    bench.sent("DCS 1")
    assert bench.send("DCD 3") == "001"
    assert bench.send("DCS 15,1") == "@4A"
    assert bench.send("DCS 100") == "@4A"


def test_inputs_8_and_9_have_no_filter(bench: Bench) -> None:
    bench.sent("DCS 99")
    connect(bench, 0x3FF)
    assert bench.send("CID") == "H0300"
    bench.wait(0.1)
    assert bench.send("CID") == "H03FF"


# Outputs


def test_outputs_are_set_one_by_one_and_together(bench: Bench) -> None:
    bench.sent("COS 3,1")
    assert bench.send("COD") == "H0008"
    bench.sent("COS H003D")
    assert bench.send("COD") == "H003D"
    assert bench.send("COD1") == "0"
    assert bench.send("COD2") == "1"
    assert bench.send("COS 16,1") == "@4A"


def test_a_one_shot_inverts_an_output_for_exactly_its_time(bench: Bench) -> None:
    bench.sent("COS H0002", "CBS 1,1000")
    assert bench.send("COD") == "H0000"
    bench.wait(0.999999)
    assert bench.send("COD1") == "0"
    bench.wait(0.000001)
    assert bench.send("COD1") == "1"


def test_a_one_shot_under_way_takes_no_other_and_is_ended_by_setting_the_output(bench: Bench) -> None:
    bench.sent("CBS 1,1000")
    assert bench.send("CBS 1,5") == "@4A"
    bench.sent("COS 1,0")
    assert bench.send("COD1") == "0"
    bench.sent("CBS 1,5")
    bench.sent("COS H0000")
    assert bench.send("COD") == "H0000"


@given(st.lists(st.tuples(st.integers(0, 15), st.booleans(), st.integers(1, 3000)), max_size=30))
def test_after_all_one_shots_the_outputs_are_as_they_were_set(steps: list[tuple[int, bool, int]]) -> None:
    bench, steady = Bench(), [False] * 16
    for output, one_shot, number in steps:
        if one_shot:
            assert bench.send(f"CBS {output},{number}") in ("", "@4A")
        else:
            steady[output] = bool(number % 2)
            bench.sent(f"COS {output},{number % 2}")
        bench.wait(number / 7919)
    bench.wait(4.0)
    assert bench.send("COD") == f"H{sum(on << output for output, on in enumerate(steady)):04X}"


# Error outputs


def test_an_ems_stop_drives_its_output_until_it_is_released(bench: Bench) -> None:
    bench.sent("CES E,2,1", "CES A,3,0", "COS 3,1")
    move(bench)
    bench.force(EMS, True)
    assert bench.send("COD") == "H0004"
    assert bench.send("CRD E") == "1"
    assert bench.send("CRD L") == "0"
    assert bench.send("CRD") == "H9"
    bench.force(EMS, False)
    assert bench.send("1+M 100") == "@66"
    bench.sent("CRS")
    assert bench.send("CRD") == "H0"
    assert bench.send("COD") == "H0008"
    bench.sent("1+M 100")


def test_a_limit_drives_its_own_output_only(bench: Bench) -> None:
    bench.sent("CES E,2,1", "CES L,4,1")
    bench.machine(origin=(-1000, -800), ccw=(-2001, -2000), cw=(3000, 3100))
    bench.sent("1+M Z")
    bench.until_end()
    assert bench.send("CRD") == "H4"
    assert bench.send("COD") == "H0010"


def test_each_error_needs_an_output_of_its_own(bench: Bench) -> None:
    bench.sent("CES E,2,1")
    assert bench.send("CED E") == "2,1"
    assert bench.send("CED A") == ""
    assert bench.send("CES L,2,0") == "@67"
    bench.sent("CES E,2,0")
    assert bench.send("CED E") == "2,0"
    assert bench.send("CBS 2,10") == "@4A"
    bench.sent("CES E", "CES L,2,0", "CBS 5,10")
    assert bench.send("CED E") == ""


# Interrupts


def test_an_edge_during_a_move_records_where_it_happened(bench: Bench) -> None:
    bench.axis.world.encoder = 8.0
    bench.sent("PBS 2.00", "CFS 9,P:25", "CFS 9,E:26", "CFS 9,C:27", "CFS 9,O:4,1,100", "COS 4,1")
    bench.sent("3PS P[25],7", "CPS 9,2")
    assert bench.send("3PD P[25]") == "+000000000"
    assert bench.send("COD4") == "0"
    bench.sent("1+M 20000")
    bench.wait(0.3)
    here = bench.position()
    connect(bench, 0x200)
    assert 0 < here < 20000
    assert bench.send("CPD 9") == "0"
    assert bench.send("3PD P[25]") == f"{here:+010d}"
    assert bench.send("3PD P[26]") == f"{round(here / 2):+010d}"
    assert bench.send("3PD P[27]") == f"{round(here / 2) * 2:+010d}"
    bench.wait(0.09999)
    assert bench.send("COD4") == "1"
    bench.wait(0.00002)
    assert bench.send("COD4") == "0"


def test_an_interrupt_goes_off_once(bench: Bench) -> None:
    bench.sent("CFS 8,P:1", "CPS 8,1")
    connect(bench, 0x100)
    move(bench)
    connect(bench, 0x000)
    first = bench.send("3PD P[1]")
    bench.wait(0.1)
    connect(bench, 0x100)
    connect(bench, 0x000)
    assert int(first) > 0
    assert bench.send("3PD P[1]") == first


def test_edges_at_rest_and_of_the_other_kind_are_not_heeded(bench: Bench) -> None:
    bench.sent("CFS 8,P:1", "CPS 8,2")
    connect(bench, 0x100)
    assert bench.send("CPD 8") == "2"
    move(bench)
    connect(bench, 0x000)
    assert bench.send("3PD P[1]") == "+000000000"
    assert bench.send("CPD 8") == "2"


def test_an_interrupt_is_armed_for_one_move_only(bench: Bench) -> None:
    bench.sent("CPS 8,2", "1+M 100")
    bench.until_end()
    assert bench.send("CPD 8") == "0"


def test_an_interrupt_waits_for_its_section(bench: Bench) -> None:
    bench.sent("CSS 8,60000,70000", "CFS 8,P:1", "CPS 8,2", "1+M 100000")
    bench.wait(1.0)
    connect(bench, 0x100)
    assert bench.send("3PD P[1]") == "+000000000"
    connect(bench, 0x000)
    while bench.position() < 60000:
        bench.wait(0.01)
    connect(bench, 0x100)
    assert 60000 <= int(bench.send("3PD P[1]")) <= 70000


def test_an_interrupt_is_not_armed_while_moving(bench: Bench) -> None:
    move(bench)
    assert bench.send("CPS 8,2") == "@50"
    assert bench.send("CSS 8,-50,50") == "@50"


# The CLR signal of servo mode


def test_clr_belongs_to_servo_mode_where_it_takes_output_0(bench: Bench) -> None:
    assert bench.send("COD CL") == "@4A"
    assert bench.send("COS CL,1") == "@4A"
    bench.sent("COS 0,1", SERVO, "COS 0,0", "COS HFFFE", "CLS 1")
    assert bench.send("COD CL") == "1"
    assert bench.send("COD") == "HFFFF"
    bench.sent("DLS 6,1")
    assert bench.send("COD CL") == "0"
    assert bench.send("CBS 0,10") == "@4A"
    assert bench.send("CES E,0,1") == "@4A"


def clear_pulse_ms(bench: Bench) -> int:
    """Milliseconds for which CLR stays on from now."""
    start = bench.now
    while bench.send("COD CL") == "1":
        bench.wait(0.0001)
    return round((bench.now - start) * 1000)


def test_an_immediate_stop_gives_clr_as_long_as_set(bench: Bench) -> None:
    bench.sent(SERVO, "CCS 50")
    move(bench)
    assert bench.send("COD CL") == "0"
    bench.sent("5IS")
    assert clear_pulse_ms(bench) == 50


def test_a_limit_and_a_finished_search_give_clr(bench: Bench) -> None:
    bench.machine(origin=(-1000, -800), ccw=(-2001, -2000), cw=(3000, 3100))
    bench.sent(SERVO, "CCS 20", "1+M Z")
    bench.until_end()
    assert clear_pulse_ms(bench) == 20
    bench.sent("00M")
    bench.until_end()
    assert clear_pulse_ms(bench) == 20


def test_a_length_of_zero_switches_clr_off(bench: Bench) -> None:
    bench.sent(SERVO, "CCS 0")
    move(bench)
    bench.sent("5IS")
    assert bench.send("COD CL") == "0"


def test_a_drive_that_does_not_come_to_rest_is_cleared_after_five_seconds(bench: Bench) -> None:
    bench.sent(SERVO, "CCS 10", "1+M 100")
    bench.until_end()
    bench.wait(4.999)
    assert bench.send("COD CL") == "0"
    bench.wait(0.001)
    assert clear_pulse_ms(bench) == 10


def test_a_drive_in_position_is_left_alone(bench: Bench) -> None:
    bench.sent(SERVO, "CCS 10", "1+M 100")
    bench.until_end()
    bench.wait(1.0)
    bench.force(IN_POSITION, True)
    bench.wait(4.001)
    assert bench.send("COD CL") == "0"


COMMANDS = """
CPS8,2 CPS9,1 CFS8,P:1 CFS9,O:4,1,7 CBS3,5 COSHFFFF CESA,2,1 CRS DCS3 DCS14,9 DISH03FF DLSH20 DLSH00 EAS0 EAS2
CLS1 EMSM:H1F,S:H3F,I:H03FF ESSC,M,S,I,O,P 1+M3000 1-M9000 00M 5IS 5SS 9CS FIS ERD CRD COD
"""
POKES = st.tuples(st.integers(0, 0x3FF), st.booleans(), st.booleans())


@given(st.lists(st.tuples(st.sampled_from(COMMANDS.split()) | POKES, st.integers(0, 30_000)), max_size=40))
def test_whatever_happens_the_controller_goes_on(
    steps: list[tuple[str | tuple[int, bool, bool], int]],
) -> None:
    bench = Bench()
    for step, hundredths_ms in steps:
        if isinstance(step, str):
            bench.send(step)
        else:
            inputs, ems, in_position = step
            bench.axis.world.forced |= {EMS: ems, IN_POSITION: in_position}
            connect(bench, inputs)
        bench.wait(hundredths_ms / 1e5)
        wake = bench.axis.wake_at()
        assert wake is None or wake > bench.now
    bench.axis.power_off(bench.now)
    bench.axis.power_on(bench.now)
