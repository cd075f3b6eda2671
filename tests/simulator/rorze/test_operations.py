"""Each operation of a user program (RC-420 manual 16)."""

import pytest

from protocols.rorze.user_program.operations import OPERATIONS
from simulator.rorze import operations
from simulator.rorze.world import EMS, IN_POSITION, STALL
from tests.simulator.rorze.bench import Bench

COMMAND_ERROR = "H04"


def ran(*program: str, bench: Bench | None = None, seconds: float = 1.0) -> Bench:
    """A bench on which a program has run."""
    bench = bench or Bench()
    bench.sent(*(f"UWS{instruction}" for instruction in program), "URG")
    bench.wait(seconds)
    return bench


def result(*program: str, bench: Bench | None = None) -> int:
    """The value of D0 after a program that has ended normally."""
    bench = ran(*program, "END", bench=bench)
    assert bench.send("URD") == "H00"
    return int(bench.send("UDDD0"))


def bits(*program: str, bench: Bench | None = None) -> str:
    """The value of D0 in hexadecimal, after a program that has ended normally."""
    bench = ran(*program, "END", bench=bench)
    assert bench.send("URD") == "H00"
    return bench.send("UDDHD0")[1:]


def fails(*program: str) -> bool:
    return ran(*program, "END").send("URD") == COMMAND_ERROR


def test_there_is_something_to_do_for_every_operation() -> None:
    assert operations._TABLE.keys() == OPERATIONS.keys()


# Data


@pytest.mark.parametrize(
    ("program", "value"),
    [
        (("LDD0,1000",), 1000),
        (("LDD0,-999999999",), -999999999),
        (("LDD1,7", "LDD0,D1"), 7),
        (("CTSC3,9", "LDD0,C3"), 9),
        (("LDIX,10", "LDD0,IX"), 10),
        (("6PD", "LDD0,RX"), 0),
        (("LDIY,10", "LDDIY,5", "LDD0,D10"), 5),
        (("LDD1,42", "LDIX,D1", "LDD0,IX"), 42),
    ],
)
def test_ld_copies_a_value(program: tuple[str, ...], value: int) -> None:
    assert result(*program) == value


def test_ld_copies_bits_of_ports_and_leaves_the_others() -> None:
    bench = Bench()
    bench.axis.world.inputs = 0b10_1010_0000
    bench.axis.sense(0.0)
    assert bits("LDD0,HFFFFFFFF", "LDD0,ID4,3", bench=bench) == "FFFFFFFA"
    bench.sent("UCS", "COSHA5A5")
    assert bits("LDD0,0", "LDD0,OD8,H7", bench=bench) == "000000A5"


def test_ld_copies_bits_of_sensors_in_the_order_of_programs() -> None:
    bench = Bench()
    bench.force(EMS, True)
    bench.force(STALL, True)
    assert bits("LDD0,SN0,5", bench=bench) == "00000011"
    bench.force(EMS, False)
    bench.force(IN_POSITION, True)
    bench.sent("UCS")
    assert bits("LDD0,SN0,5", bench=bench) == "00000021"


def test_ld_copies_bits_to_flags_and_outputs() -> None:
    bench = Bench()
    assert bits("LDD1,H2A", "LDM5,D1,5", "LDD0,M4,7", bench=bench) == "00000054"
    ran("LDD1,HFF", "LDOD2,D1,3", "END", bench=bench)
    bench.sent("UCS")
    ran("LDD1,HFF", "LDOD2,D1,3", "END", bench=bench)
    assert bench.send("COD") == "H003C"


def test_bits_beyond_a_bank_are_0_and_are_not_written() -> None:
    assert bits("LDD1,HFFFFFFFF", "LDM198,D1,31", "LDD0,M198,31") == "00000003"


def test_bst_writes_one_bit() -> None:
    assert bits("BSTD0,2,1") == "00000004"
    assert bits("LDD0,HFF", "BSTD0,H7,0") == "0000007F"
    assert bits("BSTD0,31,1") == "80000000"


