"""Recordings as MCAP, for Foxglove and PlotJuggler: live values, traces, samples and events on one time axis.

A channel is a topic with JSON: `/lines/ID/trace` has the records of a line; `/bodies/ID`, `/robots/ID` and
so on each thing as it was told; `/samples/ID` where its motors were seen; `/events` what happened.
"""

import csv
import json
from collections.abc import Iterator, Mapping
from datetime import datetime
from itertools import groupby
from typing import Any, BinaryIO, Final

from recordings.form import EVENTS, SAMPLES, STATES, Recording, line_member
from transports.trace import escape, wall_ns

_KEYS: Final = {
    "lines": "line_id",
    "bodies": "body_id",
    "groups": "group_id",
    "scaras": "scara_id",
    "robots": "robot_id",
}
"""The key by which the things of each list are called."""
_OBJECT: Final = json.dumps({"type": "object"}).encode()

Message = tuple[int, str, Mapping[str, Any]]
"""Wall time in ns, the topic, and what is told."""


def write(recording: Recording, file: BinaryIO) -> int:
    """Write all of a recording; gives how many messages there were.

    :raises ImportError: the extra `mcap` is not installed.
    :raises NotARecording: a part of it cannot be read.
    :raises OSError: the file cannot be written.
    """
    from mcap.writer import Writer  # an extra

    writer, channels, count = Writer(file), dict[str, int](), 0
    writer.start(profile="", library=f"motion-gateway {recording.manifest.gateway}")
    schema = writer.register_schema("object", "jsonschema", _OBJECT)
    for at_ns, topic, told in messages(recording):
        if topic not in channels:
            channels[topic] = writer.register_channel(topic, "json", schema)
        writer.add_message(channels[topic], at_ns, json.dumps(told).encode(), at_ns)
        count += 1
    writer.finish()  # type: ignore[no-untyped-call]  # of the library
    return count


def messages(recording: Recording) -> Iterator[Message]:
    """Give what a recording holds, each part in the order of time; errors as of `Recording.rows`."""
    clocks = recording.manifest.clocks
    began_ns = wall_ns(clocks.at) - clocks.monotonic_ns
    for line_id in recording.manifest.lines:
        for _, entry in recording.entries(line_member(line_id)):
            told = {"kind": entry.kind, "data": escape(entry.data)}
            asked = {"caller": entry.caller, "request_id": entry.request_id}
            yield began_ns + entry.monotonic_ns, f"/lines/{line_id}/trace", {**told, **asked}
    for _, row in recording.rows(STATES):
        yield from _states(began_ns + row["monotonic_ns"], row["path"], row["state"])
    for _, row in recording.rows(EVENTS):
        yield wall_ns(datetime.fromisoformat(row["time"])), "/events", row
    yield from _samples(recording)


def _states(at_ns: int, path: str, state: Mapping[str, Any]) -> Iterator[Message]:
    """Give each thing of a list by itself, and a list without names as it is."""
    name = path.strip("/")
    if (key := _KEYS.get(name)) is None:
        yield at_ns, path, state
        return
    for document in state[name]:
        yield at_ns, f"{path}/{document[key]}", document


def _samples(recording: Recording) -> Iterator[Message]:
    """Give where motors were seen: the axes of one moment together, one without a name as `position`."""
    rows = csv.DictReader(recording.text(SAMPLES).splitlines())
    for (time, body_id, move_id), axes in groupby(
        rows, lambda sample: (sample["time"], sample["body_id"], sample["move_id"])
    ):
        places = {sample["axis"] or "position": _number(sample["position"]) for sample in axes}
        yield wall_ns(datetime.fromisoformat(time)), f"/samples/{body_id}", {"move_id": move_id, **places}


def _number(text: str) -> float | None:
    """A position; None while it is unknown."""
    return float(text) if text else None
