"""How a line and its robot come to terms: the opening, the mode, silence, and the loss of power."""

import asyncio
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from itertools import pairwise
from random import Random
from typing import Any

import pytest

from gateway.core.errors import Cancelled, Expired, InvalidRequest, NoReply, NotSent, PortNotOpen
from gateway.core.exchange import Lane
from gateway.core.line import SILENCE_S
from gateway.core.line_state import LineState
from gateway.fics.errors import RobotOffline
from gateway.fics.exchange import FicsExchange, Outcome, RobotAnswered
from gateway.fics.line import ASK_AGAIN_S, CLEARING, READY_WITHIN_S, FicsLine
from protocols.fics.inputs_outputs import SwitchOutput
from protocols.fics.moves import MoveRelative
from protocols.fics.row import FicsCommand
from protocols.fics.stops import StopAllImmediately
from protocols.fics.variables import GetVariable, VariableValue
from protocols.table import Reply
from simulator.faults import Direction, Fault, Switch
from simulator.fics.layout import Layout
from simulator.fics.line import SimulatedFics, build_line
from tests.fics_plants import Cable
from tests.gateway.rorze.far_end import until, virtual
from transports.base import TransportRefused

OPENING = CLEARING.decode().rstrip("\r")
QUERY = GetVariable(number=5)
MOVE = MoveRelative(coordinates=[None, None, -5.0])
STOP = StopAllImmediately()


class Wire(Cable):
    """A cable that notes when each frame was written, and may refuse one."""

    def __init__(self, machine: SimulatedFics, baud: int | None = None) -> None:
        super().__init__(machine, baud)
        self.times: list[float] = []
        self.refused = ""

    def write(self, data: bytes) -> None:
        if self.refused and data.startswith(self.refused.encode()):
            raise TransportRefused("The message is too long.")
        super().write(data)
        self.times.append(now())

    def times_of(self, frame: str) -> list[float]:
        return [at for at, text in zip(self.times, self.frames(), strict=True) if text == frame]


class Answers(list[tuple[str, dict[str, object]]]):
    """Events of the line."""

    def of(self, beginning: str) -> list[str]:
        return [what for what, _ in self if what.startswith(beginning)]


class Stand:
    """A line, its wire, and the simulated robot behind it."""

    def __init__(self, mode: int, baud: int | None, prepare: Callable[[SimulatedFics], object]) -> None:
        self.machine = build_line(Layout())
        prepare(self.machine)
        self.wire = Wire(self.machine, baud)
        self.line = FicsLine("cell", self.wire, "r1", mode=mode, rng=Random(0))
        self.told = Answers()
        self.line.on_change = lambda what, facts: self.told.append((what, facts))

    async def ready(self) -> None:
        await until(lambda: self.line.state is LineState.READY)

    def ask(
        self, command: FicsCommand[Reply], lane: Lane = Lane.COMMAND, **more: Any
    ) -> "asyncio.Future[Outcome]":
        return self.line.submit(self.exchange(command, lane, **more))

    def exchange(self, command: FicsCommand[Reply], lane: Lane = Lane.COMMAND, **more: Any) -> FicsExchange:
        exchange = self.line.exchange(command, lane)
        for name, value in more.items():
            setattr(exchange, name, value)
        return exchange

    def power(self, on: bool) -> None:
        (self.machine.power_on if on else self.machine.power_off)(now())
        self.wire.turn()

    def power_cycle(self) -> None:
        self.power(False)
        self.power(True)

    def heard(self, text: str) -> int:
        """Number of times that the robot has heard a command."""
        return [fact.facts["text"] for fact in self.machine.truth.of("command")].count(text)


@asynccontextmanager
async def stand(
    *, mode: int = 3, baud: int | None = None, prepare: Callable[[SimulatedFics], object] = lambda _: None
) -> AsyncIterator[Stand]:
    it = Stand(mode, baud, prepare)
    it.line.start()
    yield it
    await it.line.close()


def now() -> float:
    return asyncio.get_running_loop().time()


