import errno
import os
import resource
import termios
import threading
from collections.abc import Iterator
from pathlib import Path
from time import monotonic

import anyio
import anyio.lowlevel
import pytest

from tests.transports.far_ends import PATIENCE_S, Ear, PtyFarEnd
from transports import TransportUnavailable, create, serial_port
from transports.nudge import Nudge

pytestmark = pytest.mark.anyio


@pytest.fixture
def far(tmp_path: Path) -> Iterator[PtyFarEnd]:
    end = PtyFarEnd(tmp_path)
    yield end
    end.vanish()


def at(far: PtyFarEnd, baud: int) -> str:
    return f"serial://{far.name}?baud={baud}"


async def test_the_port_is_set_to_its_speed_with_8_bits_no_parity_and_no_flow_control(far: PtyFarEnd) -> None:
    port = create(at(far, 38400))
    await port.open(Ear())
    iflag, _, cflag, lflag, _, speed, _ = termios.tcgetattr(far.fd)
    assert speed == termios.B38400
    assert cflag & termios.CSIZE == termios.CS8
    assert not cflag & (termios.PARENB | termios.CSTOPB | termios.CRTSCTS)
    assert not iflag & (termios.IXON | termios.IXOFF | termios.ICRNL)
    assert not lflag & (termios.ECHO | termios.ICANON)
    await port.close()


async def test_a_speed_without_a_name_is_accepted_too(far: PtyFarEnd) -> None:
    port, ear = create(at(far, 250_000)), Ear()
    await port.open(ear)
    await far.write(b"fast")
    assert await ear.hears(4) == b"fast"
    await port.close()


async def test_a_port_in_use_is_refused_until_it_is_closed(far: PtyFarEnd) -> None:
    first, second = create(far.address), create(at(far, 9600))
    await first.open(Ear())
    with pytest.raises(TransportUnavailable, match="another program is using it"):
        await second.open(Ear())
    await first.close()
    await second.open(Ear())
    await second.close()


async def test_a_missing_device_says_so(tmp_path: Path) -> None:
    with pytest.raises(TransportUnavailable, match=r"there is no such device; .* Nothing was sent\."):
        await create(f"serial://{tmp_path}/ttyUSB0").open(Ear())


async def test_a_file_that_is_no_serial_port_is_refused(tmp_path: Path) -> None:
    device = tmp_path / "notes.txt"
    device.write_text("not a port")
    with pytest.raises(TransportUnavailable, match="was not opened"):
        await create(f"serial://{device}").open(Ear())
    assert device.read_text() == "not a port"


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (OSError(errno.EACCES, "Permission denied"), "usually dialout"),
        (OSError(errno.EBUSY, "Device or resource busy"), "another program is using it"),
        (OSError(errno.EIO, "Input/output error"), "Input/output error"),
        (ValueError("Failed to set custom baud rate (77)"), "custom baud rate"),
        (termios.error(22, "Invalid argument"), "Invalid argument"),
    ],
)
async def test_whatever_the_driver_objects_to_is_told_as_unavailable(
    error: Exception, reason: str, monkeypatch: pytest.MonkeyPatch, far: PtyFarEnd
) -> None:
    def refuse(_device: str, _baud: int) -> None:
        raise error

    monkeypatch.setattr(serial_port, "_open", refuse)
    with pytest.raises(TransportUnavailable, match=reason):
        await create(far.address).open(Ear())


