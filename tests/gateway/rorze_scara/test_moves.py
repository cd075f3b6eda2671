"""Moves of SCARA robots through the gateway, on a simulated line."""

import asyncio
import re
from cmath import phase
from collections.abc import Callable, Sequence
from typing import Any

import pytest
from pydantic import ValidationError

from gateway.core.errors import (
    BodyBusy,
    ControllerRefused,
    GatewayError,
    InvalidRequest,
    NotSent,
    PowerCycled,
)
from gateway.core.exchange import Lane
from gateway.core.journal.intents import Intents
from gateway.core.move_record import MoveStatus
from gateway.core.origin import Origin
from gateway.core.stops import CONFIRM_WITHIN_S
from gateway.core.targets import BegunMoves
from gateway.rorze.move_requests import RelativeMoveRequest
from gateway.rorze.plans import Rate
from gateway.rorze.speed_sets import read_set
from gateway.rorze.units import Length
from gateway.rorze_scara import paths
from gateway.rorze_scara.geometry import GeometryDiffers
from gateway.rorze_scara.record import ScaraMove
from gateway.rorze_scara.requests import ScaraMoveRequest
from protocols.rorze.interpolation import PathPoint
from protocols.rorze.modes import SetSoftLimits
from protocols.rorze.path import Arc, Corner, Segment, StraightLine, rounded
from protocols.rorze.position import GetPosition
from protocols.rorze.speeds import SetMaximumAcceleration
from protocols.rorze.status import GetControllerStatus
from simulator.faults import Direction
from simulator.rorze.rc400 import LinkSettings
from simulator.rorze.world import CCW_LIMIT, EMS, STALL
from tests.gateway.rorze_scara.cell import BELTS, Cell, cell, deg, mm, read
from tests.model_book import ModelBook
from tests.plants import in_virtual_time, lose
from tests.through_the_door import ask, start

HALF_PULSES_MDEG = 0.55 * sum(360_000 / turn for turn in (121_791.045, 60_000.0, 100_000.0))
"""Each axis stands up to half a pulse beside its place."""
CORNERED = [PathPoint(x=255_000, y=300_000, radius=120_000), PathPoint(x=255_000, y=450_000, radius=0)]
"""The path of 13.10.7."""


def beside(segments: Sequence[Segment], point: complex) -> float:
    """Distance of a point from a path."""
    return min(_beside(segment, point) for segment in segments)


def _beside(segment: Segment, point: complex) -> float:
    ends = min(abs(point - segment.at(0.0)), abs(point - segment.at(segment.length)))
    if isinstance(segment, StraightLine):
        along = ((point - segment.start) / (segment.end - segment.start)).real
        return abs(point - segment.at(along * segment.length)) if 0 <= along <= 1 else ends
    assert isinstance(segment, Arc)
    share = phase((point - segment.centre) / segment.arm) / segment.turn
    return abs(abs(point - segment.centre) - abs(segment.arm)) if 0 <= share <= 1 else ends


async def follows(robot: Cell, segments: Sequence[Segment]) -> int:
    """The finger's end is on the ideal path at every tick, and the finger keeps its direction."""
    direction, ticks = robot.place().direction, 0
    async for place in robot.ticks():
        assert beside(segments, complex(place.x, place.y)) <= 2 * robot.pulse_um()
        assert abs(place.direction - direction) <= HALF_PULSES_MDEG
        ticks += 1
    return ticks


# Where moves lead


