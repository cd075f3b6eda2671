"""Searching ports: who is found, at which rate, and that only questions are asked."""

import asyncio
from dataclasses import replace
from pathlib import Path

import pytest

from gateway import search as module
from gateway.found import Found, FoundLine, FoundRobot
from gateway.search import BAUDS, addresses_of, search, serial_devices
from protocols.fics.link import Terminator
from simulator.fics.layout import Layout
from simulator.fics.line import LineSettings, SimulatedFics
from simulator.fics.line import build_line as build_fics
from simulator.rorze.line import Rc400Line, build_line
from simulator.truth import TruthLog
from tests.gateway.rorze.far_end import until
from tests.plants import in_virtual_time
from tests.simulated_line import Machine, SimulatedCable
from transports import Transport
from transports.addresses import Address
from transports.base import Receiver, TransportLost, TransportUnavailable

BODIES = (0x00, 0x0A, 0x3F)
ALLOWED = ("!", "&7FXID", "MOD\r", "VER\r", "UNT", "ACD\r")
"""Beginnings of the frames that may be sent, besides reads of position entries."""


class Deaf(Transport):
    """A port whose far end understands no byte."""

    def __init__(self, address: str, noise: bytes = b"") -> None:
        super().__init__(address)
        self._noise, self.written = noise, list[bytes]()

    async def open(self, receiver: Receiver) -> None:
        self._receiver = receiver

    def write(self, data: bytes) -> None:
        self.written.append(data)
        if self._noise:
            asyncio.get_running_loop().call_soon(self._receiver.data_received, self._noise)

    def unsent(self) -> int:
        return 0

    async def close(self) -> None:
        pass


class Refused(Deaf):
    """A port that another program has."""

    async def open(self, _receiver: Receiver) -> None:
        raise TransportUnavailable(f"{self.address} was not opened: in use. Nothing was sent.")


class Pulled(Deaf):
    """An adapter that goes at the first byte."""

    def write(self, _data: bytes) -> None:
        asyncio.get_running_loop().call_soon(
            self._receiver.connection_lost, TransportLost(f"{self.address} has gone")
        )


class Bench:
    """Ports with what is at them; a machine understands one baud rate."""

    def __init__(self) -> None:
        self.machines: dict[tuple[str, str], Machine] = {}
        self.ports: dict[str, type[Deaf]] = {}
        self.timed_baud: int | None = None
        """Rate at which bytes take their time; None, they take none."""
        self.opened: list[Transport] = []
        self.notes: list[str] = []
        self.told: list[str] = []
        self.found: list[Found] = []
        self.asking_body_20 = asyncio.Event()

    def open(self, address: str) -> Transport:
        parts = Address.parse(address)
        machine = self.machines.get((parts.path or parts.host, parts.options.get("baud", "")))
        port: Transport
        if machine is not None:
            port = SimulatedCable(machine, self.timed_baud)
            port.address = address
        elif parts.path in self.ports:
            port = self.ports[parts.path](address)
        else:
            port = Deaf(address, b"\xfe\x00>&\x7f\r")
        self.opened.append(port)
        return port

    async def search(self, *ports: str, thorough: bool = True) -> list[Found]:
        await search(
            [addresses_of(port) for port in ports],
            self.found,
            self._tell,
            note=self.notes.append,
            open_transport=self.open,
            thorough=thorough,
        )
        return self.found

    def _tell(self, address: str, what: str) -> None:
        self.told.append(f"{address} {what}")
        if "asking body 20" in what:
            self.asking_body_20.set()

    def said(self) -> list[bytes]:
        """Everything that was written anywhere."""
        return [data for port in self.opened for data in getattr(port, "written", ())]


def rc400(bodies: tuple[int, ...] = BODIES) -> Rc400Line:
    return build_line(bodies, 0.0, TruthLog(1000))


def fics(units: int = 1, axes: str = "XYZ", terminator: Terminator = "cr") -> SimulatedFics:
    return build_fics(Layout(units=units, axes=axes), TruthLog(1000), LineSettings(terminator=terminator), 0)


@in_virtual_time
async def test_an_rc400_is_found_at_its_baud_rate_with_its_bodies() -> None:
    bench = Bench()
    bench.machines["/dev/ttyS1", "115200"] = rc400()
    (line,) = await bench.search("/dev/ttyS1")
    assert line == FoundLine("serial:///dev/ttyS1?baud=115200", "00,0A,3F", list(BODIES), complete=True)
    assert [port.address for port in bench.opened] == [
        f"serial:///dev/ttyS1?baud={baud}" for baud in BAUDS[: BAUDS.index(115200) + 1]
    ]
    assert "serial:///dev/ttyS1?baud=115200 asking body 77 of 77; 3 found" in bench.told


