"""Groups over HTTP: one command to several bodies, one result for each of them."""

from tests.api.stand import BODIES, RELATIVE, Stand, on_stand


async def define(stand: Stand, members: list[str]) -> None:
    answer = await stand.client.put("/groups/80", json={"members": members})
    assert answer.status_code == 200, answer.text


@on_stand()
async def test_a_group_is_defined_at_the_link_master_and_listed(stand: Stand) -> None:
    await define(stand, ["arm.00", "3f"])
    group = (await stand.get("/groups/80")).json()
    assert (group["group_id"], group["members"]) == ("arm.80", ["arm.00", "arm.3F"])
    assert "&7FXVS80,00,3F" in stand.frames()
    assert (await stand.get("/groups")).json()["groups"] == [group]


@on_stand()
async def test_a_group_of_strangers_is_refused(stand: Stand) -> None:
    for members, status in (
        (["00"], 422),
        (["00", "00"], 422),
        (["00", "05"], 404),
        (["00", "01"] * 20, 422),
    ):
        answer = await stand.client.put("/groups/80", json={"members": members})
        assert answer.status_code == status
    assert (await stand.client.put("/groups/7F", json={"members": ["00", "01"]})).status_code == 422
    assert (await stand.get("/groups/80")).status_code == 404


@on_stand()
async def test_a_group_has_a_name_that_people_can_read_or_none(stand: Stand) -> None:
    for name in ("pair\x1b[2J", "a\nb", "\0", " ", "\x85", "\u202e"):
        answer = await stand.client.put("/groups/80", json={"members": ["00", "3F"], "name": name})
        assert (answer.status_code, answer.json()["errors"][0]["field"]) == (422, "name"), repr(name)
    assert (await stand.get("/groups/80")).status_code == 404
    for name in ("", "二軸 pair"):
        answer = await stand.client.put("/groups/80", json={"members": ["00", "3F"], "name": name})
        assert (answer.status_code, answer.json()["name"]) == (200, name)


@on_stand()
async def test_one_frame_moves_all_members_and_each_has_its_move(stand: Stand) -> None:
    await define(stand, ["00", "3F"])
    await stand.teach_speeds("00")
    await stand.teach_speeds("3F")

    answer = await stand.post("/groups/80/moves?wait=30", RELATIVE)

    assert answer.status_code == 200
    assert [(move["body_id"], move["status"]) for move in answer.json()["moves"]] == [
        ("arm.00", "succeeded"),
        ("arm.3F", "succeeded"),
    ]
    assert stand.moved() == ["&801+M50000"]


@on_stand()
async def test_a_member_that_refuses_does_not_hide_one_that_moves(stand: Stand) -> None:
    await define(stand, ["00", "3F"])
    await stand.send("3F", "set-pattern", pattern=12, acceleration=0, deceleration=0)
    for name, value in (("set-start-speed", 100), ("set-maximum-speed", 1000)):
        await stand.send("3F", name, speed_set=0, speed=value)
    await stand.send("3F", "set-maximum-acceleration", speed_set=0, acceleration=10_000)
    await stand.send("3F", "set-rising-acceleration-share", speed_set=0, percent=50)
    await stand.send("3F", "set-falling-acceleration-share", speed_set=0, percent=50)

    answer = await stand.post("/groups/80/moves?wait=60", RELATIVE | {"pattern": 12})

    rejected, moved = answer.json()["moves"]
    assert (rejected["body_id"], rejected["status"]) == ("arm.00", "rejected")
    assert rejected["error"]["controller_error"] == "0x47"
    assert (moved["body_id"], moved["status"]) == ("arm.3F", "succeeded")


@on_stand()
async def test_a_groups_move_can_be_planned(stand: Stand) -> None:
    await define(stand, ["00", "3F"])
    await stand.teach_speeds("00")
    await stand.teach_speeds("3F")
    plan = (await stand.post("/groups/80/moves", RELATIVE | {"validate_only": True})).json()
    assert plan["frame"] == "&801+M50000\\r"
    assert [member["body_id"] for member in plan["members"]] == ["arm.00", "arm.3F"]
    assert stand.moved() == []


@on_stand()
async def test_members_of_different_scales_cannot_share_a_length(stand: Stand) -> None:
    await define(stand, ["00", "01"])
    move = {"kind": "absolute", "position": {"value": 1, "unit": "mm"}}
    assert (await stand.post("/groups/80/moves", move)).status_code == 422
    assert stand.moved() == []


@on_stand({"arm": [{**body, "units": {"unit": "mm", "pulses_per_unit": 500.0}} for body in BODIES]})
async def test_members_of_one_scale_can(stand: Stand) -> None:
    await define(stand, ["00", "01"])
    move = {"kind": "absolute", "position": {"value": 1, "unit": "mm"}}
    answer = await stand.post("/groups/80/moves", move)
    assert answer.status_code == 202
    assert stand.moved() == ["&801AM500"]


@on_stand()
async def test_a_command_to_a_group_has_one_reply_for_each_member(stand: Stand) -> None:
    await define(stand, ["00", "3F"])
    await stand.send("3F", "set-position", position=77)
    answer = (await stand.post("/groups/80/commands/get-position")).json()
    assert answer["group_id"] == "arm.80"
    assert [(it["body_id"], it["reply"]["pulses"]) for it in answer["members"]] == [
        ("arm.00", 0),
        ("arm.3F", 77),
    ]


@on_stand()
async def test_a_command_to_a_group_has_one_error_for_each_member_that_refuses(stand: Stand) -> None:
    await define(stand, ["00", "3F"])
    await stand.send("3F", "set-pattern", pattern=3, acceleration=0, deceleration=0)
    first, second = (await stand.post("/groups/80/commands/get-pattern", {"pattern": 3})).json()["members"]
    assert (first["reply"], first["error"]["code"]) == (None, "0x47")
    assert (second["reply"], second["error"]) == ({"acceleration": 0, "deceleration": 0}, None)
