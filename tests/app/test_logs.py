"""The log: one line each, whatever it tells of, for people, for machines and for the journal of systemd."""

import json
import logging
import os
import re
from io import StringIO
from pathlib import Path
from typing import Any

import pytest

from app.logs import (
    ENDS_AT_ONCE,
    LINES_AT_ONCE,
    JournalLines,
    JsonLines,
    TextLines,
    formatter_for,
    logging_to,
)
from gateway.core.origin import ORIGIN, Origin

log = logging.getLogger("tests.logs")
FACTS: dict[str, Any] = {"caller": "pat", "request_id": "r-1", "move_id": None}


def written(wanted: logging.Formatter, message: str = "it moved", **facts: object) -> str:
    record = logging.LogRecord("gateway", logging.WARNING, "", 0, "%s", (message,), None)
    record.facts = facts
    return wanted.format(record)


def test_text_has_time_level_name_and_facts() -> None:
    line = written(TextLines(), **FACTS)
    assert re.fullmatch(
        r"\d{4}-\d\d-\d\dT[\d:.]+[+-]\d\d:\d\d WARNING gateway: it moved \[caller=pat request_id=r-1\]", line
    )


def test_a_fact_of_several_words_is_quoted() -> None:
    assert written(TextLines(), caller="http 10.0.0.7").endswith('[caller="http 10.0.0.7"]')


@pytest.mark.parametrize(
    ("value", "shown"),
    [
        ('mes" request_id="r-2', '"mes\\" request_id=\\"r-2"'),
        ("a\\", '"a\\\\"'),
        ("mes]", '"mes]"'),
        ("a=b", '"a=b"'),
        ("mes\trole=admin", '"mes\trole=admin"'),
        ("", '""'),
    ],
)
def test_no_value_ends_itself_or_begins_another_fact(value: str, shown: str) -> None:
    assert written(TextLines(), caller=value).endswith(f" [caller={shown}]")


def test_json_has_each_fact_as_a_member() -> None:
    told = json.loads(written(JsonLines(), **FACTS))
    assert told.pop("time").endswith("+00:00")
    assert told == {
        "level": "warning",
        "logger": "gateway",
        "message": "it moved",
        "caller": "pat",
        "request_id": "r-1",
    }


@pytest.mark.parametrize("kind", [TextLines, JournalLines, JsonLines])
def test_nobody_makes_two_lines_of_one(kind: type[logging.Formatter]) -> None:
    line = written(kind(), "one\n2026 INFO gateway: two\r\x1b[2J\x85\u2028", caller="pat\nkim")
    assert len(line.splitlines()) == 1
    assert "\x1b" not in line


def test_the_journal_of_systemd_is_given_priorities(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    assert written(JournalLines()) == "<4>gateway: it moved"
    with (tmp_path / "journal").open("w") as stream:
        assert isinstance(formatter_for("text", stream), TextLines)
        found = os.fstat(stream.fileno())
        monkeypatch.setenv("JOURNAL_STREAM", f"{found.st_dev}:{found.st_ino}")
        assert isinstance(formatter_for("text", stream), JournalLines)
        assert isinstance(formatter_for("json", stream), JsonLines)


def test_a_traceback_follows_its_sentence() -> None:
    stream = StringIO()
    with logging_to(stream, "info", "text"):
        try:
            int("broken")
        except ValueError:
            log.exception("it failed")
    assert "it failed\nTraceback" in stream.getvalue()


def test_what_is_below_the_level_is_left_out_and_all_else_is_there_at_the_end() -> None:
    stream = StringIO()
    with logging_to(stream, "warning", "json"):
        for number in range(100):
            log.info("a %d", number)
            log.warning("b %d", number)
    told = [json.loads(line)["message"] for line in stream.getvalue().splitlines()]
    assert told == [f"b {number}" for number in range(100)]


def test_what_is_logged_is_said_as_it_was_then() -> None:
    stream, moves = StringIO(), ["a"]
    with logging_to(stream, "info", "text"):
        log.info("%s", moves)
        moves.append("b")
    assert "['a']" in stream.getvalue()


def test_the_writer_lets_lines_gather_instead_of_waking_for_each(monkeypatch: pytest.MonkeyPatch) -> None:
    stream, slept = StringIO(), list[float]()

    def sleep(seconds: float) -> None:
        slept.append(seconds)
        if len(slept) == 1:
            for name in ("one", "two", "three"):
                log.warning(name)

    monkeypatch.setattr("app.logs.time.sleep", sleep)
    with logging_to(stream, "info", "text"):
        while "three" not in stream.getvalue():
            os.sched_yield()
    assert [line.rpartition(" ")[2] for line in stream.getvalue().splitlines()] == ["one", "two", "three"]
    assert len(slept) <= 3


def refused_by(address: str, logger: str, times: int, key: str = "", level: int = logging.INFO) -> None:
    caller = f"{key} (http {address})" if key else f"http {address}"
    before = ORIGIN.set(Origin(caller, address=address))
    for number in range(times):
        logging.getLogger(logger).log(level, "%s refused with 404", f"/x{number}")
    ORIGIN.reset(before)


def test_no_client_fills_the_log_and_others_are_still_told_of() -> None:
    stream = StringIO()
    with logging_to(stream, "info", "text"):
        refused_by("10.0.0.7", "api.common.problems", 2000)
        refused_by("10.0.0.8", "api.common.problems", 1)
        refused_by("10.0.0.8", "api.front.connections", 1)
    lines = stream.getvalue().splitlines()
    assert LINES_AT_ONCE <= len(lines) - 2 <= LINES_AT_ONCE + 20  # and a few a second
    left_out = [int(number) for number in re.findall(r"left_out_before=(\d+)", stream.getvalue())]
    assert sum(left_out) == 2002 - len(lines)


def test_an_address_of_the_same_ipv6_network_is_no_other_client() -> None:
    stream = StringIO()
    with logging_to(stream, "info", "text"):
        for number in range(1000):
            refused_by(f"fd00::{number:x}", "uvicorn.error", 1)
    assert len(stream.getvalue().splitlines()) <= LINES_AT_ONCE + 20


def test_a_key_that_is_used_from_many_addresses_is_one_client() -> None:
    stream = StringIO()
    with logging_to(stream, "info", "text"):
        for number in range(1000):
            refused_by(f"10.{number // 250}.{number % 250}.1", "api.common.problems", 1, key="mes")
        refused_by("10.0.0.1", "api.common.problems", 1, key="press")
    assert LINES_AT_ONCE < len(stream.getvalue().splitlines()) <= LINES_AT_ONCE + 21


def test_what_a_motor_did_is_left_out_only_where_one_client_stops_it_without_an_end() -> None:
    stream = StringIO()
    with logging_to(stream, "info", "text"):
        refused_by("10.0.0.7", "gateway.logbook", ENDS_AT_ONCE)
        assert "left_out" not in stream.getvalue()
        refused_by("10.0.0.7", "gateway.logbook", 2000)
        refused_by("10.0.0.8", "gateway.logbook", 100)
    assert ENDS_AT_ONCE + 100 <= len(stream.getvalue().splitlines()) <= ENDS_AT_ONCE + 200


def test_no_warning_about_a_motor_is_left_out_nor_what_the_gateway_did_itself() -> None:
    stream = StringIO()
    with logging_to(stream, "info", "text"):
        refused_by("10.0.0.7", "gateway.rorze.moves", 1000, level=logging.WARNING)
        refused_by("", "gateway.rorze.moves", 1000)
    assert len(stream.getvalue().splitlines()) == 2000
