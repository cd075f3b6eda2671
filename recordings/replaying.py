"""A replay to the controllers' side: this gateway, over ports that answer as a recording has it."""

import asyncio
import json
import random
from collections.abc import Callable, Coroutine, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import partial
from itertools import cycle
from typing import Any, Final, TypeVar

from pydantic import ValidationError

from gateway.access.principal import EVERYBODY, asking
from gateway.config import Config
from gateway.core.errors import GatewayError
from gateway.core.origin import Origin, acting
from gateway.door.calls import carry_out
from gateway.door.table import Operation, adapter_of, operations
from gateway.plant import Plant
from recordings.dialects import DIALECTS, Dialect
from recordings.form import (
    MANIFEST,
    REQUESTS,
    Manifest,
    NotARecording,
    Recording,
    before_member,
    families_of,
    first_of,
    line_member,
)
from recordings.line_script import NS, Numbered, script_of
from recordings.ports import Difference, ExactPort, Line, MatchingPort, ReplayPort
from recordings.virtual_loop import VirtualLoop
from transports import Transport, create
from transports.trace import TraceEntry

T = TypeVar("T")

SETTLING_S: Final = 20.0
"""Seconds after which a gateway has set its lines up and has asked its first questions."""
GRACE_S: Final = 5.0
"""Seconds by which a frame may be later than recorded."""
_BEGAN_NS: Final = 946_684_800_000_000_000
_TURNS: Final = 50
"""Turns of the loop in which all that comes at one instant is done before what is asked then."""


@dataclass
class Replayed:
    """The result of a replay."""

    differences: list[Difference]
    """The first of each line, the first of all first."""
    frames: int
    """Frames that were written."""
    requests: int
    unanswered: list[str]
    """Questions that the recording knows no answer to."""


@dataclass
class Script:
    """A recording as a replay needs it."""

    manifest: Manifest
    records: Mapping[str, Sequence[Numbered]]
    before: Mapping[str, Sequence[Numbered]]
    requests: Sequence[Mapping[str, Any]]
    exact: bool = False
    """True if all was written in virtual time, so that all is written in the same order again."""
    began_ns: int = field(init=False)

    def __post_init__(self) -> None:
        """Find the beginning: the first record of all."""
        firsts = [records[0][1].monotonic_ns for records in self.records.values() if records]
        firsts += [request["monotonic_ns"] for request in self.requests[:1]]
        self.began_ns = min(firsts, default=0)

    @classmethod
    def of(cls, recording: Recording, *, exact: bool = False) -> "Script":
        """Read a recording; errors as of `Recording.rows`."""
        manifest = recording.manifest
        return cls(
            manifest,
            {line_id: list(recording.entries(line_member(line_id))) for line_id in manifest.lines},
            {line_id: list(recording.entries(before_member(line_id))) for line_id in manifest.lines},
            [row for _, row in recording.rows(REQUESTS)],
            exact,
        )

    @property
    def length_s(self) -> float:
        """Seconds from the first record to the last."""
        lasts = [records[-1][1].monotonic_ns for records in self.records.values() if records]
        return (max(lasts, default=self.began_ns) - self.began_ns) * NS


Speed = tuple[float, bool]
"""Seconds that a byte takes at a port, and whether a box passes it on."""


def _speed_of(_line_id: str, address: str) -> Speed:
    port = create(address)
    return port.byte_time_s, port.is_bridged


def config_of(manifest: Manifest, access: Mapping[str, str]) -> Config:
    """Read the configuration of a recording, with other access.

    :raises NotARecording: a gateway cannot be configured so.
    """
    try:
        return Config.model_validate({**manifest.configuration, "access": access})
    except ValidationError as error:
        raise NotARecording(f"{MANIFEST}: configuration: {first_of(error)}.") from None


