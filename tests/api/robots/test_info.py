"""Robots over HTTP: what is known of them, where they stand, what is wrong with them, and their stops."""

import asyncio

from protocols.fics.status import MotionMode
from tests.api.bodies.test_moves import refused
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell, mm
from tests.api.stand import BODIES, Stand, on_stand


@in_cell()
async def test_a_robot_is_told_with_its_units_and_axes_and_nothing_is_sent(cell: Cell) -> None:
    before = cell.commands()
    (robot,) = (await cell.get("/robots")).json()["robots"]
    assert robot == (await cell.get("/robots/r1")).json()
    assert (robot["robot_id"], robot["line_id"], robot["line_state"]) == ("r1", "cell", "ready")
    assert (robot["online"], robot["mode"], robot["moving"], robot["error"]) == (True, 3, False, None)
    first, second = robot["units"]
    assert first == (await cell.get(UNIT)).json()
    assert [(axis["name"], axis["unit"]) for axis in first["axes"]] == [("X", "mm"), ("Y", "mm"), ("Z", "mm")]
    assert [(axis["name"], axis["speed_unit"]) for axis in first["motor_axes"]] == [
        ("A", "rpm"),
        ("B", "rpm"),
        ("Z", "mm/s"),
    ]
    assert [axis["name"] for axis in second["motor_axes"]] == ["X", "Y", "Z"]
    assert cell.commands() == before


@in_cell()
async def test_what_is_not_configured_is_404(cell: Cell) -> None:
    refused(await cell.get("/robots/r2"), 404)
    refused(await cell.get("/robots/r1/units/3"), 404)
    refused(await cell.post("/robots/r1/units/3/moves", HOME), 404)
    refused(await cell.get("/robots/r1/units/10"), 422, "unit")


@on_stand({"arm": BODIES})
async def test_a_plant_without_robots_has_an_empty_list(stand: Stand) -> None:
    assert (await stand.get("/robots")).json() == {"robots": []}
    refused(await stand.get("/robots/r1"), 404)


@in_cell()
async def test_a_position_that_is_not_known_is_null_with_the_reason(cell: Cell) -> None:
    position = (await cell.get(f"{UNIT}/position")).json()
    assert position["axes"]["X"] == {"value": None, "unit": "mm", "reason": "not_homed"}
    await cell.move(HOME)
    position = (await cell.get(f"{UNIT}/position")).json()
    assert all(axis["value"] is not None and axis["reason"] is None for axis in position["axes"].values())
    motors = (await cell.get(f"{UNIT}/position?coordinates=motor")).json()
    assert motors["axes"]["A"] == {"value": 0.0, "unit": "degree", "reason": None}
    refused(await cell.get(f"{UNIT}/position?coordinates=world"), 422, "coordinates")


@in_cell()
async def test_a_unit_stays_homed_while_another_one_is_read_until_the_power_is_lost(cell: Cell) -> None:
    async def homed() -> list[str]:
        units = (await cell.get("/robots/r1")).json()["units"]
        assert units[0] == (await cell.get(UNIT)).json()
        return [unit["homed"] for unit in units]

    assert await homed() == ["unknown", "unknown"]
    await cell.move(HOME)
    assert await homed() == ["yes", "unknown"]
    await cell.get("/robots/r1/units/2/position")
    await cell.get("/robots/r1/units/2/status")
    assert await homed() == ["yes", "yes"]

    cell.rig.power_cycle()
    await asyncio.sleep(10)
    await cell.post("/robots/r1/power-cycle/acknowledge")
    assert await homed() == ["unknown", "unknown"]


@in_cell()
async def test_the_status_names_what_each_motor_does(cell: Cell) -> None:
    still = (await cell.get(f"{UNIT}/status")).json()
    assert still["moving"] is False
    assert still["axes"]["A"]["motion"] == "standing"
    assert still["axes"]["A"]["sensors"] == {"origin": False, "plus_limit": False, "minus_limit": False}
    await cell.post(f"{UNIT}/moves", HOME)
    busy = (await cell.get(f"{UNIT}/status")).json()
    assert busy["moving"] is True
    assert busy["axes"]["A"]["motion"] == "homing"


