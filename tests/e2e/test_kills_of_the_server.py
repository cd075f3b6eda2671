"""kill -9 of the whole server under load, motors moving: nothing twice, nothing lost that was answered."""

import json
import os
import signal
import sqlite3
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import count
from pathlib import Path
from random import Random
from typing import Any

import httpx
import pytest
from websockets.exceptions import ConnectionClosed, InvalidMessage
from websockets.sync.client import connect

from gateway.core.journal import files
from tests.e2e.processes import (
    BODIES,
    PATIENCE_S,
    SimulatedLine,
    SimulatedRobot,
    simulated_line,
    simulated_robot,
    until,
    write_config,
)
from tests.fics_plants import SCARA

pytestmark = pytest.mark.prove

KILLS = 60
ANSWERS = 60
"""Before as many answers, or fewer, a server is killed."""
LONGEST_S = 5.0
"""No server lives longer."""
SHORTEST = 2_000
"""Pulses of a move that takes a moment at the speeds of a new controller."""
STROKE_MM = 40.0
ENTRIES, VARIABLES = 16, 100
ENDED_S = 60.0
TLS = httpx.create_ssl_context()
"""One context for all: to make one takes longer than a request."""


@dataclass
class Parent:
    """Starts one server after the other, and kills it."""

    config: Path
    data: Path
    lives: int = 0
    process_id: int = 0

    def __post_init__(self) -> None:
        program = [sys.executable, "-m", "tests.e2e.killed_server", str(self.config), str(self.data)]
        self._process = subprocess.Popen(  # noqa: S603  # our own program
            program, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
        )

    def start(self) -> str:
        """Begin a life; gives its address."""
        self.lives += 1
        log = self.config.with_name(f"server-{self.lives}.log")
        assert self._process.stdin
        assert self._process.stdout
        self._process.stdin.write(f"{log}\n")
        self._process.stdin.flush()
        self.process_id = int(self._process.stdout.readline())
        return until(partial(_address, log), "the server runs")

    def kill(self) -> None:
        """End the life at once."""
        os.kill(self.process_id, signal.SIGKILL)

    def end(self) -> None:
        """There is no next life."""
        with suppress(ProcessLookupError):
            self.kill()
        self._process.communicate()


def _address(log: Path) -> str:
    words = log.read_text("utf-8") if log.exists() else ""
    _, running, address = words.partition("running on ")
    return address.split()[0] if running and "\n" in address else ""


Content = dict[str, object]


@dataclass
class Mover:
    """Wants one move after the other, each with a key: without an answer it asks again in the next life."""

    moves: str
    """The path of its moves."""
    content: Callable[[int], Content]
    numbers: Iterator[int]
    asked: tuple[str, Content] | None = None
    answered: list[str] = field(default_factory=list)
    """The ids of its moves."""

    def work(self, http: httpx.Client) -> None:
        number = next(self.numbers)
        key, content = self.asked = self.asked or (f"{self.moves}-{number}", self.content(number))
        answer = http.post(self.moves, json=content, headers={"Idempotency-Key": key})
        if answer.is_success:
            move_id = answer.json()["id"]
            self.answered = [*dict.fromkeys([*self.answered, move_id])]  # one that was repeated is the same
            http.get(f"{self.moves}/{move_id}", params={"wait": 5})
        elif answer.json().get("moved") == "no":  # the key is not used up
            time.sleep(0.05)
            return
        self.asked = None


def by_pulses(number: int) -> Content:
    """A move of a body like no other of it."""
    distance = {"value": SHORTEST + number, "unit": "pulse"}
    return {"kind": "relative", "direction": "cw" if number % 2 else "ccw", "distance": distance}


def to_place(number: int) -> Content:
    """A move of a robot to a place of its own, far from the one before."""
    z = -number / 1000 - (number % 2) * STROKE_MM / 2
    return {"kind": "absolute", "axes": {"Z": {"value": round(z, 3), "unit": "mm"}}}


@dataclass
class Setter:
    """Writes one entry of a table after the other."""

    path: str
    content: Callable[[int], Content]
    frame: Callable[[int], str]
    """The frame that is sent for each request."""
    numbers: Iterator[int]
    answered: list[int] = field(default_factory=list)

    def work(self, http: httpx.Client) -> None:
        number = next(self.numbers)
        if http.post(self.path, json=self.content(number)).is_success:
            self.answered.append(number)
        time.sleep(0.01)

    def written(self) -> list[str]:
        """The commands that were answered."""
        return [self.frame(number) for number in self.answered]


