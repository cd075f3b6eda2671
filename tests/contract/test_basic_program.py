"""The manual's BASIC program against the simulator, byte for byte (RC-420 manual 17.2 to 17.4)."""

import re
from collections.abc import Sequence
from pathlib import Path

import pytest

from simulator.rorze.world import EMS, Slits, Span
from tests.contract.hosts import ClockHost, Host, at_terminal

pytestmark = pytest.mark.anyio

COMMAND_ERROR = "<コマンドエラー>"
STOP_CAUSES = {
    0x1: "<脱調エラー>",
    0x2: "<CWリミット>",
    0x4: "<CCWリミット>",
    0x8: "<EMSリミット>",
    0xA: "<停止コマンド>",
}
"""VAL reads the two hexadecimal digits as decimal ones: H10, a stop command, becomes 10, which is &HA."""

LINK = ("&7FXID", "&7FXRS M1")
MODE_0 = (
    *LINK,
    "&00EAS0",
    "&00QIS2000",
    "&00OHS50000",
    "&00OLS5000",
    "&00OSS500000",
    "&00OAS30",
    "&00OBS10",
    "&000SS50",
    "&0000M",
    "&000QM",
    "&00QSS1",
)
MODE_1 = (
    *LINK,
    "&00EAS1",
    "&00OHS2000",
    "&00OLS500",
    "&00OSS100000",
    "&00OAS50",
    "&00OBS50",
    "&000SS50",
    "&00PAS4",
    "&00PBS1.00",
    "&00PES128",
    "&00PJS1",
    "&00PKS800",
    "&00PLS200",
    "&00PRS",
    "&00PSS1",
    "&00PTS50",
    "&0000M",
)
MODE_2 = (
    *LINK,
    "&00EAS2",
    "&00OHS5000",
    "&00OLS1000",
    "&00OSS100000",
    "&00OAS30",
    "&00OBS10",
    "&000SS50",
    "&0000M",
)
DOUSA = ("&001+M2000", "&001-M2000", "&001+M1000", "&001-M1000")


def mid(text: str, start: int, length: int) -> str:
    """MID$."""
    return text[start - 1 : start - 1 + length]


def val(text: str) -> int:
    """VAL."""
    number = re.match(r"\d+", text)
    return int(number[0]) if number else 0


class Program:
    """The program, statement for statement, but for its end after some rounds; `screen` is what it prints."""

    def __init__(self, host: Host) -> None:
        self.screen: list[str] = []
        self._host = host

    async def run(self, data: Sequence[str], rounds: int = 2) -> list[str]:
        """MAIN, with RESTORE DOUSA after each round."""
        for count in range(rounds):
            for command in DOUSA if count else (*data, *DOUSA):
                if not await self._do(command):
                    return self.screen
            self.screen.append(f"回数 {count + 1}")
        return self.screen

    async def _do(self, command: str) -> bool:
        """One command and, for a move, its end; False where the program ends."""
        self.screen.append(f"- {command}")
        self._host.send(command)
        reply = await self._receive()
        self.screen.append(reply.removesuffix("\r"))
        if mid(reply, 8, 1) == "@":
            self.screen.append(COMMAND_ERROR)
            return False
        if mid(command, 6, 1) != "M":
            return True
        stop_cause = val(mid(await self._receive(), 12, 2))
        if stop_cause in STOP_CAUSES:
            self.screen.append(STOP_CAUSES[stop_cause])
        return stop_cause not in STOP_CAUSES

    async def _receive(self) -> str:
        """RECEIVE: everything that comes until there is a CR in it."""
        received = ""
        while "\r" not in received:
            received += (await self._host.receive()).decode()
        return received


def screen_without_errors(data: Sequence[str]) -> list[str]:
    """The output of two rounds without an error."""
    screen = []
    for number, commands in enumerate(((*data, *DOUSA), DOUSA), 1):
        for command in commands:
            reply = ">&7FXID00" if command == "&7FXID" else f">{command.replace(' ', '')[:6]}"
            screen += [f"- {command}", reply]
        screen.append(f"回数 {number}")
    return screen


def mount_disc(host: Host, period: int = 2_000) -> None:
    """A disc with a slit over the place where the origin search ends."""
    host.change(body=0x00, slits=Slits(-1_200, period))


async def test_the_program_runs_at_a_terminal(tmp_path: Path) -> None:
    """17.2: homing, centring and two rounds with stall detection, in real time."""
    async with at_terminal(tmp_path / "COM1", [0x00]) as host:
        mount_disc(host)
        assert await Program(host).run(MODE_0) == screen_without_errors(MODE_0)
        await host.play("""
            &006PD
            >&006PD+000000000
            &009CD
            >&009CDH00
        """)


@pytest.mark.parametrize("data", [MODE_0, MODE_1, MODE_2], ids=["17.2", "17.3", "17.4"])
async def test_the_program_with_each_set_of_data(data: Sequence[str]) -> None:
    """17.2 to 17.4."""
    host = ClockHost(0x00)
    mount_disc(host)
    assert await Program(host).run(data) == screen_without_errors(data)
    assert await host.ask("&006PD") == ">&006PD+000000000"
    assert await host.ask("&009CD") == ">&009CDH00"


async def test_it_ends_with_the_cause_when_a_limit_stops_the_motor() -> None:
    host = ClockHost(0x00)
    mount_disc(host)
    host.change(body=0x00, cw_limit=Span(500, 600))
    screen = await Program(host).run(MODE_0)
    assert screen[-3:] == ["- &001+M2000", ">&001+M", "<CWリミット>"]


async def test_it_ends_when_the_motor_stalls() -> None:
    """The disc's period is not the one set by QIS."""
    host = ClockHost(0x00)
    mount_disc(host, period=1_000)
    screen = await Program(host).run(MODE_0)
    assert screen[-3:] == ["- &001+M2000", ">&001+M", "<脱調エラー>"]


class StoppedLine(ClockHost):
    """A line on which something else stops the first move clockwise, as a program in the controller could."""

    async def receive(self) -> bytes:
        received = await super().receive()
        if received.startswith(b">&001+M"):
            self.wait(0.01)
            self.touch(self._stop)
        return received

    def _stop(self, now: float) -> None:
        self.line.axes[0x00].execute("5IS", now)
        self.line.look_after(0x00)


async def test_it_ends_when_something_else_stops_the_motor() -> None:
    screen = await Program(StoppedLine(0x00)).run(MODE_2)
    assert screen[-3:] == ["- &001+M2000", ">&001+M", "<停止コマンド>"]


async def test_it_ends_when_a_command_is_refused() -> None:
    host = ClockHost(0x00)
    host.change(body=0x00, forced={EMS: True})
    screen = await Program(host).run(MODE_0)
    assert screen[-3:] == ["- &0000M", ">&0000M@51", COMMAND_ERROR]
