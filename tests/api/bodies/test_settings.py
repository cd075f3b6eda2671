"""All settings of a body over HTTP: one document, changed by what differs."""

import asyncio
from typing import Any

import pytest

from gateway.rorze.settings_table import SETTINGS, Settings
from tests.api.bodies.test_speed_sets import set_by
from tests.api.stand import RELATIVE, Stand, on_stand

PATH = "/bodies/01/settings"
CHAPTER_18 = (
    "0BS 0RS 0SS 3IS 9VS CCS CES CFS COS CPS CSS DCS DIS DLS EAS EDS EPS HAS HCS HFS HTS HZS OAS OBS OHS OLS "
    "OSS PAS PBS PES PJS PKS PLS PSS PTS QIS QSS UAS"
)
"""But SPS, which patterns have."""


async def patch(stand: Stand, change: dict[str, Any], path: str = PATH, **headers: str) -> Any:
    answer = await stand.client.patch(path, json=change, headers=headers)
    assert answer.status_code == 200, answer.text
    return answer.json()


def test_the_document_has_all_that_fis_keeps() -> None:
    assert list(Settings.model_fields) != []
    assert set(Settings.model_fields) == set(SETTINGS)
    codes = {item.setter.code for setting in SETTINGS.values() for item in setting.items.values()}
    assert codes == set(CHAPTER_18.split())
    questions = [item.question for setting in SETTINGS.values() for item in setting.items.values()]
    assert all(it.code[:2] in {code[:2] for code in codes} for it in questions)


@on_stand()
async def test_what_the_controller_refuses_to_tell_is_named_and_can_be_set(stand: Stand) -> None:
    await stand.send("01", "set-position-index", position=2047)
    await stand.send("01", "get-position-entry", entry={"position": "next"})
    told = await stand.get("/bodies/01/settings")
    assert told.status_code == 200, told.text
    document = told.json()
    assert document["settings"]["position_index"] is None
    assert "arm.01 refused 3ID: A command parameter is out of" in document["unavailable"]["position_index"]
    assert document["settings"]["homing_retries"] == 0
    match = {"If-Match": told.headers["etag"]}
    wanted = {"position_index": 7, "homing_retries": 1}
    changed = await stand.client.patch("/bodies/01/settings", json=wanted, headers=match)
    assert changed.status_code == 200, changed.text
    assert changed.json()["steps"][1] == {
        "name": "position_index",
        "command": "3IS7",
        "outcome": "changed",
        "before": None,
    }
    assert (await stand.get("/bodies/01/settings")).json()["settings"]["position_index"] == 7


@on_stand()
async def test_a_new_body_has_the_values_of_the_factory(stand: Stand) -> None:
    told = (await stand.get(PATH)).json()
    assert (told["body_id"], told["flash"]) == ("arm.01", None)
    assert told["version"].startswith("RC-420")
    for name, setting in SETTINGS.items():
        found = told["settings"][name]
        if name in told["unavailable"]:
            assert found is None
        elif None in setting.items:
            assert found == setting.default == told["about"][name]["default"], name
        else:
            members = found.values()
            if name == "interrupt_records":
                members = [it for port in members for it in port.values()]
            assert set(members) == {setting.default}, name
    assert set(told["unavailable"]) == {
        "adjustment",
        "adjustment_limit",
        "adjustment_speed_pps",
        "adjustment_delay_ms",
        "clear_pulse_ms",
    }
    assert told["unavailable"]["adjustment"] == "Only in the operating mode encoder."


@on_stand()
async def test_units_and_ranges_stand_beside(stand: Stand) -> None:
    told = (await stand.get(PATH)).json()
    assert told["in_unit"]["origin_offset"] == {"value": 0.01, "unit": "mm"}
    assert told["in_unit"]["maximum_speed_pps"] == {"value": 50.0, "unit": "mm/s"}
    about = told["about"]["origin_offset"]
    assert about == {"command": "0SS", "unit": "pulse", "minimum": 1, "maximum": 65_535, "default": 10}
    assert told["about"]["noise_filters"]["maximum"] == 99
    assert told["about"]["autostart"] == {
        "command": "UAS",
        "unit": None,
        "minimum": None,
        "maximum": None,
        "default": False,
    }
    limited = await patch(stand, {"soft_limits": {"lower": -500, "upper": 2000.0}})
    assert limited["settings"]["soft_limits"] == {"lower": -500, "upper": 2_000}
    told = (await stand.get(PATH)).json()
    assert told["in_unit"]["soft_limits.lower"] == {"value": -0.5, "unit": "mm"}


