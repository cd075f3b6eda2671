"""One controller as a whole: time, power, the truth, and whatever a host may throw at it."""

from itertools import pairwise

import pytest
from hypothesis import settings
from hypothesis import strategies as st
from hypothesis.stateful import RuleBasedStateMachine, invariant, rule

from protocols.rorze.link import MoveEnded
from simulator.rorze.actions import codes_acted_out
from simulator.rorze.controller import Rc420
from simulator.rorze.world import CCW_LIMIT, CW_LIMIT, EMS, ORIGIN, Span
from simulator.truth import TruthLog
from tests.simulator.rorze.bench import BODY, Bench


@pytest.fixture
def bench() -> Bench:
    return Bench()


def test_a_fresh_controller_stands_at_zero_and_waits_for_nothing(bench: Bench) -> None:
    assert (bench.position(), bench.send("9CD"), bench.send("9MD")) == (0, "H00", "H00")
    assert bench.axis.wake_at() is None


@pytest.mark.parametrize("text", ["", "6", "6P", "XXX", "1+m5", "6PD6PD", "&3F6PD", "9CD-1", "5CS", "🙂🙂🙂"])
def test_what_is_no_command_is_refused_and_marked(bench: Bench, text: str) -> None:
    assert bench.send(text) in {"@49", "@4A"}
    assert bench.send("9CD") == "H08"


def test_nothing_happens_before_its_time(bench: Bench) -> None:
    bench.sent("2+M2")
    bench.wait(0.0399)
    assert (bench.position(), bench.ends()) == (1, [])
    assert bench.axis.wake_at() == pytest.approx(0.04)
    bench.wait(0.0002)
    assert (bench.position(), len(bench.ends())) == (2, 1)
    assert bench.axis.wake_at() is None


def test_the_end_of_a_move_is_dated_when_it_happened_not_when_it_was_noticed(bench: Bench) -> None:
    bench.sent("2+M50")
    bench.wait(1_000)
    (message,) = bench.axis.take_messages()
    assert message.at == pytest.approx(1.0)
    assert message.frame == MoveEnded(BODY, "2+M", 0)
    assert bench.axis.take_messages() == []


def test_the_truth_tells_every_start_and_stop_of_pulses(bench: Bench) -> None:
    bench.sent("2+M50")
    bench.wait(2)
    assert bench.send("6PD") == "+000000050"
    told = [(fact.kind, fact.at, fact.facts.get("at")) for fact in bench.truth]
    assert told == [
        ("pulses_start", 0.0, 0),
        ("command", 0.0, None),
        ("pulses_stop", pytest.approx(1.0), 50),
        ("command", 2.0, None),
    ]


def test_a_loss_of_power_stops_the_motor_and_forgets_what_was_not_saved(bench: Bench) -> None:
    bench.sent("OHS40000", "3PSP[5],55", "3IS9", "9CS", "2+MZ")
    bench.wait(1)
    bench.axis.power_off(bench.now)
    bench.wait(1)
    assert (bench.axis.wake_at(), bench.axis.take_messages(), bench.shaft()) == (None, [], 50)
    bench.axis.power_on(bench.now)
    answers = [bench.send(text) for text in ("6PD", "6ED", "OHD", "3PDP[5]", "3ID", "9MD", "9CD")]
    assert answers == ["+000000000", "+000000000", "00050000", "+000000000", "0000", "H00", "H00"]
    assert bench.truth.of("pulses_stop")[-1].facts["why"] == "power"
    assert bench.shaft() == 50, "the shaft stays where it was"


def test_another_board_would_keep_its_position_without_power(bench: Bench) -> None:
    bench.axis.keeps_position = True
    bench.sent("6PS500", "OHS40000")
    bench.axis.power_off(bench.now)
    bench.axis.power_on(bench.now)
    assert [bench.send(text) for text in ("6PD", "OHD")] == ["+000000500", "00050000"]


