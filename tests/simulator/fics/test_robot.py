"""One thing moves at a time, queries come between, stops and errors end it, and power takes it all away."""

import pytest

from protocols.fics.status import MotionMode
from simulator.fics.alarms import connection_lost, driver_error, emergency
from simulator.fics.layout import Layout
from simulator.fics.macros import Macro
from simulator.fics.settings import RobotSettings
from tests.simulator.fics.bench import Bench, cartesian

MOTIONS = (
    *("JOG Z+", "JTE Z255", "ORG", "LMI ,,50", "LMA ,,50", "POM 1"),
    *("PCK 160,140,-5", "MMI ,,50", "MMA ,,50"),
)


def homed(layout: Layout | None = None, mode: int = 3) -> Bench:
    bench = Bench(layout, mode=mode)
    bench.do("ORG")
    bench.robot.units[1].positions[1] = (160.0, 140.0)
    return bench


def under_way(motion: str, mode: int = 3) -> Bench:
    """A homed robot in the middle of a motion."""
    bench = homed(mode=mode)
    bench.ask(motion)
    assert bench.wait(0.02) == []
    return bench


def stands(bench: Bench) -> bool:
    """Say whether ACD tells that nothing moves."""
    (answer,) = bench.ask("ACD")
    return not any(int(status[1], 16) & 4 for status in answer[4:].split(","))


# Conversation


def test_after_power_on_it_is_in_ver_2_at_full_speed_and_knows_no_position() -> None:
    bench = Bench(mode=2)
    assert bench.ask("MOD") == ["MOD 2"]
    assert bench.ask("VAO") == ["VAO 100.0,100.0,100.0"]
    assert bench.ask("APS") == ["APS #####,#####,#####"]
    assert bench.ask("ERR") == ["ERR E00"]


def test_queries_are_answered_while_a_move_runs() -> None:
    bench = homed()
    assert bench.ask("LMI ,,30") == []
    # 150 mm/s after 0.1 s of 1500 mm/s².
    assert bench.wait(0.1) == []
    assert bench.ask("APS") == ["APS 150.00,150.00,7.50"]
    assert bench.ask("MPS") == ["MPS 0.00,0.00,7.50"]
    assert bench.finish() == ["LMI"]


def test_in_ver_2_the_end_of_a_move_is_seen_and_not_told() -> None:
    bench = homed(mode=2)
    assert bench.ask("LMI ,,30") == []
    assert not stands(bench)
    assert bench.finish() == []
    assert stands(bench)


def test_only_the_last_refusal_is_kept_and_err_takes_it() -> None:
    bench = Bench(mode=2)
    for command in ("VAO 0", "POS 1", "DRT"):
        assert bench.ask(command) == []
    assert [bench.ask("ERR"), bench.ask("ERR")] == [["ERR E08"], ["ERR E00"]]


# Stops


@pytest.mark.parametrize("motion", MOTIONS)
def test_aes_ends_any_motion_at_once_and_its_own_answer_comes_first(motion: str) -> None:
    bench = under_way(motion)
    before = bench.robot.unit.motor_places(bench.now)
    # JOG was answered when it began.
    assert bench.ask("AES") == ["AES", *([] if motion == "JOG Z+" else [f"{motion[:3]} 001"])]
    assert bench.finish() == []
    assert bench.robot.unit.motor_places(bench.now) == before
    assert bench.ask("ACD")[0].startswith("ACD 5")


@pytest.mark.parametrize("motion", MOTIONS)
def test_ass_ends_any_motion_and_is_answered_before_it_when_all_has_come_to_rest(motion: str) -> None:
    bench = under_way(motion)
    assert bench.ask("ASS") == []
    assert not stands(bench)
    assert bench.finish() == ["ASS", *([] if motion == "JOG Z+" else [motion[:3]])]
    assert stands(bench)
    assert bench.ask("ERR") == ["ERR E00"]


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("stop", ["AES", "ASS"])
def test_in_ver_2_stops_and_what_they_end_are_silent(motion: str, stop: str) -> None:
    bench = under_way(motion, mode=2)
    assert bench.do(stop) == []
    assert stands(bench)


