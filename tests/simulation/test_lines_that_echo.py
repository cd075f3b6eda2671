"""Lines that begin to echo at any time and cease: what is told of moves, jogs and stops under way is true.

An echo comes with true replies, as from an adapter with local echo, or in their place, from a looped plug.
"""

import asyncio
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import AsyncIterator, Callable
from contextlib import AbstractAsyncContextManager, asynccontextmanager, suppress
from math import inf
from random import Random
from typing import Any, Literal

import pytest

from gateway.causes import LINE_DOWN
from gateway.core.errors import GatewayError
from gateway.core.line_state import LineState
from gateway.core.move_record import LOST_AFTER_S, MoveStatus
from gateway.core.stops import StopMode
from gateway.fics.targets import is_missed
from gateway.rorze.move_requests import BodyJogRequest
from protocols.fics.alarms import ResetErrors
from protocols.fics.homing import HomeRobot
from protocols.fics.moves import MoveRelative, MoveToPosition
from protocols.fics.row import FicsCommand
from protocols.rorze.moves import MoveClockwise, MoveTo
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack
from tests.drawing import drawn, fresh
from tests.fics_plants import FicsRig, fics_rig
from tests.gateway.rorze.far_end import until
from tests.plants import Rig, rig
from tests.simulated_line import SimulatedCable
from tests.tested_plant import TestedPlant
from tests.virtual_time import run_virtual

SEEDS = fresh(40, "echoes")
"""Seeds for three plants and three kinds of echo: 360 stories, others with each commit."""
BAUDS = (9600, 115_200)
DEEDS = 12
"""Moves, jogs and stops of each client."""
BACK_WITHIN_S = 10.0
"""A line that echoes no longer is ready again."""
PROBED_WITHIN_S = 24.0
"""A body that has fallen silent is asked again, every 10 s at last; an echo may have met one question."""
ENDED_WITHIN_S = 120.0
"""A move whose motor can be asked again is over by then."""
AT_ONCE_S = 0.1
"""A stop is written within this time, behind the frame that is being written."""
ABANDONED_S = 2.5
"""An axis that jogs and is left alone stands still after half a second, its ramp and a busy line."""
TOLD_OF_ECHOES = (LINE_DOWN, "robot.error", "robot.move.unknown")
"""Alarms on a line whose true replies come beside its echoes; an immediate stop is an error of a robot."""
UNMOVED = (MoveStatus.CANCELLED, MoveStatus.REJECTED)
MODES: tuple[StopMode, ...] = ("immediate", "decelerate")
Kind = Literal["echoes", "is_looped"]


def now() -> float:
    return asyncio.get_running_loop().time()


class Spells(list[tuple[float, float]]):
    """When the line echoed: from, until."""

    def lasted(self) -> float:
        """The time since the line was usable: between two spells it has to be set up anew."""
        since = before = -inf
        for began_at, ended_at in self:
            since = since if began_at - before < BACK_WITHIN_S else began_at
            before = ended_at
        return now() - since if self and now() - before < BACK_WITHIN_S else 0.0


