"""The gateway and the simulator as child processes of a test, and what they have really done."""

import atexit
import json
import os
import re
import signal
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from shutil import disk_usage, rmtree
from tempfile import mkdtemp
from typing import Any, TypeVar

import httpx

from protocols.rorze.profile import Profile, SpeedParameters, plan
from tests.e2e import warm
from tests.open_access import OPEN

T = TypeVar("T")

MOTION_GATEWAY = Path(sys.executable).with_name("motion-gateway")
"""The command as `make` installs it."""
PATIENCE_S = 60.0
"""Seconds after which, on a busy machine too, a thing that has not happened never will."""
LONGEST_WAIT_S = 60
"""The gateway lets no request wait longer."""
START_PATIENCE_S = 100.0
"""A program's start takes seconds of the processor, which others may want, too."""
RECHECK_S = 0.02
BODIES = "00,01,3F"
MEMORY = Path("/dev/shm")  # noqa: S108  # only directories of our own in it are used
ROOM_BYTES = 1 << 30
PATIENT_S = "3.0"
"""The `reply_timeout_s` of a line without faults: on a busy machine a reply may take long."""
LIMITS = {"cw_limit": 1_000_000_000, "ccw_limit": -1_000_000_000}
"""No move of a test gets there, however slow the test is."""

RUNNING: "list[Program]" = []
"""Every program that has not been ended yet; the tests' report shows their words."""


class Program:
    """A `motion-gateway` command of which every word goes to a file."""

    def __init__(self, log: Path, *arguments: str) -> None:
        self.log = log
        self._begin = log.stat().st_size if log.exists() else 0
        self._process = warm.start(log, arguments)
        RUNNING.append(self)

    @property
    def pid(self) -> int:
        """The operating system's number of it."""
        assert self._process.pid
        return self._process.pid

    def runs(self) -> bool:
        """True while the program runs."""
        return self._process.exitcode is None

    @property
    def arguments(self) -> str:
        """Its arguments and environment, as other programs of the machine read them."""
        place = Path(f"/proc/{self.pid}")
        return "".join(
            (place / name).read_bytes().decode("utf-8", "replace") for name in ("cmdline", "environ")
        )

    def words(self) -> str:
        """The output of the program so far."""
        said = self.log.read_bytes() if self.log.exists() else b""
        return said[self._begin :].decode("utf-8", "replace")

    def said(self, pattern: str) -> re.Match[str]:
        """Wait until it says something."""

        def search() -> re.Match[str] | None:
            found = re.search(pattern, self.words())
            assert found or self.runs(), f"It ended without {pattern!r}:\n{self.words()}"
            return found

        return until(search, f"{self.log.stem} says {pattern!r}", START_PATIENCE_S)

    def signal(self, number: signal.Signals) -> None:
        """Send it a signal."""
        if self.runs():
            os.kill(self.pid, number)

    def kill(self) -> None:
        """End it at once, as a power cut would (SIGKILL)."""
        self._process.kill()
        self._gone()

    def end(self, within_s: float = PATIENCE_S) -> int:
        """Ask it to end (SIGTERM), and give its exit code; one that does not obey is killed."""
        self._process.terminate()
        return self.ended(within_s)

    def ended(self, within_s: float = PATIENCE_S) -> int:
        """Wait for its end, and give its exit code; one that does not end is killed."""
        self._process.join(within_s)
        code = self._process.exitcode
        self.kill()
        assert code is not None, f"{self.log.stem} does not end within {within_s:.0f} s"
        return code

    def _gone(self) -> None:
        self._process.join()
        if self in RUNNING:
            RUNNING.remove(self)


def until(look: Callable[[], T | None], what: str, within_s: float = PATIENCE_S) -> T:
    """Look again and again until there is something to see."""
    give_up_at = time.monotonic() + within_s
    while time.monotonic() < give_up_at:
        seen = look()
        if seen:
            return seen
        time.sleep(RECHECK_S)
    raise AssertionError(f"In vain for {within_s:.0f} s: {what}")


@dataclass
class Fact:
    """A line of the truth log."""

    kind: str
    time_s: float
    body: str
    request: int | None
    facts: dict[str, Any]

    @classmethod
    def of(cls, line: str) -> "Fact":
        """Read it."""
        named = json.loads(line)
        kind, time_s, body, request = (named.pop(name) for name in ("kind", "time_s", "body", "request"))
        return cls(kind, time_s, body, request, named)


