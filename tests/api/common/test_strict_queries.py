"""Queries: what a route knows, and what it says to the rest; each refuses that (`test_wrong_requests`)."""

import pytest

from api.streams import CLOSE_INVALID
from tests.api.stand import RELATIVE, Stand, on_stand, socket


@on_stand()
async def test_a_misspelt_wait_moves_nothing_and_says_how_it_is_spelt(stand: Stand) -> None:
    before = stand.frames()
    answer = await stand.post("/bodies/3F/moves?wiat=10", RELATIVE)
    assert (answer.status_code, answer.json()["moved"]) == (422, "no")
    assert answer.json()["type"].endswith(":invalid-request")
    assert answer.json()["detail"] == (
        "There is no query parameter 'wiat' here (did you mean wait?); nothing was sent."
    )
    assert stand.frames() == before


@on_stand()
async def test_a_stop_goes_out_whatever_stands_in_its_query(stand: Stand) -> None:
    for path in ("/stop", "/bodies/3F/stop"):
        before = stand.frames()
        assert (await stand.post(f"{path}?mode=immediate", {})).status_code == 200
        assert "&3F5SS" in stand.frames()[len(before) :]


@pytest.mark.parametrize(
    "path",
    [
        "/bodies/3F/moves?limit=5",
        "/events?limit=5.0",
        "/bodies/3F/speed-sets/12.0",
        "/commands?family=rorze",
        "/bodies/3F/position?",
        "/events?limit=1",
    ],
)
def test_what_a_route_knows_may_be_asked(path: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        assert (await stand.get(path)).status_code == 200

    story()


@on_stand()
async def test_a_websocket_knows_its_parameters_too(stand: Stand) -> None:
    async with socket(stand, "/events?typs=line.down") as client:
        assert (await client.message())["type"] == "websocket.accept"
        closed = await client.message()
    assert closed["code"] == CLOSE_INVALID
    assert "did you mean types?" in closed["reason"]