@pytest.mark.parametrize(
    ("kind", "request_", "end", "started_by"),
    [
        ("line", {"x": mm(50), "y": mm(200)}, (50_000, 200_000, 90_000), "&8AHMSA[3],H[63]"),
        ("offset", {"x": mm(-50)}, (-50_000, 115_000, 90_000), "&8AHXSA[3],-50000"),
        ("offset", {"y": mm(100)}, (0, 215_000, 90_000), "&8AHYSA[3],100000"),
        ("offset", {"x": mm(30), "y": mm(40)}, (30_000, 155_000, 90_000), "&8AHMSA[3],H[63]"),
        ("extend", {"distance": mm(50)}, (0, 165_000, 90_000), "&8AH+SA[3],50000"),
        ("retract", {"distance": mm(100)}, (0, 15_000, 90_000), "&8AH-SA[3],100000"),
        (
            "rotate",
            {"radius": mm(150), "angle": deg(0)},
            (180_000, -65_000, 0),
            "&8AHRSA[3],R:150000,F:0",
        ),
    ],
)
@in_virtual_time
async def test_where_each_kind_ends(
    kind: str, request_: dict[str, Any], end: tuple[float, ...], started_by: str
) -> None:
    async with cell() as robot:
        move = await robot.finished(kind, **request_)
        assert (move.status, move.end_cause, move.error) == (MoveStatus.SUCCEEDED, "normal", None)
        assert robot.place()[:2] == pytest.approx(end[:2], abs=60)
        assert robot.place().direction == pytest.approx(end[2], abs=6)
        assert move.preparation[-1] == f"{started_by}\\r"
        assert (move.frame, robot.frames_of("HMM")) == ("&8AHMM\\r", ["&8AHMM"])
        assert [axis.position for axis in move.axes] == robot.positions()
        assert move.coordinates is not None
        assert move.coordinates.x.value == pytest.approx(robot.place().x, abs=0.001)


@in_virtual_time
async def test_a_move_waits_for_the_disk_once_to_be_prepared_and_once_to_be_started() -> None:
    async with cell() as robot:
        book, line = ModelBook(), robot.scara.line
        line.intents = Intents(book, line.address_of)
        await robot.start(kind="line", x=mm(20), y=mm(150), pattern=5)
        assert book.waits == 2
        assert len(book.intents()) > 5
        assert book.written() == [intent["id"] for _, intent in book.intents()]


@in_virtual_time
async def test_the_finger_turns_alone() -> None:
    async with cell() as robot:
        before = robot.positions()
        move = await robot.finished("finger", angle=deg(60))
        assert (move.status, move.command, move.frame) == (
            MoveStatus.SUCCEEDED,
            "HFM",
            "&04HFMA[4],F:60000\\r",
        )
        assert robot.positions()[:2] == before[:2]
        assert robot.place().direction == pytest.approx(60_000, abs=4)
        assert [axis.status for axis in move.axes] == [None, None, MoveStatus.SUCCEEDED]
        assert [axis.move_id for axis in move.axes][:2] == [None, None]


@in_virtual_time
async def test_aligned_with_a_target_an_extension_ends_there() -> None:
    """13.10.6, over the centre."""
    async with cell() as robot:
        points = [PathPoint(place="center"), PathPoint(x=300_000, y=400_000, radius=0)]
        await paths.write(robot.scara, 3, points)
        aligned = await robot.finished("align", path=3)
        assert (aligned.status, aligned.frame) == (MoveStatus.SUCCEEDED, "&8AHNMA[4],H[3]\\r")
        move = await robot.finished("path", path=3)
        assert move.status is MoveStatus.SUCCEEDED
        assert robot.place()[:2] == pytest.approx((300_000, 400_000), abs=60)


@in_virtual_time
async def test_a_path_goes_through_points_of_the_request_and_leaves_the_stored_ones() -> None:
    async with cell() as robot:
        await paths.write(robot.scara, 0, CORNERED)
        through = [{"x": mm(120), "y": mm(260), "radius": mm(20)}, {"x": mm(60), "y": mm(300)}]
        move = await robot.finished("path", points=through)
        assert move.status is MoveStatus.SUCCEEDED
        assert robot.place()[:2] == pytest.approx((60_000, 300_000), abs=60)
        assert [*(await paths.read(robot.scara, 0)).values()] == CORNERED
        with pytest.raises(InvalidRequest, match="cannot do that"):
            await robot.start("path", points=[{"x": mm(2000), "y": mm(0)}])


