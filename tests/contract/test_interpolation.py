"""The examples of RC-420 manual 13.10, with three controllers as one virtual body, or two.

They stand as printed, but numbers have the width that their pages give, and a virtual body answers for each
of its members. After what moves comes what it ends with.
"""

import re
from dataclasses import replace

import pytest

from protocols.rorze.scara import BeltLinked, Mechanics, ThreeAxes
from simulator.rorze.world import CCW_LIMIT, EMS
from tests.contract.hosts import ClockHost

BASE, ARM, FINGER = 0x02, 0x03, 0x04

ROBOT = ThreeAxes(215_000, 330_000, (121_791.045, 60_000.0, 100_000.0))
RR_730 = ThreeAxes(156_000, 330_000, (121_791.04, 60_000.0, 100_000.0))
RR_700 = BeltLinked(156_000, 208_000, (98_765.0, 99_000.0))

GROUP = """
    &7F XVS 80, 02, 03, 04
    >&7FXVS
    &7FXRSM1
    >&7FXRS
"""

SET_UP = """
    &80 HTS 0
    &02 HCS 0
    &03 HCS 1
    &04 HCS 2
    &80 HZS 0, 121791.045
    &80 HZS 1, 60000.000
    &80 HZS 2, 100000.000
    &80 HAS 215000
    &80 HFS 330000
    &80 HDS H[0], 0, X:255000, Y:300000, R:120000
    &80 HDS H[0], 1, X:255000, Y:450000, R:0
"""
"""13.10.7, 1."""

PATTERNS = """
    &80 OLS S[1], 1000
    &80 OHS S[1], 1000000
    &80 OSS S[1], 5000000
    &80 OAS S[1], 50
    &80 OBS S[1], 50
    &80 SPS A[1], A:S[1], D:S[1]
    &80 SPS A[3], A:S[1], D:S[1]
    &80 OLS S[4], 50
    &80 OHS S[4], 50000
    &80 OSS S[4], 100000
    &80 OAS S[4], 50
    &80 OBS S[4], 50
    &80 SPS A[4], A:S[4], D:S[4]
"""
"""The speeds of 13.10.3 for what goes along a path, others for what turns alone."""

POSITIONS = """
    &80 6PD
    >&806PD[02:-000010149][03:-000010000][04:-000016666]
    &80 HPS 0, -10149
    >&80HPS[02:][03:][04:]
    &80 HPS 1, -10000
    >&80HPS[02:][03:][04:]
    &80 HPS 2, -16666
    >&80HPS[02:][03:][04:]
"""
"""13.10.7, 2."""

ON_ITS_WAY = f"""
    {POSITIONS}
    &80 HYS A[3], -100000
    >&80HYS[02:][03:][04:]
    &80 HMM
    >&80HMM[02:][03:][04:]
"""


class RobotHost(ClockHost):
    """A host with a robot, whose finger's end it can measure."""

    def __init__(self, robot: Mechanics) -> None:
        super().__init__(*(BASE, ARM, FINGER)[: robot.axes])
        self.robot = robot

    async def accepted(self, commands: str) -> None:
        """Go through commands, which all must be accepted by all they are sent to."""
        for command in filter(None, map(str.strip, commands.splitlines())):
            answer = await self.ask(command)
            code = command.replace(" ", "")[3:6]
            assert re.fullmatch(rf">&[0-9A-F]{{2}}{code}(\[0[2-4]:\])*", answer), f"{command} {answer}"

    async def put(self, *pulses: int) -> None:
        """Call the present positions so."""
        for body, position in zip(self.line.axes, pulses, strict=True):
            await self.command(f"6PS{position}", body=body)

    async def tell_positions(self) -> None:
        for number, position in enumerate(self.positions()):
            await self.accepted(f"&80 HPS {number}, {position}")

    def positions(self) -> tuple[int, ...]:
        return tuple(axis.position(self.now) for axis in self.line.axes.values())

    def end(self) -> complex:
        place = self.robot.place(self.positions())
        return complex(place.x, place.y)

    def direction(self) -> float:
        return self.robot.place(self.positions()).direction


@pytest.fixture
async def host() -> RobotHost:
    """13.10.7: the robot stands where its example has it."""
    host = RobotHost(ROBOT)
    await host.play(GROUP)
    await host.accepted(SET_UP + PATTERNS)
    await host.put(-10_149, -10_000, -16_666)
    return host


@pytest.mark.anyio
@pytest.mark.parametrize(
    ("preparation", "end", "direction"),
    [
        ("HMS A[3], H[0]", 255_000 + 450_000j, 90_000),
        ("HXS A[3], -50000", -50_000 + 115_000j, 90_000),
        ("HYS A[3], 100000", 215_000j, 90_000),
        ("H+S A[3], 50000", 165_000j, 90_000),
        ("H-S A[3], 100000", 15_000j, 90_000),
        ("HRS A[3], R:150000, F:90000", 115_000j, 90_000),
        ("HRS A[3], R:150000, F:0", 180_000 - 65_000j, 0),
    ],
)
async def test_positions_preparation_and_start(
    host: RobotHost, preparation: str, end: complex, direction: int
) -> None:
    """13.10.7, 2 to 4; in its last example the finger points to 90 degrees already, so there is one more."""
    code = preparation[:3]
    await host.play(f"""
        {POSITIONS}
        &80 {preparation}
        >&80{code}[02:][03:][04:]
        &80 HMM
        >&80HMM[02:][03:][04:]
        >&7DHMM[02:00][03:00][04:00]
    """)
    assert host.end() == pytest.approx(end, abs=40)
    assert host.direction() == pytest.approx(direction, abs=6)


