"""A process that is told to end, or is suspended: nothing moves for ever, and nothing begins late."""

import json
import os
import pty
import signal
import subprocess
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest
from websockets.sync.client import connect

from tests.e2e.processes import (
    BODIES,
    MOTION_GATEWAY,
    PATIENCE_S,
    Gateway,
    Program,
    SimulatedLine,
    SimulatedRobot,
    simulated_line,
    until,
)
from tests.open_access import OPEN

pytestmark = pytest.mark.prove

END_S = 40.0
"""A gateway that takes longer to end has hung."""
GOING_AWAY = 1001
LONG = 180_000
"""Pulses of a move that takes 5 s at the speeds of a new controller: time to end a gateway meanwhile."""
BEAT_S = 0.2
ROBOT_UNIT = '{ number = 1, axes = ["X", "Y", "Z"], motor_axes = ["A", "B", "Z"] }'
SUSPENDED_S = 2.6


class Cell:
    """A line with three bodies, a robot, and a gateway before both."""

    def __init__(self, folder: Path, line: SimulatedLine, robot: SimulatedRobot) -> None:
        self.folder, self.line, self.robot = folder, line, robot

    @contextmanager
    def gateway(self, **server: str) -> Iterator[Gateway]:
        """Run a gateway that works; `server` are keys of its configuration."""
        gateway = Gateway(self.config(**server))
        try:
            yield gateway.wait_until_ready()
        finally:
            gateway.kill()

    def config(self, **server: str) -> Path:
        """Write a configuration."""
        keys = "\n".join(f"{key} = {value}" for key, value in server.items())
        bodies = ", ".join(f'{{ id = "{body}" }}' for body in ("00", "01", "3F"))
        text = f"""
            [server]
            port = 0
            allow_endless_moves = true
            {keys}
            [[lines]]
            id = "line1"
            address = "{self.line.address(115_200)}"
            bodies = [{bodies}]
            reply_timeout_s = 0.2
            late_reply_s = 0.3
            poll_interval_s = 0.1
            [[lines]]
            id = "cell1"
            protocol = "fics"
            address = "serial://{self.robot.place}?baud=115200"
            robot = {{ id = "r1", units = [{ROBOT_UNIT}] }}
            reply_timeout_s = 0.2
            late_reply_s = 0.3
            poll_interval_s = 0.1
            {OPEN}
            """
        path = self.folder / "cell.toml"
        path.write_text(text, "utf-8")
        return path


@pytest.fixture(scope="module")
def plant(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Cell]:
    folder = tmp_path_factory.mktemp("life")
    with simulated_line(folder) as line:
        robot = SimulatedRobot(folder)
        yield Cell(folder, line, robot)
        robot.program.end()


@pytest.fixture
def cell(plant: Cell) -> Cell:
    """Each test knows nothing of what was before it; what one that has failed left moving loses its power."""
    for body in BODIES.split(","):
        if len(plant.line.truth("pulses_start", body)) > len(plant.line.truth("pulses_stop", body)):
            plant.line.tell("PUT", f"/bodies/{body}/power", on=False)
            plant.line.tell("PUT", f"/bodies/{body}/power", on=True)
    until(lambda: starts(plant.line) == ends(plant.line), "nothing moves")
    plant.line.begin_anew()
    plant.robot.begin_anew()
    return plant


def starts(line: SimulatedLine) -> int:
    return len(line.truth("pulses_start"))


def ends(line: SimulatedLine) -> int:
    return len(line.truth("pulses_stop"))


def why_it_stopped(line: SimulatedLine, body: str) -> str:
    """Wait for the end of a motor's only motion."""
    (stop,) = until(lambda: line.truth("pulses_stop", body), f"{body} stands still")
    return str(stop.facts["why"])


def endless(gateway: Gateway, body: str) -> None:
    content = {"kind": "continuous", "direction": "cw"}
    assert gateway.http.post(f"/bodies/{body}/moves", json=content).status_code == 202


def jogging(gateway: Gateway) -> str:
    """Let the robot's Z axis jog; gives the path of the session."""
    gateway.http.post("/robots/r1/errors/reset")  # a stop of the robot is an error, too
    answer = gateway.http.post("/robots/r1/jogs", json={"unit": 1, "axis": "Z", "direction": "-"})
    assert answer.status_code == 201, answer.text
    return str(answer.headers["location"])