@in_virtual_time
async def test_belts_carry_the_finger_along_a_path() -> None:
    """13.10.11."""
    async with cell(BELTS, (20_000, -3_000)) as robot:
        points = [PathPoint(x=200_000, y=150_000, radius=50_000), PathPoint(x=200_000, y=-50_000, radius=0)]
        await paths.write(robot.scara, 3, points)
        move = await robot.finished("path", path=3)
        assert move.status is MoveStatus.SUCCEEDED
        assert robot.place()[:2] == pytest.approx((200_000, -50_000), abs=60)
        with pytest.raises(InvalidRequest, match="The finger has no axis of its own"):
            await robot.start("finger", angle=deg(0))


# On the way


@pytest.mark.parametrize("baud", [None, 9600])
@in_virtual_time
async def test_the_finger_ends_on_a_straight_line_at_every_tick(baud: int | None) -> None:
    async with cell(baud=baud) as robot:
        begun = robot.place()
        move = asyncio.create_task(robot.start("line", x=mm(120), y=mm(260)))
        ticks = await follows(robot, [StraightLine(complex(begun.x, begun.y), 120_000 + 260_000j)])
        assert ticks > 300
        assert (await robot.ended(await move)).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_the_finger_ends_on_the_rounded_corner_at_every_tick() -> None:
    """The path of 13.10.7."""
    async with cell() as robot:
        await paths.write(robot.scara, 0, CORNERED)
        begun = robot.place()
        corners = [Corner(255_000 + 300_000j, 120_000), Corner(255_000 + 450_000j)]
        move = asyncio.create_task(robot.start("path", path=0))
        assert await follows(robot, rounded(complex(begun.x, begun.y), corners)) > 500
        assert (await robot.ended(await move)).status is MoveStatus.SUCCEEDED


# One undivided turn


@in_virtual_time
async def test_from_the_positions_to_the_start_in_one_turn() -> None:
    async with cell(baud=9600) as robot:
        before = len(robot.frames())
        move = asyncio.create_task(robot.start("offset", x=mm(10)))
        await robot.rig.wire.begun("&8AHPS1,-10000")
        asked = asyncio.create_task(robot.scara.members[1].ask(GetPosition()))
        started = await move
        told = [it for it in robot.frames()[before:] if "3ND" not in it and it[:3] != "&3F"]
        told = told[told.index("&8A6PD") :]  # the sets of its pattern were asked before, for its stop
        assert told[:5] == ["&8A6PD", "&8AEPD", "&8AHPS0,-10149", "&8AHPS1,-10000", "&8AHPS2,-16666"]
        assert told[5:8] == ["&8AHCD", "&8AHLD", "&8AHXSA[3],10000"]
        between = told[8 : told.index("&8AHMM")]
        assert sorted(between) == sorted(f"&0{n}{it}" for n in (2, 3, 4) for it in ("9CD", "6PD", "9VD7"))
        await asked
        assert (await robot.ended(started)).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_a_second_move_waits_for_the_first() -> None:
    async with cell() as robot:
        first = await robot.start("offset", x=mm(10))
        with pytest.raises(BodyBusy, match="wafer still has the move"):
            await robot.start("offset", x=mm(10))
        assert (await robot.ended(first)).status is MoveStatus.SUCCEEDED
        assert (await robot.finished("offset", x=mm(-10))).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_a_plan_only_reads() -> None:
    async with cell() as robot:
        plan = await robot.moves.plan(robot.scara, read("offset", x=mm(10), validate_only=True))
        assert plan.frames == [
            *("&8AHPS0,-10149\\r", "&8AHPS1,-10000\\r", "&8AHPS2,-16666\\r"),
            *("&8AHXS10000\\r", "&8AHMM\\r"),
        ]
        assert plan.target.x.value == pytest.approx(10_000, abs=60)
        assert plan.length_um == pytest.approx(10_000)
        assert robot.frames_of("HPS") == []


