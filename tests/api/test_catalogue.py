"""The command table as data."""

from protocols.fics.commands import ROWS
from protocols.rorze.commands import COMMANDS
from tests.api.stand import Stand, on_stand


@on_stand()
async def test_the_table_holds_every_row(stand: Stand) -> None:
    commands = (await stand.get("/commands")).json()["commands"]
    rorze = [command["code"] for command in commands if command["family"] == "rorze"]
    fics = [command["name"] for command in commands if command["family"] == "fics"]
    assert rorze == list(COMMANDS)
    assert fics == [row.name() for row in ROWS]
    assert len(rorze) + len(fics) == len(commands)
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


@on_stand()
async def test_a_robots_row_says_when_it_is_answered_and_what_blocks_it(stand: Stand) -> None:
    commands = (await stand.get("/commands")).json()["commands"]
    unit = next(command for command in commands if command["name"] == "select-unit")
    assert (unit["code"], unit["family"], unit["addressed_to"]) == ("UNT", "fics", "robot")
    assert (unit["answered"], unit["blocked_by"]) == ("on_completion", ["a", "b", "d"])
    position = next(command for command in commands if command["name"] == "upload-position")
    assert (position["addressed_to"], position["during_upload"]) == ("unit", True)


@on_stand()
async def test_one_family_can_be_asked_for(stand: Stand) -> None:
    for family, count in (("fics", len(ROWS)), ("rorze", len(COMMANDS))):
        commands = (await stand.get(f"/commands?family={family}")).json()["commands"]
        assert {command["family"] for command in commands} == {family}
        assert len(commands) == count
    assert (await stand.get("/commands?family=other")).status_code == 422
