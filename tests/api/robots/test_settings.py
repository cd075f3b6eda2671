"""Settings of a unit over HTTP: all of them, by axis, written as bytes and read back."""

import asyncio
from typing import Any

import httpx2
import pytest

from gateway.fics.settings import SETTINGS, SMOOTH, SettingsChange, UnitSettings
from protocols.fics.commands import ROWS
from protocols.table import Retry
from tests.api.bodies.test_moves import refused
from tests.api.robots.cell import HOME, UNIT, Cell, in_cell, mm


def test_every_setting_of_the_table_that_can_be_read_back_is_one() -> None:
    names = {SMOOTH, *SETTINGS}
    assert set(SettingsChange.model_fields) == names
    assert set(UnitSettings.model_fields) == names | {"robot_id", "unit"}
    written = {row.code for row in ROWS if row.retry is Retry.SETTING} - {"VAR", "SCV"}
    assert {setting.write.code for setting in SETTINGS.values()} == written
    assert all(setting.read.code == setting.write.code for setting in SETTINGS.values())


@in_cell()
async def test_all_settings_are_read_with_the_names_and_units_of_their_axes(cell: Cell) -> None:
    settings = (await cell.get(f"{UNIT}/settings")).json()
    assert None not in settings.values()
    assert settings["speed_percent"] == {"X": 100.0, "Y": 100.0, "Z": 100.0}
    assert settings["maximum_speed"]["X"] == {"value": 500.0, "unit": "mm/s"}
    assert settings["motor_maximum_speed"]["A"]["unit"] == "rpm"
    assert settings["homing_type"] == {"A": 0, "B": 0, "Z": 0}


@pytest.mark.parametrize(
    ("name", "value", "frame"),
    [
        ("speed_percent", {"X": 10, "Z": 0.5}, "VAO 10,,0.5"),
        ("maximum_speed", {"Y": {"value": 120.5, "unit": "mm/s"}}, "VSO ,120.5"),
        ("acceleration_time_ms", {"X": 1, "Y": 9999}, "VST 1,9999"),
        ("deceleration_time_ms", {"Z": 300}, "VSS ,,300"),
        ("upper_soft_limit", mm(X=250), "SLP 250"),
        ("lower_soft_limit", mm(X=-250), "SLM -250"),
        ("start_speed_pps", {"A": 0, "B": 9999}, "VSB 0,9999"),
        ("homing_type", {"B": 6}, "HMT ,6"),
        ("homing_offset", {"A": {"value": -1.5, "unit": "degree"}}, "HMO -1.5"),
        ("homing_speed", {"A": {"value": 9, "unit": "rpm"}}, "HMV 9"),
        ("index_search_speed", {"Z": {"value": 2, "unit": "mm/s"}}, "HMB ,,2"),
        ("motor_speed_percent", {"A": 100}, "MAO 100"),
        ("motor_maximum_speed", {"A": {"value": 30, "unit": "rpm"}}, "MSO 30"),
        ("motor_acceleration_time_ms", {"A": 77}, "MST 77"),
        ("motor_deceleration_time_ms", {"A": 78}, "MSS 78"),
        ("motor_upper_soft_limit", {"B": {"value": 70, "unit": "degree"}}, "MSP ,70"),
        ("motor_lower_soft_limit", {"B": {"value": -70, "unit": "degree"}}, "MSM ,-70"),
        ("smooth_acceleration", True, "SCV 1"),
    ],
)
def test_a_setting_is_written_and_read_back(name: str, value: Any, frame: str) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        answer = await cell.client.patch(f"{UNIT}/settings", json={name: value})
        assert answer.status_code == 200, answer.text
        told = answer.json()[name]
        assert frame in cell.commands()
        assert [key for key, setting in answer.json().items() if setting is not None] == [
            "robot_id",
            "unit",
            name,
        ]
        assert told == value or {axis: told[axis] for axis in value} == value

    story()