@pytest.mark.parametrize(
    ("kind", "request_"),
    [
        ("offset", {"x": mm(50), "pattern": 5}),
        ("finger", {"angle": deg(0)}),
        ("align", {"x": mm(99), "y": mm(400)}),
    ],
)
@in_virtual_time
async def test_a_plan_tells_how_long_it_would_take(kind: str, request_: dict[str, Any]) -> None:
    async with cell() as robot:
        planned = read(kind, **{"pattern": 4, **request_})
        plan = await robot.moves.plan(robot.scara, planned)
        starting = asyncio.create_task(robot.moves.start(robot.scara, planned))
        await robot.until_moving()
        began_at = asyncio.get_running_loop().time()
        while any(robot.moving()):  # noqa: ASYNC110  # virtual time
            await asyncio.sleep(0.001)
        assert plan.duration_s == pytest.approx(asyncio.get_running_loop().time() - began_at, abs=0.01)
        await robot.ended(await starting)


@in_virtual_time
async def test_a_plan_tells_why_it_would_be_refused_and_leaves_no_command_error() -> None:
    async with cell() as robot:
        for body in robot.scara.members:
            await body.poll(Lane.READ)
        plan = await robot.moves.plan(robot.scara, read("offset", x=mm(10), pattern=9))
        assert plan.duration_s is None
        assert plan.note is not None
        assert "would be refused: line1.02 refused SPD: The acceleration pattern is not set." in plan.note
        for body in robot.scara.members:
            assert (await body.ask(GetControllerStatus()))[0].bits == 0


# A speed of its own


async def fastest(robot: Cell, seconds: float) -> float:
    """The greatest speed of the finger's end, in micrometres a second, seen over a time."""
    most, before = 0.0, robot.place()
    for _ in range(round(seconds / 0.1)):
        await asyncio.sleep(0.1)
        here = robot.place()
        most, before = max(most, abs(complex(here.x - before.x, here.y - before.y)) / 0.1), here
    return most


ME = Origin("test")
FIVE = {"value": 5, "unit": "mm/s"}


async def start_move(robot: Cell, request: ScaraMoveRequest, wait_s: float = 0.0) -> ScaraMove:
    begun = await ask(robot.rig.plant, "startScaraMove", scara_id="wafer", request=request, wait=wait_s)
    assert isinstance(begun, BegunMoves)
    [move] = begun.moves
    assert isinstance(move, ScaraMove)
    return move


@pytest.mark.parametrize(
    "request_",
    [
        {"kind": "offset", "y": mm(30)},
        {"kind": "line", "x": mm(10), "y": mm(145)},
        {"kind": "extend", "distance": mm(30)},
    ],
)
def test_the_finger_goes_no_faster_than_asked_for_and_the_plan_knows_it(request_: dict[str, Any]) -> None:
    @in_virtual_time
    async def story() -> None:
        async with cell() as robot:
            slowly = read(**request_, max_speed=FIVE)
            plan = await robot.moves.plan(robot.scara, slowly)
            assert plan.duration_s is not None
            assert plan.duration_s > (plan.length_um or 0.0) / 5_000
            assert robot.frames_of("OHS") == []
            move = await start_move(robot, slowly)
            assert isinstance(move, ScaraMove)
            assert "A[29]" in move.preparation[-1]
            assert 4_000 < await fastest(robot, 4.0) < 5_300
            assert (await robot.ended(move)).status is MoveStatus.SUCCEEDED
            back = await robot.finished("offset", y=mm(-10))
            assert back.status is MoveStatus.SUCCEEDED

    story()