@contextmanager
def heartbeats(gateway: Gateway, session: str) -> Iterator[list[int]]:
    """Send heartbeats until the block ends, each on a connection of its own; gives their statuses."""
    over, statuses = threading.Event(), list[int]()

    def send() -> None:
        try:
            statuses.append(httpx.post(f"{gateway.url}{session}/heartbeat", timeout=PATIENCE_S).status_code)
        except httpx.HTTPError:  # the gateway has ended
            statuses.append(0)

    with ThreadPoolExecutor(32) as threads:
        beat = threads.submit(lambda: [threads.submit(send) for _ in iter(lambda: over.wait(BEAT_S), True)])
        try:
            yield statuses
        finally:
            over.set()
            beat.result()


def robot_stands(robot: SimulatedRobot) -> bool:
    return len(robot.truth("motion_start")) == len(robot.truth("motion_stop"))


# told to end


@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGINT])
def test_what_would_never_end_is_stopped_and_what_goes_on_is_named(
    cell: Cell, number: signal.Signals
) -> None:
    with (
        cell.gateway() as gateway,
        ThreadPoolExecutor(1) as thread,
        connect(gateway.websocket) as client,
    ):
        endless(gateway, "3F")
        with heartbeats(gateway, jogging(gateway)):
            waiting = thread.submit(gateway.move, "00", LONG, 60)
            until(lambda: starts(cell.line) == 2, "both run")
            gateway.program.signal(number)
            events = [json.loads(text) for text in client]
            assert client.close_code == GOING_AWAY
            answer = waiting.result(END_S)
            # Who repeated a 500 would move the motor twice.
            assert answer.status_code == 202
            assert answer.json()["status"] in ("sent", "moving")
        words = gateway.program.words
        assert gateway.program.ended(END_S) == 0
    assert why_it_stopped(cell.line, "3F") != "done"
    assert robot_stands(cell.robot)
    assert "JOG Z" in cell.robot.heard("JOG")
    types = [event["type"] for event in events]
    at_end = types.index("gateway.shutting_down")
    assert "body.stop.confirmed" in types[at_end:]
    # On a busy machine a heartbeat may have come too late before that.
    assert "robot.jog.stopped" in types[at_end:] or "robot.jog.lost" in types[:at_end]
    (left,) = (event for event in events if event["type"].endswith("left_moving"))
    assert (left["subject"], left["data"]["move_id"]) == ("/bodies/line1.00", answer.json()["id"])
    assert types[-1] == "body.left_moving"
    assert number.name in words()
    assert "line1.00 is left moving" in words()
    assert "Traceback" not in words()
    # What the motor was told to do it does.
    assert why_it_stopped(cell.line, "00") == "done"
    assert len(cell.line.executed("1+M")) == 2


def test_every_motor_is_stopped_where_the_configuration_says_so(cell: Cell) -> None:
    with cell.gateway(on_exit='"stop"') as gateway, ThreadPoolExecutor(1) as thread:
        waiting = thread.submit(gateway.move, "00", LONG, 60)
        until(lambda: starts(cell.line) == 1, "it runs")
        gateway.program.signal(signal.SIGTERM)
        answer = waiting.result(END_S)
        assert (answer.status_code, answer.json()["status"]) == (200, "stopped")
        assert gateway.program.ended(END_S) == 0
        assert "left moving" not in gateway.program.words()
    assert why_it_stopped(cell.line, "00") != "done"


def test_a_closed_terminal_leaves_no_motor_moving(cell: Cell) -> None:
    ours, its = pty.openpty()
    program = subprocess.Popen(  # noqa: S603  # our own program at a terminal of its own
        [MOTION_GATEWAY, "serve", "--config", str(cell.config()), "--data", str(cell.folder / "terminal")],
        preexec_fn=lambda: os.login_tty(its),
    )
    os.close(its)
    try:
        said = b""
        while b"running on " not in said:
            said += os.read(ours, 4096)
        said += os.read(ours, 4096) if b"\n" not in said.partition(b"running on ")[2] else b""
        url = said.partition(b"running on ")[2].split()[0].decode()
        until(lambda: httpx.get(f"{url}/readyz").is_success, "the gateway is ready")
        content = {"kind": "continuous", "direction": "cw"}
        assert httpx.post(f"{url}/bodies/3F/moves", json=content).status_code == 202
        os.close(ours)
        assert program.wait(END_S) == 0
    finally:
        program.kill()
        program.wait()
    assert why_it_stopped(cell.line, "3F") != "done"


