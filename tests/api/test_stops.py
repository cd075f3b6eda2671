"""Stops over HTTP: with the least that a request can hold, and told as far as they are proved."""

import pytest

from gateway.core.errors import Ambiguous, GatewayError, InvalidRequest, NotFound
from gateway.plant import Plant
from tests.api.stand import RELATIVE, Stand, on_stand

JSON = {"Content-Type": "application/json"}
JAPANESE = {"Accept-Language": "ja"}


@on_stand()
async def test_a_stop_needs_no_body_and_decelerates(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    move = await stand.post("/bodies/3F/moves", RELATIVE)

    answer = await stand.post("/bodies/3F/stop")

    assert answer.status_code == 200
    assert answer.json()["confirmed"] is True
    assert answer.json()["bodies"][0]["state"] == "confirmed"
    assert "&3F5SS" in stand.frames()
    over = (await stand.get(move.headers["location"] + "?wait=10")).json()
    assert (over["status"], over["position"] < 50_000) == ("stopped", True)


@on_stand()
async def test_an_immediate_stop_is_another_command(stand: Stand) -> None:
    await stand.post("/bodies/3F/stop", {"mode": "immediate"})
    assert "&3F5IS" in stand.frames()
    assert "&3F5SS" not in stand.frames()


@on_stand({"arm": [{"id": "00"}, {"id": "3F"}], "rail": [{"id": "10"}]})
async def test_stopping_all_stops_every_body_of_every_line(stand: Stand) -> None:
    answer = await stand.post("/stop", {"mode": "immediate"})
    assert [report["body_id"] for report in answer.json()["bodies"]] == ["arm.00", "arm.3F", "rail.10"]
    assert {"&005IS", "&3F5IS"} <= set(stand.frames())
    assert b"&105IS\r" in stand.ports["rail"].written


@on_stand()
async def test_an_unknown_mode_is_refused(stand: Stand) -> None:
    answer = await stand.post("/bodies/3F/stop", {"mode": "gently"})
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["field"] == "mode"


@pytest.mark.parametrize(
    ("method", "path", "content", "status", "stops"),
    [
        ("POST", "/bodies/3F/stop", "{", 400, "/bodies/3F/stop"),
        ("POST", "/bodies/3F/stop", '{"mode":"gently"}', 422, "/bodies/3F/stop"),
        ("POST", "/bodies/3F/stop", '{"mod":"immediate"}', 422, "/bodies/3F/stop"),
        ("POST", "/bodies/3F/stop", '{"mode":"immediate","mode":"decelerate"}', 422, "/bodies/3F/stop"),
        ("POST", "/bodies/3F/stop", f'{{"mode":"{70_000 * "x"}"}}', 413, "/bodies/3F/stop"),
        ("GET", "/bodies/3F/stop", "", 405, "/bodies/3F/stop"),
        ("POST", "/bodies/3F/commands/stop-immediately", '{"mode":1}', 422, "/bodies/3F/stop"),
        ("POST", "/bodies/77/stop", "", 404, "/stop"),
        ("POST", "/stop", "[]", 422, "/stop"),
        ("POST", "/lines/line1/stop", "", 404, "/stop"),
    ],
)
def test_a_refused_stop_says_that_nothing_was_stopped_and_what_stops(
    method: str, path: str, content: str, status: int, stops: str
) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        sent = len(stand.frames())
        answer = await stand.client.request(method, path, content=content, headers=JSON)
        assert (answer.status_code, len(stand.frames())) == (status, sent)
        problem = answer.json()
        assert f" Nothing was stopped: send POST {stops} without a body to stop" in problem["detail"]
        assert problem["remedy"] == f"POST {stops} at once; in danger use the hardware stop."

        answer = await stand.client.request(method, path, content=content, headers=JSON | JAPANESE)
        problem = answer.json()
        assert "何も停止していません。" in problem["detail"]
        assert problem["detail"].endswith("送信してください。")
        assert f"本文なしで POST {stops} を送信してください。" in problem["detail"]
        assert f"すぐに POST {stops} を送信してください。" in problem["remedy"]

        assert (await stand.client.post(stops)).json()["confirmed"] is True

    story()


@on_stand()
async def test_the_stop_of_an_address_that_cannot_be_or_a_jog_that_is_not_says_how_to_stop(
    stand: Stand,
) -> None:
    for path in ("/robots/r1/units/zz/stop", "/bodies/3F/jogs/gone/stop"):
        answer = await stand.post(path)
        assert " Nothing was stopped: send POST /stop without a body" in answer.json()["detail"]


@on_stand({"arm": [{"id": "3F"}], "rail": [{"id": "3F"}]})
async def test_a_stop_of_an_address_that_two_lines_have_says_how_to_stop_both(stand: Stand) -> None:
    answer = await stand.post("/bodies/3F/stop")
    assert answer.status_code == 409
    assert " Nothing was stopped: send POST /stop without a body" in answer.json()["detail"]


@on_stand()
async def test_a_stop_that_cannot_be_sent_is_never_called_confirmed(stand: Stand) -> None:
    stand.port.unplug()
    answer = (await stand.post("/stop")).json()
    assert answer["confirmed"] is False
    assert {report["state"] for report in answer["bodies"]} == {"not_sent"}


@on_stand()
async def test_why_a_stop_is_not_confirmed_is_told_in_the_language_of_who_asks(stand: Stand) -> None:
    stand.port.unplug()
    english = await stand.post("/stop")
    japanese = await stand.client.post("/stop", headers=JAPANESE)
    assert "Content-Language" not in english.headers
    assert japanese.headers["Content-Language"] == "ja"
    assert english.json()["bodies"][0]["detail"].endswith("use the hardware stop.")
    told = japanese.json()["bodies"][0]["detail"]
    assert told.startswith("停止を送信できませんでした。（")
    assert told.endswith("静止を確認できていません。ハードウェアの停止を使ってください。")


@on_stand()
async def test_a_group_is_stopped_by_one_frame_and_then_one_for_each(stand: Stand) -> None:
    await stand.client.put("/groups/80", json={"members": ["00", "3F"]})
    answer = await stand.post("/groups/80/stop", {"mode": "immediate"})
    stops = [frame for frame in stand.frames() if frame.endswith("5IS")]
    assert answer.json()["confirmed"] is True
    assert stops[:3] == ["&805IS", "&005IS", "&3F5IS"]


@pytest.mark.parametrize("kind", [NotFound, Ambiguous, InvalidRequest])
def test_whatever_the_words_of_a_refusal_it_says_that_nothing_was_stopped(
    kind: type[GatewayError], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object) -> None:
        raise kind("That is not possible here. Nothing was sent.")

    @on_stand()
    async def story(stand: Stand) -> None:
        monkeypatch.setattr(Plant, "target", refuse)
        answer = await stand.post("/bodies/3F/stop")
        assert answer.json()["detail"].startswith(
            "That is not possible here. Nothing was sent. Nothing was stopped: send POST "
        )
        answer = await stand.client.post("/bodies/3F/stop", headers=JAPANESE)
        assert "何も停止していません。" in answer.json()["detail"]

    story()
