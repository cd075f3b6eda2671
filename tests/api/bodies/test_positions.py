"""A body's stored positions over HTTP: as JSON in parts, as CSV in whole, with names."""

from httpx2 import Response

from tests.api.bodies.test_moves import refused
from tests.api.stand import Stand, on_stand, socket

TABLE = "/bodies/3F/positions"
FEW = "?first=0&last=9"


async def put(stand: Stand, content: object, path: str = TABLE, **headers: str) -> Response:
    return await stand.client.put(path, json=content, headers=headers)


async def upload(stand: Stand, text: str, path: str = f"{TABLE}.csv", **headers: str) -> Response:
    return await stand.client.put(
        path, content=text.encode(), headers={"content-type": "text/csv", **headers}
    )


@on_stand()
async def test_a_number_alone_stores_where_the_motor_stands(stand: Stand) -> None:
    await stand.teach_speeds("3F")
    move = {"kind": "relative", "direction": "cw", "distance": {"value": 640, "unit": "pulse"}}
    assert (await stand.post("/bodies/3F/moves?wait=30", move)).json()["status"] == "succeeded"

    stored = await put(stand, {"positions": [{"number": 7, "name": "unload"}]})
    entry = {"number": 7, "name": "unload", "pulses": 640, "value": None, "unit": None}
    assert stored.json() == {"body_id": "arm.3F", "positions": [entry], "flash": {}}

    back = {"kind": "absolute", "position": {"value": 0, "unit": "pulse"}}
    await stand.post("/bodies/3F/moves?wait=30", back)
    moved = (await stand.post("/bodies/3F/moves?wait=30", {"kind": "position", "position": 7})).json()
    assert (moved["frame"], moved["kind"], moved["position"]) == ("&3F1AMP[7]\\r", "absolute", 640)
    slowly = {"kind": "position", "position": 7, "speed": "low", "pattern": 3, "validate_only": True}
    assert (await stand.post("/bodies/3F/moves", slowly)).json()["frame"] == "&3F2AMA[3],P[7]\\r"
    refused(await stand.post("/bodies/3F/moves", {"kind": "position", "position": 2048}), 422)


@on_stand()
async def test_positions_are_in_the_unit_of_the_body(stand: Stand) -> None:
    wanted = [{"number": 1, "position": {"value": 2.5, "unit": "mm"}}]
    stored = await put(stand, {"positions": wanted}, "/bodies/01/positions")
    [entry] = stored.json()["positions"]
    assert (entry["pulses"], entry["value"], entry["unit"]) == (2_500, 2.5, "mm")
    assert "&013PSP[1],2500" in stand.frames()
    refused(await put(stand, {"positions": wanted}), 422)


@on_stand()
async def test_a_part_is_read_and_changed_only_where_it_is_as_it_was_read(stand: Stand) -> None:
    read = await stand.get(TABLE + FEW)
    assert [it["number"] for it in read.json()["positions"]] == list(range(10))
    wanted = {"positions": [{"number": 3, "position": {"value": 5, "unit": "pulse"}}]}
    first = await put(stand, wanted, TABLE + FEW, **{"if-match": read.headers["etag"]})
    assert first.status_code == 200
    sent = stand.frames()
    late = await put(stand, wanted, TABLE + FEW, **{"if-match": read.headers["etag"]})
    refused(late, 412)
    assert not [frame for frame in stand.frames()[len(sent) :] if frame.startswith("&3F3PS")]
    now = (await stand.get(TABLE + FEW)).headers["etag"]
    by_csv = await upload(stand, "number,pulse\n3,6\n", f"{TABLE}.csv{FEW}", **{"if-match": now})
    assert by_csv.json()["positions"][0]["pulses"] == 6


@on_stand()
async def test_names_are_given_and_taken_away_without_a_word_on_the_wire(stand: Stand) -> None:
    sent = stand.frames()
    named = await put(stand, {"name": "置き場"}, f"{TABLE}/4/name")
    assert named.json() == {"body_id": "arm.3F", "number": 4, "name": "置き場"}
    assert not [frame for frame in stand.frames()[len(sent) :] if frame[3:5] in ("3P", "3N")]
    assert (await stand.get(f"{TABLE}?first=4&last=4")).json()["positions"][0]["name"] == "置き場"
    assert (await put(stand, {"name": None}, f"{TABLE}/4/name")).json()["name"] is None
    assert (await stand.get(f"{TABLE}?first=4&last=4")).json()["positions"][0]["name"] is None
    refused(await put(stand, {"name": "x"}, f"{TABLE}/2048/name"), 422)


