"""Replays to the controllers' side: no difference where there is none, and one changed byte at its record."""

import logging
from collections.abc import Callable, Iterable
from datetime import UTC, datetime
from pathlib import Path
from random import Random
from typing import Any

import pytest

from recordings.dialogue import dialogue_of, read
from recordings.form import Clocks, Manifest, NotARecording, line_member, opened
from recordings.line_script import Numbered
from recordings.replaying import Replayed, Script, Speed, replay
from tests.recordings.runs import BYTE_TIME_S, record_run
from tests.recordings.taking import BOTH, bodies_at_work

RUNS, TOGETHER, DRAWN = 1_000, 8, 24
DRAWN_IN_VAIN = 421
"""While its port was lost numbers of fences were drawn that no recording has."""
DIALOGUES = sorted((Path(__file__).parent / "dialogues").glob("*.dialogue"))
SPEEDS: dict[str, Speed] = {"rorze": (10 / 9600, False), "fics": (10 / 19200, False)}
OPTIONS = {"rorze": {}, "fics": {"baud": 19200}}


@pytest.fixture(autouse=True)
def _quiet(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL, "gateway")


def at(speed: Speed) -> Callable[[str, str], Speed]:
    return lambda *_: speed


def script_of(path: Path, *, exact: bool = False) -> Script:
    with opened(path) as recording:
        return Script.of(recording, exact=exact)


def changed(script: Script, number: int, dice: Random) -> bytes:
    """Change one byte of a frame; give what it was before."""
    (line_id,) = script.records
    records: list[Numbered] = list(script.records[line_id])
    place = next(place for place, (found, _) in enumerate(records) if found == number)
    entry = records[place][1]
    data = bytearray(entry.data)
    data[dice.randrange(len(data) - 1)] ^= 1 << dice.randrange(3)
    records[place] = number, entry.model_copy(update={"data": bytes(data)})
    script.records = {line_id: records}
    return entry.data


def sent(script: Script, *, by_clients: bool = False) -> list[int]:
    """The numbers of the records of what was sent."""
    (records,) = script.records.values()
    return [
        number
        for number, entry in records
        if entry.kind == "tx" and (entry.request_id is not None or not by_clients)
    ]


def test_runs_on_a_bad_wire_are_replayed_without_a_difference(tmp_path: Path) -> None:
    for first in range(0, DRAWN, TOGETHER):
        replay_runs(range(first, first + TOGETHER), tmp_path)
    replay_runs([DRAWN_IN_VAIN], tmp_path)


@pytest.mark.prove
@pytest.mark.parametrize("first", range(DRAWN, RUNS, TOGETHER))
def test_a_thousand_runs_are_replayed_without_a_difference(first: int, tmp_path: Path) -> None:
    replay_runs(range(first, first + TOGETHER), tmp_path)


def replay_runs(seeds: Iterable[int], tmp_path: Path) -> None:
    found: dict[int, Replayed] = {}
    for seed in seeds:
        script = script_of(record_run(seed, tmp_path / str(seed)), exact=True)
        found[seed] = replay(script, speed_of=at((BYTE_TIME_S, False)))
    differ = {seed: replay.differences for seed, replay in found.items() if replay.differences}
    assert differ == {}
    assert min(replay.frames for replay in found.values()) > 100


@pytest.mark.parametrize("exact", [True, False], ids=["exact", "matching"])
@pytest.mark.parametrize("family", BOTH)
def test_what_was_recorded_is_done_again(family: str, exact: bool, tmp_path: Path) -> None:
    script = script_of(BOTH[family](tmp_path, **OPTIONS[family]), exact=exact)
    replayed = replay(script, speed_of=at(SPEEDS[family]))
    assert list(map(str, replayed.differences)) == []
    assert replayed.requests > 10
    assert replayed.frames > 300


@pytest.mark.parametrize("exact", [True, False], ids=["exact", "matching"])
@pytest.mark.parametrize("family", BOTH)
def test_one_changed_byte_is_found_at_its_record(family: str, exact: bool, tmp_path: Path) -> None:
    path, dice = BOTH[family](tmp_path, **OPTIONS[family]), Random(7)
    script = script_of(path)
    (line_id,) = script.records
    for number in dice.sample(sent(script, by_clients=not exact), 5):
        script = script_of(path, exact=exact)
        before = changed(script, number, dice)
        (difference, *_) = replay(script, speed_of=at(SPEEDS[family])).differences
        assert difference.place == f"{line_member(line_id)}:{number}", str(difference)
        assert difference.then is not None
        assert difference.then.frame != before