def said(*texts: str) -> Callable[[SimulatedFics], None]:
    """Let another host speak to the robot before the gateway does."""

    def prepare(machine: SimulatedFics) -> None:
        for text in texts:
            machine.receive(text.encode() + b"\r", 0.0)
        machine.take_output(0.0)

    return prepare


# set-up and mode


@virtual
async def test_a_robot_fresh_from_power_on_is_told_its_mode_and_asked_whether_it_took_it() -> None:
    async with stand() as it:
        await it.ready()
        assert it.wire.frames() == [OPENING, "MOD", "MOD 3", "MOD"]
        opened_at, asked_at = it.wire.times[:2]
        assert asked_at == pytest.approx(opened_at + SILENCE_S)
        assert it.told == [("line.up", {"mode": 3})]


@virtual
async def test_a_robot_in_its_mode_already_is_only_asked() -> None:
    async with stand(prepare=said("MOD 3")) as it:
        await it.ready()
        assert it.wire.frames() == [OPENING, "MOD"]


@virtual
async def test_in_mode_2_the_error_that_the_opening_may_have_left_is_taken_away() -> None:
    async with stand(mode=2) as it:
        await it.ready()
        assert it.wire.frames() == [OPENING, "MOD", "ERR"]
        assert it.told == [("line.up", {"mode": 2})]


@pytest.mark.parametrize(("mode", "asked"), [(3, ["MOD"]), (2, ["MOD", "POF", "VAR"] * 3 + ["VER", "ERR"])])
def test_a_robot_in_motion_is_left_in_the_mode_it_is_in(mode: int, asked: list[str]) -> None:
    """In motion MOD is refused in Ver.3 and not answered in Ver.2: then the version tells the mode."""

    @virtual
    async def story() -> None:
        async with stand(mode=mode, prepare=said(f"MOD {mode}", "VAO 1,1,1", "LMI ,,-50")) as it:
            await it.ready()
            assert it.machine.robot.mode == mode
            assert it.machine.robot.job is not None
            assert [text[:3] for text in it.wire.frames()[1:]] == asked
            assert it.told.of("robot.power") == []

    story()


@virtual
async def test_a_robot_that_stays_in_the_wrong_mode_is_asked_less_and_less_often() -> None:
    async with stand() as it:
        it.wire.lost_command = "MOD 3"
        await asyncio.sleep(20)
        assert it.line.state is LineState.SETTING_UP
        tries = it.wire.times_of("MOD 3")
        first, longest = ASK_AGAIN_S
        pauses = [later - earlier for earlier, later in pairwise(tries)]
        assert pauses[0] < pauses[1] < pauses[2] == pytest.approx(pauses[3])
        assert pauses[1] - pauses[0] == pytest.approx(first)
        assert pauses[2] - pauses[0] == pytest.approx(longest - first)
        it.wire.lost_command = ""
        await it.ready()


@pytest.mark.parametrize("mode", [2, 3])
def test_a_robot_of_c_host_ver_2_knows_no_mod_and_is_served_in_mode_2_alone(mode: int) -> None:
    """MOD is new in Ver.3 (C-HOST manual 1-7); the alarm tells what to configure, not that none answers."""

    @virtual
    async def story() -> None:
        async with stand(mode=mode) as it:
            it.wire.lost_command = "MOD"
            await asyncio.sleep(20)
            if mode == 2:
                assert it.line.state is LineState.READY
            else:
                assert "configure mode = 2" in str(it.line.trouble)

    story()


@virtual
async def test_before_the_mode_is_agreed_on_nothing_is_sent_but_stops() -> None:
    async with stand() as it:
        it.wire.lost_command = "MOD 3"
        await until(lambda: "MOD 3" in it.wire.frames())
        early = it.ask(SwitchOutput(channel=1, bit=0, on=True))
        stop = it.ask(STOP, Lane.STOP)
        await asyncio.sleep(0.2)
        assert it.heard("AES") == 1
        assert it.heard("IOT 1-0:+") == 0
        it.wire.lost_command = ""
        await it.ready()
        assert stop.done()
        await asyncio.wait([early], timeout=5)
        assert it.wire.frames().index("IOT 1-0:+") > it.wire.frames().index("MOD 3")


