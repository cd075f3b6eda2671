"""The moves of a SCARA robot (RC-420 manual 13.10, 14.H)."""

from cmath import rect
from collections.abc import Callable, Sequence
from math import radians

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from protocols.rorze.link import MoveEnded
from protocols.rorze.path import Corner, Segment, rounded
from protocols.rorze.profile import Profile, SpeedParameters, plan
from protocols.rorze.scara import BeltLinked, Mechanics, ThreeAxes
from simulator.rorze.controller import StallFinder
from simulator.rorze.world import CCW_LIMIT, CW_LIMIT, EMS, Span
from tests.simulator.rorze.robot import BELTS, THREE_AXES, RobotBench

SPEED = SpeedParameters(low=1_000, high=1_000_000, acceleration=5_000_000, rising=50, falling=50)
"""Speeds of pattern 3."""

COARSEST = 360_000 / 60_000
"""Thousandths of a degree a pulse, of the coarsest axis."""

HALF_PULSES = 0.55 * sum(360_000 / turn for turn in THREE_AXES.pulses_per_turn)
"""Thousandths of a degree that the finger may turn: each axis stands up to half a pulse beside its place."""

CORNERED = ("HDSH[0]", "HDSH[0],0,X:255000,Y:300000,R:120000", "HDSH[0],1,X:255000,Y:450000,R:0")
"""The path of 13.10.7."""


@pytest.fixture
def robot() -> RobotBench:
    return RobotBench()


def along(segments: Sequence[Segment], distance: float) -> complex:
    for segment in segments:
        if distance <= segment.length:
            return segment.at(distance)
        distance -= segment.length
    return segments[-1].at(segments[-1].length)


def speed_curve(segments: Sequence[Segment]) -> Profile:
    return plan(round(sum(segment.length for segment in segments)), SPEED, SPEED)


def follows(robot: RobotBench, segments: Sequence[Segment]) -> None:
    """The finger's end is where the speed curve has it on the ideal path, at every tick to the end.

    The finger keeps its direction.
    """
    begun, direction = robot.now, robot.place().direction
    profile = speed_curve(segments).starting_at(begun)
    for now in robot.ticks():
        ideal = along(segments, profile.position(now))
        assert abs(robot.end() - ideal) <= 2 * robot.pulse_um()
        if robot.robot is THREE_AXES:
            assert abs(robot.place().direction - direction) <= HALF_PULSES
    assert robot.now == pytest.approx(begun + (profile.duration_s or 0), abs=2e-3)
    assert [(ended.code, ended.cause) for ended in robot.ends()] == [("HMM", 0)] * robot.robot.axes


def straight(robot: RobotBench, way: complex) -> list[Segment]:
    return rounded(robot.end(), [Corner(robot.end() + way)])


# Along the path


@pytest.mark.parametrize(
    ("preparation", "way"),
    [
        ("HXSA[3],-50000", -50_000),
        ("HYSA[3],100000", 100_000j),
        ("HYSA[3],-100000", -100_000j),
        ("H+SA[3],50000", 50_000j),
        ("H-SA[3],100000", -100_000j),
        ("H+SA[3],400000", 400_000j),
    ],
)
def test_the_finger_end_goes_straight_along_the_speed_curve(
    robot: RobotBench, preparation: str, way: complex
) -> None:
    """From the place of 13.10.7; the last extension passes the centre."""
    robot.start(preparation)
    follows(robot, straight(robot, way))


def test_a_rounded_path_is_followed_at_full_speed(robot: RobotBench) -> None:
    robot.sent(*CORNERED)
    robot.start("HMSA[3],H[0]")
    corners = [Corner(255_000 + 300_000j, 120_000), Corner(255_000 + 450_000j)]
    follows(robot, rounded(robot.end(), corners))