class Client(ABC):
    """Moves, jogs and stops one motor, or robot, and compares what is told with what it did."""

    stop_frames: tuple[bytes, ...]

    def __init__(self, plant: TestedPlant, cable: SimulatedCable, dice: Random, *, is_heard: bool) -> None:
        self.plant, self.cable, self.dice, self.is_heard = plant, cable, dice, is_heard
        self.wrong: list[str] = []
        self.seen: Counter[str] = Counter()
        self._last = 0
        self.stops_at: list[float] = []
        self.spells = Spells()
        self._note_stops(cable)

    def _note_stops(self, cable: SimulatedCable) -> None:
        write = cable.write

        def note_and_write(data: bytes) -> None:
            if data in self.stop_frames:
                self.stops_at.append(now())
            write(data)

        cable.write = note_and_write  # type: ignore[method-assign]

    @abstractmethod
    def command(self) -> tuple[Any, str]:
        """A motion that no other frame is like, and its frame as the controller hears it."""

    @abstractmethod
    async def start(self, command: Any) -> Any: ...

    @abstractmethod
    async def ended(self, move: Any) -> Any: ...

    @abstractmethod
    def records(self) -> list[Any]: ...

    @abstractmethod
    async def stop(self, mode: StopMode) -> Any: ...

    @abstractmethod
    async def jog(self) -> Callable[[], Any]:
        """Begin to jog; gives how to end it."""

    @abstractmethod
    def executed(self, frame: str) -> int: ...

    @abstractmethod
    def moving(self) -> bool: ...

    @abstractmethod
    def is_being_stopped(self) -> bool: ...

    @abstractmethod
    def is_there(self, move: Any) -> bool:
        """It stands where a motion should have brought it."""

    @abstractmethod
    async def make_fit(self) -> None:
        """Do what a person does before the next motion."""

    async def work(self) -> None:
        for _ in range(DEEDS):
            await asyncio.sleep(self.dice.choice((0.0, 0.05, 0.5, 3.0)))
            await self.dice.choice((self._move, self._move, self._stop, self._jog))()
            with suppress(GatewayError):
                await self.make_fit()

    async def _move(self) -> None:
        command, frame = self.command()
        known = {move.id for move in self.records()}
        echoed = self.plant_echoes()
        stopping = self._stop_soon() if self.dice.random() < 0.3 else None
        try:
            move = await self.start(command)
        except GatewayError as refusal:
            self.seen["refused"] += 1
            move = next((move for move in self.records() if move.id not in known), None)
            if move is None or move.status in UNMOVED:
                self._expect(
                    not self.executed(self._heard(frame)), f"{frame}: {refusal}, and it was executed"
                )
            self._expect(
                refusal.moved != "no" or not self.executed(self._heard(frame)), f"{frame}: {refusal}"
            )
        else:
            self._expect(not echoed or self.plant_echoes() != echoed, f"{frame} was written to an echo")
        if stopping is not None:
            await stopping
        if move is not None:
            await self._judge(frame, move)

    async def _judge(self, frame: str, move: Any) -> None:
        over = await self.ended(move)
        self.seen[over.status] += 1
        times = self.executed(self._heard(frame))
        told = f"{frame} {over.status} {over.end_cause} {over.error and over.error.detail}, executed {times}"
        self._expect(times <= 1, told)
        self._expect(over.status.final, told)
        self._expect(over.status is not MoveStatus.LOST or self.spells.lasted() >= LOST_AFTER_S, told)
        if over.status in UNMOVED:
            self._expect(times == 0, told)
        if over.status in (MoveStatus.SUCCEEDED, MoveStatus.STOPPED):
            self._expect(not self.moving(), f"{told}, and it moves")
        if over.status is MoveStatus.SUCCEEDED:
            self._expect((times == 1 or had_no_way(over)) and self.is_there(over), told)
        if over.status is MoveStatus.FAILED:
            self._expect(times == 0 or not self.is_there(over), told)

    async def _stop(self) -> None:
        repeats_itself, began_at = self.is_being_stopped(), now()
        stopping = asyncio.create_task(self._stop_until_confirmed())
        await asyncio.sleep(AT_ONCE_S)
        written = max(self.stops_at, default=-inf) >= began_at
        self._expect(written or repeats_itself, f"no stop was written at {began_at}")
        await stopping

    def _stop_soon(self) -> "asyncio.Task[None]":
        async def stop() -> None:
            await asyncio.sleep(self.dice.uniform(0.0, 2.0))
            await self._stop()

        return asyncio.create_task(stop())

    async def _stop_until_confirmed(self) -> None:
        report, began_at = await self.stop(self.dice.choice(MODES)), now()
        await until(lambda: report.state == "confirmed", ENDED_WITHIN_S)
        self.seen["confirmed"] += 1
        self._expect(not self.moving(), f"{report}, and it moves")
        if not self.is_heard:
            self._expect(now() - began_at < BACK_WITHIN_S, f"{report} after {now() - began_at:.1f} s")

    async def _jog(self) -> None:
        try:
            end = await self.jog()
        except GatewayError:
            self.seen["no jog"] += 1
        else:
            self.seen["jogs"] += 1
            if self.dice.random() < 0.5:
                await asyncio.sleep(self.dice.uniform(0.0, 0.4))
                with suppress(GatewayError):
                    await end()
        await asyncio.sleep(ABANDONED_S)
        if self.is_heard:
            await until(lambda: not self.moving(), ENDED_WITHIN_S)
        else:
            self._expect(not self.moving(), "it jogs on")

    def plant_echoes(self) -> bool:
        (line,) = self.plant.ports().values()
        return bool(getattr(line, "echoes", False))

    def _heard(self, frame: str) -> str:
        return frame

    def _expect(self, so: bool, otherwise: str) -> None:
        if not so:
            self.wrong.append(otherwise)


