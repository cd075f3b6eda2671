"""Jogging over HTTP: an axis moves only for as long as heartbeats come."""

import asyncio

from tests.api.bodies.test_moves import refused
from tests.api.robots.cell import HOME, Cell, in_cell

JOG = {"unit": 2, "axis": "X", "direction": "+"}


@in_cell()
async def test_an_axis_jogs_while_heartbeats_come_and_stops_when_told(cell: Cell) -> None:
    started = await cell.post("/robots/r1/jogs", JOG)
    assert started.status_code == 201, started.text
    place = started.headers["location"]
    for _ in range(4):
        await asyncio.sleep(0.4)
        assert (await cell.post(f"{place}/heartbeat")).json()["state"] == "jogging"
    ended = await cell.post(f"{place}/stop")
    assert (ended.status_code, ended.json()["state"]) == (200, "ended")
    assert (await cell.get("/robots/r1/units/2/status")).json()["moving"] is False
    assert [text for text in cell.commands() if text.startswith("JOG")][:2] == ["JOG X+", "JOG X"]


@in_cell()
async def test_without_a_heartbeat_the_axis_is_stopped_and_the_next_one_is_told_so(cell: Cell) -> None:
    place = (await cell.post("/robots/r1/jogs", JOG)).headers["location"]
    await asyncio.sleep(2)
    assert "JOG X" in cell.commands()
    late = await cell.post(f"{place}/heartbeat")
    assert (late.status_code, late.json()["type"].rpartition(":")[2]) == (409, "jog-over")
    assert (await cell.get("/robots/r1/units/2/status")).json()["moving"] is False


@in_cell()
async def test_a_jog_that_is_over_can_be_stopped_again_and_nothing_is_sent(cell: Cell) -> None:
    place = (await cell.post("/robots/r1/jogs", JOG)).headers["location"]
    await asyncio.sleep(2)
    before = cell.commands()
    for _ in range(2):
        stopped = await cell.post(f"{place}/stop")
        assert (stopped.status_code, stopped.json()["state"]) == (200, "lost")
    assert [text for text in cell.commands()[len(before) :] if text.startswith(("JOG", "A"))] == []
    refused(await cell.post("/robots/r1/jogs/nobody/stop"), 404)


@in_cell()
async def test_an_axis_or_direction_that_does_not_exist_is_not_sent(cell: Cell) -> None:
    before = cell.commands()
    answer = await cell.post("/robots/r1/jogs", JOG | {"axis": "W"})
    refused(answer, 422)
    assert "axis: r1/units/2 has the axes X, Y, Z; " in answer.json()["detail"]
    refused(await cell.post("/robots/r1/jogs", JOG | {"direction": "up"}), 422, "direction")
    refused(await cell.post("/robots/r1/jogs", JOG | {"unit": 3}), 404)
    refused(await cell.post("/robots/r1/jogs", JOG | {"unit": 10}), 422, "unit")
    refused(await cell.post("/robots/r1/jogs/nobody/heartbeat"), 404)
    assert cell.commands() == before


@in_cell()
async def test_the_command_of_the_table_opens_a_session_too(cell: Cell) -> None:
    answer = await cell.post("/robots/r1/units/2/commands/start-jog", {"axis": "Y", "direction": "-"})
    assert (answer.status_code, answer.json()["state"]) == (201, "jogging")
    await asyncio.sleep(3)
    assert "JOG Y" in cell.commands()
    await cell.move(HOME)


@in_cell(units=1)
async def test_a_jog_that_came_to_its_limit_is_over_and_leaves_the_robot_free(cell: Cell) -> None:
    await cell.move(HOME)
    jog = {"unit": 1, "axis": "Z", "direction": "+"}
    place = (await cell.post("/robots/r1/jogs", jog)).headers["location"]
    busy = await cell.post("/robots/r1/jogs", jog)
    assert (busy.status_code, busy.json()["type"].rpartition(":")[2]) == (409, "robot-busy")
    for _ in range(100):
        await asyncio.sleep(0.4)
        beat = await cell.post(f"{place}/heartbeat")
    assert (beat.status_code, beat.json()["type"].rpartition(":")[2]) == (409, "jog-over")
    assert cell.rig.types("robot.jog") == [
        "robot.jog.started",
        "robot.jog.stopping",
        "robot.jog.ended",
    ]
    await asyncio.sleep(1)
    assert (await cell.get("/robots/r1")).json()["moving"] is False
    await cell.move(HOME)


@in_cell(units=1)
async def test_a_heartbeat_that_nobody_hears_is_not_answered_as_one_that_keeps_the_axis(cell: Cell) -> None:
    await cell.move(HOME)
    jog = {"unit": 1, "axis": "Z", "direction": "-"}
    place = (await cell.post("/robots/r1/jogs", jog)).headers["location"]
    cell.rig.cable.unplug()
    beat = await cell.post(f"{place}/heartbeat")
    assert (beat.status_code, beat.json()["type"].rpartition(":")[2]) == (409, "jog-out-of-reach")
    assert "may go on moving" in beat.json()["detail"]
    assert beat.json()["moved"] == "unknown"


@in_cell()
async def test_a_stop_whose_standstill_was_not_seen_is_202_and_the_state_says_so(cell: Cell) -> None:
    place = (await cell.post("/robots/r1/jogs", JOG)).headers["location"]
    cell.rig.cable.lost_answer = "ACD"
    unseen = await cell.post(f"{place}/stop")
    assert (unseen.status_code, unseen.json()["state"], unseen.json()["ends_as"]) == (
        202,
        "stopping",
        "ended",
    )
    cell.rig.cable.lost_answer = ""
    await asyncio.sleep(10)
    seen = await cell.post(f"{place}/stop")
    assert (seen.status_code, seen.json()["state"]) == (200, "ended")


@in_cell()
async def test_the_command_that_stops_a_jog_is_200_only_where_standstill_was_seen(cell: Cell) -> None:
    await cell.post("/robots/r1/jogs", JOG)
    cell.rig.cable.lost_answer = "ACD"
    unseen = await cell.post("/robots/r1/units/2/commands/stop-jog", {"axis": "X"})
    refused(unseen, 409)
    assert "not seen to stand still" in unseen.json()["detail"]
    cell.rig.cable.lost_answer = ""
    await asyncio.sleep(10)
    assert (await cell.post("/robots/r1/units/2/commands/stop-jog", {"axis": "X"})).status_code == 200