@in_virtual_time
async def test_axes_that_turn_alone_take_degrees_a_second() -> None:
    async with cell() as robot:
        wanted = read("finger", angle=deg(70), max_speed={"value": 10, "unit": "deg/s"})
        move = await start_move(robot, wanted)
        assert isinstance(move, ScaraMove)
        await asyncio.sleep(1.0)
        assert 78.0 < robot.place().direction / 1000 < 82.0
        assert (await robot.ended(move)).status is MoveStatus.SUCCEEDED
        with pytest.raises(ValidationError):
            read("finger", angle=deg(70), max_speed=FIVE)
        with pytest.raises(ValidationError, match="cannot be given together"):
            read("offset", x=mm(1), max_speed=FIVE, pattern=3)


@in_virtual_time
async def test_axes_of_unlike_standard_speeds_get_the_gentlest_and_single_axes_go_on_with_their_own() -> None:
    """After a restart, too: what it then finds has the ramps of one or of the other."""
    async with cell() as robot:
        base, arm, _ = robot.scara.members
        for acceleration, body in ((300_000, base), (50_000, arm)):
            await body.ask(SetMaximumAcceleration(acceleration=acceleration))
        slowly = read("offset", y=mm(10), max_speed=FIVE)
        alone = RelativeMoveRequest(
            kind="relative",
            direction="cw",
            distance=Length(value=10, unit="pulse"),
            max_speed=Rate(value=100, unit="pulse/s"),
        )
        for _ in range(2):
            move = await start_move(robot, slowly, 30.0)
            assert isinstance(move, ScaraMove)
            assert move.status is MoveStatus.SUCCEEDED
            assert {(await read_set(body, 29)).acceleration_pps_s for body in robot.scara.members} == {50_000}
            base.own_speed.written = None
            for back in ("cw", "ccw"):
                one = alone.model_copy(update={"direction": back})
                await start(robot.rig.plant, ME, "/bodies/line1.02", one, 30.0)
            assert (await read_set(base, 29)).acceleration_pps_s == 300_000
            base.own_speed.written = None


# What is refused


async def refused(robot: Cell, error: type[GatewayError], match: str, **request: Any) -> None:
    before = robot.positions()
    with pytest.raises(error, match=match):
        await robot.start(**request)
    await asyncio.sleep(1)
    assert robot.frames_of("HMM") == []
    assert robot.positions() == before
    assert robot.scara.move is None
    assert all(body.move is None for body in robot.scara.members)
    move = robot.moves.log.of("wafer")[0]
    assert move.status in (MoveStatus.REJECTED, MoveStatus.CANCELLED)


@pytest.mark.parametrize(
    ("request_", "match"),
    [
        ({"kind": "line", "x": mm(0), "y": mm(900)}, "The wrist comes 430000 um from the origin"),
        ({"kind": "path", "path": 7}, "The path has no points"),
        ({"kind": "align", "x": mm(0), "y": mm(0)}, "gives no direction"),
    ],
)
@in_virtual_time
async def test_what_the_arm_cannot_do_is_not_tried(request_: dict[str, Any], match: str) -> None:
    async with cell() as robot:
        await refused(robot, InvalidRequest, match, **request_)
        assert robot.frames_of("HPS") == []


LOWER = SetSoftLimits(lower=-10_100, upper=-9_900)
"""Limits of axis 1, which stands at -10000."""


@pytest.mark.parametrize(
    "request_",
    [
        {"kind": "offset", "y": mm(50)},
        {"kind": "line", "x": mm(0), "y": mm(215)},
        {"kind": "path", "points": [{"x": mm(10), "y": mm(260)}]},
        {"kind": "extend", "distance": mm(50)},
        {"kind": "retract", "distance": mm(50)},
        {"kind": "rotate", "radius": mm(150), "angle": deg(70)},
    ],
)
def test_a_move_that_would_end_beyond_a_soft_limit_starts_no_axis_and_its_plan_is_refused_alike(
    request_: dict[str, Any],
) -> None:
    @in_virtual_time
    async def story() -> None:
        async with cell() as robot:
            await robot.scara.members[1].ask(LOWER)
            match = r"of axis 1, line1.03, the target -\d+ lies beyond its (upper|lower) soft limit"
            with pytest.raises(InvalidRequest, match=match):
                await robot.moves.plan(robot.scara, read(**request_, pattern=3))
            await refused(robot, InvalidRequest, match, **request_)
            assert robot.frames_of("HPS") == []

    story()