def test_set_and_rst_turn_flags_and_outputs() -> None:
    bench = ran("SETOD1", "SETOD3", "RSTOD3", "SETM10", "SETM11", "RSTM11", "LDD0,M10,1", "END")
    assert (bench.send("COD"), bench.send("UDDD0")) == ("H0002", "+000000001")


def test_output_0_is_not_there_in_servo_mode() -> None:
    bench = Bench()
    bench.settings(mode=2)
    assert ran("SETOD0", "SETOD1", "END", bench=bench).send("COD") == "H0002"


def test_counts_are_set_from_numbers_and_memories() -> None:
    bench = ran("LDD1,30", "TMST0,D1", "CTSC1,D1", "TMST1,20", "END", seconds=0.55)
    told = [bench.send(f"UDD{memory}") for memory in ("T0", "C1", "T1")]
    assert told == ["+000000025", "+000000030", "+000000015"]
    assert fails("LDD1,-1", "TMST0,D1")
    assert fails("LDD1,10000000", "CTSC0,D1")


# Arithmetic


@pytest.mark.parametrize(
    ("program", "value"),
    [
        (("LDD0,5", "ADDD0,1000"), 1005),
        (("LDD0,5", "LDD10,-7", "ADDD0,D10"), -2),
        (("LDD0,5", "SUBD0,1000"), -995),
        (("LDD0,5", "MULD0,-3"), -15),
        (("LDD0,7", "DIVD0,2"), 3),
        (("LDD0,-7", "DIVD0,2"), -3),
        (("LDD0,-7", "DIVD0,-2"), 3),
        (("6PD", "LDD0,5", "ADDD0,RX"), 5),
        (("LDIX,5", "ADDIX,10", "LDD0,IX"), 15),
        (("LDIX,5", "MULIX,39", "LDD0,IX"), 195),
        (("LDD0,999999999", "INCD0"), 999999999),
        (("LDD0,-999999999", "DECD0"), -999999999),
        (("INCD0", "INCD0", "DECD0"), 1),
        (("CTSC1,9999999", "INCC1", "LDD0,C1"), 9999999),
        (("DECC1", "LDD0,C1"), 0),
        (("LDIX,199", "INCIX", "LDD0,IX"), 199),
        (("DECIY", "LDD0,IY"), 0),
    ],
)
def test_arithmetic(program: tuple[str, ...], value: int) -> None:
    assert result(*program) == value


@pytest.mark.parametrize(
    "program",
    [
        ("DIVD0,0",),
        ("DIVD0,D1",),
        ("LDIX,199", "ADDIX,1"),
        ("SUBIX,1",),
        ("LDIX,100", "MULIX,2"),
        ("LDIX,1", "DIVIX,0"),
        ("LDD1,200", "LDIX,D1"),
    ],
)
def test_what_cannot_be_is_a_command_error(program: tuple[str, ...]) -> None:
    assert fails(*program)


BEYOND = ("CTSCIX,1", "INCCIX", "JONIDIX,+1", "SETODIX", "LDD0,SNIX,1", "TMSTIX,1", "SDDCIX")


@pytest.mark.parametrize("instruction", BEYOND)
def test_an_index_beyond_the_bank_is_a_command_error(instruction: str) -> None:
    assert fails("LDIX,30", instruction)


def test_a_data_memory_that_runs_over_keeps_its_lowest_32_bits() -> None:
    assert bits("LDD0,H7FFFFFFF", "ADDD0,1") == "80000000"
    assert bits("LDD0,HFFFFFFFF", "MULD0,HFFFFFFFF") == "00000001"


# Logic


@pytest.mark.parametrize(
    ("program", "value"),
    [
        (("LDD0,HFF00", "ANDD0,H0FF0"), "00000F00"),
        (("LDD0,HFF00", "LDD1,H00FF", "ORD0,D1"), "0000FFFF"),
        (("LDD0,HFFFFFFFF", "ANDD0,H80000000"), "80000000"),
        (("LDD0,HA0AAAAAA", "RSLD0"), "41555555"),
        (("LDD0,H50555555", "RSRD0"), "A82AAAAA"),
        (("SETM0", "ANDM0,M1", "LDD0,M0,0"), "00000000"),
        (("SETM0", "CTSC1,5", "ANDM0,C1", "LDD0,M0,0"), "00000001"),
        (("TMST1,5", "ORM0,T1", "LDD0,M0,0"), "00000001"),
        (("ORM0,MT", "LDD0,M0,0"), "00000000"),
    ],
)
def test_logic(program: tuple[str, ...], value: str) -> None:
    assert bits(*program) == value


