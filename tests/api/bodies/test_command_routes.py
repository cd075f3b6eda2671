"""One route for each row: its own parameters in, its own reply out, and the rules of the row kept."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.door import commands
from gateway.rorze.family import Rorze
from protocols.rorze.commands import COMMANDS, Row
from protocols.rorze.row import LinkMasterCommand
from protocols.table import Reply, Retry
from tests.api.stand import Stand, on_stand

READS = [row for row in COMMANDS.values() if row.retry is Retry.READ and not row.model_fields]


def test_every_row_has_its_routes() -> None:
    paths = {row.path for row in commands.rows_of(Rorze)}
    for row in COMMANDS.values():
        to_line = issubclass(row, LinkMasterCommand)
        places = ["lines/{line_id}"] if to_line else ["bodies/{body_id}", "groups/{group_id}"]
        assert {f"/{place}/commands/{row.name()}" for place in places} <= paths


@given(st.sampled_from(list(COMMANDS.values())))
def test_every_row_is_described_with_its_code_title_and_errors(row: Row) -> None:
    text = commands.describe(Rorze, row)
    assert f"`{row.code}`" in text
    assert row.titles()[0] in text
    assert all(f"0x{code:02X}" in text for code in row.errors)


@on_stand()
async def test_reads_without_parameters_need_no_body_and_answer_in_their_type(stand: Stand) -> None:
    for row in READS:
        answer = await stand.post(f"/bodies/3F/commands/{row.name()}")
        if answer.status_code == 200:
            reply: Reply = row.reply_type().model_validate_json(answer.content)
            assert stand.frames()[-1] == f"&3F{row.code}"
            assert reply.model_dump(mode="json") == answer.json()
            assert float(answer.headers["age-ms"]) >= 0
        else:
            assert answer.json()["code"] is not None, answer.text


@on_stand()
async def test_an_empty_object_is_as_good_as_no_body(stand: Stand) -> None:
    assert (await stand.post("/bodies/3F/commands/get-position", {})).json() == {"pulses": 0}
    assert (await stand.post("/bodies/3F/commands/get-position", {"x": 1})).status_code == 422


@on_stand()
async def test_a_required_parameter_is_required(stand: Stand) -> None:
    answer = await stand.post("/bodies/3F/commands/set-origin-offset")
    assert answer.status_code == 422
    assert (await stand.post("/bodies/3F/commands/set-origin-offset", {})).json()["errors"] == [
        {"field": "offset", "message": "is required"}
    ]


@on_stand()
async def test_no_row_is_brought_down_by_a_request_without_parameters(stand: Stand) -> None:
    """A command that can be written without parameters is sent, every other one is 422."""
    for row in COMMANDS.values():
        if row.retry is Retry.SETTING and not issubclass(row, LinkMasterCommand):
            answer = await stand.post(f"/bodies/3F/commands/{row.name()}")
            refused_here = answer.status_code == 422 and "code" not in answer.json()
            assert refused_here is not row.may_be_empty(), (row.code, answer.text)


@on_stand()
async def test_a_setting_is_written_and_read_back(stand: Stand) -> None:
    await stand.send("3F", "set-origin-offset", offset=20)
    assert await stand.send("3F", "get-origin-offset") == {"offset": 20}
    assert "&3F0SS20" in stand.frames()


@on_stand()
async def test_a_motion_row_makes_the_same_move_as_moves_do(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    answer = await stand.post("/bodies/3F/commands/move-clockwise?wait=30", {"distance": 500})
    move = answer.json()
    assert (answer.status_code, move["status"], move["kind"]) == (200, "succeeded", "relative")
    assert (await stand.get(answer.headers["location"])).json() == move
    assert [it["id"] for it in (await stand.get("/bodies/3F/moves")).json()["moves"]] == [move["id"]]


@on_stand()
async def test_a_stop_row_makes_the_same_stop_as_stop_does(stand: Stand) -> None:
    answer = await stand.post("/bodies/3F/commands/stop-immediately")
    assert answer.json()["confirmed"] is True
    assert "&3F5IS" in stand.frames()


@on_stand()
async def test_a_move_from_the_position_table_is_possible(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    await stand.send("3F", "set-position-entry", entry={"position": 25}, pulses=321)
    move = await stand.send("3F", "move-to", position={"position": 25})
    over = (await stand.get(f"/bodies/3F/moves/{move['id']}?wait=30")).json()
    assert (over["frame"], over["position"]) == ("&3F1AMP[25]\\r", 321)


@pytest.mark.parametrize("text", ["a\rb", "a\nb", "a&b", "a>b", "a\x00b", "é", "\t"])
def test_text_that_could_become_a_frame_is_422_and_not_sent(text: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        parameters = {"comment_number": 2, "text": text}
        answer = await stand.post("/bodies/3F/commands/set-user-comment", parameters)
        assert answer.status_code == 422
        assert not any("9VS2" in frame for frame in stand.frames())

    story()


@on_stand()
async def test_the_link_masters_own_commands_belong_to_the_line(stand: Stand) -> None:
    answer = await stand.post("/lines/arm/commands/identify-controllers")
    assert answer.json() == {"text": "00,01,3F"}
    assert (await stand.post("/bodies/3F/commands/identify-controllers")).status_code == 404


@on_stand()
async def test_a_group_set_at_the_link_master_is_known_to_the_gateway(stand: Stand) -> None:
    parameters = {"group": "81", "members": ["01", "3F"]}
    assert (await stand.post("/lines/arm/commands/set-group", parameters)).status_code == 200
    assert (await stand.get("/groups/81")).json()["members"] == ["arm.01", "arm.3F"]


@on_stand()
async def test_an_unknown_command_is_404(stand: Stand) -> None:
    assert (await stand.post("/bodies/3F/commands/fly")).status_code == 404
