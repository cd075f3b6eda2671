"""Refusals in each state: the tables of C-HOST manual 1-7 and 4-1, cell by cell, in both modes."""

from collections.abc import Callable

import pytest

from protocols.fics.commands import ROWS, read
from protocols.fics.status import MotionMode
from simulator.fics.layout import Layout
from tests.simulator.fics.bench import Bench

BLOCKED = {
    "MOD": "c",
    "MOD {mode}": "c",
    "UNT": "abd",
    "UNT 2": "abd",
    "JOG A+": "abc",
    # The table blocks all of JOG in (c), but it is JOG without a direction that ends a JOG (2-2).
    "JOG A": "ab",
    "JTE A1": "abc",
    "ORG": "abc",
    "LMI 1": "abc",
    "LMA ,,1": "abc",
    "AES": "b",
    "ASS": "b",
    "DRT": "",
    "VAO": "abc",
    "VAO 50": "abc",
    "POM 1": "abc",
    "POF 1": "abc",
    "POF 2": "abc",
    "POS 1": "abc",
    "PCL": "abc",
    "IOT 1-0:+": "",
    "SCV": "abc",
    "SCV 1": "abc",
    "HMT": "abc",
    "HMT 1": "abc",
    "HMO": "abc",
    "HMO 1": "abc",
    "HMV": "abc",
    "HMV 1": "abc",
    "HMB": "abc",
    "HMB 1": "abc",
    "VSB": "abc",
    "VSB 1": "abc",
    "VSO": "abc",
    "VSO 1": "abc",
    "VST": "abc",
    "VST 1": "abc",
    "VSS": "abc",
    "VSS 1": "abc",
    "SLP": "abc",
    "SLP 1": "abc",
    "SLM": "abc",
    "SLM 1": "abc",
    "VAR V1": "a",
    "VAR V1=1": "a",
    "VER": "",
    "PCK 160,140,-5": "abc",
    "APS": "",
    "ACD": "",
    "ASD": "",
    "ERR": "",
    "ERD": "",
    "POR": "abc",
    "IDI 1": "",
    "IDO 1": "",
    "MMI 1": "abc",
    "MMA 1": "abc",
    "MPS": "",
    "MAO": "abc",
    "MAO 50": "abc",
    "MSO": "abc",
    "MSO 1": "abc",
    "MST": "abc",
    "MST 1": "abc",
    "MSS": "abc",
    "MSS 1": "abc",
    "MSP": "abc",
    "MSP 1": "abc",
    "MSM": "abc",
    "MSM 1": "abc",
}
"""Commands by their tables; a setting and its query have one line there."""

TERMINAL_RUNS = {
    "automatic operation": MotionMode.MACRO,
    "homing": MotionMode.HOMING,
    "JOG": MotionMode.JOG,
}
"""Motion modes of state (a), as ACD tells them."""

MOTIONS = {
    "JOG Z+": "cd",
    "JTE Z255": "cd",
    # 2-1 leaves ORG out where it names what blocks UNT; the table has it.
    "ORG": "cd",
    "LMI ,,50": "cd",
    "LMA ,,50": "cd",
    "POM 1": "cd",
    "PCK 160,140,-5": "c",
    # The tables do not name the moves of motors, which cannot be meant to block less.
    "MMI ,,50": "cd",
    "MMA ,,50": "cd",
}
"""The host's own motions, and which of the states (c) and (d) they are."""

ERRORS = {"a": "E01", "b": "E03", "c": "E01", "d": "E01"}

DURING_UPLOAD = {"POS 1", "ERR", "POF 2"}


def bench_in(mode: int) -> Bench:
    """Two units, all homed without any motion, with position 1."""
    bench = Bench(Layout(units=2), mode=mode)
    for unit in bench.robot.units.values():
        unit.positions[1] = (160.0, 140.0, 1.0)
        for motor in unit.motors:
            motor.homed = True
    return bench


def refusal(bench: Bench, command: str) -> str:
    """The error a command is refused with, told by its reply in Ver.3 and by ERR in Ver.2; empty if none."""
    name, mode = command[:3], bench.robot.mode
    heard = bench.ask(command.format(mode=mode))
    if mode == 2:
        assert heard == [] or not heard[0].startswith(f"{name} E") or command == "ERR"
        name, heard = "ERR", bench.ask("ERR")
    errors = [text.removeprefix(f"{name} ") for text in heard if text.startswith(f"{name} E")]
    return "" if errors in ([], ["E00"]) else errors[0]


