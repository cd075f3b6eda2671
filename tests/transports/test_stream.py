import anyio
import pytest

from tests.transports.far_ends import Ear, TcpFarEnd
from transports import create
from transports.stream import Session

pytestmark = pytest.mark.anyio


async def test_a_session_that_has_not_begun_tells_nobody() -> None:
    session, ear = Session("tcp://moxa:4001"), Ear()
    session.data_received(b"too early")
    session.connection_lost(None)
    session.begin(ear)
    assert (ear.heard, ear.losses) == (b"", [])


async def test_a_loss_says_where_and_why() -> None:
    session, ear = Session("tcp://moxa:4001"), Ear()
    session.begin(ear)
    session.connection_lost(OSError("the cable burns"))
    assert str(ear.losses[0]).startswith(
        "tcp://moxa:4001 was lost (the cable burns). What was sent last may not"
    )


async def test_closing_works_though_its_caller_gives_up_waiting() -> None:
    far, ear = TcpFarEnd(), Ear()
    transport = create(far.address)
    await transport.open(ear)
    await far.answer()
    with anyio.CancelScope() as impatient:
        impatient.cancel()
        await transport.close()
    assert await far.end() == b""
    assert ear.losses == []
    far.vanish()