@in_virtual_time
async def test_a_limit_of_an_axis_that_does_not_turn_refuses_no_turn_of_the_finger() -> None:
    async with cell() as robot:
        await robot.scara.members[1].ask(SetSoftLimits(lower=0, upper=10))
        assert (await robot.finished("finger", angle=deg(70))).status is MoveStatus.SUCCEEDED
        await robot.scara.members[2].ask(SetSoftLimits(lower=-20_000, upper=0))
        with pytest.raises(
            InvalidRequest, match=r"of axis 2, line1\.04, the target -\d+ lies beyond its lower"
        ):
            await robot.start("finger", angle=deg(-179))


@in_virtual_time
async def test_a_path_that_passes_the_origin_nearby_is_refused_unless_it_is_allowed() -> None:
    """13.10.6: such paths must not be."""
    async with cell() as robot:
        match = r"would pass the origin within (49|50)\d\d um"
        await refused(robot, InvalidRequest, match, kind="line", x=mm(10), y=mm(545))
        await refused(robot, InvalidRequest, r"within \d um", kind="offset", y=mm(400))
        assert (await robot.finished("extend", distance=mm(400))).status is MoveStatus.SUCCEEDED
    async with cell(extra="keep_out_um = 0") as robot:
        assert (await robot.finished("line", x=mm(10), y=mm(545), pattern=5)).status is MoveStatus.SUCCEEDED


@in_virtual_time
async def test_a_controller_with_another_geometry_is_not_moved() -> None:
    async with cell() as robot:
        robot.rig.axis(3).execute("HAS200000", 0.0)
        await refused(robot, GeometryDiffers, "line1.03 finds the finger at", kind="offset", x=mm(10))
        robot.rig.axis(3).execute("HAS215000", 0.0)
        robot.rig.axis(2).execute("HCS1", 0.0)
        await refused(robot, GeometryDiffers, "line1.02 drives axis 1, not 0", kind="offset", x=mm(10))
        for command in ("HCS0", "HTS1", "HZS1,1.00"):  # as from the factory
            robot.rig.axis(2).execute(command, 0.0)
        reason = r"line1\.02 calculates that the arm cannot be where it stands; nothing was moved"
        await refused(robot, GeometryDiffers, reason, kind="offset", x=mm(10))


@in_virtual_time
async def test_a_controller_that_does_not_take_the_preparation_is_told() -> None:
    async with cell() as robot:
        robot.rig.touch(3, lambda axis: axis.world.forced.update({CCW_LIMIT: True}))
        await refused(robot, ControllerRefused, "line1.03 refused HYS", kind="offset", y=mm(-100))
        assert robot.moves.log.of("wafer")[0].status is MoveStatus.REJECTED


@in_virtual_time
async def test_an_axis_that_has_moved_since_is_not_started() -> None:
    async with cell(baud=9600) as robot:
        move = asyncio.create_task(robot.start("offset", x=mm(10)))
        await robot.rig.wire.begun("&8AHXSA[3],10000")
        robot.rig.axis(4).execute("6PS-16000", asyncio.get_running_loop().time())
        with pytest.raises((NotSent, PowerCycled)):
            await move
        assert robot.frames_of("HMM") == []


@in_virtual_time
async def test_after_a_loss_of_power_nothing_is_prepared() -> None:
    async with cell() as robot:
        _brown_out(robot)
        await refused(robot, PowerCycled, "line1.03 has been switched off and on", kind="offset", x=mm(10))
        told = len(robot.frames_of("HPS"))
        await refused(robot, PowerCycled, "line1.03 has been switched off and on", kind="offset", x=mm(10))
        assert len(robot.frames_of("HPS")) == told