def expected(command: str, states: str) -> str:
    """The error expected in one of the states (a) to (d), or in (c) and (d) together; empty if none."""
    return "".join({ERRORS[state] for state in states if state in BLOCKED[command]})


def unlike_the_table(mode: int, states: str, enter: Callable[[Bench], object]) -> dict[str, str]:
    """The commands whose refusal differs from the table after something has entered the states."""
    found = {}
    for command in BLOCKED:
        bench = bench_in(mode)
        enter(bench)
        if (error := refusal(bench, command)) != expected(command, states):
            found[command] = error
    return found


def test_no_command_is_missing() -> None:
    asked = {type(read(command[:3], command[3:].format(mode=2).replace(" ", ""))) for command in BLOCKED}
    assert asked == set(ROWS)


@pytest.mark.parametrize("mode", [2, 3])
def test_a_system_at_rest_takes_everything_but_positions_without_an_upload(mode: int) -> None:
    refused = {command: error for command in BLOCKED if (error := refusal(bench_in(mode), command))}
    # POF 2 without POF 1 is not in the manual: it is refused as POS is.
    assert refused == {"POS 1": "E08", "POF 2": "E08"}


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("activity", TERMINAL_RUNS)
def test_what_runs_from_the_teaching_terminal_blocks_a(activity: str, mode: int) -> None:
    def run(bench: Bench) -> None:
        bench.robot.terminal = TERMINAL_RUNS[activity]

    assert unlike_the_table(mode, "a", run) == {}


@pytest.mark.parametrize("mode", [2, 3])
def test_editing_at_the_teaching_terminal_blocks_b(mode: int) -> None:
    def edit(bench: Bench) -> None:
        bench.robot.editing = True

    assert unlike_the_table(mode, "b", edit) == {}


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("motion", MOTIONS)
def test_a_motion_of_the_host_blocks_c_and_in_its_unit_d(motion: str, mode: int) -> None:
    def start(bench: Bench) -> None:
        assert bench.ask(motion) == (["JOG"] if motion == "JOG Z+" and mode == 3 else [])

    # While a motor jogs, others may be started (2-2).
    exceptions = {"JOG A+": ""} if motion == "JOG Z+" else {}
    assert unlike_the_table(mode, MOTIONS[motion], start) == exceptions


@pytest.mark.parametrize("mode", [2, 3])
def test_motion_in_one_unit_is_c_in_another_but_not_d(mode: int) -> None:
    # Only a macro lets the host go to another unit before it ends.
    bench = bench_in(mode)
    bench.ask("PCK 160,140,-5")
    assert refusal(bench, "UNT 2") == ""
    assert refusal(bench, "UNT") == ""
    assert refusal(bench, "LMI 1") == "E01"
    assert refusal(bench, "MOD") == "E01"


@pytest.mark.parametrize("mode", [2, 3])
def test_between_pof_1_and_pof_2_only_pos_err_and_pof_2_are_taken(mode: int) -> None:
    refused = {}
    for command in BLOCKED:
        bench = bench_in(mode)
        assert bench.ask("POF 1") == (["POF"] if mode == 3 else [])
        refused[command] = refusal(bench, command)
    # The manual prints no error for it: E03, "not taken in this state", fits best.
    assert refused == {command: "" if command in DURING_UPLOAD else "E03" for command in BLOCKED}


@pytest.mark.parametrize("mode", [2, 3])
def test_an_upload_is_blocked_as_any_other_command_by_the_teaching_terminal(mode: int) -> None:
    # The manual does not say what happens when somebody starts something there between POF 1 and POF 2.
    bench = bench_in(mode)
    bench.ask("POF 1")
    bench.robot.terminal = MotionMode.JOG
    assert [refusal(bench, command) for command in ("POS 1", "POF 2")] == ["E01", "E01"]
    bench.robot.terminal = None
    assert [refusal(bench, command) for command in ("POS 1", "POF 2")] == ["", ""]


def test_a_refused_command_changes_nothing() -> None:
    bench = bench_in(3)
    bench.robot.editing = True
    for command in ("UNT 2", "VAO 50", "POF 1", "PCL", "JTE A1"):
        assert bench.ask(command) == [f"{command[:3]} E03"]
    bench.robot.editing = False
    assert bench.ask("UNT") == ["UNT 1,1"]
    assert bench.ask("VAO") == ["VAO 100.0,100.0,100.0"]
    assert bench.ask("POR") == ["POS 160,140,1", "POE"]
    assert bench.line.wake_at() is None
