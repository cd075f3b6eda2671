"""A Fics at its line: bytes however they come, answers when they are due, and never one too many."""

from collections import Counter

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.fics.commands import COMMANDS
from simulator.faults import Direction, Fault, Switch
from simulator.fics.layout import Layout
from simulator.fics.line import LineSettings, build_line
from simulator.fics.macros import MACROS
from tests.simulator.fics.bench import Bench

# Bytes in


@pytest.mark.parametrize(
    "written",
    [b"UNT 2\r", b"UNT2\r", b"UNT 2\r\n", b" U\tNT  2 \r", b"\n\0UNT 2\0\0\r", b"\r\rUNT 2\r", b"UNT +002\r"],
)
def test_blanks_padding_and_empty_lines_mean_nothing(written: bytes) -> None:
    bench = Bench(Layout(units=2))
    bench.line.receive(written, bench.now)
    assert bench.heard() == ["UNT"]
    assert bench.ask("UNT") == ["UNT 2,2"]


def test_a_command_counts_at_its_cr_however_it_was_split() -> None:
    bench = Bench()
    for byte in b"MOD\r":
        assert bench.heard() == []
        bench.line.receive(bytes([byte]), bench.now)
    assert bench.heard() == ["MOD 3"]


def test_several_commands_at_once_are_done_in_turn() -> None:
    bench = Bench()
    bench.line.receive(b"VAR V1=5\rVAR V1\rAPS\r", bench.now)
    assert bench.heard() == ["VAR", "VAR V01=+5", "APS #####,#####,#####"]


def test_after_a_line_that_is_too_long_the_next_is_understood() -> None:
    bench = Bench()
    bench.line.receive(b"X" * 5000 + b"\rMOD\r", bench.now)
    assert bench.heard() == ["E99", "MOD 3"]
    assert bench.ask("ERR") == ["ERR E99"]


# Bytes out


def test_answers_take_their_time_and_keep_their_order() -> None:
    bench = Bench(mode=2, settings=LineSettings(reply_delay_s=0.5))
    bench.line.receive(b"UNT\rMOD\r", bench.now)
    assert bench.wait(0.49) == []
    assert bench.line.wake_at() == 0.5
    assert bench.wait(0.01) == ["UNT 1,1", "MOD 2"]


def test_lines_end_as_they_are_set_up() -> None:
    line = build_line(Layout(), settings=LineSettings(terminator="crlf"))
    line.receive(b"UNT\r", 0.0)
    assert line.take_output(0.0) == b"UNT 1,1\r\n"


def test_the_end_of_a_motion_is_told_at_its_time_however_late_somebody_looks() -> None:
    bench = Bench()
    assert bench.ask("LMI ,,300") == []
    bench.wait(100)
    (stop,) = bench.line.truth.of("motion_stop")
    (told,) = bench.line.truth.of("reply")[-1:]
    assert stop.at == told.at < 2.0


def test_time_never_runs_backwards() -> None:
    bench = Bench()
    bench.wait(10)
    bench.line.receive(b"LMI ,,1\r", 3.0)
    (start,) = bench.line.truth.of("motion_start")
    assert start.at == 10.0


# Power


def test_without_power_nothing_is_heard_or_said() -> None:
    bench = Bench()
    bench.line.receive(b"MO", bench.now)
    bench.line.power_off(bench.now)
    bench.line.power_off(bench.now)
    assert bench.ask("MOD") == []
    assert not bench.line.powered
    bench.line.power_on(bench.now)
    bench.line.power_on(bench.now)
    assert bench.ask("MOD") == ["MOD 2"]
    assert [fact.facts["on"] for fact in bench.line.truth.of("power")] == [False, True]


def test_half_a_command_is_forgotten_without_power() -> None:
    bench = Bench(mode=2)
    bench.line.faults.set(Switch(Fault.MERGED, Direction.REQUESTS, next_frames=1))
    assert bench.ask("UNT") == []
    bench.line.power_off(bench.now)
    bench.line.power_on(bench.now)
    assert bench.ask("MOD") == ["MOD 2"]


def test_an_answer_that_has_not_left_is_lost_with_the_power() -> None:
    bench = Bench(mode=2, settings=LineSettings(reply_delay_s=0.5))
    assert bench.ask("MOD") == []
    bench.line.power_off(bench.now)
    bench.line.power_on(bench.now)
    assert bench.finish() == []


