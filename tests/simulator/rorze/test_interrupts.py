"""The two interrupts: in which moves they go off, and where they keep out of each other's way."""

import pytest

from simulator.rorze.interrupts import FALLING, INTERRUPT_INPUTS, OFF, RISING
from tests.simulator.rorze.bench import Bench

RECORD = {8: "CFS8,P:1", 9: "CFS9,P:2"}


@pytest.fixture
def bench() -> Bench:
    return Bench()


def recorded(bench: Bench) -> list[int]:
    return [bench.axis.positions[number] for number in (1, 2)]


def modes(bench: Bench) -> list[int]:
    return list(bench.axis.settings.interrupt_modes)


def edge(bench: Bench, port: int, kind: int) -> None:
    bench.axis.io.interrupts.edge(port, kind, bench.now)


@pytest.mark.parametrize("port", INTERRUPT_INPUTS)
def test_each_input_has_an_interrupt_of_its_own(bench: Bench, port: int) -> None:
    bench.sent(*RECORD.values(), "CPS8,2", "CPS9,2", "1+M20000")
    bench.wait(0.3)
    edge(bench, port, RISING)
    here = bench.position()
    assert recorded(bench) == [here if port == 8 else 0, here if port == 9 else 0]
    assert modes(bench) == [OFF if port == 8 else RISING, OFF if port == 9 else RISING]


@pytest.mark.parametrize(
    ("command", "heeded"), [("1+M", True), ("1-M", True), ("2+M", True), ("2-M", True), ("00M", False)]
)
def test_moves_are_interrupted_and_searches_for_the_origin_are_not(
    bench: Bench, command: str, heeded: bool
) -> None:
    amount = "" if command == "00M" else "9000"
    bench.sent("1+M50000")
    bench.until_end()
    bench.sent(RECORD[8], "CPS8,1", command + amount)
    bench.wait(0.2)
    edge(bench, 8, FALLING)
    assert (recorded(bench)[0] != 0) is heeded
    assert modes(bench) == [OFF if heeded else FALLING, OFF]


def test_a_search_for_the_origin_leaves_interrupts_armed_for_the_next_move(bench: Bench) -> None:
    bench.sent("CPS8,2", "00M")
    bench.until_end()
    assert modes(bench) == [RISING, OFF]
    bench.sent("1+M100")
    bench.until_end()
    assert modes(bench) == [OFF, OFF]


@pytest.mark.parametrize(("section", "heeded"), [("-5000,0", False), ("1,999999", True), ("", True)])
def test_only_in_its_section_it_goes_off(bench: Bench, section: str, heeded: bool) -> None:
    bench.sent(RECORD[8], f"CSS8,{section}".rstrip(","), "CPS8,2", "1+M20000")
    bench.wait(0.3)
    edge(bench, 8, RISING)
    assert modes(bench) == [OFF if heeded else RISING, OFF]


def test_both_ends_belong_to_its_section(bench: Bench) -> None:
    bench.sent(RECORD[8], "CPS8,2", "1+M20000")
    bench.wait(0.3)
    here = bench.axis.position(bench.now)
    for ends, heeded in (((here + 1, here + 2), False), ((here - 2, here - 1), False), ((here, here), True)):
        bench.settings(interrupt_sections=(ends, (0, 0)))
        edge(bench, 8, RISING)
        assert modes(bench) == [OFF if heeded else RISING, OFF]


def test_arming_clears_what_is_to_be_recorded_and_nothing_else(bench: Bench) -> None:
    bench.sent("3PSP[1],7", "3PSP[2],7", "3PSP[3],7", "CFS8,P:1", "CFS8,E:2", "CFS9,P:3", "CPS8,2")
    assert [bench.axis.positions[number] for number in (1, 2, 3)] == [0, 0, 7]


@pytest.mark.parametrize("level", [0, 1])
def test_arming_makes_the_output_ready_to_be_pulsed(bench: Bench, level: int) -> None:
    bench.sent(f"COS4,{level}", f"CFS8,O:4,{level},100", "CPS8,2")
    assert bench.send("COD4") == str(1 - level)


def test_an_interrupt_without_actions_goes_off_all_the_same(bench: Bench) -> None:
    outputs = bench.send("COD")
    bench.sent("CPS9,2", "1+M20000")
    bench.wait(0.3)
    edge(bench, 9, RISING)
    assert modes(bench) == [OFF, OFF]
    assert bench.send("COD") == outputs
    assert not any(bench.axis.positions)
