"""Scans of ports while the gateway serves: who is found gets a table, and is served from it."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from tempfile import NamedTemporaryFile

import pytest

from gateway import port_scans as port_scan_module
from gateway.access.errors import NotPermitted
from gateway.access.principal import EVERYBODY, Principal, asking
from gateway.access.roles import Role
from gateway.config import Server
from gateway.config_file import ConfigFile
from gateway.core.errors import BodyBusy, InvalidRequest, NotFound
from gateway.core.origin import Origin
from gateway.door.port_scans import PortScanRequest
from gateway.fics.config import FicsLineTable as FicsLine
from gateway.port_scans import PortScan, PortScans, require_device
from simulator.fics.layout import Layout
from simulator.fics.line import build_line as build_robot
from simulator.rorze.line import build_line
from tests.open_access import OPEN
from tests.own_faults import Place, fail_once, named
from tests.plants import Wire, in_virtual_time
from tests.simulated_line import SimulatedCable, Unplugged
from tests.tested_plant import TestedPlant
from tests.through_the_door import add_line, ask, reload
from transports import Transport

ME = Origin("test", "r-1")
ARM = '[[lines]]\nid = "line1"\naddress = "tcp://arm:1"\nbodies = [{ id = "00" }]\n'
CELL, LEG, NOBODY = (f"tcp://10.0.0.{n}:1" for n in (1, 2, 3))


class Hall:
    """A gateway that serves one line, with more controllers at other ports."""

    def __init__(self, folder: Path) -> None:
        self.file = ConfigFile(folder / "gateway.toml")
        self.file.path.write_text(ARM + OPEN)
        self.arm = Wire(build_line((0x00,), 0.0))
        self.plant = TestedPlant(self.file.load(), open_transport=self._open, file=self.file)

    def _open(self, address: str) -> Transport:
        if address == "tcp://arm:1":
            return self.arm
        if address == NOBODY:
            return Unplugged(address)
        machine = build_robot(Layout(axes="XYZ@")) if address == CELL else build_line((0x0A, 0x3F), 0.0)
        cable = SimulatedCable(machine)
        cable.address = address
        return cable

    async def scan(self, *ports: str) -> PortScan:
        wanted = PortScanRequest(ports=list(ports))
        scan: PortScan = await ask(self.plant, "startPortScan", request=wanted, wait=120.0)
        return scan


@asynccontextmanager
async def hall(folder: Path) -> AsyncIterator[Hall]:
    it = Hall(folder)
    with asking(EVERYBODY):
        await it.plant.start()
        await asyncio.sleep(2)
        yield it
        await it.plant.close()


@in_virtual_time
async def test_a_robot_that_is_found_is_added_while_the_plant_runs_and_gone_after_a_reload(
    tmp_path: Path,
) -> None:
    async with hall(tmp_path) as it:
        scan = await it.scan(CELL)
        (found,) = scan.found
        assert scan.status == "finished"
        assert "a Fics of version" in found.told
        before = it.file.path.read_text()
        await add_line(it.plant, ME, found.line, comment=found.comment, dry_run=False)
        await asyncio.sleep(2)
        robot = it.plant.robot("r1")
        assert (robot.online, robot.units[0].axes) == (True, ["X", "Y", "Z", "@"])
        assert it.plant.line("line1").state == "ready"
        text = it.file.path.read_text()
        assert text.startswith(before)
        assert f" by everybody.\n# {CELL}: a Fics of version" in text
        assert "# compare this with its set-up before anything moves." in text
        (_, line) = it.file.load().lines
        assert isinstance(line, FicsLine)
        it.file.path.write_text(before)
        await reload(it.plant, ME, dry_run=False)
        with pytest.raises(NotFound):
            it.plant.robot("r1")


@in_virtual_time
async def test_what_is_found_at_several_ports_gets_ids_of_its_own(tmp_path: Path) -> None:
    async with hall(tmp_path) as it:
        scan = await it.scan(LEG, CELL)
        assert [found.line["id"] for found in scan.found] == ["cell1", "line2"]
        assert scan.found[1].line["bodies"] == [{"id": "0A"}, {"id": "3F"}]
        for found in scan.found:
            await add_line(it.plant, ME, found.line, comment=found.comment, dry_run=False)
        await asyncio.sleep(2)
        assert [port.state for port in it.plant.ports().values()] == ["ready"] * 3
        assert it.plant.body("3F").line.id == "line2"


@in_virtual_time
async def test_a_port_that_a_line_has_is_left_alone(tmp_path: Path) -> None:
    async with hall(tmp_path) as it:
        sent = len(it.arm.sent)
        with pytest.raises(InvalidRequest, match="Line line1 has the port tcp://arm:1; nothing was sent"):
            await it.scan(CELL, "tcp://arm:1")
        assert len(it.arm.sent) == sent


@in_virtual_time
async def test_a_file_is_no_port(tmp_path: Path) -> None:
    with (
        NamedTemporaryFile(dir="/dev/shm") as below_dev,
        pytest.raises(InvalidRequest, match="no device of the gateway's machine"),
    ):
        require_device(f"dpram://{below_dev.name}", Server())
    for place in (tmp_path / "journal.db", tmp_path / "link", Path("/dev/../etc/passwd")):
        with pytest.raises(InvalidRequest, match="no device of the gateway's machine"):
            require_device(f"dpram://{place}", Server())
    (tmp_path / "link").symlink_to("/dev/uio0")
    for address in (f"dpram://{tmp_path}/link", "serial:///dev/ttyUSB0", "tcp://10.1.2.3:4001"):
        require_device(address, Server())
    async with hall(tmp_path) as it:
        with pytest.raises(InvalidRequest, match="nothing was sent"):
            await it.scan(f"dpram://{tmp_path}/journal.db")


@pytest.mark.parametrize(
    "address",
    [
        "serial:///dev/mem",
        "serial:///dev/tty",
        "serial:///dev/tty1",
        "serial:///dev/console",
        "dpram:///dev/sda",
        "dpram:///dev/mem",
        "serial:///dev/uio0",
        "dpram:///dev/ttyUSB0",
        "serial:///dev/null",
        "dpram:///dev",
        "dpram:///sys/bus/pci/devices/0000:00:00.0/resource0",
        "serial:///dev/ttyUSB0/../mem",
        "tcp://8.8.8.8:53",
        "tcp://169.254.169.254:80",
        "tcp://0.0.0.0:80",
        "tcp://[fe80::1]:80",
        "tcp://[::ffff:169.254.169.254]:80",
        "tcp://[::ffff:8.8.8.8]:53",
        "tcp://255.255.255.255:80",
        "tcp://240.0.0.1:80",
        "tcp://moxa:4001",
        "tcp://2130706433:80",
        "tcp://metadata.google.internal:80",
    ],
)
def test_a_request_names_no_other_device_and_no_foreign_network(address: str) -> None:
    with pytest.raises(InvalidRequest, match="nothing was sent"):
        require_device(address, Server())


def test_a_request_names_terminal_servers_of_the_configured_networks() -> None:
    server = Server(line_networks=("10.1.0.0/16",))
    require_device("tcp://10.1.2.3:4001", server)
    for host in ("10.2.0.1", "127.0.0.1", "moxa"):
        with pytest.raises(InvalidRequest, match="no network of terminal servers; nothing was sent"):
            require_device(f"tcp://{host}:4001", server)
    for host in ("10.1.2.3", "192.168.7.1", "127.0.0.1", "localhost", "[::1]", "[fd00::7]"):
        require_device(f"tcp://{host}:4001", Server())


@in_virtual_time
async def test_a_port_that_cannot_be_opened_is_noted(tmp_path: Path) -> None:
    async with hall(tmp_path) as it:
        scan = await it.scan(NOBODY)
        assert (scan.status, scan.found) == ("finished", [])
        assert scan.notes == [f"{NOBODY} was not opened: there is no such port."]
        with pytest.raises(InvalidRequest, match="must begin with one of"):
            await it.scan("http://host")


@in_virtual_time
async def test_one_scan_runs_at_a_time_and_one_that_is_broken_off_tells_what_was_found(
    tmp_path: Path,
) -> None:
    async with hall(tmp_path) as it:
        scan = await ask(it.plant, "startPortScan", request=PortScanRequest(ports=[LEG]), wait=3.0)
        assert scan.status == "running"
        assert "asking body" in scan.doing[0]
        with pytest.raises(BodyBusy, match="still running"):
            await it.scan(CELL)
        over = await ask(it.plant, "breakOffPortScan")
        assert (over is scan, over.status, over.found[0].line["bodies"]) == (True, "failed", [{"id": "0A"}])
        assert "Not all 120 body numbers were asked" in over.found[0].comment
        assert await ask(it.plant, "getPortScan", scan_id="current") is scan
        with pytest.raises(NotFound, match="No scan of ports is running"):
            await ask(it.plant, "breakOffPortScan")


@in_virtual_time
async def test_the_end_of_the_gateway_ends_a_scan_that_has_not_begun(tmp_path: Path) -> None:
    async with hall(tmp_path) as it:
        scan = it.plant.works.port_scans.start([CELL])
        await it.plant.close()
        assert scan.status == "failed"


@pytest.mark.parametrize("role", [Role.VIEWER, Role.OPERATOR, Role.SETUP])
@in_virtual_time
async def test_ports_are_a_matter_of_admins(tmp_path: Path, role: Role) -> None:
    async with hall(tmp_path) as it:
        with asking(Principal("somebody", role)):
            for asked in (
                ask(it.plant, "listPorts"),
                ask(it.plant, "startPortScan", request=PortScanRequest(ports=[CELL]), wait=0),
                ask(it.plant, "getPortScan", scan_id="current"),
                ask(it.plant, "breakOffPortScan"),
            ):
                with pytest.raises(NotPermitted):
                    await asked


@in_virtual_time
async def test_serial_ports_are_listed_with_the_lines_that_have_them(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with hall(tmp_path) as it:
        monkeypatch.setattr("gateway.port_scans.serial_devices", lambda: ["/dev/ttyUSB0", "/dev/ttyUSB1"])
        wanted = it.file.load().lines[0].model_copy(update={"address": "serial:///dev/ttyUSB1?baud=9600"})
        it.plant.config = it.plant.config.model_copy(update={"lines": (wanted,)})
        found = (await ask(it.plant, "listPorts")).ports
        assert [(port.port, port.line_id) for port in found] == [
            ("/dev/ttyUSB0", None),
            ("/dev/ttyUSB1", "line1"),
        ]


@pytest.mark.parametrize(
    "place", [(port_scan_module, "search"), (PortScans, "_ended"), (PortScans, "_tables")], ids=named
)
@in_virtual_time
async def test_a_scan_that_meets_a_fault_of_the_gateway_itself_keeps_nobody_from_another(
    place: Place, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    async with hall(tmp_path) as it:
        failed = fail_once(monkeypatch, place)
        await it.scan(CELL)
        await asyncio.sleep(1.0)
        assert failed
        assert (await it.scan(CELL)).status == "finished"