def entry(number: int) -> Content:
    """An entry of a body's position table."""
    return {"entry": {"position": number % ENTRIES}, "pulses": number}


def variable(number: int) -> Content:
    """A variable of a robot."""
    return {"number": number % VARIABLES, "value": number}


def movers() -> list[Mover]:
    """One for each body, and one for the robot."""
    bodies = [Mover(f"/bodies/{body}/moves", by_pulses, count(1)) for body in BODIES.split(",")]
    return [*bodies, Mover("/robots/r1/units/1/moves", to_place, count(1))]


def setters() -> list[Setter]:
    """One for each body, and one for the robot."""

    def of_body(body: str) -> Setter:
        path = f"/bodies/{body}/commands/set-position-entry"
        return Setter(path, entry, lambda number: f"&{body}3PSP[{number % ENTRIES}],{number}", count(1))

    path = "/robots/r1/commands/set-variable"
    robot = Setter(path, variable, lambda number: f"VAR V{number % VARIABLES:02}={number}", count(1))
    return [*map(of_body, BODIES.split(",")), robot]


@dataclass
class Follower:
    """Reads the events of all lives, from where it has been."""

    cursor: str
    told: list[dict[str, Any]] = field(default_factory=list)

    def stream(self, http: httpx.Client) -> None:
        with http.stream("GET", "/events/stream", headers={"Last-Event-ID": self.cursor}) as answer:
            for line in answer.iter_lines():
                name, _, value = line.partition(": ")
                if name == "data":
                    self._take(value)

    def socket(self, http: httpx.Client) -> None:
        address = str(http.base_url).replace("http", "ws", 1).rstrip("/")
        with connect(f"{address}/events?after={self.cursor}") as client:
            for text in client:
                self._take(str(text))

    def page(self, http: httpx.Client) -> None:
        while events := _get(http, f"/events?limit=1000&after={self.cursor}")["events"]:
            for event in events:
                self._take(json.dumps(event))

    def _take(self, text: str) -> None:
        self.told.append(json.loads(text))
        self.cursor = self.told[-1]["cursor"]


def _client(address: str, timeout_s: float = PATIENCE_S) -> httpx.Client:
    return httpx.Client(base_url=address, timeout=timeout_s, verify=TLS)


def _get(http: httpx.Client, path: str) -> Any:
    return http.get(path).raise_for_status().json()


def _again_and_again(work: Callable[[httpx.Client], object], address: str) -> None:
    """Go on until the server is killed."""
    with (
        _client(address) as http,
        suppress(httpx.TransportError),
    ):
        while True:
            work(http)


def _until_killed(read: Callable[[httpx.Client], object], address: str) -> None:
    with (
        _client(address) as http,
        suppress(httpx.TransportError, ConnectionClosed, InvalidMessage, OSError),
    ):
        read(http)


@contextmanager
def parent_of_servers(line: SimulatedLine, robot: SimulatedRobot, data: Path) -> Iterator[Parent]:
    config = write_config(line, "gateway")
    with config.open("a", encoding="utf-8") as text:
        text.write(
            f'[[lines]]\nid = "cell"\nprotocol = "fics"\naddress = "{robot.address}"\n'
            f'robot = {{id = "r1", units = [{SCARA}]}}\n'
        )
    parent = Parent(config, data)
    try:
        yield parent
    finally:
        parent.end()


