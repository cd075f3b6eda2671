"""The paths of SCARA robots over HTTP."""

from tests.api.scaras.cell import on_cell
from tests.api.stand import Stand


def mm(value: float) -> dict[str, object]:
    return {"value": value, "unit": "mm"}


@on_cell
async def test_a_path_is_stored_in_all_controllers_and_read_back(stand: Stand) -> None:
    points = [
        {"x": mm(20), "y": mm(150), "radius": mm(5)},
        {"place": "center"},
        {"x": mm(0), "y": {"value": 600_000, "unit": "um"}},
    ]
    stored = await stand.client.put("/scaras/wafer/paths/9", json={"points": points})
    assert stored.status_code == 200, stored.text
    assert (await stand.get("/scaras/wafer/paths/9")).json() == stored.json()
    first, centre, last = stored.json()["points"]
    assert (first["x"]["value"], first["radius"]["value"], first["place"]) == (20_000, 5_000, None)
    assert (centre["x"], centre["place"]) == (None, "center")
    assert last["radius"] == {"value": 0, "unit": "um"}
    assert (await stand.client.put("/scaras/wafer/paths/9", json={"points": []})).json()["points"] == []


@on_cell
async def test_paths_that_differ_are_told(stand: Stand) -> None:
    await stand.send("03", "set-path-point", path=3, point=1, x=1, y=2, radius=0)
    answer = await stand.get("/scaras/wafer/paths/3")
    assert (answer.status_code, answer.json()["type"]) == (409, "urn:motion-gateway:problem:paths-differ")
    move = await stand.post("/scaras/wafer/moves", {"kind": "path", "path": 3, "pattern": 3})
    assert (move.status_code, move.json()["moved"]) == (409, "no")
    assert stand.moved() == []


@on_cell
async def test_a_point_is_a_place_or_the_centre(stand: Stand) -> None:
    x, y = mm(1), mm(2)
    for point in (
        {},
        {"x": x},
        {"x": x, "y": y, "place": "center"},
        {"place": "center", "radius": x},
        {"x": x, "y": y, "radius": mm(-1)},
        {"x": x, "y": {"value": 1, "unit": "deg"}},
        {"x": x, "y": {"value": 1e9, "unit": "um"}},
        {"x": x, "y": {"value": 1e6, "unit": "mm"}},
    ):
        answer = await stand.client.put("/scaras/wafer/paths/9", json={"points": [point]})
        assert answer.status_code == 422, point
    for number in (-1, 64):
        assert (await stand.get(f"/scaras/wafer/paths/{number}")).status_code == 422


@on_cell
async def test_the_path_that_the_gateway_keeps_is_not_stored(stand: Stand) -> None:
    answer = await stand.client.put("/scaras/wafer/paths/63", json={"points": []})
    assert answer.status_code == 422
    assert "the one that the gateway writes its lines to" in answer.json()["detail"]