def test_a_brown_out_ends_unasked_and_the_robot_hears_when_it_has_booted() -> None:
    bench = Bench(settings=LineSettings(boot_s=0.5))
    bench.line.brown_out(bench.now, 0.05)
    bench.wait(0.54)
    assert bench.ask("MOD") == []
    bench.wait(0.02)
    assert bench.ask("MOD") == ["MOD 2"]
    assert [fact.at for fact in bench.line.truth.of("power")] == [0.0, 0.55]


def test_power_that_is_cut_again_while_it_boots_stays_away() -> None:
    bench = Bench(settings=LineSettings(boot_s=0.5))
    bench.line.brown_out(bench.now, 0.05)
    bench.wait(0.1)
    bench.line.power_off(bench.now)
    bench.wait(10)
    assert not bench.line.powered
    bench.line.power_on(bench.now)
    assert not bench.line.powered
    bench.wait(0.5)
    assert bench.line.powered


# Whatever is sent

NAMES = st.one_of(
    st.sampled_from([*COMMANDS, *MACROS]), st.text("ABCLMOPSVX019", min_size=3, max_size=3)
).filter(lambda name: name != "MOD")
NUMBERS = st.one_of(
    st.integers(-300, 300).map(str),
    st.decimals(-300, 300, places=3).map(str),
    st.sampled_from(["", "0", "1", "2", "3", "0.001", "1999", "9999", "99999999", "-99999999", "+.5"]),
)
ARGUMENTS = st.one_of(
    st.just(""),
    st.lists(NUMBERS, min_size=1, max_size=5).map(",".join),
    st.sampled_from(["X+", "Y-", "Z+", "A-", "B+", "Z", "X5", "Z-255", "A9", "1-0:+", "V1=2", "V99", "K+"]),
    st.text(" +-.,:=@VXZ0129", max_size=12),
)
REQUESTS = st.builds(lambda name, arguments: f"{name} {arguments}", NAMES, ARGUMENTS)
PAUSES = st.one_of(st.just(0.0), st.floats(0, 30))


@settings(max_examples=300)
@given(st.lists(st.tuples(REQUESTS, PAUSES), max_size=15), st.booleans(), st.sampled_from(["XYZ", "Z@W"]))
def test_in_ver_3_every_command_is_answered_just_once(
    story: list[tuple[str, float]], homed: bool, axes: str
) -> None:
    bench = Bench(Layout(units=2, axes=axes))
    if homed:
        bench.home()
    heard: list[str] = []
    for request, pause in story:
        heard += bench.ask(request) + bench.wait(pause)
    while (wake_at := bench.line.wake_at()) is not None:
        bench.now = max(bench.now, wake_at)
        heard += bench.heard()
    assert Counter(map(answered, heard)) - Counter({"": len(heard)}) == Counter(
        request[:3] for request, _ in story
    )


def answered(line: str) -> str:
    """The command a line is the last answer to; POR has others before its last, named as POS."""
    name, _, payload = line.partition(" ")
    if name == "POE":
        return "POR"
    return "" if name == "POS" and payload and not payload.startswith("E") else name


@settings(max_examples=300)
@given(
    st.lists(
        st.one_of(st.binary(max_size=40), REQUESTS.map(str.encode), st.sampled_from([b"MOD 2", b"MOD 3"])),
        max_size=12,
    ),
    st.lists(st.tuples(st.integers(1, 20), st.floats(-1, 30)), max_size=20),
)
def test_whatever_bytes_come_in_whatever_pieces_only_lines_of_text_come_out(
    frames: list[bytes], cuts: list[tuple[int, float]]
) -> None:
    line = build_line(Layout())
    data, now, said = b"\r".join(frames) + b"\r", 0.0, b""
    for length, pause in [*cuts, (len(data), 0.0)]:
        line.receive(data[:length], now)
        data = data[length:]
        now += pause
        piece = line.take_output(now)
        assert piece == b"" or piece.endswith(b"\r")
        said += piece
    while (wake_at := line.wake_at()) is not None:
        now = max(now, wake_at)
        said += line.take_output(now)
    lines = said.decode("ascii").split("\r")[:-1]
    assert all(text.isprintable() and len(text) >= 3 for text in lines)
    assert sum(answered(text) != "" for text in lines) <= line.requests