def test_a_difference_names_frame_request_and_decision(tmp_path: Path) -> None:
    script = script_of(BOTH["rorze"](tmp_path), exact=True)
    (records,) = script.records.values()
    number = next(number for number, record in records if record.data == b"&00OHS50000\r")
    other = records[number - 1][1].model_copy(update={"data": b"&00OHS50001\r"})
    script.records = {"line1": [*records[: number - 1], (number, other), *records[number:]]}
    (difference,) = replay(script, speed_of=at(SPEEDS["rorze"])).differences
    told = str(difference)
    assert told.startswith(
        f"lines/line1.jsonl:{number}: then &00OHS50001\\r (http 127.0.0.1, request step-4), "
    )
    assert "now &00OHS50000\\r (http 127.0.0.1, request step-4); decided in " in told
    decided = told.partition("decided in ")[2]
    assert "rorze/" in decided, "the family's own code is named"
    assert "core/line.py" not in decided, "the driver writes all frames"


@pytest.mark.parametrize("family", BOTH)
def test_a_recording_from_the_middle_of_a_life_is_done_again(family: str, tmp_path: Path) -> None:
    """How the line was set up is not in it, and the gateway sets it up all the same."""
    path = BOTH[family](tmp_path, **OPTIONS[family])
    script = script_of(path)
    (line_id,) = script.records
    records = list(script.records[line_id])
    begin = next(place for place, (_, record) in enumerate(records) if record.request_id is not None)
    middle = Script(
        script.manifest,
        {line_id: records[begin:]},
        {line_id: records[:begin]},
        script.requests,
    )
    replayed = replay(middle, speed_of=at(SPEEDS[family]))
    assert list(map(str, replayed.differences)) == []


def test_a_mark_that_a_client_had_set_is_no_difference(tmp_path: Path) -> None:
    """For who comes early a mark is set; in the replay the gateway may have set it by itself before."""
    script = script_of(bodies_at_work(tmp_path))
    (records,) = script.records.values()
    client = {"caller": "http 127.0.0.1", "request_id": "step-0"}
    script.records = {
        "line1": [
            (n, record.model_copy(update=client) if b"9VS7,GW-" in record.data else record)
            for n, record in records
        ]
    }
    assert list(script.records["line1"]) != list(records)
    assert list(map(str, replay(script, speed_of=at(SPEEDS["rorze"])).differences)) == []


@pytest.mark.parametrize("family", BOTH)
def test_a_recording_becomes_a_dialogue_that_is_said_again_to_the_last_frame(
    family: str, tmp_path: Path
) -> None:
    text, replayed = dialogue_of(script_of(BOTH[family](tmp_path, **OPTIONS[family])))
    assert replayed.differences == []
    path = tmp_path / "a.dialogue"
    path.write_text(text, "utf-8")
    script, speeds = read(path)
    again = replay(script, speed_of=lambda line_id, _: speeds[line_id])
    assert list(map(str, again.differences)) == []
    assert again.frames >= 300
    number = Random(3).choice(sent(script))
    changed(script, number, Random(4))
    (difference, *_) = replay(script, speed_of=lambda line_id, _: speeds[line_id]).differences
    assert difference.number == number


@pytest.mark.parametrize("path", DIALOGUES, ids=lambda path: path.stem)
def test_the_dialogues_of_faults_are_said_as_then(path: Path) -> None:
    script, speeds = read(path)
    replayed = replay(script, speed_of=lambda line_id, _: speeds[line_id])
    assert list(map(str, replayed.differences)) == []
    assert replayed.frames > 0


def test_there_are_dialogues() -> None:
    assert DIALOGUES


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("", "no dialogue"),
        ("motion-gateway dialogue 2\n{}", "no dialogue"),
        ("motion-gateway dialogue 1\n{", ":2: "),
        ("motion-gateway dialogue 1\n{}\n= arm\n{}", ":4: "),
    ],
)
def test_what_is_no_dialogue_is_refused(text: str, why: str, tmp_path: Path) -> None:
    (tmp_path / "a.dialogue").write_text(text)
    with pytest.raises(NotARecording, match=why):
        read(tmp_path / "a.dialogue")


@pytest.mark.parametrize(
    ("configuration", "why"),
    [({"lines": [{"id": "line1"}]}, "address"), ({"lines": [{"id": "line1", "address": 1}]}, "address")],
)
def test_a_recording_of_a_line_that_nobody_could_serve_is_refused(
    configuration: dict[str, Any], why: str
) -> None:
    now = datetime(2026, 1, 2, tzinfo=UTC)
    manifest = Manifest(
        gateway="0.1.0",
        epoch="00000001",
        from_=now,
        to=now,
        clocks=Clocks(at=now, monotonic_ns=1),
        lines=["line1"],
        configuration=configuration,
    )
    with pytest.raises(NotARecording, match=rf"manifest.json: configuration: .*{why}"):
        replay(Script(manifest, {"line1": []}, {"line1": []}, []))
