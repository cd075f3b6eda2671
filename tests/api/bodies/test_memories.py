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
async def test_each_bank_has_its_range(stand: Stand) -> None:
    for name, value in (("C0", -1), ("T30", 0), ("D0", 1_000_000_000), ("X", 1)):
        answer = await stand.client.put(f"/bodies/3F/memories/{name}", json={"value": value})
        assert (answer.status_code, answer.json()["moved"]) == (422, "no")
    assert (await stand.get("/bodies/3F/memories?first=C29&count=2")).status_code == 422
    assert not [frame for frame in stand.frames() if frame[3:5] == "UD"]
