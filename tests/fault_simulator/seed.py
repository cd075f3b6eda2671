"""One seed: a plant with its clients, on a bad wire, through several lives; it always does the same.

`python -m tests.fault_simulator.seed 4711` runs one again and prints what happened.
"""

import asyncio
import secrets
import sys
import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from hashlib import sha256
from random import Random
from typing import Any, Final, NamedTuple
from unittest.mock import patch

from gateway.access.principal import EVERYBODY, asking
from gateway.core import origin
from gateway.core.errors import GatewayError, NotFound
from gateway.core.events import Event
from gateway.core.exchange import QUEUE_LIMIT, STOPS
from gateway.core.line_state import LineState
from gateway.core.origin import Origin
from gateway.core.targets import BegunMoves, CommandReplies, MemberAnswers
from gateway.door import doing, stopping
from gateway.fics.exchange import FicsExchange, RobotAnswered
from gateway.rorze.session import RorzeSession
from simulator.faults import Direction, Fault, Switch
from simulator.wire import Wire
from tests.fault_simulator.families import Family, Fics, Rorze
from tests.fault_simulator.history import Deed, History, told_by
from tests.fault_simulator.model_disk import ModelDisk
from tests.fault_simulator.world import Cable, Life, Written
from tests.simulation.test_faulty_line import InOrder
from tests.virtual_time import run_virtual

COMMANDS: Final = 200
"""Commands that clients send in one seed."""
CLIENTS: Final = 3
BAUD: Final = 38_400
LONGEST_S: Final = 2_000.0
"""A plant that stands still fails the test instead of keeping it."""
LIVENESS_S: Final = 10.0
LAST_MOVES_S: Final = 400.0
SET_UP_S: Final = 30.0
MOMENTS: Final = {
    "commit": 60,
    "write": 400,
    "written": 400,
    "move.queued": 12,
    "move.sent": 12,
    "move.succeeded": 8,
    "stop.requested": 3,
}
"""Kinds of moments at which a gateway may be killed, each with the last that is drawn; events by type."""
JUMPS_S: Final = (3_600.0, 400 * 86_400.0)
"""Seconds by which the wall clock jumps at most, forth or back, often and seldom."""
_WORST: Final = {
    Fault.LOST: (0.03, 0.03),
    Fault.GARBLED: (0.02, 0.02),
    Fault.LATE: (0.0, 0.04),
    Fault.DOUBLED: (0.03, 0.03),
    Fault.MERGED: (0.01, 0.0),
    Fault.NOISE: (0.0, 0.02),
    Fault.SPLIT: (0.02, 0.02),
}
"""Share of the requests, and of the replies, that a fault hits at most."""


class Report(NamedTuple):
    """The results of a seed."""

    violations: list[str]
    wanted: int
    """Commands that clients have asked for, stops among them."""
    faults: int
    crashes: int
    told: Counter[str]
    digest: str
    """Digest of all that went over the cable."""