def test_a_path_has_up_to_sixteen_points(robot: RobotBench) -> None:
    """Round and round a square in H[63], the corners rounded."""
    square = (60_000 + 135_000j, 60_000 + 255_000j, -60_000 + 255_000j, -60_000 + 135_000j)
    corners = [Corner(square[number % 4], 20_000 if number < 15 else 0) for number in range(16)]
    for number, (at, radius) in enumerate(corners):
        robot.sent(f"HDSH[63],{number},X:{at.real:.0f},Y:{at.imag:.0f},R:{radius}")
    robot.start("HMSA[3],H[63]")
    follows(robot, rounded(robot.end(), corners))


def test_belts_carry_the_finger_end_along_the_path() -> None:
    """13.10.11."""
    robot = RobotBench(BELTS, (12_000, 9_000))
    robot.sent("HDSH[3]", "HDSH[3],0,X:200000,Y:150000,R:50000", "HDSH[3],1,X:200000,Y:-50000,R:0")
    robot.start("HMSA[3],H[3]")
    follows(robot, rounded(robot.end(), [Corner(200_000 + 150_000j, 50_000), Corner(200_000 - 50_000j)]))


@pytest.mark.parametrize("preparation", ["H-SA[3],300000", "H+SA[3],100000"])
def test_belts_extend_the_arm_along_the_finger(preparation: str) -> None:
    robot = RobotBench(BELTS, (12_000, 9_000))
    heading = radians(12_000 / 98_765.0 * 360)
    amount = int(preparation.split(",")[1]) * (1 if "+" in preparation else -1)
    robot.start(preparation)
    follows(robot, straight(robot, rect(amount, heading)))


def test_over_the_centre_to_the_other_side(robot: RobotBench) -> None:
    """13.10.6: CENTER between two places on a line with the origin."""
    robot.sent("HDSH[3]", "HDSH[3],0,CENTER", "HDSH[3],1,X:0,Y:600000,R:0")
    robot.start("HMSA[3],H[3]")
    follows(robot, rounded(robot.end(), [Corner(600_000j)]))
    assert robot.positions()[1] > 0, "the arm has bent the other way"


def test_past_the_centre_the_base_whirls_round(robot: RobotBench) -> None:
    """13.10.6 warns of it: without CENTER half a turn of the base takes next to no time."""
    robot.start("HYSA[3],400000")
    fastest = 0
    before = robot.positions()[0]
    for _ in robot.ticks():
        fastest = max(fastest, abs(robot.positions()[0] - before))
        before = robot.positions()[0]
    assert fastest > 121_791 * 0.45, "in a single tick"
    assert robot.end() == pytest.approx(515_000j, abs=100)


@settings(max_examples=12)
@given(
    at=st.tuples(st.integers(-60_000, 60_000), st.integers(4_000, 26_000), st.integers(-50_000, 50_000)),
    way=st.builds(complex, st.integers(-90_000, 90_000), st.integers(-90_000, 90_000)),
)
def test_any_way_between_two_places_within_reach(at: tuple[int, int, int], way: complex) -> None:
    robot = RobotBench(at=(at[0], -at[1], at[2]))
    end = robot.end() + way
    robot.sent("HDSH[5]", f"HDSH[5],0,X:{round(end.real)},Y:{round(end.imag)},R:0")
    robot.tell_positions()
    answers = robot.send("HMSA[3],H[5]")
    if answers != [""] * 3:
        assert answers == ["@63"] * 3
        return
    begun = robot.end()
    robot.sent("HMM")
    profile = plan(max(1, round(abs(end - begun))), SPEED, SPEED)
    pivot = robot.robot.guide(begun, radians(robot.place().direction / 1000))
    target = robot.robot.guide(end, radians(robot.place().direction / 1000))
    near = abs((pivot.conjugate() * (target - pivot)).imag) / max(1.0, abs(target - pivot))
    for now in robot.ticks():
        if near > 20_000:
            share = profile.position(now) / max(1, round(abs(end - begun)))
            assert abs(robot.end() - begun - share * (end - begun)) <= 2 * robot.pulse_um() + 1
    assert abs(robot.end() - end) <= 2 * robot.pulse_um() + 1


# Turning about a point of the finger


