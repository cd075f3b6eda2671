"""Idempotency-Key: what has an effect is refused with it, a stop goes out, and reads do not care."""

import pytest

from tests.api.stand import RELATIVE, Stand, on_stand

KEY = {"idempotency-key": "4711"}


@on_stand()
async def test_the_sentence_says_what_to_do(stand: Stand) -> None:
    answer = await stand.post("/bodies/3F/moves", RELATIVE, **KEY)
    told = answer.json()
    assert (told["moved"], told["retryable"]) == ("no", False)
    assert "nothing was sent" in told["detail"]
    assert told["remedy"]
    assert stand.moved() == []


@pytest.mark.parametrize(
    "path",
    [
        "/stop",
        "/bodies/3F/stop",
        "/bodies/3F/commands/stop-immediately",
        "/bodies/3F/commands/stop-decelerating",
    ],
)
def test_a_stop_goes_out_whatever_its_headers_say(path: str) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        before = stand.frames()
        form = {"content-type": "application/x-www-form-urlencoded"}
        answer = await stand.client.post(path, content=b"{}", headers=KEY | form)
        assert answer.status_code == 200, answer.text
        assert {"&3F5SS", "&3F5IS"} & set(stand.frames()[len(before) :])

    story()


@on_stand(raw_commands=True)
async def test_a_command_as_text_is_refused_unless_it_stops(stand: Stand) -> None:
    assert (await stand.post("/bodies/3F/raw", {"text": "1+M500"}, **KEY)).status_code == 422
    assert stand.moved() == []
    assert (await stand.post("/bodies/3F/raw", {"text": "5IS"}, **KEY)).status_code == 200


@on_stand()
async def test_reads_pass_over_a_key(stand: Stand) -> None:
    for path in ("/bodies/3F/position", "/bodies", "/events"):
        assert (await stand.get(path, **KEY)).status_code == 200
    answer = await stand.post("/bodies/3F/commands/get-position", {}, **KEY)
    assert answer.status_code == 200, answer.text
