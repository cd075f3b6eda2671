"""User programs over HTTP: what is wrong is told by its place, what is stored is told, and they run."""

from typing import Any

import pytest

from tests.api.stand import Stand, on_stand, socket

PROGRAM = "/bodies/3F/program"
BLINK = "; blinks once\n*BLINK\n  SET OD0\n  WAT 5\n  RST OD0\n  END\n"
TEXT = "*BLINK\nSET OD0\nWAT 5\nRST OD0\nEND\n"
WAITING = "*W\nWAT 50\nJMP *W\n"
PLAIN = {"content-type": "text/plain"}


async def put(stand: Stand, source: str, query: str = "?wait=60", **options: Any) -> Any:
    return await stand.client.put(f"{PROGRAM}{query}", json={"source": source, **options})


@on_stand()
async def test_a_program_is_uploaded_and_read_back(stand: Stand) -> None:
    answer = await put(stand, BLINK)
    assert (answer.status_code, answer.json()["status"], answer.json()["saved"]) == (200, "succeeded", False)
    assert answer.headers["location"].startswith("/bodies/arm.3F/program/uploads/")
    assert (await stand.get(answer.headers["location"])).json() == answer.json()
    program = (await stand.get(PROGRAM)).json()
    assert program == {
        "body_id": "arm.3F",
        "source": TEXT,
        "instructions": 5,
        "steps": answer.json()["steps"],
        "labels": {"BLINK": 0},
        "running": False,
    }
    text = await stand.get(PROGRAM, accept="text/plain")
    assert (text.text, text.headers["content-type"]) == (TEXT, "text/plain; charset=utf-8")


@on_stand()
async def test_a_program_without_its_end_is_taken_and_told(stand: Stand) -> None:
    answer = (await put(stand, "*BLINK\nSET OD0\n")).json()
    assert answer["status"] == "succeeded"
    assert "Line 2: The program goes on behind its last instruction" in answer["stored"]
    assert "Line" not in (await put(stand, BLINK)).json()["stored"]


@on_stand()
async def test_plain_text_is_a_program_too(stand: Stand) -> None:
    answer = await stand.client.put(f"{PROGRAM}?wait=60&flash=true", content=BLINK, headers=PLAIN)
    assert (answer.status_code, answer.json()["saved"]) == (200, True)
    assert "&3FFUS" in stand.frames()


@on_stand()
async def test_a_long_upload_is_told_as_it_goes_and_can_be_cancelled(stand: Stand) -> None:
    async with socket(stand, "/events?bodies=3F") as client:
        await client.message()
        answer = await put(stand, BLINK, query="")
        assert (answer.status_code, answer.json()["status"]) == (202, "running")
        types = [(await client.event())["type"]]
        while types[-1] != "body.program.upload.succeeded":
            types.append((await client.event())["type"])
        assert "body.program.upload.started" in types
    nothing = await stand.client.delete(f"{PROGRAM}/uploads/current")
    assert (nothing.status_code, nothing.json()["detail"]) == (404, "No program is being uploaded to arm.3F.")
    await put(stand, BLINK, query="")
    cancelled = await stand.client.delete(f"{PROGRAM}/uploads/current")
    assert (cancelled.status_code, cancelled.json()["status"]) == (200, "cancelled")
    assert "RAM holds" in cancelled.json()["stored"]


@on_stand()
async def test_what_is_wrong_is_told_by_line_and_column_and_nothing_is_sent(stand: Stand) -> None:
    before = stand.frames()
    answer = await put(stand, "SET OD0\n  JMP *NO\n  FUS\n")
    assert answer.status_code == 422
    assert [(it["line"], it["column"]) for it in answer.json()["errors"]] == [(2, 7), (3, 3)]
    assert answer.json()["errors"][1]["message"] == "FUS cannot stand in a program."
    assert not [frame for frame in stand.frames()[len(before) :] if frame[3] == "U"]
    too_long = await put(stand, "JMP +1\n" * 2500 + "END\n")
    assert "there is room for 6039 steps" in too_long.json()["detail"]


@pytest.mark.parametrize(
    ("content", "kind", "status"),
    [
        (b"{", "application/json", 400),
        (b'{"source": 1}', "application/json", 422),
        (b'{"source": "END", "text": 1}', "application/json", 422),
        (b'{"source": "END", "source": "END"}', "application/json", 422),
        (b"\xff\xfe", "text/plain", 422),
        (b"END", "text/csv", 415),
        (b"END", "", 415),
        (b";" * 262_145, "text/plain", 413),
    ],
)
def test_what_is_no_program_is_refused(content: bytes, kind: str, status: int) -> None:
    @on_stand()
    async def story(stand: Stand) -> None:
        answer = await stand.client.put(PROGRAM, content=content, headers={"content-type": kind})
        assert (answer.status_code, answer.json()["moved"]) == (status, "no")
        assert "&3FUCS" not in stand.frames()

    story()


@on_stand()
async def test_a_program_runs_from_its_label_and_tells_where_it_is(stand: Stand) -> None:
    await put(stand, BLINK)
    begun = await stand.post(f"{PROGRAM}/runs", {"label": "*BLINK"})
    assert (begun.status_code, begun.json()["status"], begun.json()["label"]) == (202, "running", "BLINK")
    at = (await stand.get(f"{PROGRAM}/runs/current")).json()
    assert (at["running"], at["line"], at["instruction"], at["end_cause"]) == (True, 3, "WAT 5", None)
    busy = await put(stand, BLINK)
    assert (busy.status_code, "A user program runs" in busy.json()["detail"]) == (409, True)
    over = (await stand.get(f"{begun.headers['location']}?wait=10")).json()
    assert (over["status"], over["end_cause"]) == ("ended", "normal")
    state = (await stand.get(f"{PROGRAM}/runs/current")).json()
    assert (state["running"], state["end_cause"], state["run"]) == (False, "normal", over)


@on_stand()
async def test_a_stop_ends_a_program(stand: Stand) -> None:
    await put(stand, WAITING)
    begun = await stand.post(f"{PROGRAM}/runs")
    stop = await stand.post("/bodies/3F/stop", {})
    assert stop.json()["confirmed"]
    state = (await stand.get(f"{PROGRAM}/runs/current")).json()
    assert (state["running"], state["end_cause"]) == (False, "stopped")
    assert (state["run"]["status"], state["run"]["end_cause"]) == ("ended", "stopped")
    over = (await stand.get(f"{begun.headers['location']}?wait=10")).json()
    assert over["end_cause"] == "stopped"


@on_stand()
async def test_a_place_that_is_not_there_is_refused(stand: Stand) -> None:
    await put(stand, BLINK)
    nowhere = await stand.post(f"{PROGRAM}/runs", {"label": "NO"})
    assert (nowhere.status_code, nowhere.json()["code"]) == (422, "0x5B")
    both = await stand.post(f"{PROGRAM}/runs", {"label": "BLINK", "address": 0})
    assert (both.status_code, "label or address, not both" in both.json()["detail"]) == (422, True)
    step = await stand.post(f"{PROGRAM}/runs?wait=5", {"address": 1, "single_step": True})
    assert (step.status_code, step.json()["end_cause"]) == (200, "single_step")