# Stops


@pytest.mark.parametrize("body", [0, 1, 2])
@in_virtual_time
async def test_a_stop_of_one_axis_stops_all(body: int) -> None:
    async with cell() as robot:
        begun = robot.place()
        move = await robot.start("offset", y=mm(-100), pattern=5)
        await asyncio.sleep(0.5)
        reports = await robot.rig.plant.stops.stop([robot.scara.members[body]], "decelerate")
        assert {it.body_id for it in reports} == {"line1.02", "line1.03", "line1.04"}
        assert all(it.state == "confirmed" for it in reports)
        over = await robot.ended(move)
        assert (over.status, over.end_cause, over.error) == (MoveStatus.STOPPED, "stop_command", None)
        assert robot.place().x == pytest.approx(begun.x, abs=120), "it is still on its line"
        assert robot.place().y > begun.y - 90_000
        assert not any(robot.moving())


@in_virtual_time
async def test_a_stop_on_a_long_ramp_of_the_path_raises_no_alarm() -> None:
    async with cell() as robot:
        for body in robot.scara.members:
            await body.ask(SetMaximumAcceleration(speed_set=5, acceleration=10_000))
        move = await robot.start("offset", y=mm(-100), pattern=5)
        await asyncio.sleep(3.0)
        asked_at = asyncio.get_running_loop().time()
        reports = await robot.rig.plant.stops.stop([robot.scara.members[0]], "decelerate")
        assert {it.state for it in reports} == {"acknowledged"}
        assert all("it may take up to 5.8 s" in str(it.detail) for it in reports)
        await robot.rig.plant.stops.confirmed()
        assert asyncio.get_running_loop().time() - asked_at > CONFIRM_WITHIN_S
        assert "body.stop.unconfirmed" not in robot.rig.types("body.stop")
        assert (await robot.ended(move)).status is MoveStatus.STOPPED


@in_virtual_time
async def test_a_stop_amid_the_preparation_starts_nothing() -> None:
    async with cell(baud=9600) as robot:
        move = asyncio.create_task(robot.start("offset", x=mm(10)))
        await robot.rig.wire.begun("&8AHPS1,-10000")
        await robot.rig.plant.stops.stop([robot.scara.members[2]], "decelerate")
        with pytest.raises(NotSent, match="A stop came first"):
            await move
        assert robot.frames_of("HMM") == []
        assert robot.moves.log.of("wafer")[0].status is MoveStatus.CANCELLED
        assert (await robot.finished("offset", x=mm(10))).status is MoveStatus.SUCCEEDED


# One axis fails

RAMP_S = 0.3
"""Seconds from 30 mm a second to standstill with pattern 5."""


def _ems(robot: Cell) -> None:
    robot.rig.touch(3, lambda axis: axis.world.forced.update({EMS: True}))


def _stall(robot: Cell) -> None:
    robot.rig.touch(3, lambda axis: axis.motor.stop(1 << STALL, asyncio.get_running_loop().time()))


def _limit(robot: Cell) -> None:
    robot.rig.touch(3, lambda axis: axis.world.forced.update({CCW_LIMIT: True}))


def _power_cut(robot: Cell) -> None:
    robot.switch(3, on=False)


def _brown_out(robot: Cell) -> None:
    robot.switch(3, on=False)
    robot.switch(3, on=True)


