"""The truth log remembers, forgets and writes."""

import io
import json

from simulator.truth import Fact, TruthLog


def test_facts_are_found_by_kind_and_body() -> None:
    truth = TruthLog()
    truth.log("start", 1.0, 0x3F, position=0)
    truth.log("stop", 2.0, 0x3F, position=500)
    truth.log("stop", 3.0, 0x00, position=7)
    assert truth.of("stop", 0x3F) == [Fact("stop", 2.0, 0x3F, None, {"position": 500})]
    assert [fact.at for fact in truth.of("stop")] == [2.0, 3.0]
    assert [fact.kind for fact in truth] == ["start", "stop", "stop"]


def test_a_fact_carries_the_request_that_brought_it_about() -> None:
    truth = TruthLog()
    truth.request = 17
    truth.log("start", 1.0, 0x3F)
    truth.request = None
    truth.log("stop", 2.0, 0x3F)
    assert [fact.request for fact in truth] == [17, None]


def test_a_bounded_log_forgets_the_oldest_and_still_counts() -> None:
    truth = TruthLog(capacity=3)
    for second in range(5):
        truth.log("stop", float(second), 0)
    assert truth.count == 5
    assert [fact.at for fact in truth.since(0)] == [2.0, 3.0, 4.0]
    assert [fact.at for fact in truth.since(4)] == [4.0]
    assert truth.since(5) == []


def test_a_sink_gets_every_fact_as_a_line_of_json() -> None:
    sink = io.StringIO()
    truth = TruthLog(capacity=1, sink=sink)
    truth.log("start", 1.5, 0x0A, position=0, pattern=None)
    truth.log("stop", 2.5, 0x0A, cause=4)
    assert [json.loads(line) for line in sink.getvalue().splitlines()] == [
        {"kind": "start", "time_s": 1.5, "body": "0A", "request": None, "position": 0, "pattern": None},
        {"kind": "stop", "time_s": 2.5, "body": "0A", "request": None, "cause": 4},
    ]