def test_an_immediate_stop_overtakes_one_that_brakes() -> None:
    """C-HOST manual 1-7: nothing but (b) keeps AES from stopping."""
    bench = under_way("LMI ,,50")
    assert bench.ask("ASS") == []
    assert bench.ask("AES") == ["AES", "ASS", "LMI 001"]
    assert stands(bench)


@pytest.mark.parametrize("motion", MOTIONS)
def test_an_immediate_stop_may_ramp_down_in_the_state_emergency(motion: str) -> None:
    """C-HOST manual 2-7 does not tell how the axes stop, and 2-10 has 5 for EMERGENCY alone."""
    bench = under_way(motion)
    bench.robot.settings = RobotSettings(emergency_stop="brakes")
    assert bench.ask("AES") == ["AES"]
    assert not stands(bench)
    assert bench.ask("ACD")[0].startswith("ACD 5")
    assert bench.ask("LMI ,,1") == ["LMI E01"]
    assert bench.finish() == ([] if motion.startswith("JOG") else [f"{motion[:3]} 001"])
    assert stands(bench)
    assert bench.ask("LMI ,,1") == ["LMI E02"]


def test_a_decelerating_stop_in_the_state_emergency_is_answered_at_standstill() -> None:
    bench = under_way("LMI ,,50")
    bench.robot.settings = RobotSettings(emergency_stop="brakes")
    assert bench.ask("AES") == ["AES"]
    assert bench.ask("ASS") == []
    assert bench.finish() == ["ASS", "LMI 001"]


@pytest.mark.parametrize("second", ["ASS", "AES"])
def test_a_second_stop_is_refused_while_the_first_is_under_way(second: str) -> None:
    """ASS for certain (C-HOST manual 2-12), AES where it is assumed."""
    bench = under_way("LMI ,,50")
    bench.robot.settings = RobotSettings(stop_while_braking="refused")
    assert bench.ask("ASS") == []
    assert bench.ask(second) == [f"{second} E04"]
    assert bench.finish() == ["ASS", "LMI"]
    assert bench.ask("ERR") == ["ERR E04"]
    assert bench.ask(second) == [second]


def test_the_emergency_lasts_until_drt_whatever_is_asked() -> None:
    bench = homed()
    assert bench.ask("AES") == ["AES"]
    assert bench.ask("AES") == ["AES"]
    for _ in range(2):
        assert bench.ask("ERR") == ["ERR 001"]
    for motion in MOTIONS:
        assert bench.ask(motion) == [f"{motion[:3]} E02"]
    assert bench.ask("JOG Z") == ["JOG"]
    assert bench.ask("ASS") == ["ASS"]
    bench.asked("DRT")
    assert bench.do("LMI ,,1") == ["LMI"]


@pytest.mark.parametrize("stop", ["AES", "ASS"])
def test_a_stopped_homing_leaves_no_origin(stop: str) -> None:
    bench = Bench()
    bench.ask("ORG")
    bench.wait(0.5)
    bench.do(stop)
    bench.asked("DRT")
    assert bench.ask("APS") == ["APS #####,#####,#####"]
    bench.home()


@pytest.mark.parametrize("stop", ["AES", "ASS"])
def test_a_stopped_macro_does_no_further_step(stop: str) -> None:
    bench = under_way("PCK 160,140,-5")
    bench.do(stop)
    assert bench.ask("IDO 1") == ["IDO 00"]
    assert bench.finish() == []


def test_ass_ends_the_pause_of_a_macro_at_once() -> None:
    bench = homed(Layout(macros={"NAP": Macro(7, ("WAIT 100", "IOT 1-0:+"))}))
    assert bench.ask("NAP") == []
    bench.wait(1)
    assert bench.ask("ASS") == ["ASS", "NAP"]
    assert bench.line.wake_at() is None
    assert bench.ask("IDO 1") == ["IDO 00"]