@pytest.mark.anyio
async def test_a_place_of_the_position_table_is_a_way_in_micrometres(host: RobotHost) -> None:
    """13.4.4: 1,000 pulses for a move of one axis, 1,000 um along X for all."""
    await host.play(f"""
        &80 3PS P[1], 1000
        >&803PS[02:][03:][04:]
        &04 1+M A[3], P[1]
        >&041+M
        >&7D1+M[04:00]
        &04 6PS -16666
        >&046PS
        {POSITIONS}
        &80 HXS A[1], P[1]
        >&80HXS[02:][03:][04:]
        &80 HMM
        >&80HMM[02:][03:][04:]
        >&7DHMM[02:00][03:00][04:00]
    """)
    assert host.end() == pytest.approx(1_000 + 115_000j, abs=40)


@pytest.mark.anyio
async def test_the_finger_turns_alone(host: RobotHost) -> None:
    """13.10.7, 5; it is a little beside 90 degrees, which is less than half a pulse."""
    await host.play(f"""
        {POSITIONS}
        &80 HFM A[4], 90000
        >&80HFM[02:][03:][04:]
        >&7DHFM[02:00][03:00][04:00]
        &80 HFM A[4], F:45000
        >&80HFM[02:][03:][04:]
        >&7DHFM[02:00][03:00]
        >&7DHFM[04:00]
    """)
    assert host.direction() == pytest.approx(45_000, abs=4)


@pytest.mark.anyio
async def test_to_the_start_of_an_extension(host: RobotHost) -> None:
    """13.10.6 and 13.10.7, 5: H[3] leads over the centre."""
    await host.accepted("""
        &80 HDS H[3]
        &80 HDS H[3], 0, CENTER
        &80 HDS H[3], 1, X:300000, Y:400000, R:0
    """)
    await host.play(f"""
        {POSITIONS}
        &80 HNM A[4], H[3]
        >&80HNM[02:][03:][04:]
        >&7DHNM[03:00]
    """)
    assert {(await host.hear()), (await host.hear())} == {">&7DHNM[02:00]", ">&7DHNM[04:00]"}
    await host.tell_positions()
    await host.accepted("""
        &80 HMS A[3], H[3]
        &80 HMM
    """)
    assert await host.hear() == ">&7DHMM[02:00][03:00][04:00]"
    assert host.end() == pytest.approx(300_000 + 400_000j, abs=40)


@pytest.mark.anyio
async def test_coordinates(host: RobotHost) -> None:
    """13.10.7, 5; the manual prints the ideal coordinates, not those of the whole pulses."""
    await host.play(f"""
        {POSITIONS}
        &02 HLD
        >&02HLDX:+000000012,Y:+000115000,F:+000089998
        &02 HLS X:0, Y:115000, F:90000
        >&02HLS0:-000010149,1:-000010000,2:-000016666
    """)


@pytest.mark.anyio
async def test_coordinates_of_other_positions(host: RobotHost) -> None:
    """13.10.8; the manual does not say of which robot, and prints other coordinates."""
    await host.accepted("""
        &80 HPS 0, 10000
        &80 HPS 1, 20000
        &80 HPS 2, 15000
    """)
    answer = await host.ask("&02 HLD")
    assert re.fullmatch(r">&02HLDX:[+-]\d{9},Y:[+-]\d{9},F:[+-]\d{9}", answer)


@pytest.mark.anyio
async def test_a_path_with_a_rounded_corner_and_three_axes() -> None:
    """13.10.9; with the finger at 90 degrees the wrist would have to go 429 mm out, and comes 312 mm."""
    host = RobotHost(RR_730)
    await host.play(GROUP)
    await host.accepted(
        """
        &80 HTS 0
        &02 HCS 0
        &03 HCS 1
        &04 HCS 2
        &80 HZS 0, 121791.04
        &80 HZS 1, 60000.00
        &80 HZS 2, 100000.00
        &80 HAS 156000
        &80 HFS 330000
        &80 HDS H[3]
        &80 HDS H[3], 0, X :200000, Y:150000, R:50000
        &80 HDS H[3], 1, X:200000, Y:-50000, R:0
        """
        + PATTERNS
    )
    await host.put(15_000, -12_000, 40_000)
    for direction, answer in ((90_000, "@[02:@63][03:@63][04:@63]"), (0, "[02:][03:][04:]")):
        await host.tell_positions()
        await host.play(f"""
            &04 HFM {direction}
            >&04HFM
            >&7DHFM[04:00]
        """)
        assert host.direction() == pytest.approx(direction, abs=4)
        await host.tell_positions()
        await host.play(f"""
            &80 HMS A[1], H[3]
            >&80HMS{answer}
        """)
    await host.play("""
        &80 HMM
        >&80HMM[02:][03:][04:]
        >&7DHMM[02:00][03:00][04:00]
    """)
    assert host.end() == pytest.approx(200_000 - 50_000j, abs=40)


