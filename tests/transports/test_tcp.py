import socket
import struct
from collections.abc import Iterator

import anyio
import pytest

from tests.transports.far_ends import Ear, TcpFarEnd
from transports import TransportUnavailable, create, tcp
from transports.addresses import Address

pytestmark = pytest.mark.anyio


@pytest.fixture
def far() -> Iterator[TcpFarEnd]:
    end = TcpFarEnd()
    yield end
    end.vanish()


async def test_small_frames_are_not_held_back_and_a_silent_far_end_is_probed(far: TcpFarEnd) -> None:
    port = tcp.TcpPort(Address.parse(far.address))
    await port.open(Ear())
    assert port._channel is not None
    sock = port._channel.get_extra_info("socket")
    assert sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
    assert sock.getsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE)
    assert sock.getsockopt(socket.IPPROTO_TCP, socket.TCP_KEEPIDLE) == tcp.LIVENESS["TCP_KEEPIDLE"]
    await port.close()


async def test_a_broken_connection_is_lost_at_once(far: TcpFarEnd) -> None:
    port, ear = create(far.address), Ear()
    await port.open(ear)
    await far.answer()
    far.client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    far.vanish()
    assert "reset" in str(await ear.loses())
    await port.close()


async def test_a_far_end_that_only_stops_sending_is_lost_though_it_still_takes_bytes(far: TcpFarEnd) -> None:
    port, ear = create(far.address), Ear()
    await port.open(ear)
    await far.answer()
    port.write(bytes(1_000_000))
    far.client.shutdown(socket.SHUT_WR)
    assert "the far end closed it" in str(await ear.loses())
    await port.close()


async def test_what_the_far_end_does_at_once_is_heard_after_the_port_is_open(far: TcpFarEnd) -> None:
    port, ear = create(far.address), Ear()

    async def greet_and_leave() -> None:
        await far.answer()
        await far.write(b"login:")
        far.vanish()

    async with anyio.create_task_group() as tasks:
        tasks.start_soon(greet_and_leave)
        await port.open(ear)
        assert (ear.heard, ear.losses) == (b"", [])
    assert await ear.hears(6) == b"login:"
    await ear.loses()
    await port.close()


async def test_a_refusal_says_what_to_check(far: TcpFarEnd) -> None:
    far.vanish()
    with pytest.raises(TransportUnavailable, match=r"the far end refused; check .* Nothing was sent\."):
        await create(far.address).open(Ear())


async def test_a_far_end_that_does_not_answer_is_given_up_while_the_loop_runs_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(tcp, "CONNECT_TIMEOUT_S", 0.05)
    with socket.create_server(("127.0.0.1", 0), backlog=0) as deaf:
        host, number = deaf.getsockname()
        filler = socket.create_connection((host, number))  # fills the queue, so that the next one waits
        with filler, pytest.raises(TransportUnavailable, match=r"no answer within 0\.05 s"):
            await create(f"tcp://{host}:{number}").open(Ear())


async def test_a_host_that_cannot_be_looked_up_is_unavailable() -> None:
    with pytest.raises(TransportUnavailable, match="was not opened"):
        await create("tcp://moxa..plant:4001").open(Ear())


@pytest.mark.parametrize(
    ("error", "reason"),
    [
        (socket.gaierror(-2, "Name or service not known"), "the host name is not known"),
        (OSError(113, "No route to host"), "No route to host"),
    ],
)
def test_network_errors_are_told_in_plain_words(error: Exception, reason: str) -> None:
    assert reason in tcp._reason(error)


async def test_a_system_that_does_not_tell_what_is_unsent_counts_as_empty(
    far: TcpFarEnd, monkeypatch: pytest.MonkeyPatch
) -> None:
    port = create(far.address)
    await port.open(Ear())
    monkeypatch.setattr(tcp, "SIOCOUTQNSD", 0)
    assert port.unsent() == 0
    await port.close()