@in_virtual_time
async def test_those_that_the_link_master_names_are_asked_and_no_others() -> None:
    bench = Bench()
    bench.machines["/dev/ttyS1", "9600"] = rc400()
    (line,) = await bench.search("/dev/ttyS1", thorough=False)
    assert line == FoundLine("serial:///dev/ttyS1?baud=9600", "00,0A,3F", list(BODIES), complete=False)
    asked = {data[1:3] for data in bench.said() if data[:1] == b"&"} - {b"7F"}
    assert asked == {b"00", b"0A", b"3F"}


@in_virtual_time
async def test_bodies_are_found_on_a_line_whose_replies_take_a_quarter_of_a_second() -> None:
    bench, machine = Bench(), rc400()
    machine.settings = replace(machine.settings, reply_delay_s=0.26)
    bench.machines["/dev/ttyS1", "9600"] = machine
    (line,) = await bench.search("/dev/ttyS1", thorough=False)
    assert line == FoundLine("serial:///dev/ttyS1?baud=9600", "00,0A,3F", list(BODIES), complete=False)


@in_virtual_time
@pytest.mark.parametrize("named", ["", "RC-400", "01,02"])
async def test_where_none_that_is_named_answers_all_are_asked(
    named: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    bench, machine = Bench(), rc400()
    monkeypatch.setattr(machine, "_identify", lambda _arguments: named)
    bench.machines["/dev/ttyS1", "9600"] = machine
    (line,) = await bench.search("/dev/ttyS1", thorough=False)
    assert line == FoundLine("serial:///dev/ttyS1?baud=9600", named, list(BODIES), complete=True)


@pytest.mark.parametrize("terminator", ["cr", "crlf"])
def test_a_fics_is_found_in_the_mode_of_power_on(terminator: Terminator) -> None:
    @in_virtual_time
    async def story() -> None:
        bench = Bench()
        bench.machines["cell", ""] = fics(axes="XYZ@", terminator=terminator)
        (robot,) = await bench.search("tcp://cell:4001")
        assert isinstance(robot, FoundRobot)
        assert (robot.address, robot.mode, robot.units) == ("tcp://cell:4001", 2, {1: 4})
        assert robot.version is not None

    story()


@in_virtual_time
async def test_a_line_whose_120_bodies_are_all_named_is_found_at_its_rate() -> None:
    bench, bodies = Bench(), tuple(range(0x78))
    bench.timed_baud = 9600
    bench.machines["/dev/ttyS1", "9600"] = rc400(bodies)
    bench.machines["moxa", ""] = rc400(bodies)
    for line in await bench.search("/dev/ttyS1", "tcp://moxa:1", thorough=False):
        assert isinstance(line, FoundLine)
        assert line.bodies == list(bodies)
    assert sorted(line.address for line in bench.found) == ["serial:///dev/ttyS1?baud=9600", "tcp://moxa:1"]


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("present", [1, 3])
def test_all_units_of_a_robot_are_found_and_the_present_one_is_selected_again(
    mode: int, present: int
) -> None:
    @in_virtual_time
    async def story() -> None:
        bench, machine = Bench(), fics(units=3)
        for command in (f"MOD {mode}\r", f"UNT {present}\r"):
            machine.receive(command.encode("ascii"), 0.0)
        machine.take_output(0.0)
        bench.machines["cell", ""] = machine
        (robot,) = await bench.search("tcp://cell:1")
        assert isinstance(robot, FoundRobot)
        assert robot.units == {1: 3, 2: 3, 3: 3}
        assert machine.robot.host_unit == present

    story()


@in_virtual_time
async def test_no_unit_of_a_robot_is_selected_while_it_moves() -> None:
    bench, machine = Bench(), fics(units=2)
    machine.receive(b"ORG\r", 0.0)
    bench.machines["cell", ""] = machine
    (robot,) = await bench.search("tcp://cell:1")
    assert isinstance(robot, FoundRobot)
    assert robot.units == {1: 3}
    assert not any(data.startswith(b"UNT ") for data in bench.said())


@in_virtual_time
async def test_a_search_that_is_cancelled_among_units_leaves_the_one_that_was_selected() -> None:
    bench, machine = Bench(), fics(units=3)
    bench.machines["cell", ""] = machine
    searching = asyncio.create_task(bench.search("tcp://cell:1"))
    await until(lambda: machine.robot.host_unit == 2)
    searching.cancel()
    with pytest.raises(asyncio.CancelledError):
        await searching
    assert machine.robot.host_unit == 1


@in_virtual_time
async def test_a_fics_is_found_in_mode_3_and_behind_a_dual_port_ram() -> None:
    bench = Bench()
    machine = fics()
    machine.receive(b"MOD 3\r", 0.0)
    machine.take_output(0.0)
    bench.machines["/dev/uio0", ""] = machine
    (robot,) = await bench.search("dpram:///dev/uio0")
    assert isinstance(robot, FoundRobot)
    assert robot.mode == 3
    assert not any(data.startswith(b"&") for data in bench.said())


@in_virtual_time
async def test_all_ports_are_searched_and_those_in_trouble_are_named() -> None:
    bench = Bench()
    bench.machines["/dev/ttyS1", "9600"] = rc400((0x02,))
    bench.machines["cell", ""] = fics()
    bench.ports |= {"/dev/ttyS2": Refused, "/dev/ttyS3": Pulled}
    found = await bench.search("/dev/ttyS0", "/dev/ttyS2", "/dev/ttyS3", "tcp://cell:1", "/dev/ttyS1")
    assert sorted(it.address for it in found) == ["serial:///dev/ttyS1?baud=9600", "tcp://cell:1"]
    assert len(bench.notes) == 2
    assert "in use" in bench.notes[0]
    assert "has gone" in bench.notes[1]


@in_virtual_time
async def test_only_questions_are_asked_and_a_half_command_is_not_ended_but_spoiled() -> None:
    bench = Bench()
    line, robot = rc400(), fics()
    line.receive(b"&001+M500", 0.0)
    robot.receive(b"ORG", 0.0)
    bench.machines |= {("/dev/ttyS1", "9600"): line, ("cell", ""): robot}
    await bench.search("/dev/ttyS1", "tcp://cell:1", "/dev/ttyS0")
    for data in bench.said():
        text = data.decode("ascii").replace("\n", "")
        assert text.startswith(ALLOWED) or text[3:6] == "3ND", text
    assert {str(fact.facts["text"])[:3] for fact in line.truth.of("command")} == {"3ND"}
    spoiled, *asked = [str(fact.facts["text"]) for fact in robot.truth.of("command")]
    assert (spoiled[:5], {text[:3] for text in asked}) == ("ORG !", {"MOD", "VER", "UNT", "ACD"})
    assert not robot.truth.of("motion_start")


@in_virtual_time
async def test_what_was_found_before_it_was_cancelled_is_kept() -> None:
    bench = Bench()
    bench.machines["/dev/ttyS1", "9600"] = rc400()
    searching = asyncio.create_task(bench.search("/dev/ttyS1"))
    await asyncio.wait_for(bench.asking_body_20.wait(), 60)
    searching.cancel()
    with pytest.raises(asyncio.CancelledError):
        await searching
    assert bench.found == [FoundLine("serial:///dev/ttyS1?baud=9600", "00,0A,3F", [0x00, 0x0A])]


@in_virtual_time
async def test_nobody_is_found_where_there_is_only_noise() -> None:
    assert await Bench().search("/dev/ttyS0", "tcp://nobody:1", "dpram:///dev/uio0") == []


@pytest.mark.parametrize(
    ("port", "addresses"),
    [
        ("/dev/ttyS0", [f"serial:///dev/ttyS0?baud={baud}" for baud in BAUDS]),
        ("serial:///dev/ttyS0", [f"serial:///dev/ttyS0?baud={baud}" for baud in BAUDS]),
        ("serial:///dev/ttyS0?baud=1200", ["serial:///dev/ttyS0?baud=1200"]),
        ("tcp://host:1", ["tcp://host:1"]),
        ("dpram:///dev/uio0?map=1", ["dpram:///dev/uio0?map=1"]),
    ],
)
def test_the_addresses_of_a_port(port: str, addresses: list[str]) -> None:
    assert addresses_of(port) == addresses


@pytest.mark.parametrize("port", ["ttyS0", "tcp://host", "http://host:1", "serial:///dev/x?speed=3"])
def test_what_is_no_port_is_refused(port: str) -> None:
    with pytest.raises(ValueError, match="address"):
        addresses_of(port)


def test_a_port_is_named_by_the_link_that_stays(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    device, links = tmp_path / "ttyUSB0", tmp_path / "by-id"
    device.touch()
    links.mkdir()
    (links / "usb-FTDI_1234").symlink_to(device)
    assert module._lasting_name(str(device), links) == str(links / "usb-FTDI_1234")
    assert module._lasting_name("/dev/ttyS0", links) == "/dev/ttyS0"
    assert all(port.startswith("/dev/") for port in serial_devices())