def had_no_way(move: Any) -> bool:
    """Say whether the axis stood at its target before, so that the command makes no difference."""
    start, target = move.start_position, move.target_position
    if isinstance(target, dict):
        return all(start.get(axis) == place for axis, place in target.items())
    return bool(start == target)


class OfBody(Client):
    def __init__(self, stand: Rig, number: int, dice: Random, *, is_heard: bool) -> None:
        super().__init__(stand.plant, stand.wire, dice, is_heard=is_heard)
        self._rig, self._number = stand, number
        self._body, self._axis = stand.body(f"{number:02X}"), stand.axis(number)
        self.stop_frames = tuple(f"&{number:02X}{code}\r".encode() for code in ("5IS", "5SS"))

    def command(self) -> tuple[RorzeCommand[Ack], str]:
        self._last += 1
        pulses = 400 * (self._last % 8) + 10 * self._last + 1
        command = MoveTo(position=pulses) if self.dice.random() < 0.5 else MoveClockwise(distance=pulses)
        return command, f"&{self._number:02X}{command.frame_text}"

    async def start(self, command: RorzeCommand[Ack]) -> Any:
        self._from = self._axis.motor.pulses(now())
        [move] = await self.plant.moves.start(self._body, command)
        return move

    async def ended(self, move: Any) -> Any:
        return await self.plant.moves.wait(move.id, ENDED_WITHIN_S)

    def records(self) -> list[Any]:
        return self.plant.moves.log.of(self._body.address)

    async def stop(self, mode: StopMode) -> Any:
        [report] = await self.plant.stops.stop([self._body], mode)
        return report

    async def jog(self) -> Callable[[], Any]:
        jogs, body = self.plant.rorze.jogs, self._body
        jog = await jogs.start(body, BodyJogRequest(direction="cw"))
        return lambda: jogs.end(jog.id, body)

    def executed(self, frame: str) -> int:
        return len(self._rig.executed(frame, self._number))

    def _heard(self, frame: str) -> str:
        return frame[3:]

    def moving(self) -> bool:
        return self._axis.motor.moving

    def is_being_stopped(self) -> bool:
        return self._body.life.being_stopped

    def is_there(self, move: Any) -> bool:
        return bool(self._axis.motor.pulses(now()) == move.target_position)

    async def make_fit(self) -> None:
        """A body takes the next motion after any stop."""


class OfRobot(Client):
    stop_frames = (b"AES\r", b"ASS\r")

    def __init__(self, stand: FicsRig, dice: Random, *, is_heard: bool) -> None:
        super().__init__(stand.plant, stand.cable, dice, is_heard=is_heard)
        self._rig = stand
        self._before = 0

    def command(self) -> tuple[FicsCommand[Ack], str]:
        self._last += 1
        self._before = len(self._rig.machine.truth.of("motion_start"))
        if self.dice.random() < 0.2:
            return HomeRobot(), "ORG"
        if self.dice.random() < 0.3:
            return (position := MoveToPosition(position=self.dice.choice((1, 183)))), position.text
        amount = (5 + self._last / 1000) * (-1 if self._last % 4 < 2 else 1)
        command = MoveRelative(coordinates=[None, None, round(amount, 3)])
        return command, command.text

    async def start(self, command: FicsCommand[Ack]) -> Any:
        return await self._rig.start(command)

    async def ended(self, move: Any) -> Any:
        return await self.plant.robot_moves.wait(move.id, ENDED_WITHIN_S)

    def records(self) -> list[Any]:
        return self.plant.robot_moves.log.of(self._rig.robot.unit(1).address)

    async def stop(self, mode: StopMode) -> Any:
        return await self._rig.robot.stop(mode)

    async def jog(self) -> Callable[[], Any]:
        jogs = self._rig.robot.jogs
        jog = await jogs.start(1, "Z", "+" if self.dice.random() < 0.5 else "-")
        return lambda: jogs.end(jog.id)

    def executed(self, frame: str) -> int:
        frames = {fact.request: str(fact.facts["frame"]) for fact in self._rig.machine.truth.of("request")}
        begun = self._rig.machine.truth.of("motion_start")[self._before :]
        return sum(frames.get(fact.request) == frame for fact in begun)

    def moving(self) -> bool:
        return self._rig.fics.job is not None

    def is_being_stopped(self) -> bool:
        return self._rig.robot.stops.unconfirmed is not None

    def is_there(self, move: Any) -> bool:
        if self._rig.stops()[-1].facts["why"] == "done":
            return True
        return not is_missed(move.target_position, move.position)  # a stop came at its very end

    async def make_fit(self) -> None:
        if self._rig.robot.latched_error is not None:
            await self._rig.robot.ask(ResetErrors())


