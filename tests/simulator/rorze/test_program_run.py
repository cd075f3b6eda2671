"""A user program runs, waits, calls, steps and ends (RC-420 manual 15.2)."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.rorze.user_program.assembler import Assembled, assemble
from simulator.rorze.program_run import DEEPEST_CALL, INSTRUCTION_S
from tests.protocols.rorze.user_program.examples import INSTRUCTIONS
from tests.simulator.rorze.bench import Bench

SOON_S = INSTRUCTION_S / 4


def bench_with(*program: str) -> Bench:
    bench = Bench()
    bench.sent(*(f"UWS{instruction}" for instruction in program))
    return bench


def how(bench: Bench) -> tuple[str, str]:
    """Why the program has ended, and where."""
    return bench.send("URD"), bench.send("UND")


# Time


def test_instructions_follow_each_other_in_their_time() -> None:
    bench = bench_with("INCC0", "INCC0", "INCC0", "END")
    bench.sent("URG")
    told = []
    for _ in range(4):
        bench.wait(SOON_S)
        told.append((*how(bench), bench.send("UDDC0")[-1]))
        bench.wait(INSTRUCTION_S - SOON_S)
    assert told == [
        ("H01", "00001", "1"),
        ("H01", "00002", "2"),
        ("H01", "00003", "3"),
        ("H00", "00003", "3"),
    ]


def test_wat_stays_at_its_address_for_its_time() -> None:
    bench = bench_with("WAT5", "SETOD0", "END")
    bench.sent("URG")
    bench.wait(0.49)
    assert (*how(bench), bench.send("COD0")) == ("H01", "00000", "0")
    bench.wait(0.02)
    assert (*how(bench), bench.send("COD0")) == ("H00", "00002", "1")


def test_a_program_follows_the_motor_and_the_inputs() -> None:
    bench = bench_with("1AM5000", "JONMT,+0", "SETOD0", "JOFID3,+0", "SETOD1", "END")
    bench.sent("URG")
    bench.wait(0.05)
    assert (bench.send("UND"), bench.send("COD")) == ("00001", "H0000")
    assert bench.until_end() == ("1AM", 0x00)
    bench.wait(5 * INSTRUCTION_S)
    assert (bench.send("UND"), bench.send("COD")) == ("00003", "H0001")
    bench.axis.world.inputs = 1 << 3
    bench.axis.sense(bench.now)
    bench.wait(5 * INSTRUCTION_S)
    assert (*how(bench), bench.send("COD")) == ("H00", "00005", "H0003")


def test_endless_polling_costs_no_time_of_ours() -> None:
    bench = bench_with("*L", "JONMT,+3", "JOFID6,-1", "JMP*L", "END", "END")
    bench.sent("URG")
    bench.wait(1e6)
    assert bench.send("URD") == "H01"
    bench.sent("1+MZ")
    bench.wait(4 * INSTRUCTION_S)
    assert how(bench) == ("H00", "00004")


def test_polling_goes_on_where_it_would_have_been() -> None:
    """A program that sleeps is where one is that is looked at all the time."""
    slept, watched = (bench_with("JOFM0,+1", "JOFM0,+1", "JMP-2") for _ in range(2))
    for bench in (slept, watched):
        bench.sent("URG")
        bench.wait(SOON_S)
    places = []
    for _ in range(50):
        watched.wait(INSTRUCTION_S)
        places.append(watched.send("UND"))
    slept.wait(50 * INSTRUCTION_S)
    assert set(places) == {"00000", "00001", "00002"}
    assert slept.send("UND") == places[-1]


def test_a_timer_that_is_polled_runs_out() -> None:
    bench = bench_with("TMST0,30", "JONT0,+0", "END")
    bench.sent("URG")
    bench.wait(2.9)
    assert bench.send("URD") == "H01"
    bench.wait(0.15)
    assert bench.send("URD") == "H00"


def test_the_position_is_followed_while_the_motor_moves() -> None:
    bench = bench_with("1+MZ", "JCPPP<1000,+0", "5IS", "END")
    bench.sent("URG")
    bench.wait(5)
    assert (bench.send("URD"), bench.ends()[-1].cause) == ("H00", 0x10)
    assert 1000 <= bench.position() < 1100


# Calls


def test_a_subroutine_returns_behind_its_call() -> None:
    bench = bench_with("CAL*S", "SETOD1", "END", "*S", "SETOD0", "RET")
    bench.sent("URG")
    bench.wait(1)
    assert (*how(bench), bench.send("COD")) == ("H00", "00002", "H0003")


@pytest.mark.parametrize(("depth", "cause"), [(DEEPEST_CALL, "H00"), (DEEPEST_CALL + 1, "H04")])
def test_calls_go_sixteen_deep(depth: int, cause: str) -> None:
    subroutine = ("*S", "DECC0", "JOFC0,+2", "CAL*S", "RET")
    bench = bench_with("JMP*GO", *subroutine, "*GO", f"CTSC0,{depth}", "CAL*S", "END")
    bench.sent("URG")
    bench.wait(1)
    assert bench.send("URD") == cause


def test_ret_without_a_call_is_a_command_error() -> None:
    bench = bench_with("SETM0", "RET", "END")
    bench.sent("URG")
    bench.wait(1)
    assert how(bench) == ("H04", "00001")


# Ends


@pytest.mark.parametrize(
    ("program", "cause", "address"),
    [
        (("SETM0", "END", "SETM1"), "H00", "00001"),
        (("SETM0", "JMP*NO", "END"), "H08", "00001"),
        (("SETM0", "JMP+2", "END"), "H08", "00001"),
        (("SETM0", "JMP-2", "END"), "H08", "00001"),
        (("CAL*L", "*L"), "H08", "00000"),
        (("SETM0", "SETM1"), "H08", "00002"),
        (("LDD0,5000", "3PDP[D0]", "END"), "H04", "00001"),
        (("1+MZ", "1+M5", "END"), "H20", "00001"),
        (("1+MZ", "6PS0", "END"), "H04", "00001"),
        (("1+MA[3],5", "END"), "H04", "00000"),
    ],
)
def test_a_program_ends_with_its_cause(program: tuple[str, ...], cause: str, address: str) -> None:
    bench = bench_with(*program)
    bench.sent("URG")
    bench.wait(0.1)
    assert how(bench) == (cause, address)


def test_an_error_in_a_program_is_none_of_the_hosts() -> None:
    bench = bench_with("1+MA[3],5", "END")
    bench.sent("URG")
    assert bench.send("9CD") == "H00"


def test_an_error_of_the_host_does_not_end_a_program() -> None:
    bench = bench_with("JMP+0")
    bench.sent("URG")
    assert bench.send("XYZ") == "@49"
    assert bench.send("URD") == "H01"


def test_a_refused_command_of_a_program_has_no_effect() -> None:
    bench = bench_with("LDD0,3", "EASD0", "END")
    bench.sent("URG")
    bench.wait(1)
    assert (bench.send("URD"), bench.send("EAD")) == ("H04", "0")


def test_ues_ends_a_program_and_leaves_the_motor() -> None:
    bench = bench_with("1+M200000", "JONMT,+0", "END")
    bench.sent("URG")
    bench.wait(0.5)
    bench.sent("UES")
    assert how(bench) == ("H02", "00001")
    assert bench.until_end() == ("1+M", 0x00)
    assert how(bench) == ("H02", "00001")


def test_ues0_stops_the_motor_and_ends_the_program() -> None:
    bench = bench_with("1+MZ", "JONMT,+0", "1-MZ", "END")
    bench.sent("URG")
    bench.wait(0.5)
    bench.sent("UES0")
    assert (bench.send("URD"), bench.send("9CD0")) == ("H02", "0")
    bench.wait(1)
    assert bench.send("9CD0") == "0"


def test_ues1_ends_the_program_when_the_motor_has_slowed_down() -> None:
    bench = bench_with("1+MZ", "JONMT,+0", "1-MZ", "END")
    bench.sent("URG")
    bench.wait(2)
    bench.sent("UES1")
    assert bench.send("URD") == "H01"
    assert bench.send("URG") == "@5A"
    bench.until_end()
    assert how(bench) == ("H02", "00001")
    bench.wait(1)
    assert bench.send("9CD0") == "0", "the program has not moved on"


@pytest.mark.parametrize("stop", ["5IS", "5SS"])
def test_a_stop_of_the_motor_alone_lets_the_program_go_on(stop: str) -> None:
    bench = bench_with("1+MZ", "JONMT,+0", "SETOD0", "END")
    bench.sent("URG")
    bench.wait(0.5)
    bench.sent(stop)
    bench.wait(5)
    assert (bench.send("URD"), bench.send("COD0")) == ("H00", "1")


# From outside


def test_a_program_that_runs_is_neither_changed_nor_started_again() -> None:
    bench = bench_with("JMP+0")
    bench.sent("FUS", "URG")
    for text in ("URG", "USG", "UWSEND", "UCS", "FUD"):
        assert bench.send(text) == "@5A", text
    bench.sent("UDSD0,5", "UES", "UCS")


@pytest.mark.parametrize("text", ["URG3", "URG*L", "URG*NO", "USG3", "USG*L", "URG6038"])
def test_a_program_starts_where_something_stands(text: str) -> None:
    assert bench_with().send(text.replace("*L", "")) == "@5B"
    assert bench_with("SETM0", "END", "*L").send(text) == "@5B"


def test_a_program_starts_at_an_address_or_after_a_label() -> None:
    for start, outputs in (("URG", "H0007"), ("URG1", "H0006"), ("URG*L", "H0004")):
        bench = bench_with("SETOD0", "SETOD1", "*L", "SETOD2", "END")
        bench.sent(start)
        bench.wait(1)
        assert bench.send("COD") == outputs


def test_a_single_instruction_is_executed() -> None:
    bench = bench_with("*L", "SETOD0", "CAL*S", "END", "*S", "WAT5", "RET")
    told = []
    for text in ("USG*L", "USG", "USG"):
        bench.sent(text)
        told.append(how(bench))
        bench.wait(1)
    assert told == [("H80", "00002"), ("H80", "00005"), ("H01", "00005")]
    assert how(bench) == ("H80", "00006")
    bench.sent("USG")
    assert how(bench) == ("H80", "00003"), "it has returned"
    bench.sent("USG")
    assert how(bench) == ("H00", "00003")


def test_a_single_instruction_that_fails_tells_why() -> None:
    bench = bench_with("DIVD0,0")
    bench.sent("USG")
    assert how(bench) == ("H04", "00000")


def test_what_a_program_commands_is_in_the_truth() -> None:
    bench = bench_with("LDD0,500", "1+MD0", "END")
    bench.sent("URG")
    bench.wait(1)
    (fact,) = bench.truth.of("program")
    assert fact.facts == {"address": 1, "text": "1+M500"}
    assert fact.at == pytest.approx(INSTRUCTION_S)


# Power


def test_a_loss_of_power_ends_a_program_and_clears_its_memories() -> None:
    bench = bench_with("1+MZ", "SDCHELLO", "SETM5", "LDD3,7", "JMP+0")
    bench.sent("URG")
    bench.wait(1)
    bench.axis.power_off(bench.now)
    assert bench.axis.wake_at() is None
    bench.now += 1
    bench.axis.power_on(bench.now)
    bench.wait(1)
    assert how(bench) == ("H00", "00000")
    assert (bench.send("UDDD3"), bench.send("UED"), bench.axis.take_text(bench.now)) == (
        "+000000000",
        "00000",
        None,
    )


@pytest.mark.parametrize(
    ("prepared", "runs"),
    [
        (("UAS1", "FUS", "FIS"), True),
        (("UAS1", "FIS"), False),
        (("UAS1", "FUS"), False),
        (("FUS", "FIS"), False),
    ],
)
def test_a_program_starts_with_the_power_if_all_is_in_flash(prepared: tuple[str, ...], runs: bool) -> None:
    bench = bench_with("SETOD0", "1+M500", "JMP+0")
    bench.sent(*prepared)
    bench.axis.power_off(bench.now)
    bench.axis.power_on(bench.now)
    bench.wait(1)
    assert (bench.send("URD"), bench.send("COD0"), bench.position()) == (
        ("H01", "1", 500) if runs else ("H00", "0", 0)
    )


# Anything


LONG = st.lists(INSTRUCTIONS, min_size=200, max_size=200)


@settings(max_examples=15)
@given(LONG, st.integers(0, 999))
def test_no_program_hangs_or_breaks_the_controller(program: list[str], inputs: int) -> None:
    bench = Bench()
    stored = []
    for instruction in ("*L0", "*L1", "*L2", "*L3", "*L4", *program):
        if instruction not in stored or not instruction.startswith("*"):
            bench.sent(f"UWS{instruction}")
            stored.append(instruction)
    bench.axis.world.inputs = inputs
    bench.axis.sense(bench.now)
    for start in range(0, len(stored), 25):
        bench.sent(f"URG{start}")
        bench.wait(0.5)
        assert bench.send("URD") in {"H00", "H01", "H04", "H08", "H10", "H20"}
        bench.sent("UES0")
        assert bench.send("URD") == "H02"
    assert [bench.send("UWD0"), *(bench.send("UWD") for _ in stored[1:])] == stored


@settings(max_examples=30)
@given(st.lists(INSTRUCTIONS, max_size=30))
def test_what_is_assembled_is_stored_and_told_alike(program: list[str]) -> None:
    assembled = assemble("\n".join(program))
    if not isinstance(assembled, Assembled):
        return
    bench = bench_with(*assembled.texts())
    assert [bench.send("UWD0" if not place else "UWD") for place in range(len(program))] == program
    assert bench.send("UBD") == f"{6039 - assembled.steps:05}"
    assert bench.send("UED") == f"{len(program):05}"
