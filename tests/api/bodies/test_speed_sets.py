"""Speed parameter sets over HTTP: read, changed where they differ, never over another client's change."""

from tests.api.stand import Stand, on_stand

SET_12 = "/bodies/01/speed-sets/12"
QUICK = {
    "start_speed_pps": 5_000,
    "maximum_speed_pps": 50_000,
    "acceleration_pps_s": 70_000,
    "rising_percent": 30,
    "falling_percent": 30,
}


def set_by(frames: list[str]) -> list[str]:
    """The settings among frames."""
    return [frame[3:] for frame in frames if frame[5:6] == "S" and frame[3:6] not in ("9VS", "XRS")]


@on_stand()
async def test_a_set_stands_in_pulses_and_in_the_unit_of_the_body(stand: Stand) -> None:
    standard = (await stand.get("/bodies/01/speed-sets/30")).json()
    assert (standard["body_id"], standard["number"], standard["flash"]) == ("arm.01", 30, None)
    assert standard["maximum_speed_pps"] == 50_000
    assert standard["maximum_speed"] == {"value": 50.0, "unit": "mm/s"}
    assert standard["acceleration"] == {"value": 100.0, "unit": "mm/s2"}
    plain = (await stand.get("/bodies/3F/speed-sets/30")).json()
    assert plain["maximum_speed"] is None


@on_stand()
async def test_a_set_is_put_by_the_commands_that_it_takes_and_no_other(stand: Stand) -> None:
    answer = await stand.client.put(SET_12, json=QUICK)
    assert answer.status_code == 200, answer.text
    told = answer.json()
    assert {name: told[name] for name in QUICK} == QUICK
    commands = ["OLSS[12],5000", "OHSS[12],50000", "OSSS[12],70000", "OASS[12],30", "OBSS[12],30"]
    assert [step["command"] for step in told["steps"]] == commands
    assert set_by(stand.frames()) == commands
    assert [step["before"] for step in told["steps"]] == [0] * 5
    again = (await stand.client.put(SET_12, json={**QUICK, "rising_percent": 40.0})).json()
    assert [it["outcome"] for it in again["steps"]] == ["unchanged"] * 3 + ["changed", "unchanged"]
    assert set_by(stand.frames()) == [*commands, "OASS[12],40"]


@on_stand()
async def test_zero_percent_is_written_to_a_set_that_was_never_set(stand: Stand) -> None:
    steep = {**QUICK, "rising_percent": 0, "falling_percent": 0}
    told = (await stand.client.put("/bodies/01/speed-sets/9", json=steep)).json()
    assert [it["outcome"] for it in told["steps"]] == ["changed"] * 5
    assert set_by(stand.frames())[3:] == ["OASS[9],0", "OBSS[9],0"]
    pattern = {"acceleration_set": 9, "deceleration_set": 9}
    assert (await stand.client.put("/bodies/01/patterns/9", json=pattern)).status_code == 200
    again = (await stand.client.put("/bodies/01/speed-sets/9", json=steep)).json()
    assert [it["outcome"] for it in again["steps"]] == ["unchanged"] * 5
    goes = {"kind": "relative", "direction": "cw", "distance": {"value": 5, "unit": "mm"}, "pattern": 9}
    assert (moved := await stand.post("/bodies/01/moves", goes)).status_code == 202, moved.text


@on_stand()
async def test_zero_percent_of_the_standard_set_is_a_value_that_was_set(stand: Stand) -> None:
    zero = {"rising_percent": 0}
    await stand.client.patch("/bodies/01/speed-sets/30", json=zero)
    again = (await stand.client.patch("/bodies/01/speed-sets/30", json=zero)).json()
    assert (again["steps"][0]["outcome"], set_by(stand.frames())) == ("unchanged", ["OAS0"])


@on_stand()
async def test_a_change_is_an_event_where_it_has_changed_something(stand: Stand) -> None:
    news = stand.plant.events.subscribe(types=["body.settings.changed"])
    await stand.client.put(SET_12, json=QUICK)
    await stand.client.put(SET_12, json=QUICK)
    await stand.client.patch(SET_12 + "?flash=true", json={"rising_percent": 40})
    first, second = await anext(news), await anext(news)
    assert first.subject == "/bodies/arm.01"
    assert first.data == {
        "commands": ["OLSS[12],5000", "OHSS[12],50000", "OSSS[12],70000", "OASS[12],30", "OBSS[12],30"],
        "saved": False,
    }
    assert second.data == {"commands": ["OASS[12],40"], "saved": True}


