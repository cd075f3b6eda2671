"""The answers of ERR and ERD for each error, column by column, and DRT (C-HOST manual 2-12 to 2-14)."""

import pytest

from simulator.fics.alarms import connection_lost, driver_error, system_error, timed_out
from simulator.fics.axes import Sensor
from simulator.fics.layout import Layout
from simulator.fics.macros import Macro
from tests.simulator.fics.bench import Bench, cartesian


def told(bench: Bench) -> tuple[str, str]:
    """The answers of ERR and ERD, without their names."""
    (error,), (detail,) = bench.ask("ERR"), bench.ask("ERD")
    return error[4:], detail[4:]


def overrun(bench: Bench) -> None:
    """Run axis Z, the first one, onto its minus limit."""
    assert bench.do("LMI -200") == ["LMI 002"]


# Each class of the table in 2-13, brought about over the line where that can be


def test_nothing_is_wrong() -> None:
    assert told(Bench()) == ("E00", "----")


def test_emergency_of_the_system() -> None:
    bench = Bench()
    bench.asked("AES")
    assert told(bench) == ("001", "----E  ")


@pytest.mark.parametrize(("units", "unit"), [(1, " "), (2, "2")])
def test_an_error_of_a_driver_names_unit_axis_code_and_limit(units: int, unit: str) -> None:
    bench = Bench(cartesian(units))
    bench.asked(f"UNT {units}")
    overrun(bench)
    assert told(bench) == ("002", f"{unit}ZF0  -")
    bench.asked("DRT")
    assert bench.do("LMI 300") == ["LMI 002"]
    assert told(bench) == ("002", f"{unit}ZF0 + ")


def test_a_driver_that_is_not_ready_reports_ff() -> None:
    bench = Bench()
    bench.robot.raise_alarm(driver_error(1, "@", 0xFF), bench.now)
    assert told(bench) == ("002", "1@FF   ")


def test_the_connection_to_a_driver_is_lost() -> None:
    bench = Bench()
    bench.robot.raise_alarm(connection_lost(3, "B"), bench.now)
    assert told(bench) == ("003", "3B C")
    bench.robot.raise_alarm(connection_lost(0, "B"), bench.now)
    assert told(bench) == ("003", " B C")


def test_an_origin_that_is_not_found_is_a_timeout_in_program_999() -> None:
    bench = Bench(cartesian())
    bench.motor("Z").held[Sensor.ORIGIN] = False
    assert bench.do("ORG") == ["ORG 004"]
    assert told(bench) == ("004", "-- T9990000")


def test_any_program_may_time_out() -> None:
    bench = Bench()
    bench.robot.raise_alarm(timed_out(12, 345), bench.now)
    assert told(bench) == ("004", "-- T0120345")


def test_a_step_a_macro_cannot_do_is_a_message_error() -> None:
    bench = Bench(Layout(macros={"FAR": Macro(42, ("LMI ,,1", "LMA ,,101"))}))
    bench.home()
    assert bench.do("FAR") == ["FAR 207"]
    assert told(bench) == ("207", "-2070420002")


def test_any_other_error() -> None:
    bench = Bench()
    bench.robot.raise_alarm(system_error(905, 1, 20), bench.now)
    assert told(bench) == ("905", "-9050010020")


def test_only_an_emergency_takes_the_servos_whatever_number_another_error_has() -> None:
    bench = Bench()
    bench.robot.raise_alarm(system_error(1), bench.now)
    assert told(bench) == ("001", "-0010000000")
    assert bench.ask("ACD") == ["ACD 0200,0200,0200"]
    bench.asked("AES")
    assert bench.ask("ACD") == ["ACD 5000,5000,5000"]


def test_the_conversion_adds_what_it_says_to_error_183() -> None:
    bench = Bench()
    bench.home()
    bench.asked("MSM ,-100")
    assert bench.do("LMA 260,260") == ["LMA 183"]
    assert told(bench) == ("183", "-183000000001")


# How long they stand


def test_err_and_erd_leave_an_error_of_the_system_and_drt_ends_it() -> None:
    bench = Bench(cartesian())
    overrun(bench)
    assert told(bench) == told(bench) == ("002", " ZF0  -")
    bench.asked("DRT")
    assert told(bench) == ("E00", "----")
    assert bench.ask("ACD") == ["ACD 0200,0200,0200"]


def test_the_latest_error_of_the_system_is_told() -> None:
    bench = Bench(cartesian())
    overrun(bench)
    bench.asked("AES")
    assert told(bench) == ("001", "----E  ")


def test_a_refusal_waits_behind_an_error_of_the_system() -> None:
    bench = Bench()
    bench.asked("AES")
    assert bench.ask("POM 0") == ["POM E05"]
    assert told(bench) == ("001", "----E  ")
    bench.asked("DRT")
    assert told(bench) == ("E05", "----")
    assert told(bench) == ("E00", "----")


# Each error of communication in the table of 2-12


REFUSALS = {
    "E01": ("LMI ,,50", "VAO"),
    "E02": ("AES", "LMI 1"),
    "E03": ("POF 1", "LMI 1"),
    "E04": ("LMI ,,50", "ASS", "ASS"),
    "E05": ("VAO 100.1",),
    "E06": ("VAO A",),
    "E07": ("ORG", "LMI ,,100.01"),
    "E08": ("POS 1",),
    "E09": ("ORG", "POM 1999"),
    "E10": ("LMA 1",),
    "E11": ("POF 1,1999", "POS 1", "POS 1"),
    "E12": ("PIC 1",),
}


@pytest.mark.parametrize("error", REFUSALS)
def test_each_refusal_is_told_in_ver_3_and_kept_for_err_in_both_modes(error: str) -> None:
    *before, last = REFUSALS[error]
    for mode in (2, 3):
        bench = Bench(mode=mode)
        for command in before:
            bench.wait(0.02)
            bench.ask(command)
            if command == "ORG":
                bench.finish()
        assert bench.ask(last) == ([f"{last[:3]} {error}"] if mode == 3 else [])
        if error == "E02":
            bench.ask("DRT")
        assert [bench.ask("ERR"), bench.ask("ERR")] == [[f"ERR {error}"], ["ERR E00"]]


@pytest.mark.parametrize("noise", [b"\x80\x81\r", b"LM\x01I 1\r", b"A" * 600 + b"\r"])
def test_what_is_no_text_is_a_disturbed_communication(noise: bytes) -> None:
    bench = Bench()
    bench.line.receive(noise, bench.now)
    assert bench.heard() == ["E99"]
    assert [bench.ask("ERR"), bench.ask("ERR")] == [["ERR E99"], ["ERR E00"]]


@pytest.mark.parametrize("text", ["vao", "VA", "?", "L_I 1"])
def test_text_that_looks_like_no_command_is_not_written_correctly(text: str) -> None:
    bench = Bench()
    assert bench.ask(text) == ["E06"]
    assert [bench.ask("ERR"), bench.ask("ERR")] == [["ERR E06"], ["ERR E00"]]


@pytest.mark.parametrize("noise", [b"vao\r", b"\x80\x81\r"])
def test_ver_2_says_nothing_to_what_is_no_command(noise: bytes) -> None:
    bench = Bench(mode=2)
    bench.line.receive(noise, bench.now)
    assert bench.heard() == []