async def test_an_adapter_pulled_while_it_is_opened_is_unavailable_and_leaves_nothing_open(
    far: PtyFarEnd, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[int] = []
    opens = serial_port._open

    def pulled(device: str, baud: int) -> serial_port._Port:
        port = opens(device, baud)
        opened.append(port.fileno())
        far.vanish()
        return port

    monkeypatch.setattr(serial_port, "_open", pulled)
    with pytest.raises(TransportUnavailable, match=r"was not opened: .* Nothing was sent\."):
        await create(far.address).open(Ear())
    (descriptor,) = opened
    with pytest.raises(OSError, match="Bad file descriptor"):
        os.fstat(descriptor)


class SlowAdapter:
    """An adapter whose opening is held up until it is let go."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self._open = serial_port._open
        self.reached = threading.Event()
        self.let_go = threading.Event()
        monkeypatch.setattr(serial_port, "_open", self.open)

    def open(self, device: str, baud: int) -> serial_port._Port:
        self.reached.set()
        assert self.let_go.wait(PATIENCE_S), "the event loop stood still while the port was being opened"
        return self._open(device, baud)


async def test_the_event_loop_runs_on_while_an_adapter_opens_slowly(
    far: PtyFarEnd, monkeypatch: pytest.MonkeyPatch
) -> None:
    adapter = SlowAdapter(monkeypatch)
    port = create(far.address)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(port.open, Ear())
        await anyio.to_thread.run_sync(adapter.reached.wait)
        adapter.let_go.set()
    port.write(b"open now")
    assert await far.read(8) == b"open now"
    await port.close()


async def test_an_opening_that_is_given_up_leaves_the_port_free(
    far: PtyFarEnd, monkeypatch: pytest.MonkeyPatch
) -> None:
    adapter = SlowAdapter(monkeypatch)
    async with anyio.create_task_group() as tasks:
        tasks.start_soon(create(far.address).open, Ear())
        await anyio.to_thread.run_sync(adapter.reached.wait)
        tasks.cancel_scope.cancel()
    adapter.let_go.set()
    port = create(far.address)
    with anyio.fail_after(PATIENCE_S):
        while True:
            try:
                await port.open(Ear())
                break
            except TransportUnavailable:
                await anyio.lowlevel.checkpoint()  # the abandoned opening is on its way out
    await port.close()


async def test_a_port_works_beside_more_than_a_thousand_open_connections(far: PtyFarEnd) -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (max(soft, 2048), hard))
    others = [os.dup(far.fd) for _ in range(1024)]
    port, ear = create(far.address), Ear()
    try:
        await port.open(ear)
        port.write(b"&3F6PD\r")
        assert await far.read(7) == b"&3F6PD\r"
        await far.write(b">&3F6PD+000050000\r")
        assert await ear.hears(18) == b">&3F6PD+000050000\r"
        await port.close()
    finally:
        for other in others:
            os.close(other)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))


def test_a_false_alarm_of_a_byte_is_not_a_loss(far: PtyFarEnd) -> None:
    with serial_port._open(str(far.name), 9600) as port:
        assert port.read(1024) == b""


async def test_a_driver_that_does_not_tell_what_is_unsent_counts_as_empty(
    far: PtyFarEnd, monkeypatch: pytest.MonkeyPatch
) -> None:
    def untold(_port: serial_port._Port) -> int:
        raise OSError(errno.ENOTTY, "Inappropriate ioctl for device")

    port = create(far.address)
    await port.open(Ear())
    monkeypatch.setattr(serial_port._Port, "out_waiting", property(untold))
    assert port.unsent() == 0
    await port.close()


async def test_a_closed_port_leaves_nothing_open(far: PtyFarEnd) -> None:
    port, before = create(far.address), open_files()
    for _ in range(3):
        await port.open(Ear())
        await port.close()
    assert open_files() == before


async def test_the_nudge_hears_of_each_frame_and_of_the_reply_before_it(
    far: PtyFarEnd, monkeypatch: pytest.MonkeyPatch
) -> None:
    told: list[tuple[bytes, float]] = []
    monkeypatch.setattr(Nudge, "wrote", lambda _, frame, heard_at: told.append((frame, heard_at)))
    port, ear = create(far.address), Ear()
    await port.open(ear)
    began_at = monotonic()
    for frame in (b"&3F6PD\r", b"&3F9MD\r"):
        port.write(frame)
        await far.read(len(frame))
        await far.write(b">&3F6PD+000050000\r")
        await ear.hears(18)
    await port.close()
    assert [frame for frame, _ in told] == [b"&3F6PD\r", b"&3F9MD\r"]
    assert told[0][1] < began_at < told[1][1] < monotonic()


def open_files() -> int:
    return len(list(Path("/proc/self/fd").iterdir()))