@virtual
async def test_who_asks_during_a_long_set_up_is_told_soon_and_afterwards_at_once() -> None:
    async with stand() as it:
        it.wire.lost_command = "MOD 3"
        await until(lambda: "MOD 3" in it.wire.frames())
        begun_at = now()
        outcome = await it.ask(QUERY, Lane.READ)
        assert type(outcome) is NotSent
        assert outcome.detail == "Robot r1 is being set up; nothing was sent."
        assert READY_WITHIN_S / 2 < now() - begun_at <= READY_WITHIN_S
        with pytest.raises(NotSent, match="is being set up"):
            it.ask(MOVE)
        stop = it.ask(STOP, Lane.STOP)
        it.wire.lost_command = ""
        await it.ready()
        assert stop.done()
        assert isinstance(await it.ask(QUERY, Lane.READ), RobotAnswered)
        assert it.heard("VAR V05") == 1


@pytest.mark.parametrize("mode", [2, 3])
def test_an_upload_left_open_is_ended_however_often_its_end_is_lost(mode: int) -> None:
    @virtual
    async def story() -> None:
        def left_open(machine: SimulatedFics) -> None:
            said(f"MOD {mode}", "POF 1")(machine)
            machine.faults.set(Switch(Fault.LOST, Direction.REQUESTS, next_frames=2))  # the opening

        async with stand(mode=mode, prepare=left_open) as it:
            it.wire.lost_command = "POF 2"
            await asyncio.sleep(10)
            assert it.machine.robot.upload is not None
            assert it.told == [("robot.offline", {})]
            it.wire.lost_command = ""
            await it.ready()
            assert it.told.of("robot") == ["robot.offline", "robot.online"]
            assert it.machine.robot.upload is None
            assert it.line.online

    story()


# asking


@virtual
async def test_nothing_can_be_asked_before_the_port_is_open() -> None:
    it = Stand(3, None, lambda _: None)
    it.wire.plugged_in = False
    it.line.start()
    await asyncio.sleep(1)
    for command, lane in ((QUERY, Lane.READ), (STOP, Lane.STOP)):
        with pytest.raises(PortNotOpen):
            it.ask(command, lane)
    await it.line.close()


@virtual
async def test_what_could_not_be_written_in_time_is_told_at_that_time() -> None:
    async with stand() as it:
        await it.ready()
        it.wire.stuck = True
        it.ask(STOP, Lane.STOP)
        expires_at = now() + 0.2
        assert isinstance(await it.ask(MOVE, expires_at=expires_at), Expired)
        assert now() == pytest.approx(expires_at)
        it.wire.stuck = False
        await asyncio.sleep(1)
        assert "LMI ,,-5" not in it.wire.frames()


@virtual
async def test_what_the_port_does_not_carry_is_not_sent_and_the_line_stays_up() -> None:
    async with stand() as it:
        await it.ready()
        it.wire.refused = "IOT"
        outcome = await it.ask(SwitchOutput(channel=1, bit=0, on=True))
        assert isinstance(outcome, InvalidRequest)
        assert outcome.detail == "The message is too long. Nothing was sent."
        assert it.line.state is LineState.READY
        assert isinstance(await it.ask(QUERY, Lane.READ), RobotAnswered)


# silence


@virtual
async def test_a_robot_that_has_never_answered_makes_a_silent_line_that_says_what_to_check(
    caplog: pytest.LogCaptureFixture,
) -> None:
    async with stand() as it:
        it.power(False)
        await asyncio.sleep(30)
        assert it.line.state is LineState.SILENT
        assert it.line.trouble is not None
        for cause in ("cable", "power", "baud rate", "terminator", "mode"):
            assert cause in it.line.trouble
        assert caplog.text.count("is silent") == 1
        assert it.told.of("line") == []
        it.power(True)
        await it.ready()
        assert it.told.of("line") == ["line.up"]
        assert it.line.trouble is None


