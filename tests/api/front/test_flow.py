"""Peers that do not take what is sent to them."""

import asyncio
from typing import cast

from api.front.flow import Flow, RestTimer
from tests.gateway.rorze.far_end import virtual


class Wire:
    """A transport with bytes that the peer has not taken."""

    def __init__(self, left: int, *, closing: bool = False) -> None:
        self.left = left
        self.closing = closing
        self.aborted = False
        self.reading = True

    def pause_reading(self) -> None:
        self.reading = False

    def resume_reading(self) -> None:
        self.reading = True

    def get_write_buffer_size(self) -> int:
        return self.left

    def is_closing(self) -> bool:
        return self.closing

    def abort(self) -> None:
        self.aborted = True


def watched(wire: Wire) -> Flow:
    flow = Flow(cast("asyncio.Transport", wire), 10.0)
    flow.watch()
    return flow


@virtual
async def test_a_peer_that_takes_nothing_is_cut_off() -> None:
    wire = Wire(5)
    watched(wire)
    await asyncio.sleep(9.9)
    assert not wire.aborted
    await asyncio.sleep(0.2)
    assert wire.aborted


@virtual
async def test_a_peer_that_takes_a_little_is_not_until_it_stops() -> None:
    wire = Wire(5)
    watched(wire)
    for _ in range(4):
        await asyncio.sleep(9.0)
        wire.left -= 1
        assert not wire.aborted
    await asyncio.sleep(20.0)
    assert wire.aborted


@virtual
async def test_a_closed_transport_that_does_not_end_is_aborted_even_without_bytes() -> None:
    wire = Wire(0, closing=True)
    watched(wire)
    await asyncio.sleep(10.1)
    assert wire.aborted


@virtual
async def test_nobody_is_cut_off_who_has_taken_everything_or_is_not_watched_any_more() -> None:
    done, stopped = Wire(5), Wire(5)
    watched(done)
    flow = watched(stopped)
    done.left = 0
    flow.stop()
    await asyncio.sleep(30.0)
    assert not done.aborted
    assert not stopped.aborted


@virtual
async def test_a_rest_that_ends_begins_anew_and_takes_its_whole_time() -> None:
    over: list[float] = []
    rest, loop = RestTimer(), asyncio.get_running_loop()
    begun_at = loop.time()
    for _ in range(3):
        rest.begin(5.0, lambda: over.append(loop.time() - begun_at))
        await asyncio.sleep(4.0)
        rest.end()
    await asyncio.sleep(20.0)
    assert not over
    begun_at = loop.time()
    rest.begin(5.0, lambda: over.append(loop.time() - begun_at))
    await asyncio.sleep(20.0)
    assert over == [5.0]


@virtual
async def test_a_connection_that_is_held_or_has_enough_is_not_read() -> None:
    wire = Wire(0)
    flow = Flow(cast("asyncio.Transport", wire), 10.0)
    flow.read(enough=True)
    flow.held = True
    flow.read()
    assert not wire.reading
    flow.held = False
    flow.read()
    assert wire.reading


@virtual
async def test_a_client_that_reads_on_makes_room() -> None:
    flow = Flow(cast("asyncio.Transport", Wire(5)), 10.0)
    assert flow.room is None
    flow.pause()
    room = flow.room
    assert room is not None
    assert not room.is_set()
    flow.resume()
    assert (room.is_set(), flow.room) == (True, None)
