"""Exports for Wireshark, as TShark reads them: the records and bytes of the JSONL, with their meaning."""

import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path

import pytest

from protocols.rorze.commands import COMMANDS
from recordings.dissector import dissector
from recordings.form import line_member, opened
from recordings.pcapng import write
from tests.recordings.scripts import BODIES, ROBOT
from tests.recordings.taking import BOTH
from transports.trace import TraceEntry, wall_ns

TSHARK = shutil.which("tshark")
pytestmark = pytest.mark.skipif(TSHARK is None, reason="there is no tshark here")
FRAME = (
    "frame.interface_name",
    "frame.time_epoch",
    "frame.packet_flags_direction",
    "frame.comment",
    "frame.len",
)
MEANING = ("mg.body", "mg.command", "mg.arguments", "mg.meaning", "mg.error")


def exported(recording: Path) -> tuple[Path, Path]:
    """Write a recording for Wireshark, with its dissector."""
    capture = recording.with_suffix(".pcapng")
    with opened(recording) as read, capture.open("wb") as file:
        write(read, file)
    script = recording.with_suffix(".lua")
    script.write_text(dissector(), "utf-8")
    return capture, script


def shown(capture: Path, script: Path, fields: Sequence[str], *more: str) -> list[list[str]]:
    """Ask TShark for fields of all packets."""
    words = [
        str(TSHARK),
        "-r",
        str(capture),
        "-X",
        f"lua_script:{script}",
        "-T",
        "fields",
        "-E",
        "separator=/t",
    ]
    words += [*more, *(word for field in fields for word in ("-e", field))]
    said = subprocess.run(words, capture_output=True, text=True, check=True)  # noqa: S603  # our own words
    assert "error" not in said.stderr.lower(), said.stderr
    return [line.split("\t") for line in said.stdout.splitlines()]


def told(entry: TraceEntry, line_id: str) -> list[str]:
    """A record as TShark has to show it."""
    seconds, nanoseconds = divmod(wall_ns(entry.at), 10**9)
    sent_or_received = entry.kind in ("rx", "tx")
    return [
        line_id,
        f"{seconds}.{nanoseconds:09d}",
        {"rx": "0x00000001", "tx": "0x00000002"}.get(entry.kind, ""),
        (entry.request_id or "") if sent_or_received else entry.kind,
        str(len(entry.data)),
    ]


def compare(recording: Path) -> int:
    """Compare each record with what TShark shows of it; gives how many there were."""
    capture, script = exported(recording)
    with opened(recording) as read:
        (line_id,) = read.manifest.lines
        entries = [entry for _, entry in read.entries(line_member(line_id))]
    assert shown(capture, script, FRAME) == [told(entry, line_id) for entry in entries]
    raw = subprocess.run(  # noqa: S603  # our own words
        [str(TSHARK), "-r", str(capture), "-x"], capture_output=True, text=True, check=True
    ).stdout
    digits = [line[6:53].replace(" ", "") for line in raw.splitlines() if line]
    assert bytes.fromhex("".join(digits)) == b"".join(entry.data for entry in entries)
    return len(entries)


@pytest.mark.parametrize("family", BOTH)
def test_every_record_and_byte_is_shown_as_it_was_recorded(family: str, tmp_path: Path) -> None:
    assert compare(BOTH[family](tmp_path)) > 100


@pytest.mark.prove
@pytest.mark.parametrize("family", BOTH)
def test_long_recordings_are_shown_as_they_were_recorded(family: str, tmp_path: Path) -> None:
    script = BODIES if family == "rorze" else ROBOT
    assert compare(BOTH[family](tmp_path, script * 20)) > 4000


def meanings(recording: Path, command: str, way: str) -> list[list[str]]:
    capture, script = exported(recording)
    only = ("-Y", f'mg.command == "{command}" && frame.packet_flags_direction == {way}')
    return shown(capture, script, MEANING, *only)


def test_frames_of_bodies_are_shown_with_body_command_arguments_and_meaning(tmp_path: Path) -> None:
    recording = BOTH["rorze"](tmp_path)
    title = COMMANDS["OHS"].titles()[1]
    assert ["00", "OHS", "50000", title, ""] in meanings(recording, "OHS", "2")
    assert ["00", "OHS", "", title, ""] in meanings(recording, "OHS", "1")
    (asked, *_) = meanings(recording, "6PD", "2")
    assert asked[:2] == ["00", "6PD"]
    refused = [row for row in meanings(recording, "1+M", "1") if row[4]]
    assert all(row[4][2:4] == "h " and len(row[4]) > 6 for row in refused)


def test_frames_of_robots_are_shown_with_command_arguments_and_meaning(tmp_path: Path) -> None:
    recording = BOTH["fics"](tmp_path)
    assert ["", "UNT", "2"] in [row[:3] for row in meanings(recording, "UNT", "2")]
    queries = {tuple(row) for row in meanings(recording, "UNT", "2")}
    assert len({row[3] for row in queries}) == 2, queries  # selecting a unit, and asking which is selected
    assert all(row[3] for row in meanings(recording, "APS", "1"))


@pytest.mark.parametrize("family", BOTH)
def test_every_frame_has_a_meaning(family: str, tmp_path: Path) -> None:
    capture, script = exported(BOTH[family](tmp_path))
    frames = shown(capture, script, ("mg.command", "mg.meaning"), "-Y", "mg.command")
    assert len({command for command, _ in frames}) > 10
    assert [row for row in frames if not row[1]] == []