def test_the_finger_turns_about_one_of_its_points(robot: RobotBench) -> None:
    robot.start("HRSA[3],R:150000,F:0")
    finger = radians(robot.place().direction / 1000)
    pivot = robot.end() - rect(180_000, finger)
    length = 180_000 * finger
    profile = plan(round(length), SPEED, SPEED).starting_at(robot.now)
    for now in robot.ticks():
        turned = finger * (1 - profile.position(now) / round(length))
        assert abs(robot.end() - pivot - rect(180_000, turned)) <= 2 * robot.pulse_um()
        assert radians(robot.place().direction / 1000) == pytest.approx(turned, abs=radians(COARSEST / 1000))
    assert robot.place().direction == pytest.approx(0, abs=COARSEST)


@pytest.mark.parametrize(("angle", "turned"), [(-80_000, -170_000), (-100_000, 170_000), (450_000, 0)])
@pytest.mark.parametrize("code", ["HRSA[3],R:0,", "HFMA[3],"])
def test_the_finger_turns_the_shorter_way(robot: RobotBench, code: str, angle: int, turned: int) -> None:
    before = robot.place().direction
    robot.tell_positions()
    robot.sent(f"{code}F:{angle}", *(["HMM"] if code.startswith("HRS") else []))
    assert set(robot.until_end()) == {0}
    assert robot.place().direction - before == pytest.approx(turned, abs=COARSEST)


@pytest.mark.parametrize("text", ["HFMA[3],F:60000", "HFMA[3],60000"])
def test_the_finger_axis_alone_turns_the_finger(robot: RobotBench, text: str) -> None:
    """In pps; the others have nothing to do, and are done at once."""
    robot.tell_positions()
    before = robot.positions()
    robot.sent(text)
    assert [ended.body for ended in robot.ends()] == [2, 3]
    assert robot.until_end() == [0]
    assert robot.positions()[:2] == before[:2]
    assert robot.place().direction == pytest.approx(60_000, abs=2)


# Towards the target of an extension


@pytest.mark.parametrize(
    ("target", "at"),
    [
        ("X:100000,Y:400000", (-10_149, -10_000, -16_666)),
        ("X:-300000,Y:-300000", (-10_149, -10_000, -16_666)),
        ("X:0,Y:-200000", (40_000, 12_000, 3_000)),
        ("H[3]", (0, -20_000, 0)),
    ],
)
def test_base_and_finger_turn_to_the_line_of_the_target(target: str, at: tuple[int, ...]) -> None:
    """13.10.6: then an extension over the centre ends there, without a jump of the base."""
    robot = RobotBench(at=at)
    robot.sent("HDSH[3]", "HDSH[3],0,CENTER", "HDSH[3],1,X:-200000,Y:350000,R:0")
    robot.tell_positions()
    robot.sent(f"HNMA[3],{target}")
    assert robot.until_end() == [0] * 3
    base, arm, finger = (after - before for after, before in zip(robot.positions(), at, strict=True))
    assert abs(base) <= 121_791 / 4
    assert arm == 0
    assert abs(finger) <= 100_000 / 4
    end = -200_000 + 350_000j
    if not target.startswith("H"):
        x, y = (int(part[2:]) for part in target.split(","))
        end = complex(x, y)
    pose = robot.robot.pose(robot.positions())
    for direction in (pose.heading, pose.finger):
        assert (rect(1, direction) / end).imag * abs(end) == pytest.approx(0, abs=2e-4)


def test_belts_turn_the_finger_to_the_target() -> None:
    robot = RobotBench(BELTS, (0, 9_000))
    robot.tell_positions()
    robot.sent("HNMA[3],X:-100000,Y:100000")
    assert robot.until_end() == [0, 0]
    assert robot.place().direction == pytest.approx(135_000, abs=4)


