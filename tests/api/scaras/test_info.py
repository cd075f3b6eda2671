"""SCARA robots over HTTP: what they are, where the finger is, and how one calculates with them."""

import pytest

from tests.api.scaras.cell import on_cell
from tests.api.stand import Stand


@on_cell
async def test_a_robot_is_listed_with_its_axes_and_its_geometry(stand: Stand) -> None:
    [listed] = (await stand.get("/scaras")).json()["scaras"]
    assert (await stand.get("/scaras/WAFER")).json() == listed
    assert (listed["scara_id"], listed["name"], listed["group_id"]) == ("wafer", "wafers", "arm.8A")
    assert [axis["body_id"] for axis in listed["axes"]] == ["arm.02", "arm.03", "arm.04"]
    assert listed["geometry"]["type"] == "three_axes"
    assert listed["geometry"]["arm"] == {"value": 215_000, "unit": "um"}
    assert (await stand.get("/scaras/other")).status_code == 404
    groups = (await stand.get("/groups")).json()["groups"]
    assert [(group["group_id"], group["members"]) for group in groups] == [
        ("arm.8A", ["arm.02", "arm.03", "arm.04"])
    ]


@on_cell
async def test_its_group_is_not_defined_anew(stand: Stand) -> None:
    answer = await stand.client.put("/groups/8A", json={"members": ["02", "3F"]})
    assert answer.status_code == 422
    assert "group of a SCARA robot" in answer.json()["detail"]


@on_cell
async def test_coordinates_take_one_frame(stand: Stand) -> None:
    before = len(stand.frames())
    answer = (await stand.get("/scaras/wafer/coordinates")).json()
    assert [frame for frame in stand.frames()[before:] if frame.startswith("&8A")] == ["&8A6PD"]
    assert answer["x"]["value"] == pytest.approx(12, abs=1)
    assert answer["y"] == {"value": pytest.approx(115_000, abs=1), "unit": "um"}
    assert answer["angle"] == {"value": pytest.approx(89_998, abs=1), "unit": "mdeg"}
    assert answer["pulses"] == [-10_149, -10_000, -16_666]


@on_cell
async def test_kinematics_in_both_directions(stand: Stand) -> None:
    before = len(stand.frames())
    pulses = [-10_149, -10_000, -16_666]
    there = (await stand.post("/scaras/wafer/kinematics/forward", {"pulses": pulses})).json()
    place = {name: there[name] for name in ("x", "y", "angle")}
    back = (await stand.post("/scaras/wafer/kinematics/inverse", place)).json()
    assert back == there
    wafer = {
        "x": {"value": 0, "unit": "mm"},
        "y": {"value": 115, "unit": "mm"},
        "angle": {"value": 90, "unit": "deg"},
    }
    told = (await stand.post("/scaras/wafer/kinematics/inverse", wafer)).json()
    assert told["pulses"] == pulses  # RC-420 manual 13.10.7
    far = {"x": {"value": 0, "unit": "mm"}, "y": {"value": 900, "unit": "mm"}}
    answer = await stand.post("/scaras/wafer/kinematics/inverse", far)
    assert answer.status_code == 422
    assert "The wrist comes 430000 um" in answer.json()["detail"]
    short = await stand.post("/scaras/wafer/kinematics/forward", {"pulses": [0, 0]})
    assert "has 3 axes, not 2" in short.json()["detail"]
    assert not [frame for frame in stand.frames()[before:] if frame.startswith("&8A")]


@on_cell
async def test_the_geometry_is_compared_and_given_to_the_controllers(stand: Stand) -> None:
    assert (await stand.get("/scaras/wafer/geometry")).json()["agrees"]
    await stand.send("03", "set-arm-length", length=200_000)
    told = (await stand.get("/scaras/wafer/geometry")).json()
    assert [it["agrees"] for it in told["controllers"]] == [True, False, True]
    before = len(stand.frames())
    applied = (await stand.post("/scaras/wafer/geometry/apply")).json()
    assert applied["agrees"]
    assert [frame for frame in stand.frames()[before:] if frame[5] == "S"] == ["&03HAS215000"]
    assert (await stand.post("/scaras/wafer/geometry/apply", {"flash": True})).json()["agrees"]
    assert "&8AFIS" in stand.frames()