@on_stand()
async def test_all_is_read_in_few_frames(stand: Stand) -> None:
    before = len(stand.frames())
    await stand.get(PATH)
    assert len(stand.frames()) - before <= 90


SINGLE: list[tuple[dict[str, Any], list[str]]] = [
    ({"pulse_format": "pulse_direction"}, ["EDS0"]),
    ({"origin_offset": 20, "overrun_factor": 3, "homing_retries": 1}, ["0SS20", "0BS3", "0RS1"]),
    ({"encoder_multiplier": "double", "encoder_ratio": 2.5}, ["PAS2", "PBS2.50"]),
    ({"stall_sensor_interval": 100, "stall_sensor_detection": True}, ["QIS100", "QSS1"]),
    ({"input_logic": {"d9": "normally_closed", "d0": "normally_open"}}, ["DIS9,1"]),
    ({"sensor_logic": {"clear_output": "normally_closed"}}, ["DLS6,1"]),
    ({"noise_filters": {"d0": 2, "stall": 3, "ems": 5}}, ["DCS0,2", "DCS9,3", "DCS14,5"]),
    ({"outputs": {"d3": True}}, ["COS3,1"]),
    ({"error_outputs": {"ems": {"output": 2, "on": True}}}, ["CESE,2,1"]),
    (
        {
            "interrupt_edges": {"8": "rising"},
            "interrupt_ranges": {"8": {"lower": -50, "upper": 50}},
            "interrupt_records": {"8": {"position": 25}},
            "interrupt_pulses": {"9": {"output": 5, "on": True, "duration_ms": 10}},
        },
        ["CPS8,2", "CSS8,-50,50", "CFS8,P:25", "CFS9,O:5,1,10"],
    ),
    ({"arm_length_um": 156_000, "pulses_per_turn": {"1": 5000.5}}, ["HAS156000", "HZS1,5000.50"]),
    ({"comments": {"2": "Serial No.152"}, "autostart": True}, ["UAS1"]),
    (
        {"operating_mode": "encoder", "adjustment": True, "adjustment_delay_ms": 50, "adjustment_limit": 700},
        ["EAS1", "PKS700", "PTS5", "PJS1"],
    ),
    ({"operating_mode": "servo", "clear_pulse_ms": 50}, ["EAS2", "CCS50"]),
    ({"start_speed_pps": 100, "falling_percent": 20}, ["OLS100", "OBS20"]),
]


@pytest.mark.parametrize(("change", "frames"), SINGLE)
def test_what_is_named_is_set_and_read_back_and_set_again_sends_nothing(
    change: dict[str, Any], frames: list[str]
) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        told = await patch(stand, change)
        assert told["settings"].keys() == change.keys()
        for name, value in change.items():
            found = told["settings"][name]
            if isinstance(value, dict):
                assert {key: found[key] for key in value if not isinstance(value[key], dict)} == {
                    key: it for key, it in value.items() if not isinstance(it, dict)
                }
            else:
                assert found == value
        assert set_by(stand.frames()) == frames
        again = await patch(stand, change)
        assert {step["outcome"] for step in again["steps"]} == {"unchanged"}
        assert set_by(stand.frames()) == frames
        assert again["settings"] == told["settings"]

    story()


@on_stand()
async def test_null_ends_what_can_be_ended(stand: Stand) -> None:
    await patch(
        stand,
        {"soft_limits": {"lower": -5, "upper": 5}, "error_outputs": {"any": {"output": 1, "on": False}}},
    )
    ended = await patch(stand, {"soft_limits": None, "error_outputs": None})
    assert ended["settings"].keys() == {"soft_limits", "error_outputs"}
    assert ended["settings"]["soft_limits"] is None
    assert set(ended["settings"]["error_outputs"].values()) == {None}
    assert set_by(stand.frames())[-2:] == ["EPS", "CESA"]


