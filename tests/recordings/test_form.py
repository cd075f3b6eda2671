"""The file of a recording: whole or not there, and read with a clear word about what is wrong."""

import json
import zipfile
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path

import pytest

from recordings.form import EVENTS, MANIFEST, Clocks, Manifest, NotARecording, line_member, opened, pack

NOW = datetime(2026, 1, 2, 3, 4, 5, tzinfo=UTC)
RECORD = '{"at":"2026-01-02T03:04:05Z","monotonic_ns":1,"kind":"tx","data":"&3F6PD\\\\r"}\n'
EVENT = {
    "sequence": "000000000001",
    "time": "2026-01-02T03:04:05Z",
    "type": "line.up",
    "subject": "/lines/arm",
    "data": {},
}
MANIFEST_TEXT = Manifest(
    gateway="0.1.0",
    epoch="00000001",
    from_=NOW,
    to=NOW,
    clocks=Clocks(at=NOW, monotonic_ns=1),
    lines=["arm"],
    configuration={"lines": [{"id": "arm"}]},
).model_dump_json(by_alias=True)


def folder(tmp_path: Path) -> Path:
    part = tmp_path / "part"
    (part / "lines").mkdir(parents=True)
    (part / MANIFEST).write_text(MANIFEST_TEXT)
    (part / line_member("arm")).write_text(RECORD * 3)
    (part / EVENTS).write_text(f"{json.dumps(EVENT)}\n")
    return part


def test_what_was_packed_is_read(tmp_path: Path) -> None:
    target = tmp_path / "a.mgrec"
    assert list(pack(folder(tmp_path), target)) == [None] * 3
    with opened(target) as recording:
        assert recording.manifest.from_ == NOW
        assert [(number, entry.data) for number, entry in recording.entries(line_member("arm"))] == [
            (number, b"&3F6PD\r") for number in (1, 2, 3)
        ]
        assert list(recording.rows(EVENTS)) == [(1, EVENT)]
        assert list(recording.rows("requests.jsonl")) == []
    assert target.stat().st_mode & 0o777 == 0o600


def test_a_disk_that_takes_no_more_leaves_nothing(tmp_path: Path) -> None:
    packing = pack(folder(tmp_path), tmp_path / "a.mgrec")
    next(packing)
    with pytest.raises(OSError, match="full"):
        packing.throw(OSError("full"))
    assert [file.name for file in tmp_path.iterdir()] == ["part"]


def of_members(**members: str) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        with zipfile.ZipFile(path, "w") as archive:
            for name, text in members.items():
                archive.writestr(name.replace("_", "."), text)

    return write


WRONG: list[tuple[Callable[[Path], object], str]] = [
    (lambda path: path.write_bytes(b"no zip"), "is no recording"),
    (of_members(events_jsonl=""), "manifest.json"),
    (of_members(manifest_json="{}"), "manifest.json: gateway: Field required"),
    (of_members(manifest_json=MANIFEST_TEXT.replace('"version":1', '"version":2')), "manifest.json: version"),
    (
        of_members(manifest_json=MANIFEST_TEXT.replace('["arm"]', '["../../arm"]')),
        "manifest.json: the configuration has no line ../../arm",
    ),
    (lambda path: bomb(path), "unpacked it would have 300 MiB, more than 200 times its size"),
]


def bomb(path: Path) -> None:
    """Write a small file that would fill the memory."""
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(MANIFEST, MANIFEST_TEXT)
        with archive.open(line_member("arm"), "w", force_zip64=True) as member:
            for _ in range(300):
                member.write(bytes(1 << 20))


@pytest.mark.parametrize(("write", "why"), WRONG)
def test_what_is_no_recording_is_refused_with_the_reason(
    write: Callable[[Path], object], why: str, tmp_path: Path
) -> None:
    write(tmp_path / "a.mgrec")
    with pytest.raises(NotARecording, match=why), opened(tmp_path / "a.mgrec"):
        pass


@pytest.mark.parametrize(
    "event",
    [
        {**EVENT, "sequence": "one"},
        {**EVENT, "time": "today"},
        {**EVENT, "data": []},
        {"type": "line.up"},
        [],
        "[" * 100_000,
    ],
)
def test_an_event_without_what_is_read_of_it_is_named(event: object, tmp_path: Path) -> None:
    part = folder(tmp_path)
    line = event if isinstance(event, str) else json.dumps(event)
    (part / EVENTS).write_text(f"{json.dumps(EVENT)}\n{line}\n")
    list(pack(part, tmp_path / "a.mgrec"))
    with opened(tmp_path / "a.mgrec") as recording, pytest.raises(NotARecording, match=r"events\.jsonl:2: "):
        list(recording.rows(EVENTS))


def test_a_file_that_was_changed_on_its_way_is_damaged(tmp_path: Path) -> None:
    """Each byte of what is packed is noticed, by what it makes of it or by its check sum."""
    list(pack(folder(tmp_path), tmp_path / "a.mgrec"))
    whole = bytearray((tmp_path / "a.mgrec").read_bytes())
    place = whole.index(b"lines/arm.jsonl") + 60
    for bit in range(8):
        changed = bytearray(whole)
        changed[place] ^= 1 << bit
        (tmp_path / "b.mgrec").write_bytes(changed)
        with pytest.raises(NotARecording), opened(tmp_path / "b.mgrec") as recording:
            list(recording.entries(line_member("arm")))


@pytest.mark.parametrize("line", ["{", "[]", '{"kind":"tx"}', RECORD.replace("tx", "up")])
def test_a_line_that_cannot_be_read_is_named(line: str, tmp_path: Path) -> None:
    part = folder(tmp_path)
    (part / line_member("arm")).write_text(f"{RECORD}{line}\n")
    list(pack(part, tmp_path / "a.mgrec"))
    with (
        opened(tmp_path / "a.mgrec") as recording,
        pytest.raises(NotARecording, match=r"lines/arm\.jsonl:2: "),
    ):
        list(recording.entries(line_member("arm")))