def test_a_configuration_is_read_again_while_a_move_goes_on(cell: Cell) -> None:
    with cell.gateway() as gateway:
        running = gateway.moving("00", LONG)
        text = cell.folder.joinpath("cell.toml").read_text("utf-8")
        wrong = cell.folder / "cell.toml"
        wrong.write_text(text.replace("reply_timeout_s = 0.2", "reply_timeot_s = 0.2"), "utf-8")
        gateway.program.signal(signal.SIGHUP)
        until(lambda: gateway.events("gateway.reload_failed"), "what is wrong is told")
        until(lambda: "did you mean reply_timeout_s?" in gateway.program.words(), "the log tells why")
        robot = text[text.rindex("[[lines]]") : text.rindex("robot = ")]
        wrong.write_text(text.replace(robot, robot + "trace_entries = 7\n"), "utf-8")
        gateway.program.signal(signal.SIGHUP)
        (reloaded,) = until(lambda: gateway.events("gateway.reloaded"), "it is read again")
        assert reloaded["data"]["lines"] == [
            {"line_id": "cell1", "change": "changed", "keys": ["trace_entries"]}
        ]
        assert gateway.ended("00", running["id"])["status"] == "succeeded"
        until(lambda: gateway.http.get("/lines/cell1").json()["state"] == "ready", "the robot is back")
        assert gateway.end(END_S) == 0
        assert "Traceback" not in gateway.program.words()


def test_a_second_signal_is_not_waited_after_but_the_stop_is_written(cell: Cell) -> None:
    with cell.gateway() as gateway:
        endless(gateway, "3F")
        cell.line.tell("PUT", "/bodies/3F/power", on=False)  # nobody will confirm anything
        gateway.program.signal(signal.SIGINT)
        until(lambda: "SIGINT: shutting down" in gateway.program.words(), "the first is heard")
        gateway.program.signal(signal.SIGINT)
        assert gateway.program.ended(END_S) == 0
        assert "SIGINT again: ending without waiting any longer" in gateway.program.words()
        assert "Standstill is not confirmed: use the hardware stop." in gateway.program.words()
    assert "&3F5SS" in cell.line.requests()
    cell.line.tell("PUT", "/bodies/3F/power", on=True)


def test_the_end_has_a_bound_where_nobody_answers(cell: Cell) -> None:
    with cell.gateway() as gateway, ThreadPoolExecutor(4) as threads:
        endless(gateway, "3F")
        cell.line.tell("PUT", "/link/power", on=False)
        stop = threads.submit(gateway.http.post, "/stop", json={"mode": "immediate"})
        reads = [
            threads.submit(httpx.get, f"{gateway.url}/bodies/{body}/position", timeout=END_S)
            for body in ("00", "01")
        ]
        time.sleep(0.1)
        began_at = time.monotonic()
        gateway.program.signal(signal.SIGTERM)
        statuses = [answer.result(END_S).status_code for answer in (stop, *reads)]
        assert gateway.program.ended(END_S) == 0
        assert time.monotonic() - began_at < END_S
        assert 500 not in statuses
        assert "line1.3F is left moving" in gateway.program.words()
        assert "Traceback" not in gateway.program.words()
    cell.line.tell("PUT", "/link/power", on=True)
    cell.line.tell("PUT", "/bodies/3F/power", on=False)
    cell.line.tell("PUT", "/bodies/3F/power", on=True)


def test_the_end_may_come_before_the_lines_are_set_up(cell: Cell) -> None:
    gateway = Gateway(cell.config())
    assert gateway.end(END_S) == 0
    assert "Traceback" not in gateway.program.words()


def test_a_gateway_that_is_told_to_end_while_it_starts_is_no_crash_to_the_next(tmp_path: Path) -> None:
    words = ("serve", "--demo", "--port", "0", "--data", str(tmp_path / "data"))
    program = Program(tmp_path / "first.log", *words)
    until((tmp_path / "data" / "journal.db").exists, "a journal has been begun")
    assert program.end(END_S) == 0, program.words()
    program = Program(tmp_path / "second.log", *words)
    program.said("running on")
    program.end(END_S)
    assert "did not end as it should" not in program.words()