# Jumps


@pytest.mark.parametrize(
    ("jump", "taken"),
    [
        ("JMP+2", True),
        ("JCPD5>D6,+2", False),
        ("JCPD5=D6,+2", True),
        ("JCPD5<1,+2", True),
        ("JCPD5>HFFFFFFFF,+2", True),
        ("JCPPP=0,+2", True),
        ("JCPRX<0,+2", False),
        ("JCPT0=0,+2", True),
        ("JONM0,+2", False),
        ("JOFM0,+2", True),
        ("JONC0,+2", False),
        ("JOFMT,+2", True),
        ("JBTD5,0,0,+2", True),
        ("JBTD5,0,1,+2", False),
        ("JER+2", False),
        ("JMG+2", False),
    ],
)
def test_jumps(jump: str, taken: bool) -> None:
    assert result(jump, "LDD0,1") == (0 if taken else 1)


@pytest.mark.parametrize(
    ("comparison", "strict", "inclusive"),
    [
        ("JCPD5>5,+2", False, True),
        ("JCPD5<5,+2", False, True),
        ("JCPD5=5,+2", True, True),
        ("JCPD5>4,+2", True, True),
        ("JCPD5<4,+2", False, False),
    ],
)
def test_comparisons_are_strict_unless_another_controller_is_wanted(
    comparison: str, strict: bool, inclusive: bool
) -> None:
    for switch, taken in ((False, strict), (True, inclusive)):
        bench = Bench()
        bench.axis.compares_inclusively = switch
        assert result("LDD5,5", comparison, "LDD0,1", bench=bench) == (0 if taken else 1)


@pytest.mark.parametrize(
    ("jump", "taken"), [("JER+2", True), ("JER2,+2", True), ("JER1,+2", False), ("JER7,+2", False)]
)
def test_jumps_at_errors(jump: str, taken: bool) -> None:
    bench = Bench()
    bench.sent("1+MZ")
    bench.force(EMS, True)
    assert result(jump, "LDD0,1", bench=bench) == (0 if taken else 1)


def test_eed_ends_the_program_if_there_is_an_error() -> None:
    bench = Bench()
    bench.sent("1+MZ")
    bench.force(EMS, True)
    ran("EED", "END", bench=bench)
    assert (bench.send("URD"), bench.send("UND")) == ("H10", "00000")
    bench.sent("9CS", "URG")
    bench.wait(1)
    assert bench.send("URD") == "H00"


def test_other_errors_are_none_of_eeds() -> None:
    bench = Bench()
    assert bench.send("XYZ") == "@49"
    assert ran("EED", "JER+2", "END", "END", bench=bench).send("UND") == "00002"


# Messages


@pytest.mark.parametrize(
    ("program", "text"),
    [
        (("SDCD0=",), "D0="),
        (("LDD0,-5", "SDDD0"), "-000000005"),
        (("LDD0,-5", "SDDHD0"), "HFFFFFFFB"),
        (("CTSC10,99", "SDDC10"), "+000000099"),
        (("TMST0,5000", "SDDHT0"), "H00001388"),
    ],
)
def test_a_message_waits_to_be_collected(program: tuple[str, ...], text: str) -> None:
    bench = ran(*program, "JMG+0", "END")
    assert bench.send("URD") == "H01"
    assert bench.axis.take_text(bench.now) == text
    bench.wait(0.01)
    assert bench.send("URD") == "H00"
    assert bench.axis.take_text(bench.now) is None


def test_a_message_replaces_one_that_waits() -> None:
    bench = ran("SDCONE", "SDCTWO", "END")
    assert bench.axis.take_text(bench.now) == "TWO"
