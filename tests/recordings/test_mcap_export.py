"""Exports as MCAP, read back by the library's own reader: nothing is lost, and all is on one time axis."""

import json
from collections import defaultdict
from pathlib import Path
from typing import Any

import pytest
from mcap.reader import make_reader

from recordings.form import EVENTS, SAMPLES, STATES, line_member, opened
from recordings.mcap_export import write
from tests.recordings.taking import BOTH
from transports.trace import escape, wall_ns

NS_OF_US = 1_000
"""Wall times are recorded in microseconds."""
Topics = dict[str, list[tuple[int, Any]]]


def topics_of(recording: Path) -> Topics:
    """Export a recording, and read its topics as others do."""
    path, found = recording.with_suffix(".mcap"), defaultdict(list)
    with opened(recording) as read, path.open("wb") as file:
        count = write(read, file)
    with path.open("rb") as file:
        last_ns = 0
        for schema, channel, message in make_reader(file).iter_messages():
            assert schema is not None
            assert (schema.encoding, channel.message_encoding) == ("jsonschema", "json")
            assert message.log_time >= last_ns
            last_ns = message.log_time
            found[channel.topic].append((message.log_time, json.loads(message.data)))
    assert sum(map(len, found.values())) == count
    return dict(found)


@pytest.mark.parametrize("family", BOTH)
def test_each_record_event_and_sample_is_there_at_its_time(family: str, tmp_path: Path) -> None:
    recording = BOTH[family](tmp_path)
    topics = topics_of(recording)
    with opened(recording) as read:
        (line_id,) = read.manifest.lines
        entries = [entry for _, entry in read.entries(line_member(line_id))]
        trace = topics[f"/lines/{line_id}/trace"]
        told = [(record["kind"], record["data"], record["request_id"]) for _, record in trace]
        assert told == [(entry.kind, escape(entry.data), entry.request_id) for entry in entries]
        assert (
            max(abs(at - wall_ns(entry.at)) for (at, _), entry in zip(trace, entries, strict=True)) < NS_OF_US
        )
        assert [event for _, event in topics["/events"]] == [event for _, event in read.rows(EVENTS)]
        samples = read.text(SAMPLES).splitlines()[1:]
        seen = [sample for name, told in topics.items() if name.startswith("/samples/") for _, sample in told]
        assert sum(len(way) - 1 for way in seen) == len(samples) > 0


def test_live_values_are_numbers_of_a_topic_of_each_body(tmp_path: Path) -> None:
    recording = BOTH["rorze"](tmp_path)
    topics = topics_of(recording)
    with opened(recording) as read:
        told = [row["state"]["bodies"] for _, row in read.rows(STATES) if row["path"] == "/bodies"]
    values = [state["position"] for _, state in topics["/bodies/line1.3F"]]
    assert values == [body["position"] for bodies in told for body in bodies if body["body_id"] == "line1.3F"]
    assert len(set(values)) > 2
    assert all(isinstance(sample["position"], float) for _, sample in topics["/samples/line1.3F"])


def test_live_values_traces_and_events_share_one_time_axis(tmp_path: Path) -> None:
    topics = topics_of(BOTH["rorze"](tmp_path))
    started = next(at for at, event in topics["/events"] if event["type"] == "body.move.started")
    before, after = (
        [state["moving"] for at, state in topics["/bodies/line1.3F"] if (at > started) is late]
        for late in (False, True)
    )
    assert True not in before
    assert True in after
    ((sent, _),) = [
        record for record in topics["/lines/line1/trace"] if record[1]["data"].startswith("&3F1+M20000")
    ]
    assert 0 <= started - sent < 1e9
