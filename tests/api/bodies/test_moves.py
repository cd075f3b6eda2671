"""Moves over HTTP: what moves a motor, what does not, and how a client learns of the end."""

import pytest
from httpx2 import Response

from tests.api.stand import RELATIVE, Stand, on_stand

UNTAUGHT = RELATIVE | {"pattern": 12}
"""A controller fresh from the factory has no speeds for this pattern."""


def refused(answer: Response, status: int, field: str | None = None) -> None:
    """The answer is a problem that swears that nothing moved."""
    problem = answer.json()
    assert answer.headers["content-type"] == "application/problem+json"
    assert (answer.status_code, problem["status"], problem["moved"]) == (status, status, "no")
    if field is not None:
        assert field in [error["field"] for error in problem["errors"]]


@on_stand()
async def test_a_relative_move_is_accepted_followed_and_ends(stand: Stand) -> None:
    await stand.teach_speeds("3F")

    accepted = await stand.post("/bodies/3f/moves", {**RELATIVE, "speed": "high"})

    move = accepted.json()
    assert accepted.status_code == 202
    assert accepted.headers["location"] == f"/bodies/arm.3F/moves/{move['id']}"
    assert move["frame"] == "&3F1+M50000\\r"
    assert move["status"] in ("sent", "moving")

    over = await stand.get(accepted.headers["location"] + "?wait=30")
    assert over.json() | {"status": "succeeded", "end_cause": "normal", "position": 50_000} == over.json()
    assert stand.moved() == ["&3F1+M50000"]


@on_stand()
async def test_waiting_by_prefer_or_query_answers_200_when_the_move_is_over(stand: Stand) -> None:
    await stand.teach_speeds("3F")

    by_header = await stand.post("/bodies/3F/moves", RELATIVE, prefer="wait=30")
    by_query = await stand.post("/bodies/3F/moves?wait=30", RELATIVE)
    impatient = await stand.post("/bodies/3F/moves", RELATIVE, prefer="wait=0.1")

    assert (by_header.status_code, by_header.json()["status"]) == (200, "succeeded")
    assert by_header.headers["preference-applied"] == "wait=30"
    assert (by_query.status_code, by_query.json()["position"]) == (200, 100_000)
    assert (impatient.status_code, impatient.json()["status"]) == (202, "moving")


@on_stand()
async def test_no_request_waits_longer_than_a_minute(stand: Stand) -> None:
    await stand.send("3F", "set-start-speed", speed=1)
    await stand.send("3F", "set-maximum-speed", speed=2)
    await stand.send("3F", "set-maximum-acceleration", acceleration=1)

    refused = await stand.post("/bodies/3F/moves?wait=61", RELATIVE)
    assert (refused.status_code, refused.json()["errors"][0]["field"]) == (422, "wait")
    assert not stand.moved()

    answer = await stand.post("/bodies/3F/moves", RELATIVE, prefer="wait=3600")

    assert (answer.status_code, answer.headers["preference-applied"]) == (202, "wait=60")