@on_stand()
async def test_a_change_names_what_shall_change(stand: Stand) -> None:
    told = (await stand.client.patch("/bodies/3F/speed-sets/30", json={"maximum_speed_pps": 20_000})).json()
    assert set_by(stand.frames()) == ["OHS20000"]
    assert (told["maximum_speed_pps"], told["start_speed_pps"]) == (20_000, 50)


@on_stand()
async def test_what_somebody_else_has_changed_meanwhile_is_left_alone(stand: Stand) -> None:
    seen = (await stand.get(SET_12)).headers["etag"]
    changed = await stand.client.put(SET_12, json=QUICK, headers={"If-Match": seen})
    assert changed.status_code == 200
    stale = await stand.client.patch(SET_12, json={"rising_percent": 1}, headers={"If-Match": seen})
    assert (stale.status_code, stale.json()["moved"]) == (412, "no")
    assert stale.json()["type"].endswith(":precondition-failed")
    assert "OASS[12],1" not in set_by(stand.frames())
    fresh = {"If-Match": changed.headers["etag"]}
    assert (await stand.client.patch(SET_12, json={"rising_percent": 1}, headers=fresh)).status_code == 200
    assert (await stand.get(SET_12)).headers["etag"] != changed.headers["etag"]


@on_stand()
async def test_what_no_move_could_use_is_refused_before_anything_is_sent(stand: Stand) -> None:
    for wrong in (
        {"start_speed_pps": 30_001},
        {"start_speed_pps": 100, "maximum_speed_pps": 99},
        {"rising_percent": 60, "falling_percent": 41},
        {"rising_percent": 0.5},
        {"speed": 1},
    ):
        answer = await stand.client.patch(SET_12, json=wrong)
        assert (answer.status_code, answer.json()["moved"]) == (422, "no"), wrong
    assert (await stand.client.put(SET_12, json={"rising_percent": 1})).status_code == 422
    assert (await stand.get("/bodies/01/speed-sets/31")).status_code == 422
    assert set_by(stand.frames()) == []


@on_stand()
async def test_flash_memory_is_known_from_the_moment_it_was_written(stand: Stand) -> None:
    await stand.client.put(SET_12, json=QUICK)
    assert (await stand.get(SET_12)).json()["flash"] is None
    saved = await stand.client.patch(SET_12 + "?flash=true", json={"rising_percent": 20})
    assert saved.json()["flash"] == {**QUICK, "rising_percent": 20}
    changed = (await stand.client.patch(SET_12, json={"rising_percent": 10})).json()
    assert (changed["rising_percent"], changed["flash"]["rising_percent"]) == (10, 20)
    assert [frame for frame in stand.frames() if frame[3:] == "FIS"] == ["&01FIS"]


@on_stand()
async def test_sets_are_listed_in_their_order(stand: Stand) -> None:
    await stand.client.put(SET_12, json=QUICK)
    found = (await stand.get("/bodies/01/speed-sets?first=11&last=13")).json()
    assert [it["number"] for it in found["speed_sets"]] == [11, 12, 13]
    assert [it["maximum_speed_pps"] for it in found["speed_sets"]] == [None, 50_000, None]
    assert len((await stand.get("/bodies/01/speed-sets")).json()["speed_sets"]) == 31
    assert (await stand.get("/bodies/01/speed-sets?first=13&last=11")).status_code == 422


@on_stand()
async def test_while_the_motor_moves_the_controller_refuses(stand: Stand) -> None:
    await stand.post(
        "/bodies/3F/moves",
        {"kind": "relative", "direction": "cw", "distance": {"value": 50_000, "unit": "pulse"}},
    )
    answer = await stand.client.patch("/bodies/3F/speed-sets/30", json={"maximum_speed_pps": 20_000})
    assert (answer.status_code, answer.json()["code"]) == (409, "0x50")
