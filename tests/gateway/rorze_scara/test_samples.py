"""Where the axes of a SCARA robot were seen in a move, and where the plan has them."""

from typing import Any

import pytest

from gateway.core.errors import InvalidRequest, NotFound
from gateway.rorze_scara.preparation import prepare, work_out
from gateway.rorze_scara.record import ScaraSamples
from protocols.rorze.interpolation import StartInterpolation
from tests.gateway.rorze_scara.cell import BELTS, Cell, cell, deg, mm, read
from tests.plants import in_virtual_time
from tests.through_the_door import ask

NEAR = 3.0
"""Pulses between a plan and what was seen: a pulse that was cut, and the instant of the answer."""
KINDS: list[tuple[str, dict[str, Any]]] = [
    ("line", {"x": mm(0), "y": mm(150)}),
    ("path", {"points": [{"x": mm(100), "y": mm(200), "radius": mm(20)}, {"x": mm(100), "y": mm(300)}]}),
    ("offset", {"x": mm(10)}),
    ("extend", {"distance": mm(20)}),
    ("rotate", {"radius": mm(150), "angle": deg(100)}),
    ("finger", {"angle": deg(80)}),
    ("align", {"x": mm(200), "y": mm(300)}),
]


async def samples_of(robot: Cell, kind: str, **request: Any) -> ScaraSamples:
    move = await robot.finished(kind, **request)
    assert move.status == "succeeded", move.error
    told = await ask(robot.rig.plant, "getScaraSamples", scara_id="wafer", move_id=move.id)
    assert isinstance(told, ScaraSamples)
    assert [it.move_id for it in told.axes] == [it.move_id for it in move.axes if it.move_id]
    for axis in told.axes:
        [record] = [it for it in move.axes if it.move_id == axis.move_id]
        assert axis.plan is not None, axis.note
        assert axis.plan[0].pulses == record.start_position
        assert axis.plan[-1].pulses == pytest.approx(record.target_position, abs=1)
    return told


@pytest.mark.parametrize(("kind", "request_"), KINDS, ids=[kind for kind, _ in KINDS])
def test_each_axis_was_seen_where_the_plan_has_it(kind: str, request_: dict[str, Any]) -> None:
    @in_virtual_time
    async def story() -> None:
        async with cell() as robot:
            slow = {} if kind in ("finger", "align") else {"pattern": 5}
            told = await samples_of(robot, kind, **request_, **slow)
            assert max(len(axis.samples) for axis in told.axes) > 2
            for axis in told.axes:
                off = [abs(it.pulses - (it.planned_pulses or 0.0)) for it in axis.samples]
                assert max(off) <= NEAR, (axis.body_id, off)

    story()


@in_virtual_time
async def test_belts_have_a_plan_too() -> None:
    async with cell(BELTS, (0, 10_000)) as robot:
        assert len((await samples_of(robot, "extend", distance=mm(20))).axes) == 2


@in_virtual_time
async def test_a_path_of_commands_of_their_own_is_known_to_the_controllers_alone() -> None:
    async with cell() as robot:
        group, moves, frames = robot.scara.group, robot.rig.plant.moves, list[str]()
        await prepare(await work_out(robot.scara, read("line", x=mm(0), y=mm(150), pattern=3)), frames.append)
        for move in await moves.start(group, StartInterpolation()):
            over = await moves.wait(move.id, 60.0)
            told = await ask(robot.rig.plant, "getSamples", body_id=over.body_id, move_id=over.id)
            assert told.plan is None
            assert "prepared by commands of its own: only the controllers know it" in told.note


@in_virtual_time
async def test_a_move_that_never_began_has_no_samples() -> None:
    async with cell() as robot:
        with pytest.raises(NotFound, match="There is no move none"):
            await ask(robot.rig.plant, "getScaraSamples", scara_id="wafer", move_id="none")
        with pytest.raises(InvalidRequest):
            await robot.start("line", x=mm(2000), y=mm(0))
        [refused] = robot.moves.log.of("wafer")
        with pytest.raises(NotFound, match="was not started, so there are no samples"):
            await ask(robot.rig.plant, "getScaraSamples", scara_id="wafer", move_id=refused.id)