class Replay:
    """One replay, in an event loop whose clock is that of the recording."""

    def __init__(
        self,
        script: Script,
        speed_of: Callable[[str, str], Speed] = _speed_of,
        plant_class: type[Plant] = Plant,
    ) -> None:
        self.script = script
        config = config_of(script.manifest, {"mode": "open", "lease_mode": "off"})
        self._families = families_of(script.manifest.configuration)
        self._dialects = {line_id: DIALECTS[self._families[line_id]]() for line_id in script.manifest.lines}
        self.ports: dict[str, ReplayPort] = {}
        for table in config.lines:
            if table.id in self._dialects:
                line = Line(
                    table.id, table.address, *speed_of(table.id, table.address), self._dialects[table.id]
                )
                port = self.ports[table.address] = self._port(line)
                port.numbers = _numbers(script.records[table.id], line.dialect)
        self.over = asyncio.Event()
        self.asked: list[dict[str, Any]] = []
        """The requests, with their times in this replay."""
        self.plant = plant_class(config, open_transport=self._open, rng=_Dice(self.ports.values()))
        for port in self.ports.values():
            recorder = self.plant.history.recorders[port.line.line_id]
            recorder.clocks = _clocks
            port.sender = partial(getattr, recorder, "sender")
            port.on_difference = self.over.set

    @property
    def said(self) -> dict[str, list[TraceEntry]]:
        """The records of the lines of this replay."""
        recorders = ((line_id, self.plant.history.recorders[line_id]) for line_id in self._dialects)
        return {
            line_id: [
                TraceEntry.of(record) for piece in recorder.history.pieces() for record in piece.records()
            ]
            for line_id, recorder in recorders
        }

    def _port(self, line: Line) -> ReplayPort:
        script, line_id = self.script, line.line_id
        if script.exact:
            return ExactPort(line, script.records[line_id], script.began_ns)
        then = DIALECTS[self._families[line_id]]()
        before = script_of(script.before[line_id], then, script.began_ns)
        return MatchingPort(line, script_of(script.records[line_id], then, script.began_ns), before)

    def _open(self, address: str) -> Transport:
        return self.ports[address]

    async def run(self) -> Replayed:
        """Play it to its end, or to the first difference."""
        await self.plant.start()
        try:
            await self._settle()
            waiting = asyncio.create_task(self._ask_all())
            length_s = self.script.length_s + GRACE_S
            with suppress(TimeoutError):
                async with asyncio.timeout(length_s):
                    await self.over.wait()
            waiting.cancel()
            await asyncio.gather(waiting, return_exceptions=True)
            if not self.over.is_set():
                for port in self.ports.values():
                    port.end()
        finally:
            await self.plant.close()
        found = [port.difference for port in self.ports.values() if port.difference is not None]
        unanswered = sorted(
            {str(frame) for port in self.ports.values() for frame in getattr(port, "unanswered", ())}
        )
        frames = sum(self.plant.history.recorders[line_id].recorded for line_id in self._dialects)
        return Replayed(found, frames, len(self.script.requests), unanswered)

    async def _settle(self) -> None:
        """Let the gateway learn what it knew when the recording began."""
        ports = list(self.ports.values())
        for port in ports:
            if isinstance(port, MatchingPort) and port.begins_open:
                port.begin()
        if not all(getattr(port, "has_begun", True) for port in ports):
            await asyncio.sleep(SETTLING_S)
        for port in ports:
            if isinstance(port, MatchingPort) and not port.has_begun:
                port.begin()

    async def _ask_all(self) -> None:
        """Ask for what was asked then, when it was asked."""
        loop, rows = asyncio.get_running_loop(), {row.name: row for row in operations()}
        began_at = max((port.began_at for port in self.ports.values()), default=0.0)
        tasks: set[asyncio.Task[None]] = set()
        try:
            for request in self.script.requests:
                at_s = (request["monotonic_ns"] - self.script.began_ns) * NS
                left_s = began_at + at_s - loop.time()
                for _ in range(_TURNS if left_s > 0 else 0):
                    await asyncio.sleep(max(left_s, 0))
                    left_s = 0
                self.asked.append({**request, "monotonic_ns": _clocks()[1]})
                if (operation := rows.get(request["operation"])) is not None:
                    tasks.add(asyncio.create_task(self._ask(operation, request)))
            await asyncio.gather(*tasks)
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    async def _ask(self, operation: Operation, request: Mapping[str, Any]) -> None:
        origin = Origin(request["caller"], request["request_id"])
        with asking(EVERYBODY), acting(origin), suppress(GatewayError):
            await carry_out(self.plant, operation, _values(operation, request["values"]))


def _clocks() -> tuple[int, int]:
    """The time of the replay, in the place of both clocks."""
    now_ns = round(asyncio.get_running_loop().time() * 1e9)
    return _BEGAN_NS + now_ns, now_ns


def _values(operation: Operation, told: Mapping[str, Any]) -> dict[str, Any]:
    """Read the values of a request as the door takes them."""
    values = dict(told)
    kinds = {name: parameter.annotation for name, parameter in operation.parameters.items()}
    if operation.request_name is not None:
        kinds[operation.request_name] = operation.request
    for name, kind in kinds.items():
        if name in values:
            with suppress(ValidationError):
                values[name] = adapter_of(kind).validate_json(json.dumps(values[name]))
    return values


def _numbers(records: Sequence[Numbered], dialect: Dialect) -> list[int]:
    """The numbers of the fences that were written, in their order."""
    found = (dialect.drawn_number(entry.data, entry.caller) for _, entry in records if entry.kind == "tx")
    return [number for number in found if number is not None]


class _Dice(random.Random):
    """Draws the recorded numbers of fences, for each line in the order of the lines.

    A number that was drawn and not written, as the port was lost, is drawn again: it is not in the recording.
    """

    def __init__(self, ports: Iterable[ReplayPort]) -> None:
        super().__init__(0)
        self._ports = iter(ports)

    def sample(self, population: Any, k: int, **options: Any) -> Any:
        """Give them, without an end."""
        return self._as_then(next(self._ports), super().sample(population, k, **options))

    @staticmethod
    def _as_then(port: ReplayPort, others: Sequence[int]) -> Iterator[int]:
        for other in cycle(others):
            yield port.draw(other)


def replay(script: Script, speed: float | None = None, **options: Any) -> Replayed:
    """Play a recording in a loop of its own; `speed` None is as fast as possible."""

    async def play() -> Replayed:
        return await Replay(script, **options).run()

    return run_loop(play(), speed)


def run_loop(story: Coroutine[Any, Any, T], speed: float | None = None) -> T:
    """Run a coroutine in a loop whose clock is that of a replay."""
    with asyncio.Runner(loop_factory=lambda: VirtualLoop(speed)) as runner:
        return runner.run(story)