@on_stand()
async def test_csv_goes_round(stand: Stand) -> None:
    wanted = "number,pulse\r\n0,1\r\n5,-70\r\n"
    stored = await upload(stand, wanted)
    assert [it["pulses"] for it in stored.json()["positions"]] == [1, -70]
    read = await stand.get(f"{TABLE}.csv?first=4&last=6")
    assert read.headers["content-type"].startswith("text/csv")
    assert read.text == "number,pulse\r\n4,0\r\n5,-70\r\n6,0\r\n"
    assert (await upload(stand, "\ufeffnumber;pulse\r\n4;44,00\r\n;\r\n")).status_code == 200
    refused(await upload(stand, "number;pulse\r\n4;44,50\r\n"), 422)
    assert (await stand.get(f"{TABLE}.csv?first=4&last=4")).text == "number,pulse\r\n4,44\r\n"


@on_stand()
async def test_a_whole_table_is_downloaded(stand: Stand) -> None:
    few = {number: number - 999_999_999 for number in range(0, 2048, 89)}
    table = "number,pulse\r\n" + "".join(f"{number},{pulses}\r\n" for number, pulses in few.items())
    assert (await upload(stand, table)).status_code == 200
    rows = (await stand.get(f"{TABLE}.csv")).text.splitlines()
    assert rows == ["number,pulse", *(f"{number},{few.get(number, 0)}" for number in range(2048))]


@on_stand()
async def test_what_cannot_be_stored_is_refused_with_its_place(stand: Stand) -> None:
    sent = stand.frames()
    for text, told in (
        ("number,pulse\n2048,1\n", "line 2, number"),
        ("number,pulse\n1,1.5\n", "line 2, pulse"),
        ("number,pulse\n1,\n", "line 2, pulse"),
        ("number,pulse\n1,5\n1,6\n", "given twice"),
        ("number\n1\n", "the columns are number,pulse"),
    ):
        answer = await upload(stand, text)
        refused(answer, 422)
        assert told in answer.json()["detail"]
    refused(await stand.client.put(f"{TABLE}.csv", content=b"number,pulse\n1,1\n"), 415)
    refused(await put(stand, {"positions": []}), 422)
    refused(await stand.get(f"{TABLE}?first=5&last=4"), 422)
    refused(await stand.get("/bodies/77/positions"), 404)
    assert not [frame for frame in stand.frames()[len(sent) :] if frame[3:5] in ("3P", "3N")]


@on_stand()
async def test_what_flash_memory_holds_is_told_where_it_is_known_and_is_no_part_of_the_tag(
    stand: Stand,
) -> None:
    first = await put(stand, {"positions": [{"number": 7, "position": pulse(100)}], "flash": True})
    assert first.json()["flash"] == {}
    saved = await stand.get(f"{TABLE}?first=7&last=7")
    assert saved.json()["flash"] == {"7": 100}
    changed = await put(stand, {"positions": [{"number": 7, "position": pulse(5)}]})
    assert (changed.json()["positions"][0]["pulses"], changed.json()["flash"]) == (5, {"7": 100})
    tag = (await stand.get(f"{TABLE}?first=7&last=7")).headers["etag"]
    await stand.post("/bodies/3F/commands/save-positions", {})
    after = await stand.get(f"{TABLE}?first=7&last=7")
    assert (after.json()["flash"], after.headers["etag"]) == ({"7": 5}, tag)


def pulse(value: int) -> dict[str, object]:
    return {"value": value, "unit": "pulse"}


@on_stand({"arm": ({"id": "3F", "units": {"unit": "mm", "pulses_per_unit": 100.0}},)})
async def test_a_whole_table_is_read_in_a_record_that_is_followed_to_its_end(stand: Stand) -> None:
    await upload(stand, "number,pulse\n7,1250\n")
    await put(stand, {"name": "unload"}, f"{TABLE}/7/name")
    async with socket(stand, "/events?types=body.position_reading.*") as client:
        await client.message()
        begun = await stand.post(f"{TABLE}/readings?first=6&last=8")
        assert (begun.status_code, begun.json()["positions"], begun.json()["expected"]) == (202, None, 3)
        again = await stand.post(f"{TABLE}/readings")
        assert (again.status_code, again.json()["type"].rpartition(":")[2]) == (409, "body-busy")
        over = (await stand.get(f"{begun.headers['location']}?wait=60")).json()
        told = [await client.event() for _ in range(2)]
    table = (await stand.get(f"{TABLE}?first=6&last=8")).json()
    assert (over["status"], over["read"], over["positions"]) == ("succeeded", 3, table["positions"])
    assert over["positions"][1]["name"] == "unload"
    assert [it["type"] for it in told] == [
        "body.position_reading.started",
        "body.position_reading.succeeded",
    ]
    assert {it["data"]["positions"] for it in told} == {None}


