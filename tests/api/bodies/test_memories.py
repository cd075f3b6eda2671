"""Memories of user programs over HTTP."""

from tests.api.stand import Stand, on_stand


@on_stand()
async def test_a_memory_that_is_set_is_read_among_others(stand: Stand) -> None:
    answer = await stand.client.put("/bodies/3F/memories/D1", json={"value": -7})
    assert (answer.status_code, answer.json()) == (200, {"name": "D1", "value": -7})
    read = (await stand.get("/bodies/3F/memories?first=D0&count=3")).json()
    assert read["body_id"] == "arm.3F"
    assert [(it["name"], it["value"]) for it in read["memories"]] == [("D0", 0), ("D1", -7), ("D2", 0)]


@on_stand()
async def test_memories_are_set_together_and_checked_before_the_first(stand: Stand) -> None:
    wanted = [{"name": "D7", "value": 70}, {"name": "C1", "value": 3}, {"name": "T0", "value": 0}]
    answer = await stand.client.put("/bodies/3F/memories", json={"memories": wanted})
    assert (answer.status_code, answer.json()) == (200, {"body_id": "arm.3F", "memories": wanted})
    sent = len(stand.frames())
    wrong = {"memories": [{"name": "D7", "value": 1}, {"name": "C30", "value": 1}]}
    refused = await stand.client.put("/bodies/3F/memories", json=wrong)
    assert (refused.status_code, refused.json()["moved"]) == (422, "no")
    assert not [frame for frame in stand.frames()[sent:] if frame[3:5] == "UD"]


@on_stand()
async def test_each_bank_has_its_range(stand: Stand) -> None:
    for name, value in (("C0", -1), ("T30", 0), ("D0", 1_000_000_000), ("X", 1)):
        answer = await stand.client.put(f"/bodies/3F/memories/{name}", json={"value": value})
        assert (answer.status_code, answer.json()["moved"]) == (422, "no")
    assert (await stand.get("/bodies/3F/memories?first=C29&count=2")).status_code == 422
    assert not [frame for frame in stand.frames() if frame[3:5] == "UD"]


@on_stand()
async def test_bits_that_are_no_number_are_not_told_as_one(stand: Stand) -> None:
    await stand.send("01", "set-program-memory", memory="D0", bits=0x40000000)
    await stand.send("01", "set-program-memory", memory="D1", value=-999_999_999)
    told = (await stand.get("/bodies/01/memories?first=D0&count=2")).json()["memories"]
    assert told == [{"name": "D0", "value": None}, {"name": "D1", "value": -999_999_999}]


@on_stand()
async def test_a_memory_is_given_once(stand: Stand) -> None:
    twice = {"memories": [{"name": "D0", "value": 1}, {"name": "d0", "value": 2}]}
    answer = await stand.client.put("/bodies/01/memories", json=twice)
    assert answer.status_code == 422
    assert answer.json()["detail"] == "Memory D0 is given twice; nothing was sent."