@pytest.mark.anyio
async def test_a_path_with_a_rounded_corner_and_belts() -> None:
    """13.10.11."""
    host = RobotHost(RR_700)
    await host.play("""
        &7F XVS 80, 02, 03
        >&7FXVS
        &7FXRSM1
        >&7FXRS
    """)
    await host.accepted(
        """
        &80 HTS 1
        &02 HCS 0
        &03 HCS 1
        &80 HZS 0, 98765. 00
        &80 HZS 1, 99000. 00
        &80 HAS 156000
        &80 HFS 208000
        &80 HDS H[3]
        &80 HDS H[3], 0, X :200000, Y:150000, R:50000
        &80 HDS H[3], 1, X:200000, Y:-50000, R:0
        """
        + PATTERNS
    )
    await host.put(20_000, -3_000)
    await host.tell_positions()
    await host.play("""
        &80 HMS A[1], H[3]
        >&80HMS[02:][03:]
        &80 HMM
        >&80HMM[02:][03:]
        >&7DHMM[02:00][03:00]
    """)
    assert host.end() == pytest.approx(200_000 - 50_000j, abs=40)
    await host.tell_positions()
    x, y = round(host.end().real), round(host.end().imag)
    assert (await host.ask("&02HLD")).startswith(f">&02HLDX:{x:+010d},Y:{y:+010d},F:-0000140")


# One of the three


@pytest.mark.anyio
async def test_a_member_without_preparation_stays_behind(host: RobotHost) -> None:
    """Its refusal is all that tells of it; the others go."""
    await host.play(POSITIONS)
    host.change(ARM, forced={CCW_LIMIT: True})
    await host.play("""
        &80 HYS A[3], -100000
        >&80HYS@[02:][03:@55][04:]
        &80 HMM
        >&80HMM@[02:][03:@61][04:]
        >&7DHMM[02:00][04:00]
    """)
    assert host.positions()[1] == -10_000


@pytest.mark.anyio
async def test_ems_of_one_axis_stops_that_axis(host: RobotHost) -> None:
    await host.play(ON_ITS_WAY)
    host.wait(0.1)
    host.change(BASE, forced={EMS: True})
    await host.play("""
        >&7DHMM[02:08]
        >&7DHMM[03:00][04:00]
    """)


@pytest.mark.anyio
async def test_a_stop_of_the_virtual_body_stops_all_at_once(host: RobotHost) -> None:
    await host.play(ON_ITS_WAY)
    host.wait(0.1)
    await host.play("""
        &80 5SS
        >&805SS[02:][03:][04:]
        >&7DHMM[02:10][03:10][04:10]
    """)
    assert host.end().real == pytest.approx(0, abs=40), "it is still on its line"
    assert host.direction() == pytest.approx(90_000, abs=8)


@pytest.mark.anyio
async def test_a_controller_that_loses_its_power_leaves_the_others_moving(host: RobotHost) -> None:
    await host.play(ON_ITS_WAY)
    host.wait(0.1)
    host.line.switch_body(ARM, on=False, now=host.now)
    await host.play("""
        >&7DHMM[02:00][04:00]
        &80 6PD
        >&806PD[02:-000015935][04:-000011916]
    """)


@pytest.mark.anyio
@pytest.mark.parametrize(
    ("hazard", "told"),
    [
        ("5IS", [">&7DHMM[03:10]", ">&7DHMM[02:10][04:10]"]),
        ("power", [">&7DHMM[02:10][04:10]"]),
    ],
)
async def test_the_others_may_be_stopped_with_it(host: RobotHost, hazard: str, told: list[str]) -> None:
    """The manual does not say that they are not."""
    host.line.settings = replace(host.line.settings, partners="stop")
    await host.play(ON_ITS_WAY)
    host.wait(0.1)
    stopped_at = host.positions()
    if hazard == "power":
        host.touch(lambda now: host.line.switch_body(ARM, on=False, now=now))
    else:
        assert {await host.ask("&03 5IS"), await host.hear()} == {">&035IS", told.pop(0)}
    assert [await host.hear() for _ in told] == told
    assert host.positions()[::2] == stopped_at[::2]


@pytest.mark.anyio
async def test_a_move_that_ends_as_it_should_stops_nobody(host: RobotHost) -> None:
    """The finger is done before the others, which have a slower pattern."""
    host.line.settings = replace(host.line.settings, partners="stop")
    await host.play(f"""
        {POSITIONS}
        &02 OHS S[1], 200000
        >&02OHS
        &03 OHS S[1], 200000
        >&03OHS
        &80 HYS A[3], -100000
        >&80HYS[02:][03:][04:]
        &80 HMM
        >&80HMM[02:][03:][04:]
        >&7DHMM[04:00]
        >&7DHMM[02:00][03:00]
    """)