@pytest.mark.parametrize(
    ("change", "field", "says"),
    [
        ({"speed_percent": {"X": 0}}, "speed_percent.X", "from 0.1 to 100"),
        ({"speed_percent": {"X": 100.5}}, "speed_percent.X", "from 0.1 to 100"),
        ({"speed_percent": {"X": 12.3456}}, "speed_percent.X", "at most 5 characters"),
        ({"acceleration_time_ms": {"X": 10_000}}, "acceleration_time_ms.X", "from 1 to 9999"),
        ({"acceleration_time_ms": {"X": 1.5}}, "acceleration_time_ms.X", "from 1 to 9999"),
        ({"maximum_speed": {"X": 5}}, "maximum_speed.X", "must be an object, not 5"),
        ({"maximum_speed": {"X": {"value": 0, "unit": "mm/s"}}}, "maximum_speed.X.value", "above 0, up to"),
        ({"maximum_speed": {"X": {"value": 5, "unit": "mm"}}}, "maximum_speed.X.unit", "'mm/s'"),
        ({"start_speed_pps": {"A": -1}}, "start_speed_pps.A", "from 0 to 9999"),
        ({"homing_type": {"A": 7}}, "homing_type.A", "from 0 to 6"),
        ({"smooth_acceleration": 1}, "smooth_acceleration", "must be true or false, not 1"),
        ({"speed": 1}, "speed", "is not known here"),
    ],
)
def test_a_value_outside_its_range_is_refused_with_field_and_range(
    change: dict[str, object], field: str, says: str
) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        before = cell.commands()
        # The setting before it is good, and is not sent either.
        answer = await cell.client.patch(f"{UNIT}/settings", json={"smooth_acceleration": True} | change)
        refused(answer, 422, field)
        assert any(says in error["message"] for error in answer.json()["errors"]), answer.text
        assert cell.commands() == before

    story()


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({}, "No setting is named"),
        ({"speed_percent": {}}, "speed_percent: at least one axis needs a value"),
        ({"speed_percent": {"A": 5}}, "speed_percent.A: r1/units/1 has the axes X, Y, Z"),
        ({"motor_speed_percent": {"X": 5}}, "has the axes A, B, Z"),
        ({"maximum_speed": {"X": {"value": 5, "unit": "rpm"}}}, "maximum_speed.X.unit: axis X"),
    ],
)
def test_what_does_not_fit_the_unit_is_refused(change: dict[str, object], says: str) -> None:
    @in_cell()
    async def story(cell: Cell) -> None:
        before = cell.commands()
        answer = await cell.client.patch(f"{UNIT}/settings", json=change)
        refused(answer, 422)
        assert says in answer.json()["detail"]
        assert cell.commands() == before

    story()


@in_cell()
async def test_settings_are_refused_while_the_robot_moves(cell: Cell) -> None:
    await cell.post(f"{UNIT}/moves", HOME)
    refused(await cell.get(f"{UNIT}/settings"), 409)
    refused(await cell.client.patch(f"{UNIT}/settings", json={"speed_percent": {"X": 5}}), 409)
    assert not cell.rig.heard("VAO")


@in_cell()
async def test_a_change_that_is_refused_midway_tells_what_was_changed_before(cell: Cell) -> None:
    change = {"speed_percent": {"X": 10}, "acceleration_time_ms": {"X": 200}}
    under_way = asyncio.create_task(cell.client.patch(f"{UNIT}/settings", json=change))
    await cell.rig.cable.written_from("VST 200")
    cell.rig.edit(on=True)
    answer = await under_way
    refused(answer, 409)
    assert "VAO was changed before it" in answer.json()["detail"]


@in_cell(units=1)
async def test_a_change_that_the_line_breaks_off_midway_tells_what_was_changed_before(cell: Cell) -> None:
    change = {"speed_percent": {"X": 10}, "acceleration_time_ms": {"X": 200}}
    under_way = asyncio.create_task(cell.client.patch(f"{UNIT}/settings", json=change))
    await cell.rig.cable.written_from("VAO")
    cell.rig.cable.lost_answer = "UNT"
    answer = await under_way
    refused(answer, 409)
    problem = answer.json()
    assert problem["type"].endswith(":partly-changed")
    assert problem["detail"] == (
        "Of the settings asked for, VAO was changed, then the change was broken off: the unit is not certain."
    )
    assert cell.rig.fics.units[1].users[0].percent == 10.0


@in_cell(units=1)
async def test_settings_that_are_not_read_back_were_changed_all_the_same(cell: Cell) -> None:
    under_way = asyncio.create_task(cell.client.patch(f"{UNIT}/settings", json={"speed_percent": {"X": 10}}))
    await cell.rig.cable.written_from("VAO 10")
    await cell.rig.cable.written_from("VAO")
    cell.rig.cable.unplug()
    answer = await under_way
    refused(answer, 409)
    assert answer.json()["type"].endswith(":not-read-back")
    assert "VAO 10 was sent to r1, but could not be read back" in answer.json()["detail"]
    assert cell.rig.fics.units[1].users[0].percent == 10.0


