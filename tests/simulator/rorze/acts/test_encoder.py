"""The encoder: what it counts, the step-outs it finds, the adjustment after a move (RC-420 manual 13.7)."""

import pytest

from tests.simulator.rorze.bench import Bench


@pytest.fixture
def bench() -> Bench:
    """Four pulses to a line of the encoder: a count a pulse, as the factory's ratio has it."""
    return Bench()


def go(bench: Bench, move: str) -> int:
    """Make a move; its end cause."""
    bench.sent(move)
    code, cause = bench.until_end()
    assert code == move[:3]
    return cause


# Counting


def test_the_multiplier_counts_half_as_much_from_here_on(bench: Bench) -> None:
    go(bench, "1+M1000")
    bench.sent("PAS2")
    assert bench.send("6ED") == "+000001000"
    go(bench, "1+M1000")
    assert (bench.send("6ED"), bench.send("6PD")) == ("+000001500", "+000002000")
    assert bench.send("PAD") == "2"


def test_with_the_multiplier_the_ratio_has_to_be_changed_too(bench: Bench) -> None:
    """PAS, PBS: in encoder mode a distance is right when both fit the encoder."""
    bench.sent("EAS1", "PAS2")
    go(bench, "1+M1000")
    assert bench.position() == 500
    bench.sent("PBS2.00", "6PS0")
    go(bench, "1+M1000")
    assert (bench.position(), bench.shaft()) == (1000, 3000)


def test_the_settings_outlast_the_power_once_saved(bench: Bench) -> None:
    bench.sent("EAS1", "PAS2", "PES100", "PJS1", "PKS700", "PLS500", "PSS1", "PTS5")
    bench.sent("FIS")
    bench.axis.power_off(bench.now)
    bench.axis.power_on(bench.now)
    told = [bench.send(text) for text in ("PAD", "PED", "PJD", "PKD", "PLD", "PSD", "PTD")]
    assert told == ["2", "00100", "1", "00700", "00000500", "1", "00005"]


def test_the_adjustment_is_for_encoder_mode(bench: Bench) -> None:
    texts = ("PJD", "PJS1", "PKD", "PKS800", "PLD", "PLS0", "PTD", "PTS3")
    assert [bench.send(text) for text in texts] == ["@61"] * len(texts)


@pytest.mark.parametrize("text", ["PAS3", "PES3001", "PSS2", "PRD1"])
def test_what_is_out_of_range_is_refused(bench: Bench, text: str) -> None:
    assert bench.send(text) == "@4A"


# Step-outs


def test_a_motor_that_slips_is_stopped_at_the_threshold(bench: Bench) -> None:
    bench.sent("PSS1", "1+M20000")
    bench.wait(0.2)
    bench.axis.world.slipped = 128
    bench.axis.sense(bench.now)
    assert bench.axis.motor.moving
    bench.axis.world.slipped = 129
    bench.axis.sense(bench.now)
    assert bench.until_end() == ("1+M", 0x01)
    assert [bench.send(text) for text in ("PRD", "QRD", "9CD6", "9MD")] == ["1", "0", "1", "H01"]
    assert bench.send("1+M100") == "@52"


def test_an_encoder_that_does_not_fit_its_ratio_is_taken_for_a_step_out(bench: Bench) -> None:
    """At 1.01 pulses a count the counters are 1 apart after each 100 pulses."""
    bench.sent("PBS1.01", "PES100", "PSS1")
    assert go(bench, "1-M20000") == 0x01
    assert bench.position() == -10_001


def test_a_step_out_at_rest_is_found_at_the_first_pulse(bench: Bench) -> None:
    bench.sent("PSS1", "6PS1000")
    assert go(bench, "1+M5000") == 0x01
    assert bench.position() == 1001


def test_without_detection_or_within_the_threshold_a_slip_goes_unnoticed(bench: Bench) -> None:
    bench.axis.world.slipped = 500
    assert go(bench, "1+M5000") == 0
    bench.sent("PES3000", "PSS1")
    assert go(bench, "1+M5000") == 0
    assert bench.send("PRD") == "0"


def test_prs_clears_what_the_encoder_has_found_and_nothing_else(bench: Bench) -> None:
    bench.sent("PSS1", "6PS1000")
    go(bench, "1+M5000")
    bench.sent("QRS")
    assert (bench.send("PRD"), bench.send("9CD6")) == ("1", "1")
    bench.sent("PRS", "6ESP")
    assert (bench.send("PRD"), bench.send("9CD6")) == ("0", "0")
    assert go(bench, "1+M5000") == 0


def test_an_origin_search_clears_it_too(bench: Bench) -> None:
    bench.sent("OLS1000", "PSS1", "6PS1000")
    go(bench, "1+M5000")
    assert go(bench, "00M") == 0
    assert (bench.send("PRD"), bench.send("9CD6")) == ("0", "0")