@pytest.mark.parametrize(
    ("text", "code"),
    [
        ("HNMA[3],X:0,Y:0", "@64"),
        ("HNMA[3],H[7]", "@64"),
        ("HNMA[3],H[8]", "@64"),
        ("HNMA[3],X:0,Y:760001", "@63"),
    ],
)
def test_a_target_needs_a_direction_and_the_arm(robot: RobotBench, text: str, code: str) -> None:
    robot.sent("HDSH[8],0,CENTER")
    robot.tell_positions()
    assert robot.send(text) == [code] * 3
    robot.sent("HNMA[3],X:0,Y:760000")


# Set-up


PREPARATIONS = ("HMSA[3],H[0]", "HXSA[3],1000", "HYSA[3],1000", "H+SA[3],1000", "H-SA[3],1000")
ALL = (*PREPARATIONS, "HRSA[3],R:150000,F:0", "HFMA[3],F:0", "HNMA[3],X:0,Y:300000")


@pytest.mark.parametrize("text", ALL)
def test_without_the_positions_of_all_axes_nothing_is_calculated(robot: RobotBench, text: str) -> None:
    robot.sent(*CORNERED)
    robot.sent("HPS0,-10149", "HPS1,-10000")
    assert robot.send(text) == ["@61"] * 3
    robot.sent("HPS2,-16666", text)


@pytest.mark.parametrize("text", ALL)
def test_a_controller_needs_an_axis_of_the_robot(robot: RobotBench, text: str) -> None:
    robot.sent(*CORNERED)
    robot.tell_positions()
    robot.axes[2].execute("HCS3", robot.now)
    assert robot.send(text) == ["", "", "@64"]


@pytest.mark.parametrize("text", ["HRSA[3],R:150000,F:0", "HFMA[3],F:0"])
def test_belts_have_no_axis_for_the_finger(text: str) -> None:
    robot = RobotBench(BELTS, (0, 0))
    robot.tell_positions()
    assert robot.send(text) == ["@64", "@64"]


@pytest.mark.parametrize("text", ["HXSA[4],1000", "HFMA[4],F:0", "HNMA[4],X:0,Y:300000"])
def test_the_pattern_must_be_there(robot: RobotBench, text: str) -> None:
    robot.tell_positions()
    assert robot.send(text) == ["@47"] * 3


@pytest.mark.parametrize(
    "points",
    [
        (),
        ("1,X:100,Y:100000,R:0",),
        ("0,X:0,Y:200000,R:10",),
        ("0,X:0,Y:200000,R:100000", "1,X:100000,Y:200000,R:0"),
    ],
)
def test_a_path_that_cannot_be_is_refused(robot: RobotBench, points: tuple[str, ...]) -> None:
    """No points, a gap before the first, a rounded end, an arc that needs more than the line there is."""
    robot.sent(*(f"HDSH[1],{point}" for point in points))
    robot.tell_positions()
    assert robot.send("HMSA[3],H[1]") == ["@64"] * 3


@pytest.mark.parametrize(
    "text", ["HXSA[3],900000", "HYSA[3],-216000", "H-SA[3],216000", "HRSA[3],R:900000,F:-90000"]
)
def test_a_way_out_of_reach_is_refused(robot: RobotBench, text: str) -> None:
    """The wrist stands 215 mm behind the origin and comes 430 mm from it."""
    robot.tell_positions()
    assert robot.send(text) == ["@63"] * 3
    assert robot.send("HMM") == ["@61"] * 3


def test_a_point_out_of_reach_is_refused_though_its_corner_is_cut(robot: RobotBench) -> None:
    """With the finger at 90 degrees, the wrist comes to Y = 760 mm - 330 mm."""
    robot.sent("HDSH[1],1,X:100000,Y:300000,R:0", "HDSH[1],0,X:0,Y:759000,R:10000")
    robot.tell_positions()
    robot.sent("HMSA[3],H[1]", "HDSH[1],0,X:0,Y:761000,R:10000")
    assert robot.send("HMSA[3],H[1]") == ["@63"] * 3


def test_distances_may_stand_in_the_position_table(robot: RobotBench) -> None:
    robot.sent("3PSP[7],-50000")
    robot.start("HXSA[3],P[7]")
    follows(robot, straight(robot, -50_000))