@in_cell(units=1)
async def test_settings_that_are_changed_and_cannot_be_shown_were_changed_all_the_same(cell: Cell) -> None:
    under_way = asyncio.create_task(cell.client.patch(f"{UNIT}/settings", json={"speed_percent": {"X": 10}}))
    await cell.rig.cable.written_from("VAO 10")
    await cell.rig.cable.written_from("VAO")
    await cell.rig.cable.written_from("VAO")
    cell.rig.cable.unplug()
    answer = await under_way
    refused(answer, 409)
    assert "The settings of r1/units/1 were changed" in answer.json()["detail"]


@pytest.mark.parametrize("mode", [2, 3])
def test_a_setting_that_was_lost_on_its_way_is_not_called_changed(mode: int) -> None:
    @in_cell(units=1, mode=mode)
    async def story(cell: Cell) -> None:
        cell.rig.cable.lost_once = "VST"
        change = {"speed_percent": {"X": 10}, "acceleration_time_ms": {"X": 777}}
        answer = await cell.client.patch(f"{UNIT}/settings", json=change)
        refused(answer, 409)
        assert answer.json()["type"].endswith(":partly-changed")
        assert "VAO was changed" in answer.json()["detail"]
        assert "VST 777 was sent to r1, and it tells VST 200,200,200" in answer.json()["detail"]

    story()


@in_cell()
async def test_soft_limits_are_sent_in_an_order_in_which_they_never_cross(cell: Cell) -> None:
    change = {"lower_soft_limit": mm(X=400), "upper_soft_limit": mm(X=500)}
    answer = await cell.client.patch(f"{UNIT}/settings", json=change)
    assert answer.status_code == 200, answer.text
    assert [text for text in cell.commands() if text.startswith(("SLP ", "SLM "))] == ["SLP 500", "SLM 400"]


@in_cell()
async def test_soft_limits_that_would_cross_are_refused_with_their_field(cell: Cell) -> None:
    answer = await cell.client.patch(f"{UNIT}/settings", json={"upper_soft_limit": mm(X=-301)})
    refused(answer, 422)
    assert "upper_soft_limit: axis X of r1/units/1 would have soft limits" in answer.json()["detail"]
    assert not [text for text in cell.commands() if text.startswith("SLP ")]


async def patch(cell: Cell, change: object, tag: str) -> httpx2.Response:
    return await cell.client.patch(f"{UNIT}/settings", json=change, headers={"If-Match": tag})


@in_cell()
async def test_a_stale_etag_sets_nothing(cell: Cell) -> None:
    seen = (await cell.get(f"{UNIT}/settings")).headers["etag"]
    assert seen == (await cell.get(f"{UNIT}/settings")).headers["etag"]
    assert (await patch(cell, {"speed_percent": {"X": 50}}, seen)).status_code == 200
    before = cell.commands()
    stale = await patch(cell, {"acceleration_time_ms": {"X": 100}}, seen)
    assert (stale.status_code, stale.json()["moved"]) == (412, "no")
    assert [text for text in cell.commands()[len(before) :] if " " in text] == []


@in_cell()
async def test_of_two_who_have_read_the_same_settings_one_changes_them(cell: Cell) -> None:
    seen = (await cell.get(f"{UNIT}/settings")).headers["etag"]
    answers = await asyncio.gather(
        patch(cell, {"speed_percent": {"X": 50}}, seen), patch(cell, {"speed_percent": {"X": 60}}, seen)
    )
    assert sorted(answer.status_code for answer in answers) == [200, 412]
    assert len([text for text in cell.commands() if text.startswith("VAO ")]) == 1


@in_cell()
async def test_settings_and_positions_go_back_as_they_were_read(cell: Cell) -> None:
    for method, path in (("PATCH", f"{UNIT}/settings"), ("PUT", f"{UNIT}/positions")):
        if method == "PUT":
            stored = {
                "positions": [
                    {"number": 1, "axes": {"X": {"value": 5, "unit": "mm"}}},
                    {"number": 2, "axes": {"Y": {"value": -1, "unit": "mm"}}},
                ]
            }
            assert (await cell.client.put(path, json=stored)).status_code == 200
        document = (await cell.get(path)).json()
        answer = await cell.client.request(method, path, json=document)
        assert answer.status_code == 200, answer.text
        assert (await cell.get(path)).json() == document
        refused_ = await cell.client.request(method, path, json={**document, "unit": 2})
        assert refused_.status_code == 422
        assert refused_.json()["detail"].startswith("unit: it cannot be set, and is otherwise now")