class SimulatedLine:
    """A simulated RC-400 in a process of its own, with its control interface and its truth log."""

    def __init__(self, folder: Path, bodies: str, *options: str) -> None:
        self.folder = folder
        place = () if "--listen" in options else ("--pty", str(folder / "line"))
        self._bodies = bodies
        self._start = ("simulate", "rc400", "--bodies", bodies, *place, *options)
        self._truth = folder / "truth.jsonl"
        self._begin = 0
        self.start()

    def start(self) -> None:
        """Switch it on; after a `kill` it has the speeds and positions of a new box."""
        log, truth = self.folder / "simulator.log", str(self._truth)
        self.program = Program(log, *self._start, "--truth", truth, "--control", "127.0.0.1:0")
        said = self.program.said(r"control interface at (http://\S+)\nRC-400 with bodies .* at (\S+)\n")
        self.control = httpx.Client(base_url=said[1], timeout=PATIENCE_S)
        self.place = said[2]
        limits = {name: {"first": at, "last": at} for name, at in LIMITS.items()}
        for body in self._bodies.split(","):
            self.tell("PATCH", f"/bodies/{body}/mechanics", **limits)

    def address(self, baud: int) -> str:
        """Where a gateway finds it."""
        return self.place if self.place.startswith("tcp://") else f"serial://{self.place}?baud={baud}"

    def kill(self) -> None:
        """Pull the whole box out of the wall, and its link first.

        The number of its terminal is free then: through a link that is left, a gateway would open, and keep,
        the terminal that another test gets under this number.
        """
        self.control.close()
        (self.folder / "line").unlink(missing_ok=True)
        self.program.kill()

    def end(self) -> int:
        """End it."""
        self.control.close()
        return self.program.end()

    def tell(self, method: str, path: str, **content: object) -> None:
        """Use the control interface."""
        self.control.request(method, path, json=content or None).raise_for_status()

    def begin_anew(self) -> None:
        """From now on tell only what happens later."""
        self._begin += len(self.truth())

    def truth(self, kind: str | None = None, body: str | None = None) -> list[Fact]:
        """Facts of the simulator's truth log; a line that is being written is left for the next call."""
        lines = self._truth.read_text("utf-8").split("\n")[self._begin : -1]
        facts = [Fact.of(line) for line in lines]
        return [fact for fact in facts if kind in (None, fact.kind) and body in (None, fact.body)]

    def executed(self, code: str) -> list[Fact]:
        """The commands of one code that controllers have taken without an error."""
        return [
            fact
            for fact in self.truth("command")
            if fact.facts["text"].startswith(code) and not fact.facts["reply"].startswith("@")
        ]

    def requests(self) -> list[str]:
        """The frames that have arrived, without CR."""
        return [fact.facts["frame"] for fact in self.truth("request")]


class SimulatedRobot:
    """A simulated Fics in a process of its own, with its truth log."""

    def __init__(self, folder: Path, *options: str) -> None:
        self._truth = folder / "robot.jsonl"
        place = () if "--listen" in options else ("--pty", str(folder / "robot"))
        start = ("simulate", "fics", "--axes", "XYZ", "--truth", str(self._truth), *place, *options)
        self.program = Program(folder / "robot.log", *start)
        self.place = self.program.said(r"Fics with 1 unit .* at (\S+)\n")[1]
        self._begin = 0

    @property
    def address(self) -> str:
        """Where a gateway finds it."""
        return self.place if self.place.startswith("tcp://") else f"serial://{self.place}?baud=115200"

    def begin_anew(self) -> None:
        """From now on tell only what happens later."""
        self._begin += len(self.truth())

    def truth(self, kind: str | None = None) -> list[Fact]:
        """Facts of the simulator's truth log; a line that is being written is left for the next call."""
        lines = self._truth.read_text("utf-8").split("\n")[self._begin : -1]
        facts = [Fact.of(line) for line in lines]
        return [fact for fact in facts if kind in (None, fact.kind)]

    def heard(self, name: str) -> list[str]:
        """The commands of a name that it has heard."""
        texts = [str(fact.facts["text"]) for fact in self.truth("command")]
        return [text for text in texts if text.startswith(name)]


def data_directory(otherwise: Path) -> Path:
    """Make one in memory, where there is room: on a busy machine a disk may take seconds for a commit."""
    has_room = MEMORY.is_dir() and disk_usage(MEMORY).free > ROOM_BYTES
    made = Path(mkdtemp(prefix="motion-gateway-", dir=MEMORY if has_room else otherwise))
    atexit.register(rmtree, made, ignore_errors=True)
    return made