@in_cell()
async def test_a_stop_is_confirmed_by_standstill_and_ends_the_move(cell: Cell) -> None:
    await cell.move(HOME)
    started = await cell.post(f"{UNIT}/moves", {"kind": "absolute", "axes": mm(X=-200)})
    answer = await cell.post("/robots/r1/stop")
    asked = answer.headers["x-request-id"]
    assert answer.json() == {
        "confirmed": True,
        "bodies": [],
        "robots": [
            {"robot_id": "r1", "state": "confirmed", "detail": None, "request_id": asked, "units_unknown": []}
        ],
    }
    assert (await cell.get(started.headers["location"])).json()["status"] == "stopped"
    assert "ASS" in cell.commands()


@in_cell()
async def test_the_stop_of_everything_stops_robots_too(cell: Cell) -> None:
    await cell.post(f"{UNIT}/moves", HOME)
    assert (await cell.post("/stop", {"mode": "immediate"})).json()["confirmed"] is True
    assert "AES" in cell.commands()


@in_cell()
async def test_an_error_is_told_without_asking_the_robot_and_goes_with_its_reset(cell: Cell) -> None:
    await cell.post(f"{UNIT}/stop", {"mode": "immediate"})
    await asyncio.sleep(1)
    before = cell.rig.heard("ERR")
    (error,) = (await cell.get("/robots/r1/errors")).json()["errors"]
    assert (error["kind"], len(error["code"])) == ("emergency", 3)
    assert cell.rig.heard("ERR") == before
    refusal = await cell.post(f"{UNIT}/moves", HOME)
    refused(refusal, 409)
    assert refusal.json()["type"].endswith(":error-stands")
    assert (await cell.post("/robots/r1/errors/reset")).json()["errors"] == []
    await cell.move(HOME)


@in_cell()
async def test_motion_after_a_loss_of_power_waits_for_somebody_who_knows(cell: Cell) -> None:
    cell.rig.power_cycle()
    await asyncio.sleep(10)
    refusal = await cell.post(f"{UNIT}/moves", HOME)
    refused(refusal, 409)
    assert refusal.json()["type"].endswith(":power-cycled")
    robot = (await cell.post("/robots/r1/power-cycle/acknowledge")).json()
    assert robot["power_cycled"] is False
    await cell.move(HOME)


@in_cell()
async def test_a_refusal_and_a_failure_are_told_with_their_codes_in_both_languages(cell: Cell) -> None:
    await cell.move(HOME)
    far = {"kind": "absolute", "axes": mm(X=100_000)}
    english = await cell.post(f"{UNIT}/moves", far)
    japanese = await cell.post(f"{UNIT}/moves", far, **{"accept-language": "ja"})
    refused(english, 422)
    assert english.json()["code"] == japanese.json()["code"] == "E07"
    assert "soft limit" in english.json()["detail"]
    assert "ソフトリミット" in japanese.json()["detail"]
    assert japanese.headers["content-language"] == "ja"


@in_cell()
async def test_answers_are_told_with_their_age(cell: Cell) -> None:
    for answer in ((await cell.get(f"{UNIT}/position")).json(), (await cell.get(f"{UNIT}/status")).json()):
        assert answer["read_at"]
        assert answer["age_ms"] >= 0


@in_cell()
async def test_a_macro_that_waits_counts_as_moving(cell: Cell) -> None:
    cell.rig.touch(lambda fics, _: setattr(fics, "terminal", MotionMode.MACRO))
    status = (await cell.get(f"{UNIT}/status")).json()
    assert status["moving"] is True
    assert not any(axis["moving"] for axis in status["axes"].values())


@in_cell()
async def test_of_a_robot_out_of_reach_nobody_says_that_it_stands_still(cell: Cell) -> None:
    cell.rig.cable.unplug()
    assert (await cell.get("/robots/r1")).json()["moving"] is None
    assert 'motion_gateway_robots{kind="moving",line="cell"} 0.0' in (await cell.get("/metrics")).text


@in_cell()
async def test_a_reset_that_did_not_help_moved_nothing(cell: Cell) -> None:
    cell.rig.fics.stop_input = True
    await cell.post(f"{UNIT}/stop", {"mode": "immediate"})
    answer = await cell.post("/robots/r1/errors/reset")
    refused(answer, 409)
    assert (answer.json()["type"].rpartition(":")[2], answer.json()["moved"]) == ("error-remains", "no")


@in_cell()
async def test_a_robot_that_does_not_tell_where_it_stands_has_not_moved(cell: Cell) -> None:
    await cell.get(f"{UNIT}/position")
    cell.rig.lose_replies(1000)
    answer = await cell.get(f"{UNIT}/position")
    refused(answer, 409)
    assert [answer.json()[key] for key in ("moved", "retryable", "remedy")] == ["no", True, "Ask again."]