@pytest.mark.parametrize("mode", [2, 3])
def test_while_somebody_edits_at_the_teaching_terminal_no_stop_is_taken(mode: int) -> None:
    bench = under_way("LMI ,,50", mode)
    bench.robot.editing = True
    for stop in ("AES", "ASS"):
        assert bench.ask(stop) == ([f"{stop} E03"] if mode == 3 else [])
        assert bench.ask("ERR") == ["ERR E03"]
    assert not stands(bench)
    assert bench.finish() == (["LMI"] if mode == 3 else [])


@pytest.mark.parametrize("activity", [MotionMode.MACRO, MotionMode.HOMING, MotionMode.JOG])
@pytest.mark.parametrize("stop", ["AES", "ASS"])
def test_a_stop_ends_what_the_teaching_terminal_runs_for_good(activity: MotionMode, stop: str) -> None:
    bench = homed()
    bench.robot.terminal = activity
    bench.asked(stop, "DRT")
    assert bench.ask("ACD")[0].startswith("ACD 0")
    assert bench.do("LMI ,,1") == ["LMI"]


@pytest.mark.parametrize("activity", [MotionMode.MACRO, MotionMode.HOMING, MotionMode.JOG])
def test_a_loss_of_power_ends_what_is_done_at_the_teaching_terminal(activity: MotionMode) -> None:
    bench = homed()
    bench.robot.terminal, bench.robot.editing = activity, True
    bench.line.power_off(bench.now)
    bench.line.power_on(bench.now)
    assert bench.robot.blocks() == frozenset()


# JOG


def test_no_axis_joins_a_jog_that_is_being_stopped() -> None:
    bench = under_way("JOG Z+")
    assert bench.ask("ASS") == []
    assert bench.ask("JOG A+") == ["JOG E01"]
    assert bench.finish() == ["ASS"]
    assert bench.ask("MPS")[0].startswith("MPS 0.00,0.00,")


def test_a_jog_ends_when_the_last_of_its_axes_stands() -> None:
    bench = under_way("JOG Z+")
    bench.asked("JOG A+", "JOG Z")
    bench.wait(1)
    assert bench.ask("LMI 1") == ["LMI E01"]
    bench.asked("JOG A")
    bench.finish()
    assert bench.do("LMI ,,1") == ["LMI"]


# Units


def test_a_macro_keeps_to_its_unit_when_the_host_goes_on_to_another() -> None:
    bench = homed(Layout(units=2, macros={"TWO": Macro(7, ("LMI ,,1", "LMI ,,2"))}))
    assert bench.ask("TWO") == []
    bench.asked("UNT 2")
    assert bench.finish() == ["TWO"]
    assert bench.ask("APS") == ["APS 0.00,0.00,0.00"]
    bench.asked("UNT 1")
    assert bench.ask("APS") == ["APS 150.00,150.00,3.00"]


def test_with_several_units_no_position_is_told_while_any_of_them_may_move() -> None:
    one, two = homed(), homed(Layout(units=2))
    for bench in (one, two):
        assert bench.ask("PCK 160,140,-5") == []
    assert one.ask("APS") == ["APS 150.00,150.00,0.00"]
    assert two.ask("APS") == ["APS #####,#####,#####"]


@pytest.mark.parametrize(
    ("activity", "position"),
    [
        (MotionMode.MACRO, "#####,#####,#####"),
        (MotionMode.HOMING, "#####,#####,#####"),
        (MotionMode.JOG, "150.00,150.00,0.00"),
    ],
)
def test_what_the_teaching_terminal_runs_shows(activity: MotionMode, position: str) -> None:
    bench = homed(Layout(units=2))
    bench.robot.terminal = activity
    assert bench.ask("APS") == [f"APS {position}"]
    assert bench.ask("ACD") == [f"ACD {activity:X}300,{activity:X}300,{activity:X}300"]


# Errors of the system


def test_the_stop_input_outlasts_drt() -> None:
    bench = under_way("LMI ,,50")
    bench.robot.stop_input = True
    bench.robot.raise_alarm(emergency(), bench.now)
    bench.line.look_after(bench.now)
    assert bench.heard() == ["LMI 001"]
    bench.asked("DRT")
    assert bench.ask("ERR") == ["ERR 001"]
    bench.robot.stop_input = False
    bench.asked("DRT")
    assert bench.ask("ERR") == ["ERR E00"]


