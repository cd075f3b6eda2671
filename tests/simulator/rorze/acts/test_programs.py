"""User programs are kept, told, run and ended by commands (RC-420 manual 14.U, 15.2)."""

import pytest

from tests.simulator.rorze.bench import Bench

PROGRAM = ("*TEST", "SETOD0", "1AM5000", "JONMT,+0", "WAT5", "RSTOD0", "END")
"""The first of 15.2.7, as it comes without blanks."""


@pytest.fixture
def bench() -> Bench:
    return Bench()


def add(bench: Bench, *instructions: str) -> None:
    bench.sent(*(f"UWS{instruction}" for instruction in instructions))


# Nothing runs


def test_no_program_has_ever_run(bench: Bench) -> None:
    assert bench.send("URD") == "H00"


def test_ending_no_program_leaves_the_motor_alone(bench: Bench) -> None:
    bench.sent("1+M2000", "UES")
    assert bench.until_end() == ("1+M", 0x00)
    assert bench.position() == 2000


@pytest.mark.parametrize("command", ["UES0", "UES1"])
def test_ending_with_a_stop_stops_the_motor(bench: Bench, command: str) -> None:
    bench.sent("1+M200000")
    bench.wait(0.5)
    bench.sent(command)
    assert bench.until_end() == ("1+M", 0x10)
    assert 0 < bench.position() < 200000


def test_ending_with_a_stop_does_nothing_to_a_motor_at_rest(bench: Bench) -> None:
    bench.sent("UES0", "UES1")
    assert bench.position() == 0
    assert bench.send("9MD") == "H00"


# Instructions


def test_a_program_is_written_and_read_address_by_address(bench: Bench) -> None:
    add(bench, *PROGRAM)
    assert bench.send("UED") == "00007", "where the next instruction will stand"
    assert [bench.send("UWD") for _ in PROGRAM] == list(PROGRAM)
    assert bench.send("UWD") == "", "beyond its end"
    assert [bench.send("UPD*TEST"), bench.send("UPD"), bench.send("UWD")] == [
        "00000,*TEST",
        "00001,SETOD0",
        "1AM5000",
    ]
    assert [bench.send("UPD6"), bench.send("UPD")] == ["00006,END", "00007,"]


def test_what_is_not_there_cannot_be_told(bench: Bench) -> None:
    assert [bench.send(text) for text in ("UWD", "UPD0", "UWD*TEST")] == ["@5B"] * 3
    add(bench, *PROGRAM)
    assert bench.send("UPD*TEST2") == "@5B"
    assert (bench.send("UWD6038"), bench.send("UWD")) == ("", "@5B")


def test_a_program_is_cleared_in_ram_and_kept_in_flash(bench: Bench) -> None:
    add(bench, *PROGRAM)
    bench.sent("FUS", "UCS")
    assert (bench.send("UED"), bench.send("UBD")) == ("00000", "06039")
    bench.axis.power_off(bench.now)
    bench.axis.power_on(bench.now)
    assert bench.send("UPD") == "00000,*TEST"


@pytest.mark.parametrize(
    ("instruction", "steps"),
    [
        ("INCD5", 1),
        ("WAT5", 2),
        ("JMP*ST1", 3),
        ("JBTD0,3,1,*ST1", 4),
        ("JCPPP>100,*ST1", 5),
        *[(f"LDD1,{value}", 3) for value in ("10000", "-5", "H3FF", "D2", "C4")],
        *[(f"LD{form}", 2) for form in ("D0,M3,7", "D0,ID0,7", "M3,D0,7", "IX,10", "D1,IX")],
        ("1+M10000", 3),
        ("*ST1", 3),
    ],
)
def test_every_instruction_takes_its_room(bench: Bench, instruction: str, steps: int) -> None:
    add(bench, instruction)
    assert bench.send("UBD") == f"{6039 - steps:05}"


def test_the_room_is_limited(bench: Bench) -> None:
    bench.axis.program = ("WAT5",) * 3019
    assert bench.send("UWSWAT5") == "@5B"
    add(bench, "END")
    assert (bench.send("UBD"), bench.send("UWSEND")) == ("00000", "@5B")


def test_labels_are_limited_and_each_is_there_once(bench: Bench) -> None:
    bench.axis.program = tuple(f"*L{number}" for number in range(499))
    assert bench.send("UWS*L7") == "@4A"
    add(bench, "*L499")
    assert bench.send("UWS*L500") == "@5B"


@pytest.mark.parametrize("instruction", ["XYZ", "URG", "FIS", "XID", "*a-b", ""])
def test_what_no_program_knows_is_refused(bench: Bench, instruction: str) -> None:
    assert bench.send(f"UWS{instruction}") == "@4A"


def test_a_program_is_not_changed_while_the_motor_runs(bench: Bench) -> None:
    bench.sent("1+MZ")
    assert (bench.send("UWSEND"), bench.send("UCS")) == ("@50", "@50")


# Memories


def test_memories_keep_what_is_set_until_the_power_goes(bench: Bench) -> None:
    bench.sent("UDSD0,-999999999", "UDSD199,5", "UDSC29,9999999")
    told = ("UDDD0", "UDDD199", "UDDC29", "UDDD1")
    assert [bench.send(text) for text in told] == ["-999999999", "+000000005", "+009999999", "+000000000"]
    bench.axis.power_off(bench.now)
    bench.axis.power_on(bench.now)
    assert [bench.send(text) for text in told] == ["+000000000"] * 4


def test_bits_are_those_of_a_number(bench: Bench) -> None:
    bench.sent("UDSD0,HFFFFFFFF", "UDSD1,H7FFFFFFF", "UDSD2,-2")
    assert (bench.send("UDDD0"), bench.send("UDDHD0")) == ("-000000001", "HFFFFFFFF")
    assert (bench.send("UDDD1"), bench.send("UDDHD1")) == ("+999999999", "H7FFFFFFF")
    assert bench.send("UDDHD2") == "HFFFFFFFE"


def test_a_timer_counts_down_in_tenths_of_a_second(bench: Bench) -> None:
    bench.sent("UDST3,12", "UDSC3,12")
    bench.wait(0.55)
    assert bench.send("UDDT3") == "+000000007"
    bench.wait(5)
    assert (bench.send("UDDT3"), bench.send("UDDC3")) == ("+000000000", "+000000012")


@pytest.mark.parametrize("text", ["UDSD200,0", "UDSC30,0", "UDST0,-1", "UDSC0,H1", "UDDM0"])
def test_memories_that_there_are_not_are_refused(bench: Bench, text: str) -> None:
    assert bench.send(text) == "@4A"
