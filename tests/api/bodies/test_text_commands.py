"""Plain text commands: off unless configured, and then by the same rules as all others."""

import pytest

from tests.api.stand import Stand, on_stand


@on_stand()
async def test_text_is_403_unless_configured(stand: Stand) -> None:
    answer = await stand.post("/bodies/3F/raw", {"text": "0PD"})
    assert answer.status_code == 403
    assert "raw_commands" in answer.json()["remedy"]
    assert "&3F0PD" not in stand.frames()


@on_stand(raw_commands=True)
async def test_a_command_is_sent_as_text_and_answered_as_text(stand: Stand) -> None:
    answer = (await stand.post("/bodies/3F/raw", {"text": "6PD"})).json()
    assert (answer["sent"], answer["reply"]) == ("&3F6PD\\r", "+000000000")


@on_stand(raw_commands=True)
async def test_what_is_answered_is_told_as_it_came(stand: Stand) -> None:
    deliver = stand.port._deliver
    stand.port._deliver = lambda data: deliver(data.replace(b"+000000000", b"-000000000"))  # type: ignore[method-assign]
    assert (await stand.post("/bodies/3F/raw", {"text": "6PD"})).json()["reply"] == "-000000000"


@on_stand(raw_commands=True)
async def test_a_motion_as_text_is_a_move(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    answer = await stand.post("/bodies/3F/raw?wait=30", {"text": "1+M500"})
    assert (answer.status_code, answer.json()["status"]) == (200, "succeeded")
    assert (await stand.get(answer.headers["location"])).json()["frame"] == "&3F1+M500\\r"


@on_stand(raw_commands=True)
async def test_a_stop_as_text_is_a_stop(stand: Stand) -> None:
    assert (await stand.post("/bodies/3F/raw", {"text": "5IS"})).json()["confirmed"] is True


@on_stand(raw_commands=True)
async def test_a_command_nobody_knows_is_left_to_the_controller(stand: Stand) -> None:
    answer = await stand.post("/bodies/3F/raw", {"text": "9XX1,2"})
    assert "&3F9XX1,2" in stand.frames()
    assert answer.json()["type"].endswith(":controller-refused")


@pytest.mark.parametrize(
    "text", ["", "6P", "6pd", "6PD\r", "6PD\r&3F1+M500", "1 +MZ", "6PD&", "6PD" + "1" * 60]
)
def test_text_that_is_no_single_command_is_422_and_not_sent(text: str) -> None:
    @on_stand(raw_commands=True)
    async def story(stand: Stand) -> None:
        before = stand.frames()
        answer = await stand.post("/bodies/3F/raw", {"text": text})
        assert answer.status_code == 422
        assert stand.frames() == before

    story()


@pytest.mark.parametrize("text", ["1+MZ", "1+M Z", "1+M5.0", "6PS", "1+M0"])
def test_a_known_command_keeps_its_rules(text: str) -> None:
    @on_stand(raw_commands=True)
    async def story(stand: Stand) -> None:
        answer = await stand.post("/bodies/3F/raw", {"text": text})
        assert answer.status_code in (403, 422)
        assert stand.moved() == []

    story()