@pytest.mark.parametrize("partners", ["go_on", "stop"])
@pytest.mark.parametrize("on_fault", ["decelerate", "immediate"])
@pytest.mark.parametrize(
    ("hazard", "status", "cause", "within_s"),
    [
        (_ems, MoveStatus.FAILED, "ems", 0.05),
        (_stall, MoveStatus.FAILED, "stall", 0.05),
        (_limit, MoveStatus.FAILED, "ccw_limit", 0.05),
        (_power_cut, MoveStatus.LOST, "lost", 0.25),
        (_brown_out, MoveStatus.LOST, "lost", 0.5),
    ],
)
@in_virtual_time
async def test_one_axis_that_fails_stops_all_and_is_named(
    hazard: Callable[[Cell], None],
    status: MoveStatus,
    cause: str,
    within_s: float,
    on_fault: str,
    partners: Any,
) -> None:
    settings = LinkSettings(partners=partners)
    async with cell(extra=f'on_fault = "{on_fault}"', baud=9600, settings=settings) as robot:
        move = await robot.start("offset", y=mm(-100), pattern=5)
        await asyncio.sleep(0.5)
        hazard(robot)
        await asyncio.sleep(within_s + (RAMP_S if on_fault == "decelerate" else 0))
        assert not any(robot.moving()), "all stand"
        over = await robot.ended(move)
        assert (over.status, over.failed_axes, over.end_cause) == (status, [1], cause)
        assert over.error is not None
        assert "Axis 1: " in over.error.detail
        assert "line1.03" in over.error.detail
        assert "line1.02" not in over.error.detail
        assert robot.frames_of("5SS" if on_fault == "decelerate" else "5IS")


@in_virtual_time
async def test_one_axis_that_does_not_take_the_start_stops_the_others() -> None:
    async with cell(baud=9600) as robot:
        starting = asyncio.create_task(robot.start("offset", y=mm(-100), pattern=5))
        await robot.rig.wire.begun("&8AHMM")
        robot.rig.axis(3).prepared = None
        over = await robot.ended(await starting)
        assert (over.status, over.failed_axes, over.end_cause) == (MoveStatus.FAILED, [1], "rejected")
        assert over.error is not None
        assert "and all its axes were stopped. Axis 1: line1.03 refused HMM" in over.error.detail
        assert robot.place().y > 115_000 - 10_000
        assert [axis.status for axis in over.axes] == ["stopped", "rejected", "stopped"]


@in_virtual_time
async def test_one_axis_whose_reply_is_lost_stops_the_others_at_once() -> None:
    async with cell(baud=9600) as robot:
        starting = asyncio.create_task(robot.start("offset", y=mm(-100), pattern=5))
        await robot.rig.wire.begun("&8AHMM")
        robot.rig.wire.deaf_to = re.compile(rb"\[03:\]")
        over = await robot.ended(await starting)
        assert (over.status, over.failed_axes) == (MoveStatus.STOPPED, []), "the stop of all is confirmed"
        assert "axis 1: it has not answered the start, and others have" in over.evidence[0]
        assert robot.place().y > 115_000 - 10_000


@in_virtual_time
async def test_a_start_that_is_lost_moves_nothing_and_says_so() -> None:
    async with cell(baud=9600) as robot:
        before = robot.positions()
        starting = asyncio.create_task(robot.start("offset", x=mm(10)))
        await robot.rig.wire.begun("&8AHMM")
        lose(robot.rig, Direction.REQUESTS)
        over = await robot.ended(await starting)
        assert (over.status, over.end_cause, over.failed_axes) == (
            MoveStatus.FAILED,
            "not_executed",
            [0, 1, 2],
        )
        assert over.error is not None
        assert over.error.detail.count("the motor has not moved") == 3
        assert over.error.moved == "no"
        assert robot.positions() == before


# What is told


@in_virtual_time
async def test_the_life_of_a_move_is_told() -> None:
    async with cell(baud=9600) as robot:
        move = await robot.finished("offset", x=mm(20), pattern=5)
        assert robot.rig.types("scara.") == [
            f"scara.move.{it}" for it in ("queued", "sent", "started", "succeeded")
        ]
        ends = robot.rig.events("scara.move.succeeded")
        assert (ends[0].subject, ends[0].data["id"]) == ("/scaras/wafer", move.id)
        assert {axis["move_id"] for axis in ends[0].data["axes"]} == {
            event.data["id"] for event in robot.rig.events("body.move.succeeded")
        }