def test_a_driver_that_does_not_answer_outlasts_drt() -> None:
    bench = homed()
    bench.motor("B").silent = True
    bench.robot.raise_alarm(connection_lost(0, "B"), bench.now)
    assert bench.ask("APS") == ["APS #####,#####,0.00"]
    assert bench.ask("MPS") == ["MPS 0.00,#####,0.00"]
    assert bench.ask("ACD") == ["ACD 0300,0900,0300"]
    bench.asked("DRT")
    assert bench.ask("ERD") == ["ERD  B C"]
    bench.motor("B").silent = False
    bench.asked("DRT")
    assert bench.ask("ERD") == ["ERD ----"]
    assert bench.ask("APS") == ["APS 150.00,150.00,0.00"]


def test_an_error_of_one_driver_ends_the_motion_and_is_forgotten_by_drt() -> None:
    bench = under_way("LMI ,,50")
    bench.motor("A").driver_error = 0x41
    bench.robot.raise_alarm(driver_error(0, "A", 0x41), bench.now)
    bench.line.look_after(bench.now)
    assert bench.heard() == ["LMI 002"]
    assert bench.ask("ACD") == ["ACD 0941,0300,0300"]
    bench.asked("DRT")
    assert bench.ask("ACD") == ["ACD 0300,0300,0300"]


# Power


def test_power_takes_the_origin_the_speeds_and_the_mode_and_leaves_settings_and_positions() -> None:
    bench = homed()
    bench.asked("VAO 50,50,50", "MAO 40", "VSO 400", "SLP ,,90", "VAR V1=7", "IOT 1-0:+", "POF 1")
    bench.line.power_off(bench.now)
    assert bench.ask("MOD") == []
    bench.line.power_on(bench.now)
    assert bench.ask("MOD 3") == ["MOD"]
    assert bench.ask("APS") == ["APS #####,#####,#####"]
    assert bench.ask("VAO") == ["VAO 100.0,100.0,100.0"]
    assert bench.ask("MAO") == ["MAO 100.0,100.0,100.0"]
    assert bench.ask("VSO") == ["VSO 400,500,300"]
    assert bench.ask("SLP") == ["SLP 300,300,90"]
    assert bench.ask("VAR V1") == ["VAR V01=+7"]
    assert bench.ask("IDO 1") == ["IDO 00"]
    assert bench.ask("POR") == ["POS 160,140", "POE"]


@pytest.mark.parametrize("motion", MOTIONS)
def test_without_power_everything_stands_where_it_is_and_nothing_is_said(motion: str) -> None:
    bench = under_way(motion)
    motors = bench.robot.unit.motors
    places = bench.robot.unit.motor_places(bench.now)
    before = [motor.zero + place for motor, place in zip(motors, places, strict=True)]
    bench.line.power_off(bench.now)
    assert bench.finish() == []
    bench.line.power_on(bench.now)
    assert [motor.zero + motor.at for motor in motors] == pytest.approx(before)
    assert stands(bench)
    assert bench.ask("MOD 3") == ["MOD"]
    bench.home()


# The truth


def test_the_truth_log_tells_commands_motions_and_errors_with_the_request_they_are_for() -> None:
    bench = Bench(cartesian())
    truth = bench.line.truth
    bench.ask("LMI 10")
    bench.wait(0.1)
    bench.ask("AES")
    (start,), (stop,), (alarm,) = truth.of("motion_start"), truth.of("motion_stop"), truth.of("alarm")
    assert [fact.facts["text"] for fact in truth.of("command")] == ["MOD 3", "LMI 10", "AES"]
    assert (start.request, start.facts["name"], stop.facts["why"], stop.at) == (2, "LMI", "alarm", 0.1)
    assert (alarm.facts["code"], alarm.request) == (1, 3)
    assert [fact.request for fact in truth.of("reply")] == [1, 3, 2]