def test_every_move_needs_its_own_preparation(robot: RobotBench) -> None:
    assert robot.send("HMM") == ["@61"] * 3
    robot.start("HXSA[3],-1000")
    assert set(robot.until_end()) == {0}
    assert robot.send("HMM") == ["@61"] * 3
    robot.tell_positions()
    robot.sent("HXSA[3],-1000")
    for axis in robot.axes:
        axis.power_off(robot.now)
        axis.power_on(robot.now)
    assert robot.send("HMM") == ["@61"] * 3


def test_a_way_of_nothing_ends_at_once(robot: RobotBench) -> None:
    robot.start("HXSA[3],0")
    assert [(ended.code, ended.cause) for ended in robot.ends()] == [("HMM", 0)] * 3


@pytest.mark.parametrize(("sensor", "code"), [(EMS, "@51"), (CCW_LIMIT, "@55")])
def test_a_sensor_keeps_an_axis_from_preparation_and_start(robot: RobotBench, sensor: int, code: str) -> None:
    """Going out in Y the arm's axis turns CCW; the others do not notice, and start without it."""
    robot.tell_positions()
    arm = robot.axes[1]
    for text in ("HYSA[3],-50000", "HMM"):
        arm.world.forced[sensor] = True
        arm.sense(robot.now)
        assert robot.send(text) == ["", code, ""]
        arm.world.forced[sensor] = False
        arm.sense(robot.now)
        if text != "HMM":
            assert arm.execute(text, robot.now).payload == ""
    assert [axis.motor.moving for axis in robot.axes] == [True, False, True]


def test_the_end_of_a_move_must_lie_in_the_movable_range(robot: RobotBench) -> None:
    robot.axes[1].execute("EPS-11000,0", robot.now)
    robot.tell_positions()
    robot.sent("HYSA[3],-50000")
    assert robot.send("HMM") == ["", "@5D", ""]
    robot.sent("5IS")
    robot.axes[1].execute("EPS", robot.now)
    assert robot.axes[1].execute("HMM", robot.now).payload == "", "the preparation still stands"


STALLED = StallFinder.SENSOR


def test_after_a_step_out_an_axis_refuses_though_it_need_not_turn(robot: RobotBench) -> None:
    robot.axes[0].stalls.add(STALLED)
    robot.tell_positions()
    assert robot.send("HYSA[3],-50000") == ["@52", "", ""]


# Under way


def test_an_axis_that_need_not_turn_waits_for_the_others(robot: RobotBench) -> None:
    """The finger turns about the wrist."""
    robot.tell_positions()
    robot.sent("HRSA[3],R:0,F:0", "HMM")
    robot.wait(0.1)
    assert [axis.motor.moving for axis in robot.axes] == [True] * 3
    assert robot.positions()[:2] == (-10_149, -10_000)
    begun = [fact.body for fact in robot.truth.of("pulses_start")]
    assert begun == [4]
    assert [(ended.code, ended.cause) for ended in ended_together(robot)] == [("HMM", 0)] * 3


def ended_together(robot: RobotBench) -> list[MoveEnded]:
    """Let the moves end, and see that all ended at the same moment."""
    for _ in robot.ticks():
        pass
    messages = [message for axis in robot.axes for message in axis.take_messages()]
    assert len({message.at for message in messages}) == 1
    return [message.frame for message in messages if isinstance(message.frame, MoveEnded)]


def test_all_axes_end_at_the_same_moment(robot: RobotBench) -> None:
    robot.sent(*CORNERED)
    robot.start("HMSA[3],H[0]")
    ended_together(robot)


def test_an_axis_may_turn_back_on_the_way() -> None:
    robot = RobotBench(at=(0, -20_000, 0))
    robot.start("HYSA[3],300000")
    follows(robot, straight(robot, 300_000j))
    ways = [fact.facts["direction"] for fact in robot.truth.of("pulses_start", body=3)]
    assert ways == [1, -1]
    assert [fact.facts["why"] for fact in robot.truth.of("pulses_stop", body=3)] == ["done", "done"]


