import re
import subprocess
import sys
from pathlib import Path

import pytest

from benchmarks.console import CHROMIUM
from benchmarks.figures import Figure, Target, table
from benchmarks.floods import FLOODS
from benchmarks.http_client import is_complete

pytestmark = pytest.mark.prove

ROOT = Path(__file__).parents[2]
YARDSTICKS = {9600: "the wire's time", 38400: "the wire's time", 115200: "a bare program's"}
ROW = re.compile(r"(?P<name>.+?)  .*(ratio|figure) (>=|<=) \S+ +(reached|MISSED)")


@pytest.mark.parametrize(
    ("benchmark", "names"),
    [
        ("line-use", [f"line use at {baud} baud: of {whose}" for baud, whose in YARDSTICKS.items()]),
        (
            "bulk",
            [
                f"{work}: of {whose}"
                for work in (
                    "upload of 2000 instructions",
                    "download of 2048 positions",
                    "backup of a body",
                )
                for whose in ("the wire's time", "a bare program's")
            ],
        ),
        ("start", ["start to /readyz: processor", "memory when ready"]),
        (
            "opcua",
            [
                "OPC UA, 120 axes: start to ready",
                "OPC UA, 120 axes: memory",
                "OPC UA, 1200 items, 1200/s: p99",
                "OPC UA, 1200 changes/s: processor",
            ],
        ),
        (
            "http-read",
            [
                "HTTP read, 1 client: p50",
                "HTTP read, 16 clients",
                "HTTP read, 16 clients: beside a bare application on such a line",
                "HTTP settings, 16 clients: beside a bare application with disk and fence",
            ],
        ),
        (
            "http-cost",
            [
                *(f"GET {path}: processor" for path in ("/bodies/{body_id}", "/lines", "/moves/{move_id}")),
                "GET /bodies of 120: processor",
                "POST commands, 16 clients: processor",
                "the same beside a hop with disk and fence",
            ],
        ),
        (
            "first-byte",
            [
                *(f"{method} to first byte: p50" for method in ("GET", "POST")),
                "POST to first byte, beyond a bare fsync: p50",
            ],
        ),
        ("stop-latency", [f"stop among hostile clients: {which}" for which in ("p99.9", "max")]),
        ("dpram", ["DPRAM round trip: p50", "DPRAM idle"]),
        ("fan-out", ["event to 100 subscribers: a message", "moves with 100 subscribers"]),
        (
            "floods",
            [
                f"{what} among {len(FLOODS)} kinds of floods{which}"
                for what, which in (
                    ("stop", ": p50"),
                    ("stop", ": p99"),
                    ("heartbeat", ": longest"),
                    ("dead man's switch", ": longest"),
                    ("turn of the loop", ": longest"),
                    ("wrong answers", ""),
                )
            ],
        ),
        (
            "crowd",
            [
                *(f"stop among 1000 subscribers: {which}" for which in ("p50", "p99")),
                "memory among them",
                "memory when they have left",
            ],
        ),
        ("garbage", ["longest collection under moves"]),
        ("move-cost", ["move: processor time", "memory after moves", "memory after 400 moves"]),
        ("live-values", [f"120 bodies watched: {what}" for what in ("a processor", "values")]),
        pytest.param(
            "console",
            [f"console of 120 bodies: {what}" for what in ("a processor", "frames", "its memory")],
            marks=pytest.mark.skipif(not CHROMIUM, reason="make test installs Chromium"),
        ),
        ("key-cost", ["read with a checked key: processor"]),
        ("tls-crowd", ["stop among 200 readers and 100 subscribers over TLS: p99"]),
        pytest.param(
            "pages",
            [
                "pages: longest hold of the loop",
                "console: first paint",
                "/docs: all its sections",
                "stop while documents are fetched: p99.9",
            ],
            marks=pytest.mark.skipif(not CHROMIUM, reason="make test installs Chromium"),
        ),
    ],
)
def test_a_benchmark_runs_and_prints_its_figures(benchmark: str, names: list[str]) -> None:
    program = [sys.executable, "-m", "benchmarks", "--only", benchmark, "--seconds", "0.2"]
    done = subprocess.run(program, cwd=ROOT, capture_output=True, text=True, check=False)  # noqa: S603
    assert done.returncode == 0, done.stderr
    head, *rows = done.stdout.splitlines()
    assert head.split() == ["benchmark", "unit", "measured", "yardstick", "ratio", "target"]
    assert [match["name"] for row in rows if (match := ROW.fullmatch(row))] == names


def figure(measured: list[float], yardstick: list[float], target: Target) -> Figure:
    return Figure("speed", "m/s", measured, yardstick, target)


def test_each_measurement_is_compared_with_the_yardstick_of_its_own_round() -> None:
    found = figure([10, 30, 80], [10, 20, 40], Target("ratio", "<=", 1.5))
    assert found.ratios == [1, 1.5, 2]
    assert found.reached


@pytest.mark.parametrize(
    ("target", "reached"),
    [
        (Target("figure", "<=", 2), True),
        (Target("figure", "<=", 1.9), False),
        (Target("ratio", ">=", 0.5), True),
        (Target("ratio", ">=", 0.51), False),
    ],
)
def test_the_median_decides_whether_a_target_is_reached(target: Target, reached: bool) -> None:
    found = figure([1, 2, 9], [4, 4, 4], target)
    assert found.reached is reached
    assert table([found]).endswith("reached" if reached else "MISSED")


def test_a_yardstick_of_zero_gives_an_endless_ratio() -> None:
    found = figure([1, 1, 1], [0, 0, 0], Target("figure", "<=", 2))
    assert "inf" in table([found])
    assert found.reached


def test_the_table_gives_the_median_and_the_spread() -> None:
    assert "2 (1-9)" in table([figure([1, 2, 9], [4, 4, 4], Target("figure", "<=", 2))])


def test_a_response_is_complete_when_all_its_bytes_are_there() -> None:
    whole = b"HTTP/1.1 200 OK\r\ncontent-length: 5\r\ncontent-type: text/plain\r\n\r\nhello"
    assert [end for end in range(len(whole) + 1) if is_complete(whole[:end])] == [len(whole)]


def test_a_failed_request_is_not_measured() -> None:
    with pytest.raises(RuntimeError, match=r"a request failed: HTTP/1\.1 404"):
        is_complete(b"HTTP/1.1 404 Not Found\r\ncontent-length: 0\r\n\r\n")