class Gateway:
    """A gateway in a process of its own, and an HTTP client for it."""

    def __init__(self, config: Path) -> None:
        self.config = config
        self.data = data_directory(config.parent)
        self._starts = 0
        self.start()

    def start(self) -> None:
        """Start it, at a port that is free now."""
        self._starts += 1
        log = self.config.with_name(f"{self.config.stem}-{self._starts}.log")
        self.program = Program(log, "serve", "--config", str(self.config), "--data", str(self.data))
        self.url = self.program.said(r"running on (http://[0-9.]+:\d+)")[1]
        self.http = httpx.Client(base_url=self.url, timeout=PATIENCE_S)
        self._cursor: str | None = None

    def wait_until_ready(self) -> "Gateway":
        """Wait until its lines are open and set up."""
        until(lambda: self.http.get("/readyz").is_success, "the gateway is ready")
        return self

    def kill(self) -> None:
        """End it at once."""
        self.http.close()
        self.program.kill()

    def end(self, within_s: float = PATIENCE_S) -> int:
        """End it as a service manager would, and give its exit code."""
        self.http.close()
        return self.program.end(within_s)

    @property
    def websocket(self) -> str:
        """The address of its event stream."""
        return self.url.replace("http", "ws") + "/events"

    def get(self, path: str) -> Any:
        """Read something that is there."""
        return self.http.get(path).raise_for_status().json()

    def command(self, body: str, name: str, **parameters: object) -> Any:
        """Call a mirror command that succeeds."""
        return (
            self.http.post(f"/bodies/{body}/commands/{name}", json=parameters or None)
            .raise_for_status()
            .json()
        )

    def move(self, body: str, pulses: int, wait: float = 0, **more: object) -> httpx.Response:
        """Ask for a relative move clockwise."""
        content = {"kind": "relative", "direction": "cw", "distance": {"value": pulses, "unit": "pulse"}}
        return self.http.post(f"/bodies/{body}/moves", params={"wait": wait}, json=content | more)

    def moving(self, body: str, pulses: int) -> Any:
        """Start a relative move that the controller accepts."""
        answer = self.move(body, pulses)
        assert answer.status_code == 202, answer.text
        return answer.json()

    def ended(self, body: str, move_id: str) -> Any:
        """Wait for the end of a move, and give it."""
        move = self.get(f"/bodies/{body}/moves/{move_id}?wait={LONGEST_WAIT_S}")
        assert move["ended_at"], move
        return move

    def begin_anew(self) -> "Gateway":
        """From now on tell only of later events."""
        while (page := self._events())["events"]:
            self._cursor = page["cursor"]
        return self

    def now(self) -> str:
        """Give the cursor after everything so far."""
        return str(self.begin_anew()._cursor)

    def events(self, *types: str) -> list[Any]:
        """The events of some types."""
        return list(self._events(types=",".join(types))["events"])

    def _events(self, **wanted: str) -> Any:
        after = {"after": self._cursor} if self._cursor else {}
        return self.http.get("/events", params={**wanted, **after, "limit": 1000}).raise_for_status().json()


def teach(gateway: Gateway, body: str, pattern: int, speeds: SpeedParameters) -> None:
    """Set an acceleration pattern with the same curve up and down."""
    values = {
        "start-speed": {"speed": speeds.low},
        "maximum-speed": {"speed": speeds.high},
        "maximum-acceleration": {"acceleration": speeds.acceleration},
        "rising-acceleration-share": {"percent": speeds.rising},
        "falling-acceleration-share": {"percent": speeds.falling},
    }
    for name, value in values.items():
        gateway.command(body, f"set-{name}", speed_set=pattern, **value)
    gateway.command(body, "set-pattern", pattern=pattern, acceleration=pattern, deceleration=pattern)


def planned(pulses: int, speeds: SpeedParameters) -> Profile:
    """How such a move has to run by the manual's rules."""
    return plan(pulses, speeds, speeds)


@contextmanager
def simulated_line(folder: Path, bodies: str = BODIES, *options: str) -> Iterator[SimulatedLine]:
    """Run a simulated line, and end it with the block."""
    line = SimulatedLine(folder, bodies, *options)
    try:
        yield line
    finally:
        line.end()


@contextmanager
def simulated_robot(folder: Path, *options: str) -> Iterator[SimulatedRobot]:
    """Run a simulated robot, and end it with the block."""
    robot = SimulatedRobot(folder, *options)
    try:
        yield robot
    finally:
        robot.program.end()


@contextmanager
def gateway_at(
    line: SimulatedLine, name: str = "gateway", bodies: str = BODIES, *, baud: int = 115_200, **more: str
) -> Iterator[Gateway]:
    """Run a gateway on a line, and end it with the block; `more` are further keys of the line's table."""
    gateway = Gateway(write_config(line, name, bodies, baud, **more))
    try:
        yield gateway
    finally:
        gateway.end()


def write_config(
    line: SimulatedLine, name: str, bodies: str = BODIES, baud: int = 115_200, **more: str
) -> Path:
    """Write a configuration for a line; `more` are further keys of its table."""
    config = line.folder / f"{name}.toml"
    table = {
        "id": '"line1"',
        "address": f'"{line.address(baud)}"',
        "bodies": "[{}]".format(", ".join(f'{{ id = "{body}" }}' for body in bodies.split(","))),
        # So that a fault costs a test as little time as it can.
        "reply_timeout_s": "0.2",
        "late_reply_s": "0.3",
        "poll_interval_s": "0.1",
        **more,
    }
    keys = [f"{key} = {value}" for key, value in table.items()]
    config.write_text("\n".join(["[server]", "port = 0", "", "[[lines]]", *keys, OPEN]), "utf-8")
    return config


def group_of(*members: str) -> str:
    """The key of a configuration that makes group 80."""
    return '[{{ id = "80", members = [{}] }}]'.format(", ".join(f'"{member}"' for member in members))