@on_stand()
async def test_a_reading_of_a_table_is_cancelled(stand: Stand) -> None:
    assert (await stand.client.delete(f"{TABLE}/readings/current")).status_code == 404
    backwards = await stand.post(f"{TABLE}/readings?first=8&last=6")
    assert (backwards.status_code, "less than first" in backwards.json()["detail"]) == (422, True)
    await stand.post(f"{TABLE}/readings")
    cancelled = await stand.client.delete(f"{TABLE}/readings/current")
    assert (cancelled.status_code, cancelled.json()["status"]) == (200, "cancelled")


@on_stand({"arm": ({"id": "3F", "units": {"unit": "mm", "pulses_per_unit": 100.0}},)})
async def test_a_whole_table_is_stored_in_a_record_that_is_followed_to_its_end(stand: Stand) -> None:
    wanted = [{"number": number, "position": pulse(number + 1)} for number in range(200)]
    wanted[7]["name"] = "unload"
    async with socket(stand, "/events?types=body.position_upload.*") as client:
        await client.message()
        begun = await stand.post(f"{TABLE}/uploads", {"positions": wanted, "flash": True})
        assert (begun.status_code, begun.json()["count"], begun.json()["expected"]) == (202, 200, 400)
        for again in (
            await stand.post(f"{TABLE}/uploads", {"positions": wanted}),
            await put(stand, {"positions": [{"number": 1}]}),
        ):
            refused(again, 409)
            assert "is being stored; nothing was sent" in again.json()["detail"]
        over = (await stand.get(f"{begun.headers['location']}?wait=60")).json()
        told = [await client.event()]
        while told[-1]["type"] != "body.position_upload.succeeded":
            told.append(await client.event())
    assert (over["status"], over["read"], over["error"]) == ("succeeded", 400, None)
    assert (await stand.get(f"{TABLE}?first=0&last=199")).json()["positions"] == over["positions"]
    assert over["positions"][7] == {"number": 7, "name": "unload", "pulses": 8, "value": 0.08, "unit": "mm"}
    assert "&3FFPS" in stand.frames()
    assert told[0]["type"] == "body.position_upload.started"
    assert {(it["data"]["positions"], it["data"]["count"]) for it in told} == {(None, 200)}


@on_stand({"arm": ({"id": "3F", "units": {"unit": "mm", "pulses_per_unit": 100.0}},)})
async def test_a_whole_table_is_stored_as_it_was_read(stand: Stand) -> None:
    read = (await stand.get(f"{TABLE}?first=0&last=2047")).json()
    for it in read["positions"]:
        it.update(pulses=-99_999_000 - it["number"], value=(-99_999_000 - it["number"]) / 100)
    stored = await put(stand, read)
    assert stored.status_code == 200, stored.text
    assert stored.json() == read


@on_stand()
async def test_the_storing_of_a_table_is_cancelled(stand: Stand) -> None:
    refused(await stand.client.delete(f"{TABLE}/uploads/current"), 404)
    table = "number,pulse\n" + "".join(f"{number},5\n" for number in range(2_048))
    begun = await stand.client.post(
        f"{TABLE}.csv", content=table.encode(), headers={"content-type": "text/csv"}
    )
    assert begun.status_code == 202
    cancelled = (await stand.client.delete(f"{TABLE}/uploads/current")).json()
    assert cancelled["status"] == "cancelled"
    assert (await stand.get(begun.headers["location"])).json() == cancelled


@on_stand()
async def test_a_table_that_cannot_be_stored_begins_nothing(stand: Stand) -> None:
    twice = {"positions": [{"number": 1, "position": pulse(1)}, {"number": 1, "position": pulse(2)}]}
    refused(await stand.post(f"{TABLE}/uploads", twice), 422)
    refused(await stand.get(f"{TABLE}/uploads/current"), 404)