@pytest.mark.long
@pytest.mark.timeout(900)
def test_a_server_that_is_killed_60_times_does_nothing_twice_and_forgets_nothing(tmp_path: Path) -> None:
    data, dice = tmp_path / "data", Random(1)
    moving, setting = movers(), setters()
    with (
        simulated_line(tmp_path) as line,
        simulated_robot(tmp_path) as robot,
        parent_of_servers(line, robot, data) as parent,
    ):
        begin, followers = "", list[Follower]()
        for _ in range(KILLS):
            address = parent.start()
            with _client(address) as http:
                if not begin:
                    _home(http)
                    begin = _get(http, "/events")["cursor"]
                    followers = [Follower(begin), Follower(begin)]
                _look_for_all(http, moving)
            _live_and_die(parent, address, moving, setting, followers, dice)
        with _client(parent.start(), PATIENCE_S + ENDED_S) as http:
            until(lambda: http.get("/readyz").is_success, "the server is ready")
            moves = _look_for_all(http, moving, wait_s=ENDED_S)
            for follower in followers:
                follower.page(http)
            everything = Follower(begin)
            everything.page(http)
        done = [
            f"&{fact.body}{fact.facts['text']}"
            for code in ("1+M", "1-M", "3PS")
            for fact in line.executed(code)
        ]
        done += robot.heard("LMA") + [text for text in robot.heard("VAR") if "=" in text]

    assert [what for what, times in Counter(done).items() if times > 1] == []
    assert len(done) > 10 * KILLS
    _check_intents(data, done)
    _check_moves(moves)
    assert [frame for setter in setting for frame in setter.written() if frame not in set(done)] == []
    for follower in followers:
        _check_order(follower.told)
        told = {event["id"] for event in follower.told}
        assert [event["id"] for event in everything.told if event["id"] not in told] == []
    assert files.verify(data) == []


def _home(http: httpx.Client) -> None:
    """A robot moves to no place before it was homed."""
    until(lambda: http.get("/readyz").is_success, "the server is ready")
    move = http.post("/robots/r1/units/1/moves", json={"kind": "home"}, params={"wait": ENDED_S}).json()
    assert move["status"] == "succeeded", move


def _look_for_all(http: httpx.Client, movers: list[Mover], wait_s: float = 0.0) -> list[Any]:
    """Read every move that was answered, in whichever life."""
    return [
        _get(http, f"{mover.moves}/{move_id}?wait={wait_s}")
        for mover in movers
        for move_id in (mover.answered if wait_s else mover.answered[-10:])
    ]


def _check_intents(data: Path, done: list[str]) -> None:
    with closing(sqlite3.connect(data / "journal.db")) as journal:
        frames = {frame for (frame,) in journal.execute("SELECT frame FROM intents")}
    assert [text for text in done if f"{text}\r" not in frames] == []


def _check_moves(moves: list[Any]) -> None:
    """Each was followed to its end, over the kill in which it was under way, or is unknown with evidence."""
    statuses = Counter(move["status"] for move in moves)
    assert statuses.keys() <= {"succeeded", "failed", "unknown"}, statuses
    for move in moves:
        assert move["ended_at"]
        assert move["status"] == "succeeded" or (move["evidence"] and move["error"]), move
    adopted = [move for move in moves if any("restarted" in sentence for sentence in move["evidence"])]
    families = Counter("robot" if move["body_id"].startswith("r1") else "body" for move in adopted)
    assert families["body"] > KILLS // 2
    assert families["robot"] > KILLS // 6
    assert sum(move["status"] == "succeeded" for move in adopted) > len(adopted) / 2


def _check_order(told: list[Any]) -> None:
    """Numbers follow one another; after a crash they go on no later than after the last one seen."""
    last = int(told[0]["sequence"]) - 1
    for event in told:
        assert event["type"] != "stream.gap"
        number = int(event["sequence"])
        assert number == last + 1 or (number <= last and event["type"] == "gateway.crashed"), event
        last = number


def _answers(movers: list[Mover], setters: list[Setter]) -> int:
    """Number of requests that were told to be begun or done."""
    return sum(len(mover.answered) for mover in movers) + sum(len(setter.answered) for setter in setters)


def _live_and_die(
    parent: Parent,
    address: str,
    movers: list[Mover],
    setters: list[Setter],
    followers: list[Follower],
    dice: Random,
) -> None:
    """One life: clients at work until the kill, and everybody's end."""
    stream, socket = followers[0].stream, followers[1].socket
    if dice.random() < 0.5:
        stream, socket = followers[1].stream, followers[0].socket
    with ThreadPoolExecutor(2 + len(movers) + len(setters)) as threads:
        tasks = [threads.submit(_until_killed, read, address) for read in (stream, socket)]
        works = [mover.work for mover in movers] + [setter.work for setter in setters]
        tasks += [threads.submit(_again_and_again, work, address) for work in works]
        until_kill = _answers(movers, setters) + dice.randrange(ANSWERS)
        give_up_at = time.monotonic() + LONGEST_S
        while _answers(movers, setters) < until_kill and time.monotonic() < give_up_at:
            time.sleep(0.005)
        parent.kill()
    for task in tasks:
        task.result()