def test_another_board_would_keep_its_comments_without_power(bench: Bench) -> None:
    bench.axis.keeps_comments = True
    bench.sent("9VS2,ABC", "OHS40000")
    bench.axis.power_off(bench.now)
    bench.axis.power_on(bench.now)
    assert [bench.send(text) for text in ("9VD2", "OHD")] == ["ABC", "00050000"]


def test_flash_survives_a_loss_of_power(bench: Bench) -> None:
    bench.sent("OHS40000", "3IS9")
    bench.axis.flash.settings = bench.axis.settings
    bench.axis.flash.positions = (7,) * 2048
    bench.axis.power_off(bench.now)
    bench.axis.power_on(bench.now)
    assert [bench.send(text) for text in ("OHD", "3ID", "3PDP[2047]")] == ["00040000", "0009", "+000000007"]
    bench.sent("3PSP[2047],8")
    assert bench.axis.flash.positions[2047] == 7


def test_a_sensor_changed_by_hand_is_felt_at_once(bench: Bench) -> None:
    bench.sent("2+MZ")
    bench.wait(1.01)
    bench.force(CW_LIMIT, True)
    assert [ended.cause for ended in bench.ends()] == [0x02]
    assert bench.position() == 50


def test_a_sensor_changed_without_power_is_seen_when_it_returns(bench: Bench) -> None:
    bench.axis.power_off(bench.now)
    bench.force(EMS, True)
    bench.axis.power_on(bench.now)
    assert bench.send("1+M5") == "@51"


def test_every_command_of_the_first_chapters_is_acted_out() -> None:
    expected = """00M 01M 02M 03M 04M 0QM 0BD 0BS 0PD 0RD 0RS 0SD 0SS 1+M 1-M 1AM 2+M 2-M 2AM
        3+S 3-S 3*S 3/S 3CS 3ID 3IS 3ND 3PD 3PS 5IS 5SS 5AS 5CS 5DS 5MD 5MS 6ED 6ES 6MD 6PD 6PS
        9CD 9CS 9MD 9VD 9VS OAD OAS OBD OBS OHD OHS OLD OLS OSD OSS SED SES SHD SPD SPS SSD"""
    assert set(expected.split()) <= codes_acted_out()


def test_the_dialogue_of_the_sample_program(bench: Bench) -> None:
    """17.2: set up, home, centre the STALL disc, switch detection on, then move to and fro."""
    bench.sent("EAS0", "QIS2000", "OHS50000", "OLS5000", "OSS500000", "OAS30", "OBS10", "0SS50")
    for text in ("00M", "0QM"):
        bench.sent(text)
        assert bench.until_end() == (text, 0)
    bench.sent("QSS1")
    for text in ("1+M2000", "1-M2000", "1+M1000", "1-M1000"):
        bench.sent(text)
        assert bench.until_end() == (text[:3], 0)
    assert (bench.position(), bench.send("9CD")) == (0, "H00")


WORDS = """00M 01M 02M 03M 04M 0QM 1+MZ 1-MZ 2+MZ 5IS 5SS 5AS 5DS 5MS 5MSS[1] 6PSC 6ESP 6PD 9CD 9MD 9CS
    3IS5 SPSA[1],A:S[1],D:S[1] OLSS[1],100 OHSS[1],9000 OSSS[1],50000 OASS[1],20 OBSS[1],70
    SSDA[1] SEDA[1],0 SESA[1] SHD50,9000 QSS1 QRS 0RS2 CLD EAS0 EAS1 EAS2
    PSS1 PSS0 PRS PES0 PES3000 PAS2 PBS1.50 PJS1 PKS20 PLS500 PTS0 PTS50 UES0 UES1
    EPS-900,900 EPS DCS10,20 DCS12,5 DCS14,9 DLS2,1 DLS2,0 FIS FPS ERD CBS3,50 COS1,1 CESL,3,1 CRS CPS8,1"""