class Seed:
    """One plant with all its lives."""

    def __init__(
        self, seed: int, wanted: int = COMMANDS, *, jumps: bool = True, family: Family | None = None
    ) -> None:
        self._dice = Random(seed)
        self._left = wanted
        self._wanted = wanted
        self.family = family or self._draw_family(seed)
        self.cable = Cable(self.family.machine, BAUD, Random(seed + 2))
        self.history = History(self.family, self.cable)
        self._wire_faults = InOrder(Random(seed + 1))
        machine: Any = self.family.machine
        machine.faults = machine._wire._faults = self._wire_faults
        self._disk = ModelDisk()
        self._lives = 0
        self._clock_shift, self._jumps = 0.0, jumps
        self._life: Life

    def _draw_family(self, seed: int) -> Family:
        if seed % 4 < 2:
            return Rorze(seed)
        return Fics(mode=seed % 4, units=1 + seed // 4 % 2)

    async def run(self) -> Report:
        """Live until all is done, and judge."""
        with self._watched():
            crashes = 3 if self._dice.random() < 0.2 else 2
            async with asyncio.timeout(LONGEST_S):
                while self._left > 0:
                    last = self.history.crashes == crashes
                    share = self._left if last else min(self._left, self._wanted // (crashes + 1))
                    await self._live(share, dies=not last)
                await self._live(0, dies=False)
        faulty = [fact.facts["faults"] for fact in self.cable.machine.truth if "faults" in fact.facts]
        self.history.faults += sum(len(faults) for faults in faulty if isinstance(faults, dict))
        told = Counter[str](deed.told for deed in self.history.deeds.values())
        violations, digest = self.history.judge(), sha256()
        for written in self.cable.history:
            digest.update(f"{written.at:.6f} {written.text}".encode())
        return Report(
            violations,
            len(self.history.deeds) + len(self.history.stops),
            self.history.faults,
            self.history.crashes,
            told,
            digest.hexdigest(),
        )

    # lives

    async def _live(self, share: int, *, dies: bool) -> None:
        """One life, for some of the commands; the last one for none, on a line that is well."""
        dice, self._lives = self._dice, self._lives + 1
        life = self._life = Life(self._lives, self._disk, self._judge_write, self.cable.cut)
        if dies:
            kind = dice.choice(list(MOMENTS))
            moment = f"{self.family.topic}.{kind}" if "." in kind else kind
            life.dies_at[moment] = dice.randint(1, MOMENTS[kind])
        life.begin(self.family.config, self.cable, Random(dice.random()), lambda: dice.uniform(0.0005, 0.02))
        self._watch_events(life)
        await life.plant.start()
        try:
            if share:
                await self._busy(life, share)
            else:
                await self._get_well(life)
            if dies and not life.killed.is_set():
                life.kill()
        finally:
            await life.plant.close()
        self.history.crashes += dies
        power_cut = dies and dice.random() < 0.5
        self._disk = life.disk.after_power_cut(dice) if power_cut else life.disk.after_kill()
        await asyncio.sleep(dice.uniform(0.1, 4.0))

    async def _busy(self, life: Life, share: int) -> None:
        """Clients want something until their share is done, or the gateway is killed."""
        self._spoil()
        until = self._left - share
        clients = [asyncio.create_task(self._client(life, until)) for _ in range(CLIENTS)]
        chaos = asyncio.create_task(self._chaos(life))
        death = asyncio.create_task(life.killed.wait())
        over = asyncio.ensure_future(asyncio.wait(clients))
        await asyncio.wait([death, over], return_when=asyncio.FIRST_COMPLETED)
        for task in (*clients, chaos, death, over):
            task.cancel()
        for outcome in await asyncio.gather(*clients, chaos, death, over, return_exceptions=True):
            if isinstance(outcome, Exception):
                raise outcome
        self._mend()

    async def _get_well(self, life: Life) -> None:
        """After the faults have ceased every line works, and every move is over: I14."""
        self._mend()
        await asyncio.sleep(SET_UP_S)
        plant = life.plant
        for port in plant.ports().values():
            if port.state is not LineState.READY or any(port.waiting().values()):
                self.history.violate("I14", f"{port.id} is {port.state}, {port.waiting()} wait")
        logs = [log for family in plant.packages.families.values() for log in family.move_logs()]
        for deed in self.history.deeds.values():
            for move_id in deed.moves:
                for log in logs:
                    with suppress(NotFound):
                        self.history.final[move_id] = await log.wait(move_id, LAST_MOVES_S)
                        if not self.history.final[move_id].status.final:
                            self.history.violate("I14", f"{move_id} never ends")

    # clients

    async def _client(self, life: Life, until: int) -> None:
        while self._left > until:
            chance = self._dice.random()
            if chance < 0.04:
                await self._stop(life)
            elif chance < 0.12:
                await self._hasten(life)
            else:
                await self._want(life)
            await asyncio.sleep(self._dice.choice((0.0, self._dice.uniform(0.0, 0.3))))

    async def _hasten(self, life: Life) -> None:
        """Want something, and stop it before it can have been done."""
        wanted = asyncio.create_task(self._want(life))
        try:
            await asyncio.sleep(self._dice.uniform(0.0, 0.03))
            await self._stop(life)
            await wanted
        finally:
            wanted.cancel()

    async def _want(self, life: Life) -> None:
        self._left -= 1
        wish = self.family.wish(self._dice)
        deed = Deed(f"d{len(self.history.deeds)}", wish.path, wish.command, self._now())
        self.history.deeds[deed.id] = deed
        try:
            result = await doing.do(life.plant, Origin("client", deed.id), wish.path, wish.command)
        except GatewayError as error:
            deed.told, deed.error = told_by(error)
            return
        if isinstance(result, BegunMoves):
            deed.told, deed.moves = "begun", [move.id for move in result.moves]
            if self._dice.random() < 0.7:
                await asyncio.gather(*(self._end_of(life, move_id) for move_id in deed.moves))
        elif isinstance(result, CommandReplies | MemberAnswers):
            deed.told = "done"

    async def _end_of(self, life: Life, move_id: str) -> None:
        for family in life.plant.packages.families.values():
            for log in family.move_logs():
                with suppress(NotFound):
                    await log.wait(move_id, 20.0)

    async def _stop(self, life: Life) -> None:
        self._left -= 1
        origin, mode = Origin("client", "stop"), self._dice.choice(("immediate", "decelerate"))
        everything = frozenset().union(*map(self.family.reach, self.family.targets))
        if self._dice.random() < 0.3:
            self.history.stops.append((self._now(), everything))
            await stopping.stop_all(life.plant, origin, mode)  # type: ignore[arg-type]
        else:
            target = self._dice.choice(self.family.targets)
            self.history.stops.append((self._now(), self.family.reach(target)))
            await stopping.stop(life.plant, origin, target, mode)  # type: ignore[arg-type]

    # what goes wrong

    def _spoil(self) -> None:
        """Each fault of the wire is there or not, and as bad as the dice say."""
        dice = self._dice
        for fault, worst in _WORST.items():
            if fault is Fault.GARBLED and self.family.name == "fics-2":
                worst = (worst[0], 0.0)  # one bit makes a refusal of E00
            for direction, most in zip(Direction, worst, strict=True):
                if most and dice.random() < 0.7:
                    delay_s = 0.05 if fault in (Fault.LATE, Fault.SPLIT) else 0.01
                    share, spread_s = dice.uniform(0.2, 1.0) * most, dice.uniform(0.0, 1.0)
                    self._wire_faults.set(Switch(fault, direction, share, delay_s=delay_s, spread_s=spread_s))

    def _mend(self) -> None:
        self._wire_faults.clear()
        self._life.disk.full = False
        self.cable.plug_in()
        self.family.restore(self.cable, self._now())

    async def _chaos(self, life: Life) -> None:
        """Power goes and comes back, the cable is pulled, the disk is full, and the wall clock jumps."""
        dice = self._dice
        while True:
            await asyncio.sleep(dice.uniform(0.5, 8.0))
            self.history.faults += 1
            kind = dice.choices(("power", "cable", "disk", "clock"), (4, 1, 2, 1))[0]
            if kind == "power":
                self.history.upsets += 1
                await asyncio.sleep(self.family.upset(self.cable, dice, self._now()))
                self.family.restore(self.cable, self._now())
            elif kind == "cable":
                self.cable.unplug()
                await asyncio.sleep(dice.uniform(0.1, 2.0))
                self.cable.plug_in()
            elif kind == "disk":
                life.disk.full = True
                await asyncio.sleep(dice.uniform(0.1, 8.0))
                life.disk.full = False
            else:
                self._clock_shift += self._jumps * dice.choice(JUMPS_S) * dice.uniform(-1.0, 1.0)
            for port in life.plant.ports().values():
                if max(port.waiting().values(), default=0) > 2 * QUEUE_LIMIT:
                    self.history.violate("I13", port.waiting())

    # watching

    def _judge_write(self, written: Written) -> None:
        has_intent = self._life.disk.has_intent(written.request_id, written.text)
        self.history.judge_write(written, has_intent=has_intent)

    def _watch_events(self, life: Life) -> None:
        def published(event: Event) -> None:
            if not life.killed.is_set():
                self.history.judge_event(event, life.plant.events.epoch)

        life.plant.events.listeners.insert(0, published)

    @contextmanager
    def _watched(self) -> Iterator[None]:
        """See which frame each reply answers, and to which it is credited."""
        random_ids = Random(self._wanted)
        put_out, note, credit = Wire._put_out, RorzeSession.note_reply, FicsExchange.credit

        take, clear, cable = Wire.take_output, Wire.clear, self.cable

        def taken(wire: Wire) -> bytes:
            cable.pieces += cable.coming
            cable.coming.clear()
            return take(wire)

        def cleared(wire: Wire) -> None:
            cable.coming.clear()
            clear(wire)

        def noted(session: RorzeSession, exchange: Any, frame: Any, at: float) -> None:
            self._judge_credit(exchange, frame)
            note(session, exchange, frame, at)

        def credited(exchange: FicsExchange, frame: Any, at: float = 0.0) -> Any:
            outcome = credit(exchange, frame, at)
            if isinstance(outcome, RobotAnswered):
                self._judge_credit(exchange, frame)
            return outcome

        with ExitStack() as stack:
            for owner, name, new in (
                (Wire, "_put_out", self._pieces_of_output(put_out)),
                (Wire, "take_output", taken),
                (Wire, "clear", cleared),
                (RorzeSession, "note_reply", noted),
                (FicsExchange, "credit", credited),
                (time, "time", self._wall_clock),
                (time, "monotonic", self._now),
                (time, "time_ns", lambda: int(self._wall_clock() * 1e9)),
                (asyncio, "to_thread", _at_once),
                (secrets, "token_hex", lambda size: random_ids.randbytes(size).hex()),
                (origin, "_DIGITS", random_ids),
            ):
                stack.enter_context(patch.object(owner, name, new))
            yield

    def _pieces_of_output(self, put_out: Callable[..., None]) -> Callable[..., None]:
        def noted(wire: Wire, request: int | None, piece: bytes, now: float) -> None:
            put_out(wire, request, piece, now)
            self.cable.coming.append((request, len(piece)))

        return noted

    def _judge_credit(self, exchange: Any, frame: object) -> None:
        if exchange.lane in STOPS or self._life.killed.is_set():
            return
        answered = self.cable.answering
        numbers = self._wire_faults.parts.get(answered or 0, frozenset()) | self.cable.unended
        text = exchange.frame.decode("ascii", "backslashreplace")
        self.history.judge_credit(text, answered=answered, numbers=numbers, what=frame)

    def _wall_clock(self) -> float:
        """It jumps; nothing but a time that is told may depend on it."""
        return 1.79e9 + self._now() + self._clock_shift

    def _now(self) -> float:
        return asyncio.get_running_loop().time()


async def _at_once(deed: Callable[..., Any], *arguments: Any) -> Any:
    """Virtual time waits for no thread."""
    return deed(*arguments)


def run(seed: int, wanted: int = COMMANDS, *, jumps: bool = True, family: Family | None = None) -> Report:
    """Run one seed in virtual time; without `jumps` of the wall clock all else is the same."""

    async def story() -> Report:
        return await Seed(seed, wanted, jumps=jumps, family=family).run()

    with asking(EVERYBODY):
        return run_virtual(story())


if __name__ == "__main__":
    for number in map(int, sys.argv[1:]):
        report = run(number)
        sys.stdout.write(f"{number}: {report}\n")