@pytest.mark.parametrize("after_s", [0.05, 0.3, 0.5])
def test_a_decelerating_stop_of_all_ends_on_the_path(after_s: float) -> None:
    """As 5SS to the virtual body does: the arm's axis turns back later, while it brakes, or has before."""
    robot = RobotBench(at=(0, -20_000, 0))
    robot.start("HYSA[3],300000")
    begun, line = robot.now, straight(robot, 300_000j)
    full = speed_curve(line)
    robot.wait(after_s)
    robot.sent("5SS")
    profile = full.braked(after_s, SPEED).starting_at(begun)
    for now in robot.ticks():
        assert abs(robot.end() - along(line, profile.position(now))) <= 2 * robot.pulse_um()
    assert profile.distance is not None
    assert (profile.distance < 300_000) is (after_s < 0.5)
    assert [ended.cause for ended in robot.ends()] == [0x10] * 3


def test_a_decelerating_stop_brakes_as_5ms_says(robot: RobotBench) -> None:
    robot.sent("OLSS[5],1000", "OHSS[5],1000000", "OSSS[5],9000000", "OASS[5],0", "OBSS[5],0", "5MSS[5]")
    robot.start("HYSA[3],-200000")
    robot.wait(0.2)
    at = robot.end()
    robot.sent("5SS")
    assert set(robot.until_end()) == {0x10}
    speed = plan(200_000, SPEED, SPEED).speed(0.2)
    assert abs(robot.end() - at) == pytest.approx(speed**2 / 2 / 9_000_000, rel=0.02)


@pytest.mark.parametrize("text", ["5AS", "5CS5000", "5DS"])
def test_the_speed_cannot_be_changed_on_the_way(robot: RobotBench, text: str) -> None:
    """14.5."""
    robot.start("HYSA[3],-100000")
    assert robot.send(text) == ["@5C"] * 3
    follows(robot, straight(robot, -100_000j))


def stop_command(robot: RobotBench) -> None:
    robot.axes[1].execute("5IS", robot.now)


def ems(robot: RobotBench) -> None:
    robot.axes[1].world.forced[EMS] = True
    robot.axes[1].sense(robot.now)


def limit(robot: RobotBench) -> None:
    robot.axes[1].world.forced[CCW_LIMIT] = True
    robot.axes[1].sense(robot.now)


def step_out(robot: RobotBench) -> None:
    robot.axes[1].execute("PSS1", robot.now)
    robot.axes[1].world.slipped = 1_000
    robot.axes[1].sense(robot.now)


def loss_of_power(robot: RobotBench) -> None:
    robot.axes[1].power_off(robot.now)
    robot.axes[1].keeps_position = True
    robot.axes[1].power_on(robot.now)


@pytest.mark.parametrize(
    ("hazard", "causes"),
    [
        (stop_command, [0, 0x10, 0]),
        (ems, [0, 0x08, 0]),
        (limit, [0, 0x04, 0]),
        (step_out, [0, 0x01, 0]),
        (loss_of_power, [0, 0]),
    ],
)
def test_what_ends_the_move_of_one_axis_leaves_the_others_on_their_way(
    robot: RobotBench, hazard: Callable[[RobotBench], None], causes: list[int]
) -> None:
    """No manual tells of a connection: the arm leaves its line."""
    if hazard is step_out:
        robot.axes[1].execute("PSS1", robot.now)
    whole = RobotBench()
    whole.start("HYSA[3],-100000")
    whole.until_end()
    robot.start("HYSA[3],-100000")
    robot.wait(0.2)
    stopped_at = robot.positions()[1]
    hazard(robot)
    assert robot.until_end() == causes
    assert robot.positions() == (whole.positions()[0], stopped_at, whole.positions()[2])


def test_a_limit_on_the_way_stops_its_axis_at_that_very_pulse(robot: RobotBench) -> None:
    robot.axes[1].world.ccw_limit = Span(-3_000, -2_500)
    robot.start("HYSA[3],-100000")
    assert robot.until_end() == [0, 0x04, 0]
    assert robot.positions()[1] == -10_000 - 2_500


