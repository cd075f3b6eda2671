"""Stops over HTTP: with the least that a request can hold, and told as far as they are proved."""

from tests.api.stand import RELATIVE, Stand, on_stand


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


@on_stand()
async def test_a_stop_that_cannot_be_sent_is_never_called_confirmed(stand: Stand) -> None:
    stand.port.unplug()
    answer = (await stand.post("/stop")).json()
    assert answer["confirmed"] is False
    assert {report["state"] for report in answer["bodies"]} == {"not_sent"}


@on_stand()
async def test_a_group_is_stopped_by_one_frame_and_then_one_for_each(stand: Stand) -> None:
    await stand.client.put("/groups/80", json={"members": ["00", "3F"]})
    answer = await stand.post("/groups/80/stop", {"mode": "immediate"})
    stops = [frame for frame in stand.frames() if frame.endswith("5IS")]
    assert answer.json()["confirmed"] is True
    assert stops[:3] == ["&805IS", "&005IS", "&3F5IS"]