def test_an_upload_is_broken_off_and_the_robot_takes_stops_again(cell: Cell) -> None:
    table = "number,X mm,Y mm,Z mm\n" + "".join(f"{number},1,2,3\n" for number in range(1, 2000))
    with cell.gateway() as gateway, ThreadPoolExecutor(1) as thread:
        path = f"{gateway.url}/robots/r1/units/1/positions.csv"
        uploading = thread.submit(
            httpx.put, path, content=table, headers={"content-type": "text/csv"}, timeout=END_S
        )
        until(lambda: len(cell.robot.heard("POS")) > 20, "the upload is under way")
        gateway.program.signal(signal.SIGTERM)
        answer = uploading.result(END_S)
        assert answer.status_code == 409
        assert "the gateway is shutting down" in answer.json()["detail"]
        assert gateway.program.ended(END_S) == 0
    assert cell.robot.heard("POF")[-1] == "POF 2"
    assert len(cell.robot.heard("POS")) < 1999


def test_the_demo_ends_cleanly(tmp_path: Path) -> None:
    demo = Program(tmp_path / "demo.log", "serve", "--demo", "--port", "0")
    url = demo.said(r"running on (http://[0-9.]+:\d+)")[1]
    until(lambda: httpx.get(f"{url}/readyz").is_success, "the demo is ready")
    content = {"kind": "relative", "direction": "cw", "distance": {"value": LONG, "unit": "pulse"}}
    assert httpx.post(f"{url}/bodies/3F/moves", json=content).status_code == 202
    assert demo.end(END_S) == 0
    assert "line1.3F is left moving" in demo.words()
    assert "Traceback" not in demo.words()


# suspended


def test_what_was_asked_for_while_the_process_was_suspended_does_not_begin_late(cell: Cell) -> None:
    with cell.gateway() as gateway, ThreadPoolExecutor(8) as threads:
        gateway.begin_anew()
        running = gateway.moving("00", LONG)
        session = jogging(gateway)

        def post(path: str, content: object = None) -> "Future[httpx.Response]":
            return threads.submit(httpx.post, gateway.url + path, json=content, timeout=END_S)

        with heartbeats(gateway, session):
            until(lambda: len(cell.robot.truth("motion_start")) == 1, "the axis jogs")
            gateway.program.signal(signal.SIGSTOP)
            move: dict[str, Any] = {"kind": "relative", "direction": "cw"}
            late = [
                post("/bodies/3F/moves", move | {"distance": {"value": 1000, "unit": "pulse"}}),
                post("/bodies/3F/commands/set-start-speed", {"speed_set": 1, "speed": 1000}),
                post("/robots/r1/units/1/moves", {"kind": "home"}),
            ]
            time.sleep(SUSPENDED_S)
            stop = post("/bodies/01/stop", {"mode": "immediate"})
            gateway.program.signal(signal.SIGCONT)
            answers = [answer.result(END_S) for answer in late]
            assert [answer.status_code for answer in answers] == [503] * 3
            assert {answer.json()["type"].rpartition(":")[2] for answer in answers} == {"held-up"}
            assert {answer.json()["moved"] for answer in answers} == {"no"}
            assert stop.result(END_S).json()["confirmed"]
            until(lambda: robot_stands(cell.robot), "the axis is stopped whatever heartbeats wait")

        assert not cell.line.executed("OLS")
        assert [fact.body for fact in cell.line.executed("1+M")] == ["00"]
        assert not cell.robot.heard("ORG")
        told = [event["data"] for event in gateway.events("gateway.loop.held")]
        (held,) = [data for data in told if data["cancelled"]]  # a busy machine holds it up for less, too
        assert held["seconds"] > SUSPENDED_S - 0.1
        until(lambda: gateway.events("robot.jog.lost"), "the JOG is told to be lost")
        assert "suspended or held up for" in gateway.program.words()
        # The move that ran is followed, and afterwards everything works as before.
        assert gateway.ended("00", running["id"])["status"] == "succeeded"
        until(lambda: gateway.move("3F", 300, wait=10).is_success, "moves are admitted again")
        assert gateway.end(END_S) == 0