# The adjustment


@pytest.fixture
def adjusting(bench: Bench) -> Bench:
    bench.sent("EAS1", "PJS1", "PLS100", "PTS3")
    return bench


def slip_underway(bench: Bench, move: str, slipped: int) -> float:
    """Start a move, let the motor slip on the way, and wait for the last pulse of the move."""
    bench.sent(move)
    bench.wait(0.1)
    bench.axis.world.slipped = slipped
    bench.axis.sense(bench.now)
    train = bench.axis.motor.train
    assert train is not None
    assert train.ends_at is not None
    bench.wait(train.ends_at - bench.now)
    return bench.now


@pytest.mark.parametrize(("move", "target", "slipped"), [("1+M5000", 5000, 40), ("1AM-5000", -5000, 40)])
def test_what_was_lost_is_made_up_for_after_the_delay(
    adjusting: Bench, move: str, target: int, slipped: int
) -> None:
    """13.7.5: 30 ms of rest, then 40 pulses at 100 pps; only then the move has ended."""
    arrived = slip_underway(adjusting, move, slipped)
    assert adjusting.position() == target - slipped
    adjusting.wait(0.0299)
    assert adjusting.position() == target - slipped
    assert (adjusting.send("9CD0"), adjusting.send("1+M1")) == ("1", "@50")
    assert adjusting.until_end() == (move[:3], 0)
    assert adjusting.now == pytest.approx(arrived + 0.03 + 0.4)
    assert (adjusting.position(), adjusting.shaft()) == (target, target)


def test_the_standard_start_speed_is_that_of_an_adjustment_by_default(adjusting: Bench) -> None:
    adjusting.sent("PLS0", "PTS0", "OLS200")
    arrived = slip_underway(adjusting, "1+M5000", 40)
    adjusting.until_end()
    assert adjusting.now == pytest.approx(arrived + 0.2)


def test_of_the_standard_set_an_adjustment_needs_the_start_speed_only(adjusting: Bench) -> None:
    """PLS: the rest of the set, here a top speed below the start speed, is for moves that use it."""
    adjusting.sent("OLSS[1],50", "OHSS[1],5000", "OSSS[1],10000", "OASS[1],50", "OBSS[1],50")
    adjusting.sent("SPSA[1],A:S[1],D:S[1]", "PLS0", "OLS200", "OHS100")
    assert adjusting.send("1+M5000") == "@45"
    slip_underway(adjusting, "1+MA[1],5000", 40)
    assert adjusting.until_end() == ("1+M", 0)
    assert adjusting.position() == 5000


def test_a_move_that_arrives_ends_at_once(adjusting: Bench) -> None:
    arrived = slip_underway(adjusting, "1+M5000", 0)
    assert adjusting.axis.wake_at() is None
    assert [end.cause for end in adjusting.ends()] == [0]
    assert adjusting.now == arrived


def test_what_the_largest_adjustment_does_not_mend_is_a_stall_error(adjusting: Bench) -> None:
    adjusting.sent("PKS30")
    slip_underway(adjusting, "1+M5000", 40)
    assert adjusting.until_end() == ("1+M", 0x01)
    assert adjusting.position() == 4990
    assert [adjusting.send(text) for text in ("PRD", "9CD6", "1+M1")] == ["1", "1", "@52"]


@pytest.mark.parametrize("stop", ["5IS", "5SS"])
@pytest.mark.parametrize("moment", [0.01, 0.1])
def test_a_stop_ends_the_rest_as_well_as_the_adjustment(adjusting: Bench, stop: str, moment: float) -> None:
    slip_underway(adjusting, "1+M5000", 40)
    adjusting.wait(moment)
    adjusting.sent(stop)
    assert adjusting.until_end() == ("1+M", 0x10)
    assert 4960 <= adjusting.position() < 5000
    assert adjusting.axis.wake_at() is None


def test_a_loss_of_power_ends_the_rest(adjusting: Bench) -> None:
    slip_underway(adjusting, "1+M5000", 40)
    adjusting.axis.power_off(adjusting.now)
    adjusting.axis.power_on(adjusting.now)
    assert (adjusting.axis.wake_at(), adjusting.axis.motor.moving) == (None, False)


def test_moves_without_an_end_and_other_modes_are_not_adjusted(adjusting: Bench) -> None:
    adjusting.sent("1+MZ")
    adjusting.wait(0.1)
    adjusting.axis.world.slipped = 40
    adjusting.sent("5IS")
    assert adjusting.until_end() == ("1+M", 0x10)
    adjusting.sent("EAS0")
    slip_underway(adjusting, "1+M5000", 80)
    assert adjusting.axis.wake_at() is None
