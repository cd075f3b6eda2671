"""The abilities of the demo's bodies."""

from protocols.rorze.scara import ThreeAxes
from simulator.demo import LIFT, PROGRAM, SCARA, teach
from simulator.rorze.line import Rc400Line, build_line

BODIES = (0x00, *SCARA, LIFT)
ROBOT = ThreeAxes(215_000, 330_000, (121_791.045, 60_000.0, 100_000.0))


def taught() -> Rc400Line:
    line = build_line(BODIES, 0.0)
    teach(line, 0.0)
    return line


def test_every_body_moves_by_pattern_12() -> None:
    for number, axis in taught().axes.items():
        assert axis.execute("1+MA[12],500", 10.0).payload == "", f"{number:02X}"


def test_the_lift_runs_its_program() -> None:
    axis = taught().axes[LIFT]
    assert axis.execute("URG*LIFT", 10.0).payload == ""
    highest, now = 0, 10.0
    while axis.execute("URD", now).payload == "H01":
        now += 0.05
        highest = max(highest, axis.position(now))
    assert highest == 5_000
    assert (axis.position(now), axis.execute("COD0", now).payload) == (0, "0")
    assert PROGRAM.count("\n") > 5


def test_the_robot_stands_where_the_manual_has_it() -> None:
    line = taught()
    axes = [line.axes[number] for number in SCARA]
    x, y, finger = ROBOT.place([axis.position(10.0) for axis in axes])
    assert abs(x) < 20
    assert abs(y - 115_000) < 20
    assert abs(finger - 90_000) < 10
    for place, pulses in enumerate(SCARA.values()):
        for axis in axes:
            assert axis.execute(f"HPS{place},{pulses}", 10.0).payload == ""
    replies = [axis.execute("HLSX:0,Y:200000,F:90000", 10.0).payload for axis in axes]
    assert not [reply for reply in replies if reply.startswith("@")]
