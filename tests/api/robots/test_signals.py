"""Inputs, outputs and variables of a robot over HTTP."""

import asyncio

import pytest

from tests.api.bodies.test_moves import refused
from tests.api.robots.cell import Cell, in_cell


@in_cell()
async def test_inputs_are_told_bit_by_bit(cell: Cell) -> None:
    cell.rig.fics.inputs[1] = 0b1000_0001
    channels = (await cell.get("/robots/r1/inputs?first=2&count=2")).json()["channels"]
    assert channels == [
        {"channel": 2, "bits": [True, *[False] * 6, True]},
        {"channel": 3, "bits": [False] * 8},
    ]


@in_cell()
async def test_an_output_is_switched_and_read_back(cell: Cell) -> None:
    on = await cell.put("/robots/r1/outputs/1/7", {"on": True})
    assert on.json() == {"robot_id": "r1", "channels": [{"channel": 1, "bits": [*[False] * 7, True]}]}
    assert (await cell.get("/robots/r1/outputs")).json() == on.json()
    off = await cell.put("/robots/r1/outputs/1/7", {"on": False})
    assert off.json()["channels"][0]["bits"] == [False] * 8
    assert [text for text in cell.commands() if text.startswith("IOT")] == ["IOT 1-7:+", "IOT 1-7:-"]


@in_cell()
async def test_a_variable_is_set_and_read_back(cell: Cell) -> None:
    assert (await cell.put("/robots/r1/variables/99", {"value": -12.5})).json() == {
        "number": 99,
        "value": -12.5,
    }
    variables = (await cell.get("/robots/r1/variables?first=98&count=2")).json()["variables"]
    assert variables == [{"number": 98, "value": 0.0}, {"number": 99, "value": -12.5}]


@in_cell()
async def test_numbers_and_values_outside_their_ranges_are_not_sent(cell: Cell) -> None:
    before = cell.commands()
    refused(await cell.get("/robots/r1/inputs?first=0"), 422, "first")
    refused(await cell.get("/robots/r1/outputs?first=99&count=2"), 422)
    refused(await cell.get("/robots/r1/variables?first=99&count=2"), 422)
    refused(await cell.put("/robots/r1/outputs/1/8", {"on": True}), 422, "bit")
    refused(await cell.put("/robots/r1/outputs/1/1", {"on": 1}), 422, "on")
    refused(await cell.put("/robots/r1/variables/100", {"value": 1}), 422, "number")
    refused(await cell.put("/robots/r1/variables/1", {"value": 1e9}), 422, "value")
    assert cell.commands() == before


@in_cell()
async def test_a_channel_the_robot_does_not_have_is_its_refusal(cell: Cell) -> None:
    answer = await cell.get("/robots/r1/inputs?first=40")
    refused(answer, 422)
    assert answer.json()["code"] == "E05"


@pytest.mark.parametrize(
    ("path", "content", "lost", "says"),
    [
        ("outputs/1/0", {"on": True}, "IDO", "IOT 1-0:+ was sent to r1, but could not be read back"),
        ("variables/5", {"value": 2}, "VAR V05=", "VAR V05=2 was sent to r1, but could not be read back"),
    ],
)
def test_what_was_done_and_not_read_back_is_not_said_to_be_unsent(
    path: str, content: dict[str, object], lost: str, says: str
) -> None:
    @in_cell(units=1)
    async def story(cell: Cell) -> None:
        cell.rig.cable.lost_answer = lost
        answer = await cell.put(f"/robots/r1/{path}", content)
        refused(answer, 409)
        problem = answer.json()
        assert problem["type"].endswith(":not-read-back")
        assert problem["detail"].startswith(says)
        assert (problem["moved"], problem["retryable"]) == ("no", False)

    story()


@in_cell(units=1)
async def test_an_output_whose_line_drops_before_it_is_read_back_was_switched_all_the_same(
    cell: Cell,
) -> None:
    switching = asyncio.create_task(cell.put("/robots/r1/outputs/1/0", {"on": True}))
    await cell.rig.cable.written_from("IDO")
    cell.rig.cable.unplug()
    answer = await switching
    refused(answer, 409)
    assert answer.json()["type"].endswith(":not-read-back")
    assert "could not be read back: Line cell was lost" in answer.json()["detail"]
    assert cell.rig.fics.outputs[0] & 1


@in_cell()
async def test_a_stale_etag_sets_no_variable(cell: Cell) -> None:
    path = "/robots/r1/variables"
    seen = {"If-Match": (await cell.get(f"{path}?first=5")).headers["etag"]}
    assert (await cell.client.put(f"{path}/5", json={"value": 1.5}, headers=seen)).json()["value"] == 1.5
    stale = await cell.client.put(f"{path}/5", json={"value": 2.5}, headers=seen)
    assert (stale.status_code, stale.json()["moved"]) == (412, "no")
    assert [text for text in cell.commands() if text.startswith("VAR V05=")] == ["VAR V05=1.5"]
