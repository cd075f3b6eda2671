"""Settings that survive a loss of power (RC-420 manual 18)."""

import pytest

from tests.simulator.rorze.bench import Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()


def cycle_power(bench: Bench) -> None:
    bench.axis.power_off(bench.now)
    bench.wait(1.0)
    bench.axis.power_on(bench.now)


@pytest.mark.parametrize("text", ["FIS", "FPS", "FPD", "FUS", "FUD", "FESPosp", "FESInit", "FESUpgm"])
def test_flash_commands_answer_after_a_second_and_a_half(bench: Bench, text: str) -> None:
    response = bench.axis.execute(text, bench.now)
    assert (response.payload, response.delay_s) == ("", 1.5)


def test_a_fresh_controller_has_the_defaults_of_the_manual(bench: Bench) -> None:
    asked = ["CED A", "CFD 8,P", "COD", "CPD 9", "CSD 9", "DCD 0", "DID", "DLD", "EAD", "EDD", "EPD", "PBD"]
    asked += ["QID", "QSD"]
    everywhere = "-999999999,+999999999"
    expected = ["", "", "H0000", "0", everywhere, "001", "H0000", "H00", "0", "1", everywhere, "00001.00"]
    assert [bench.send(text) for text in asked] == [*expected, "02048", "0"]
    bench.sent("EAS2")
    assert bench.send("CCD") == "000000001"


def test_unsaved_settings_are_lost_and_saved_ones_loaded(bench: Bench) -> None:
    bench.sent("QIS 300", "COS H0005", "CPS 8,2", "FIS", "QIS 400", "COS H0002", "EMS S:H20", "ESS C")
    cycle_power(bench)
    assert bench.send("QID") == "00300"
    assert bench.send("COD") == "H0005"
    assert bench.send("CPD 8") == "2"
    assert bench.send("EMD") == "C:H00,M:H00,S:H00,I:H0000"
    assert bench.send("ESD") == ""


def test_a_one_shot_is_not_saved_as_the_state_of_its_output(bench: Bench) -> None:
    bench.sent("COS H0001", "CBS 0,60000", "FIS")
    cycle_power(bench)
    assert bench.send("COD") == "H0001"


def test_saved_noise_filters_and_contacts_are_in_force_from_power_on(bench: Bench) -> None:
    bench.sent("DIS 3,1", "DCS 2", "FIS")
    cycle_power(bench)
    assert bench.send("CID") == "H0008"
    bench.axis.world.inputs = 0x008
    bench.axis.sense(bench.now)
    assert bench.send("CID") == "H0008"
    bench.wait(0.002)
    assert bench.send("CID") == "H0000"


def test_erased_settings_are_gone_at_the_next_power_on_and_not_before(bench: Bench) -> None:
    bench.sent("QIS 300", "FIS", "FES Init")
    assert bench.send("QID") == "00300"
    cycle_power(bench)
    assert bench.send("QID") == "02048"


def test_positions_are_saved_loaded_and_erased_apart_from_settings(bench: Bench) -> None:
    bench.sent("3PS P[7],70", "FPS", "3PS P[7],71")
    assert bench.send("3PD P[7]") == "+000000071"
    bench.sent("FPD")
    assert bench.send("3PD P[7]") == "+000000070"
    bench.sent("FES Init")
    cycle_power(bench)
    assert bench.send("3PD P[7]") == "+000000070"
    bench.sent("FES Posp")
    cycle_power(bench)
    assert bench.send("3PD P[7]") == "+000000000"


def test_the_program_memory_is_loaded_saved_and_erased(bench: Bench) -> None:
    def program_after(*texts: str) -> tuple[str, ...]:
        bench.sent(*texts)
        return bench.axis.program

    bench.axis.program = ("EED",)
    bench.sent("FUS")
    cycle_power(bench)
    assert program_after() == ("EED",)
    bench.axis.program = ()
    assert program_after("FUD") == ("EED",)
    assert program_after("FES Upgm", "FUD") == ()