@pytest.mark.parametrize(
    "wrong",
    [
        {},
        {"origin_offset": 0},
        {"origin_offset": None},
        {"noise_filters": None},
        {"autostart": 1},
        {"soft_limits": {"lower": 5, "upper": 5}},
        {"adjustment": True},
        {"operating_mode": "encoder", "clear_pulse_ms": 5},
        {"comments": {"8": "x"}},
        {"comments": {"1": "a&b"}},
        {"adjustment_delay_ms": 5},
        {"start_speed_pps": 100, "maximum_speed_pps": 50},
        {"speed": 1},
    ],
)
def test_what_cannot_be_set_is_refused_before_anything_is_sent(wrong: dict[str, Any]) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        answer = await stand.client.patch(PATH, json={"homing_retries": 1, **wrong} if wrong else {})
        assert (answer.status_code, answer.json()["moved"]) == (422, "no"), answer.text
        assert set_by(stand.frames()) == []

    story()


@pytest.mark.parametrize("name", SETTINGS)
def test_null_is_refused_where_a_setting_has_always_a_value(name: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        mode = {"1": "encoder", "2": "servo"}.get(SETTINGS[name].modes, "stepping")
        if name != "operating_mode":
            await patch(stand, {"operating_mode": mode})
        before = set_by(stand.frames())
        answer = await stand.client.patch(PATH, json={name: None})
        nullable = SETTINGS[name].default is None
        assert (answer.status_code, answer.json().get("moved", "no")) == (200 if nullable else 422, "no")
        assert set_by(stand.frames()) == before

    story()


@on_stand()
async def test_a_stale_etag_sets_nothing(stand: Stand) -> None:
    seen = (await stand.get(PATH)).headers["etag"]
    assert seen == (await stand.get(PATH)).headers["etag"]
    await patch(stand, {"origin_offset": 20}, **{"If-Match": seen})
    answer = await stand.client.patch(PATH, json={"homing_retries": 1}, headers={"If-Match": seen})
    assert (answer.status_code, answer.json()["moved"]) == (412, "no")
    assert set_by(stand.frames()) == ["0SS20"]


@on_stand()
async def test_while_the_motor_moves_it_is_read_as_far_as_it_tells_and_nothing_is_set(stand: Stand) -> None:
    await stand.post("/bodies/01/moves", RELATIVE)
    told = (await stand.get(PATH)).json()
    assert told["settings"]["origin_offset"] == 10
    assert told["unavailable"]["arm_length_um"] == "Not while the motor moves."
    answer = await stand.client.patch(PATH, json={"input_logic": {"d0": "normally_closed"}})
    assert (answer.status_code, answer.json()["type"].rpartition(":")[2]) == (409, "body-busy")
    assert set_by(stand.frames()) == []


@on_stand()
async def test_the_mark_of_the_gateway_is_no_comment_of_the_plant(stand: Stand) -> None:
    await asyncio.sleep(40)
    assert any("9VS7,GW-" in frame for frame in stand.frames())
    assert (await stand.get(PATH)).json()["settings"]["comments"] == dict.fromkeys("1234567", "")


@on_stand()
async def test_flash_memory_is_told_beside_ram_from_fis_on(stand: Stand) -> None:
    await patch(stand, {"origin_offset": 20, "input_logic": {"d1": "normally_closed"}}, PATH + "?flash=true")
    await stand.get(PATH)
    await patch(stand, {"origin_offset": 30, "input_logic": {"d1": "normally_open"}})
    told = (await stand.get(PATH)).json()
    assert (told["settings"]["origin_offset"], told["flash"]["origin_offset"]) == (30, 20)
    assert told["settings"]["input_logic"]["d1"] == "normally_open"
    assert told["flash"]["input_logic"]["d1"] == "normally_closed"
    assert told["flash"]["homing_retries"] == 0
    assert told["flash"]["outputs"] is told["flash"]["position_index"] is None