# Stale positions


def test_stale_positions_lead_the_arm_elsewhere(robot: RobotBench) -> None:
    """The controllers turn by what they have calculated from HPS, from where they really are."""
    robot.start("HYSA[3],-100000")
    assert set(robot.until_end()) == {0}
    first = robot.positions()
    robot.sent("HYSA[3],-100000", "HMM")
    assert set(robot.until_end()) == {0}
    turned = [after - before for after, before in zip(robot.positions(), first, strict=True)]
    assert turned == [
        after - before for after, before in zip(first, (-10_149, -10_000, -16_666), strict=True)
    ]
    assert abs(robot.end() - (-85_000j)) > 5_000, "not where two moves of 100 mm should end"


def test_one_stale_position_bends_the_line(robot: RobotBench) -> None:
    robot.tell_positions()
    robot.sent("HPS1,-15000", "HXSA[3],-50000", "HMM")
    assert set(robot.until_end()) == {0}
    assert abs(robot.end() - (115_000j - 50_000)) > 5_000


def test_a_controller_may_refuse_a_stale_position_of_its_own_axis(robot: RobotBench) -> None:
    robot.axes[1].refuses_stale_positions = True
    robot.tell_positions()
    robot.sent("HPS0,5", "HXSA[3],-50000", "HPS1,-9999")
    assert robot.send("HXSA[3],-50000") == ["", "@64", ""]


def test_a_move_in_between_does_not_undo_the_preparation(robot: RobotBench) -> None:
    robot.tell_positions()
    robot.sent("HYSA[3],-100000")
    robot.axes[0].execute("6PS0", robot.now)
    robot.sent("HMM")
    assert set(robot.until_end()) == {0}
    whole = RobotBench()
    whole.start("HYSA[3],-100000")
    whole.until_end()
    assert robot.positions()[0] == whole.positions()[0] + 10_149


LENGTHS = st.sampled_from([1, 2, 215_000, 999_999_999])
TURNS = st.sampled_from([1.0, 360.0, 60_000.0])
NUMBERS = st.sampled_from([0, 1, -1, 180_000, 215_000, -330_000, 430_000, 999_999_999, -999_999_999])


@settings(max_examples=40)
@given(
    robot=st.builds(
        ThreeAxes,
        link=LENGTHS,
        finger=LENGTHS,
        pulses_per_turn=st.tuples(TURNS, TURNS, TURNS),
    )
    | st.builds(BeltLinked, link=LENGTHS, finger=LENGTHS, pulses_per_turn=st.tuples(TURNS, TURNS)),
    at=st.tuples(NUMBERS, NUMBERS, NUMBERS),
    a=NUMBERS,
    b=NUMBERS,
    radius=st.sampled_from([0, 1, 50_000, 999_999_999]),
)
def test_whatever_is_set_up_can_be_calculated_or_not(
    robot: Mechanics, at: tuple[int, int, int], a: int, b: int, radius: int
) -> None:
    """The axes have no limits; the positions may leave the range of the registers."""
    bench = RobotBench(robot, at)
    for axis in bench.axes:
        axis.world.forced |= {CW_LIMIT: False, CCW_LIMIT: False}
    bench.sent("HDSH[0],0,CENTER", f"HDSH[0],1,X:{a},Y:{b},R:{radius}", f"HDSH[0],2,X:{b},Y:{a},R:0")
    bench.tell_positions()
    for text in (*PREPARATIONS, f"HXSA[3],{a}", f"H+SA[3],{b}", f"HRSA[3],R:{a},F:{b}"):
        answers = bench.send(text)
        assert answers in ([""] * robot.axes, ["@63"] * robot.axes, ["@64"] * robot.axes)
        if answers[0] == "":
            assert set(bench.send("HMM")) <= {"", "@5D"}
            bench.wait(0.005)
            bench.send("5IS")