@pytest.mark.parametrize(
    ("move", "frame"),
    [
        (RELATIVE | {"direction": "ccw", "pattern": 12}, "&3F1-MA[12],50000"),
        (RELATIVE | {"speed": "low"}, "&3F2+M50000"),
        ({"kind": "absolute", "position": {"value": -7, "unit": "pulse"}}, "&3F1AM-7"),
        ({"kind": "absolute", "position": {"value": 7, "unit": "pulse"}, "speed": "low"}, "&3F2AM7"),
        ({"kind": "home"}, "&3F00M"),
        ({"kind": "home", "method": "stall_detection"}, "&3F01M"),
        ({"kind": "home", "method": "fast_then_stop"}, "&3F02M"),
        ({"kind": "home", "method": "fast_then_decelerate"}, "&3F03M"),
        ({"kind": "home", "method": "rc204"}, "&3F04M"),
        ({"kind": "home", "method": "centre_stall_dog"}, "&3F0QM"),
    ],
)
def test_validate_only_answers_the_exact_bytes_and_moves_nothing(move: dict[str, object], frame: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        await stand.teach_speeds("3F")
        answer = await stand.post("/bodies/3F/moves", move | {"validate_only": True})
        assert (answer.status_code, answer.json()["frame"]) == (200, frame + "\\r")
        assert stand.moved() == []

    story()


@on_stand()
async def test_validate_only_plans_the_duration_that_the_move_then_takes(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    plan = (await stand.post("/bodies/3F/moves", RELATIVE | {"validate_only": True})).json()
    assert (plan["distance"], plan["target_position"]) == (50_000, 50_000)
    # 5 k to 50 kpps at 100 kpps/s, half of the ramp with rising or falling acceleration, and back.
    assert 1.0 < plan["duration_s"] < 3.0


@on_stand()
async def test_lengths_are_converted_by_the_bodys_scale(stand: Stand) -> None:
    await stand.teach_speeds("01")
    move = {"kind": "absolute", "position": {"value": 12.5, "unit": "mm"}}

    answer = await stand.post("/bodies/01/moves?wait=30", move)
    position = (await stand.get("/bodies/01/position")).json()

    assert answer.json()["frame"] == "&011AM12500\\r"
    assert (position["pulses"], position["value"], position["unit"]) == (12_500, 12.5, "mm")


@on_stand()
async def test_a_length_without_a_scale_or_of_another_dimension_is_refused(stand: Stand) -> None:
    length = {"kind": "absolute", "position": {"value": 1, "unit": "mm"}}
    angle = {"kind": "absolute", "position": {"value": 1, "unit": "deg"}}
    refused(await stand.post("/bodies/3F/moves", length), 422)
    refused(await stand.post("/bodies/01/moves", angle), 422)
    assert stand.moved() == []


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"distance": {"value": True, "unit": "pulse"}}, "distance.value"),
        ({"distance": {"value": "500", "unit": "pulse"}}, "distance.value"),
        ({"distance": {"value": 500.5, "unit": "pulse"}}, "distance"),
        ({"distance": {"value": 1e300, "unit": "mm"}}, "distance.value"),
        ({"distance": {"value": 10**400, "unit": "mm"}}, "distance.value"),
        ({"distance": 500}, "distance"),
        ({"distance": {"value": 500}}, "distance.unit"),
        ({"distance": {"value": 500, "unit": "inch"}}, "distance.unit"),
        ({"distance": {"value": 500, "unit": "pulse", "x": 1}}, "distance.x"),
        ({"direction": "up"}, "direction"),
        ({"pattern": 30}, "pattern"),
        ({"pattern": False}, "pattern"),
        ({"validate_only": 1}, "validate_only"),
        ({"speed": None}, "speed"),
        ({"kind": "sideways"}, "kind"),
        ({"more": 1}, "more"),
    ],
)
def test_an_odd_move_is_422_and_no_move(change: dict[str, object], field: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        refused(await stand.post("/bodies/3F/moves", RELATIVE | change), 422, field)
        assert stand.moved() == []

    story()


@pytest.mark.parametrize("value", [0, -5])
def test_a_distance_of_nothing_or_less_is_422(value: int) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        move = RELATIVE | {"distance": {"value": value, "unit": "pulse"}}
        refused(await stand.post("/bodies/3F/moves", move), 422)
        assert stand.moved() == []

    story()


@pytest.mark.parametrize("address", ["04", "80", "7F", "3F%0D5IS", "%33G", "other.3F", "..%2F3F", "&3F"])
def test_an_address_that_is_no_body_is_404_and_reaches_no_line(address: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        before = stand.frames()
        answer = await stand.post(f"/bodies/{address}/moves", RELATIVE)
        refused(answer, 404)
        assert stand.frames() == before

    story()


@on_stand()
async def test_a_second_move_of_a_busy_body_is_409(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await stand.post("/bodies/3F/moves", RELATIVE)
    second = await stand.post("/bodies/3F/moves", RELATIVE)
    refused(second, 409)
    assert second.json()["type"].endswith(":body-busy")
    assert second.json()["retryable"] is True
    assert len(stand.moved()) == 1


@on_stand()
async def test_a_refusal_by_the_controller_is_a_problem_with_its_code(stand: Stand) -> None:
    answer = await stand.post("/bodies/3F/moves", UNTAUGHT)
    problem = answer.json()
    refused(answer, 422)
    assert problem["type"].endswith(":controller-refused")
    assert problem["code"] == "0x47"
    assert "pattern is not set" in problem["detail"]
    assert "SPS" in problem["remedy"]


@on_stand()
async def test_a_refusal_is_told_in_japanese_to_who_asks_for_it(stand: Stand) -> None:
    answer = await stand.post("/bodies/3F/moves", UNTAUGHT, **{"accept-language": "ja-JP,en;q=0.5"})
    problem = answer.json()
    assert "加減速パターンが設定されていない" in problem["detail"]
    assert problem["code"] == "0x47"
    assert problem["type"].endswith(":controller-refused")
    assert answer.headers["content-language"] == "ja"


@on_stand()
async def test_a_move_without_an_end_is_403_unless_configured(stand: Stand) -> None:
    answer = await stand.post("/bodies/3F/moves", {"kind": "continuous", "direction": "cw"})
    refused(answer, 403)
    assert "allow_endless_moves" in answer.json()["remedy"]
    refused(await stand.post("/bodies/3F/commands/move-clockwise", {"distance": "endless"}), 403)
    assert stand.moved() == []


@on_stand(allow_endless_moves=True)
async def test_a_configured_endless_move_runs_until_it_is_stopped(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    move = await stand.post("/bodies/3F/moves", {"kind": "continuous", "direction": "ccw"})
    await stand.post("/bodies/3F/stop", {"mode": "decelerate"})
    over = (await stand.get(move.headers["location"] + "?wait=10")).json()
    assert (over["kind"], over["status"], over["end_cause"]) == ("continuous", "stopped", "stop_command")


@on_stand()
async def test_nothing_is_sent_while_the_line_is_down_and_the_client_may_repeat_it(stand: Stand) -> None:
    stand.port.unplug()
    answer = await stand.post("/bodies/3F/moves", RELATIVE)
    refused(answer, 503)
    assert answer.headers["retry-after"] == "1"
    assert answer.json()["type"].endswith(":line-down")


@on_stand()
async def test_moves_are_listed_newest_first_and_belong_to_their_body(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    first = (await stand.post("/bodies/3F/moves?wait=30", RELATIVE)).json()["id"]
    second = (await stand.post("/bodies/3F/moves?wait=30", RELATIVE)).json()["id"]

    listed = (await stand.get("/bodies/3F/moves")).json()["moves"]
    newest = (await stand.get("/bodies/3F/moves?limit=1")).json()["moves"]

    assert [move["id"] for move in listed] == [second, first]
    assert [move["id"] for move in newest] == [second]
    refused(await stand.get(f"/bodies/00/moves/{first}"), 404)
    refused(await stand.get("/bodies/3F/moves/none"), 404)


@on_stand()
async def test_the_speed_of_a_move_is_changed_on_its_way_and_not_after_it(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    place = (await stand.post("/bodies/3F/moves", RELATIVE)).headers["location"]

    slower = await stand.post(f"{place}/speed", {"mode": "change", "speed": 20_000})
    assert (slower.status_code, slower.json()["status"]) == (200, "sent"), slower.text
    assert "&3F5CS20000" in stand.frames()
    assert (await stand.post(f"{place}/speed", {"mode": "decelerate"})).status_code == 200
    assert (await stand.post(f"{place}/speed", {"mode": "accelerate"})).status_code == 200

    assert (await stand.get(f"{place}?wait=30")).json()["status"] == "succeeded"
    sent = stand.frames()
    late = await stand.post(f"{place}/speed", {"mode": "accelerate"})
    refused(late, 409)
    assert late.json()["type"].rpartition(":")[2] == "move-over"
    refused(await stand.post("/bodies/3F/moves/nobody/speed", {"mode": "accelerate"}), 404)
    assert stand.frames() == sent
