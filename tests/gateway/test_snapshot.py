"""The plant at one moment, for who has missed something."""

from typing import Any

from gateway.core.events import SNAPSHOT, Event
from gateway.core.exchange import Lane
from gateway.event_types import EVENT_TYPES
from protocols.fics.moves import MoveRelative
from protocols.rorze.moves import MoveClockwise
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time, rig, start
from tests.tested_plant import TestedPlant

LOST = "00000000-000000000001"


async def taken(plant: TestedPlant, bodies: list[str] | None = None) -> Any:
    page = await plant.events.since(LOST, bodies)
    event: Event = page.events[1]
    assert (event.type, event.subject) == (SNAPSHOT, "/events")
    return EVENT_TYPES[SNAPSHOT].data.model_validate(event.data, strict=False)


@in_virtual_time
async def test_all_bodies_lines_and_open_moves_are_in_it() -> None:
    async with rig(groups={}) as it:
        await start(it, MoveClockwise(distance=500), "00")
        await it.plant.moves.wait(it.plant.moves.log.of(it.body("00").address)[0].id, 60.0)
        move = await start(it, MoveClockwise(distance=50_000))
        await it.body().poll(Lane.READ)
        found = await taken(it.plant)
        assert found.as_of == it.plant.events.cursor
        assert [line.line_id for line in found.lines] == ["line1"]
        assert [body.body_id for body in found.bodies] == ["line1.00", "line1.01", "line1.3F"]
        assert [(body.moving, body.move_id) for body in found.bodies][2] == (True, move.id)
        assert [it.id for it in found.moves] == [move.id]


@in_virtual_time
async def test_who_wants_some_bodies_sees_no_others() -> None:
    async with rig() as it:
        await start(it, MoveClockwise(distance=50_000))
        found = await taken(it.plant, ["00"])
        assert [body.body_id for body in found.bodies] == ["line1.00"]
        assert (found.lines, found.moves, found.robots) == ([], [], [])


@in_virtual_time
async def test_robots_are_in_it_with_their_errors_and_moves() -> None:
    async with fics_rig() as it:
        move = await it.start(MoveRelative(coordinates=[None, None, -5.0]))
        found = await taken(it.plant)
        assert [(robot.robot_id, robot.online, robot.error) for robot in found.robots] == [("r1", True, None)]
        assert [it.id for it in found.moves] == [move.id]