COMMANDS = st.one_of(
    st.builds("{}{}".format, st.sampled_from(["1+M", "1-M", "2+M", "2-M"]), st.integers(0, 3_000)),
    st.builds("{}{}".format, st.sampled_from(["1AM", "2AM", "6PS", "6ES"]), st.integers(-3_000, 3_000)),
    st.builds("{}P[{}]".format, st.sampled_from(["1+M", "2AM", "3PD", "3ND"]), st.sampled_from("+-05")),
    st.builds("3PSP[{}],{}".format, st.sampled_from("+-05"), st.integers(-2_000, 2_000)),
    st.builds("OLS{}".format, st.integers(1, 5_000)),
    st.builds("OHS{}".format, st.integers(1, 20_000)),
    st.builds("5CS{}".format, st.integers(1, 20_000)),
    st.builds("SESA[1],{},F{},S{}".format, st.integers(0, 2), st.integers(0, 2_000), st.integers(1, 9_000)),
    st.builds("1+MA[1],{}".format, st.integers(1, 3_000)),
    st.sampled_from(WORDS.split()),
    st.text(st.characters(min_codepoint=33, max_codepoint=126), max_size=12),
)


class AnyHost(RuleBasedStateMachine):
    """A controller under any questions at any time: it answers, and its position is the sum of its pulses."""

    def __init__(self) -> None:
        super().__init__()
        self.now = 1_000.0
        self.truth = TruthLog()
        self.axis = Rc420(BODY, self.now, self.truth)
        self.axis.world.origin = Span(-400, -300)
        self.axis.world.ccw_limit = Span(-2_000, -1_900)
        self.axis.world.cw_limit = Span(3_000, 3_100)
        self.axis.world.slipped = 0
        self.last_message_at = 0.0

    @rule(text=COMMANDS)
    def command(self, text: str) -> None:
        response = self.axis.execute(text, self.now)
        assert response.payload.isprintable()
        assert response.delay_s >= 0

    @rule(seconds=st.floats(0, 3))
    def wait(self, seconds: float) -> None:
        self.now += seconds
        self.axis.advance(self.now)

    @rule(sensor=st.sampled_from([ORIGIN, CW_LIMIT, CCW_LIMIT, EMS]), on=st.booleans())
    def force(self, sensor: int, on: bool) -> None:
        self.axis.world.forced[sensor] = on
        self.axis.sense(self.now)

    @rule(pulses=st.integers(-300, 300))
    def slip(self, pulses: int) -> None:
        self.axis.world.slipped += pulses
        self.axis.sense(self.now)

    @rule()
    def let_go(self) -> None:
        self.axis.world.forced.clear()
        self.axis.sense(self.now)

    @rule()
    def power_cycle(self) -> None:
        self.axis.power_off(self.now)
        self.axis.power_on(self.now)

    @invariant()
    def it_wakes_later(self) -> None:
        wake = self.axis.wake_at()
        assert wake is None or wake > self.now
        assert not self.axis.motor.moving or wake is not None

    @invariant()
    def messages_come_in_order(self) -> None:
        for message in self.axis.take_messages():
            assert self.last_message_at <= message.at <= self.now
            self.last_message_at = message.at

    @invariant()
    def pulses_add_up(self) -> None:
        """Starts and stops alternate, and each stretch begins where the one before it ended."""
        facts = [fact for fact in self.truth if fact.kind in {"pulses_start", "pulses_stop"}]
        for before, after in pairwise(facts):
            assert before.kind != after.kind
            if after.kind == "pulses_start":
                assert before.facts["at"] == after.facts["at"]
            else:
                moved = int(str(after.facts["at"])) - int(str(before.facts["at"]))
                assert moved * int(str(before.facts["direction"])) >= 0
        runs = self.axis.motor.train is not None
        assert runs == (bool(facts) and facts[-1].kind == "pulses_start")
        if facts and not runs:
            assert self.axis.motor.pulses(self.now) == facts[-1].facts["at"]


AnyHost.TestCase.settings = settings(max_examples=40, stateful_step_count=40, deadline=None)
TestAnyHost = AnyHost.TestCase
