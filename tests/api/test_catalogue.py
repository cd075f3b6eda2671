"""The command table as data."""

from protocols.rorze.commands import COMMANDS
from tests.api.stand import Stand, on_stand


@on_stand()
async def test_the_table_holds_every_row(stand: Stand) -> None:
    commands = (await stand.get("/commands")).json()["commands"]
    assert [command["code"] for command in commands] == list(COMMANDS)
    assert {command["family"] for command in commands} == {"rorze"}
    assert all(command["title_ja"] and command["title_en"] for command in commands)


@on_stand()
async def test_a_row_says_all_that_a_client_needs(stand: Stand) -> None:
    commands = (await stand.get("/commands")).json()["commands"]
    move = next(command for command in commands if command["name"] == "move-clockwise")
    assert (move["code"], move["retry"]) == ("1+M", "never")
    assert (move["starts_motion"], move["while_moving"]) == (True, False)
    assert move["parameters"]["required"] == ["distance"]
    assert move["modes"] == ["stepping", "encoder", "servo"]
    assert {"0x50", "0x51"} <= {error["code"] for error in move["errors"]}
    read = next(command for command in commands if command["name"] == "get-position")
    assert list(read["reply"]["properties"]) == ["pulses"]
    assert read["example"] == ["&3F6PD", ">&3F6PD+000050000"]
    assert [it["code"] for it in commands if it["addressed_to"] == "line"] == ["XID", "XRS", "XVS"]