@virtual
async def test_a_robot_that_falls_silent_is_told_once_and_asked_until_it_is_back() -> None:
    async with stand() as it:
        await it.ready()
        it.power(False)
        assert isinstance(await it.ask(QUERY, Lane.READ), NoReply)
        assert not it.line.online
        with pytest.raises(RobotOffline):
            it.ask(QUERY, Lane.READ)
        await asyncio.sleep(30)
        assert it.told.of("robot") == ["robot.offline"]
        assert it.line.state is LineState.SILENT
        assert it.told.of("line") == ["line.up", "line.down"]
        it.power(True)
        await it.ready()
        assert it.line.online
        assert it.told.of("robot.o") == ["robot.offline", "robot.online"]
        assert it.told.of("line") == ["line.up", "line.down", "line.up"]


@virtual
async def test_a_stop_is_sent_to_a_robot_that_is_silent() -> None:
    async with stand() as it:
        await it.ready()
        it.power(False)
        await it.ask(QUERY, Lane.READ)
        sent = len(it.wire.written)
        assert isinstance(await it.ask(STOP, Lane.STOP), NoReply)
        assert "AES" in it.wire.frames(sent)


# the loss of power


@virtual
async def test_a_robot_in_the_wrong_mode_has_certainly_lost_its_power_and_its_motion() -> None:
    async with stand() as it:
        await it.ready()
        motion = it.ask(MOVE)
        await asyncio.sleep(0.1)
        waits = it.exchange(SwitchOutput(channel=1, bit=0, on=True))
        it.power_cycle()
        it.line.power_was_lost("the robot is in Ver.2")
        future = it.line.submit(waits)
        assert isinstance(await motion, NoReply)
        await it.ready()
        assert isinstance(await future, RobotAnswered)  # admitted after the loss was told
        assert ("robot.power_cycled", {}) in it.told
        assert it.told.of("robot.power") == ["robot.power_cycled"]
        assert it.machine.robot.mode == 3


@virtual
async def test_what_waited_when_the_power_was_lost_is_never_sent() -> None:
    async with stand(baud=9600) as it:
        await it.ready()
        it.ask(QUERY, Lane.READ)
        waiting = it.ask(MOVE)
        it.power_cycle()
        it.line.power_was_lost("the robot is in Ver.2")
        assert isinstance(await waiting, Cancelled)
        await it.ready()
        assert it.heard("LMI ,,-5") == 0


@pytest.mark.parametrize(("mode", "lost", "absences"), [(3, ["robot.power_cycled"], 0), (2, [], 1)])
def test_a_robot_that_was_away_is_to_be_asked_where_its_mode_does_not_tell(
    mode: int, lost: list[str], absences: int
) -> None:
    @virtual
    async def story() -> None:
        async with stand(mode=mode) as it:
            await it.ready()
            it.power(False)
            await it.ask(QUERY, Lane.READ)
            it.power(True)
            await it.ready()
            assert it.told.of("robot.power_cycled") == lost
            assert it.line.absences == absences

    story()


@virtual
async def test_a_cable_pulled_from_a_robot_in_ver_3_proves_no_loss_of_power() -> None:
    async with stand() as it:
        await it.ready()
        it.wire.unplug()
        it.wire.plugged_in = True
        await asyncio.sleep(1)
        await it.ready()
        assert it.told.of("robot") == []
        assert it.wire.frames().count(OPENING) == 2


@virtual
async def test_what_was_read_before_the_port_was_lost_belongs_to_no_answer_after_it() -> None:
    async with stand() as it:
        await it.ready()
        it.line.data_received(b"VAR V05")
        it.wire.unplug()
        it.wire.plugged_in = True
        await asyncio.sleep(1)
        await it.ready()
        assert it.line.counters["garbage"] == 0
        outcome = await it.ask(QUERY, Lane.READ)
        assert outcome == RobotAnswered((VariableValue(number=5, value=0.0),))