async def echo_at_times(
    cable: SimulatedCable, kinds: list[Kind], dice: Random, seen: Counter[str], spells: Spells
) -> None:
    """Let the line echo from a drawn moment on, for a drawn time, again and again."""
    while True:
        await asyncio.sleep(dice.choice((dice.expovariate(1.0), dice.expovariate(0.1))))
        kind = dice.choice(kinds)
        seen[kind] += 1
        setattr(cable, kind, True)
        spells.append((now(), inf))
        await asyncio.sleep(
            dice.choice((dice.uniform(0.0, 0.1), dice.uniform(0.1, 2.0), dice.uniform(2.0, 15.0)))
        )
        setattr(cable, kind, False)
        spells[-1] = (spells[-1][0], now())


@asynccontextmanager
async def bodies(
    dice: Random, *, is_heard: bool
) -> AsyncIterator[tuple[TestedPlant, SimulatedCable, list[Client]]]:
    numbers = (0x00, 0x3F)
    async with rig(bodies=numbers, groups={}, baud=dice.choice(BAUDS), seed=dice.randrange(1000)) as stand:
        await asyncio.sleep(5.0)
        clients: list[Client] = [OfBody(stand, number, dice, is_heard=is_heard) for number in numbers]
        yield stand.plant, stand.wire, clients


def robot(
    mode: int,
) -> Callable[..., AbstractAsyncContextManager[tuple[TestedPlant, SimulatedCable, list[Client]]]]:
    @asynccontextmanager
    async def there(
        dice: Random, *, is_heard: bool
    ) -> AsyncIterator[tuple[TestedPlant, SimulatedCable, list[Client]]]:
        async with fics_rig(mode=mode, baud=dice.choice(BAUDS), seed=dice.randrange(1000)) as stand:
            assert (await stand.move(HomeRobot())).status is MoveStatus.SUCCEEDED
            stand.fics.units[1].positions = {1: (None, None, 10.0), 183: (None, None, 20.0)}
            yield stand.plant, stand.cable, [OfRobot(stand, dice, is_heard=is_heard)]

    return there


PLANTS = {"RC-400": bodies, "Fics in mode 2": robot(2), "Fics in mode 3": robot(3)}
KINDS: dict[str, list[Kind]] = {
    "local echo": ["echoes"],
    "joined wires": ["is_looped"],
    "either": ["echoes", "is_looped"],
}


async def story(plant: str, kinds: str, seed: int) -> Counter[str]:
    """Let clients work on a line that echoes at times, and give what was seen."""
    dice, seen = Random(seed), Counter[str]()
    async with PLANTS[plant](dice, is_heard=kinds != "local echo") as (plant_told, cable, clients):
        known, (line,) = plant_told.events.last, plant_told.ports().values()
        spells = Spells()
        for client in clients:
            client.spells = spells
        echoing = asyncio.create_task(echo_at_times(cable, KINDS[kinds], dice, seen, spells))
        await asyncio.gather(*(client.work() for client in clients))
        echoing.cancel()
        cable.echoes = cable.is_looped = False
        await until(lambda: line.state is LineState.READY, BACK_WITHIN_S)
        await asyncio.sleep(PROBED_WITHIN_S)
        for client in clients:
            await client.make_fit()
            seen += client.seen
        types = [
            plant_told.events.event(number).type for number in range(known + 1, plant_told.events.last + 1)
        ]
        wrong = [text for client in clients for text in client.wrong]
        wrong += [text for text in types if "power" in text or "strict" in text]
        alarms = [alarm for alarm in plant_told.alarms.standing() if alarm.ended_at is None]
        if kinds == "local echo":
            alarms += [alarm for alarm in plant_told.alarms.standing() if alarm.cause not in TOLD_OF_ECHOES]
        wrong += [f"{alarm.cause}: {alarm.en}" for alarm in alarms]
        assert not wrong, "\n".join(wrong)
    return seen


@pytest.mark.parametrize("plant", PLANTS)
@pytest.mark.parametrize("kinds", KINDS)
@pytest.mark.parametrize("seed", drawn(SEEDS, 2, "lines_that_echo"))
def test_what_is_told_on_a_line_that_echoes_at_times_is_true(plant: str, kinds: str, seed: int) -> None:
    run_virtual(story(plant, kinds, seed))
