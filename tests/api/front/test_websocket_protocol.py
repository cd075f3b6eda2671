"""WebSocket clients that break the protocol, or do not read: a close code, an end, and no traceback."""

import asyncio
import json
import logging
import struct
import time

import pytest
from websockets.http11 import Request, Response

from gateway.core.events import EventHub
from tests.api.front_stand import HOST, PATIENCE_S, Client, Front, garbage, on_front

HANDSHAKE = (
    b"GET /events HTTP/1.1\r\n" + HOST + b"connection: Upgrade\r\nupgrade: websocket\r\n"
    b"sec-websocket-version: 13\r\nsec-websocket-key: AAAAAAAAAAAAAAAAAAAAAA==\r\n"
)
MASK = b"\x01\x02\x03\x04"
FIN, TEXT, BINARY, CLOSE, PING = 0x80, 1, 2, 8, 9


def frame(first: int, payload: bytes = b"", *, masked: bool = True) -> bytes:
    """A frame as a client sends it."""
    length = len(payload)
    if length < 126:
        size = bytes([length])
    else:
        size = struct.pack("!BH", 126, length) if length < 65_536 else struct.pack("!BQ", 127, length)
    if not masked:
        return bytes([first]) + size + payload
    covered = bytes(byte ^ MASK[place % 4] for place, byte in enumerate(payload))
    return bytes([first, size[0] | 0x80]) + size[1:] + MASK + covered


async def opened(front: Front, *headers: bytes) -> Client:
    client = await front.client()
    client.say(HANDSHAKE, *headers, b"\r\n")
    async with asyncio.timeout(PATIENCE_S):
        head = await client.reader.readuntil(b"\r\n\r\n")
    assert head.startswith(b"HTTP/1.1 101")
    await front.until(lambda: "websocket" in front.app.begun)
    return client


@on_front()
async def test_a_handshake_that_the_application_refuses_is_answered_and_ended(front: Front) -> None:
    client = await front.client()
    client.say(HANDSHAKE.replace(b"/events", b"/denied"), b"\r\n")
    assert await client.answer() == (403, b"no")
    assert await client.ended()


def test_no_line_of_the_log_has_what_stands_in_a_query(caplog: pytest.LogCaptureFixture) -> None:
    @on_front()
    async def story(front: Front) -> None:
        for path in (b"/events", b"/denied"):
            client = await front.client()
            client.say(HANDSHAKE.replace(b"/events", path + b"?key=mg_secret"), b"\r\n")
            async with asyncio.timeout(PATIENCE_S):
                await client.reader.readuntil(b"\r\n\r\n")

    caplog.set_level(logging.DEBUG, "uvicorn")
    story(caplog)
    assert "mg_secret" not in caplog.text


async def close_code(client: Client) -> int:
    """The code of the frame that closes the connection, which then ends."""
    async with asyncio.timeout(PATIENCE_S):
        first, length = await client.reader.readexactly(2)
        assert first == FIN | CLOSE
        (code,) = struct.unpack("!H", (await client.reader.readexactly(length))[:2])
    assert await client.ended()
    return int(code)


@pytest.mark.parametrize(
    ("frames", "code"),
    [
        (frame(FIN | TEXT, b"\xff\xfe"), 1007),
        (frame(TEXT, b"a\xe3") + frame(FIN, b"\x81"), 1007),
        (frame(FIN | CLOSE, b"\x03\xe8\xff"), 1007),
        (frame(FIN | 0x40 | TEXT, b"a"), 1002),
        (frame(FIN | 3, b"a"), 1002),
        (frame(FIN, b"a"), 1002),
        (frame(TEXT, b"a") + frame(FIN | TEXT, b"b"), 1002),
        (frame(PING, b"a"), 1002),
        (frame(FIN | PING, b"a" * 126), 1002),
        (frame(FIN | CLOSE, b"\x03"), 1002),
        (frame(FIN | CLOSE, struct.pack("!H", 999)), 1002),
        (frame(FIN | TEXT, b"a", masked=False), 1002),
        (frame(FIN | BINARY, b"a" * 65_537), 1009),
        (frame(TEXT, b"a" * 60_000) + frame(FIN, b"a" * 60_000), 1009),
    ],
)
def test_a_broken_frame_is_answered_with_its_code(
    frames: bytes, code: int, caplog: pytest.LogCaptureFixture
) -> None:
    @on_front()
    async def story(front: Front) -> None:
        client = await opened(front)
        client.say(frames)
        assert await close_code(client) == code
        await front.until(lambda: front.app.left == ["websocket"])

    story(caplog)


@on_front()
async def test_text_that_is_cut_between_frames_is_text(front: Front) -> None:
    client = await opened(front)
    client.say(frame(TEXT, b"\xe3\x81"), frame(FIN, b"\x82"), frame(FIN | CLOSE, b"\x03\xe8"))
    assert await close_code(client) == 1000


PONG, CONT = 10, 0


@pytest.mark.parametrize(
    "flood",
    [frame(FIN | PONG), frame(FIN | PING), frame(FIN | TEXT), frame(FIN | TEXT, b"a"), frame(FIN | BINARY)],
    ids=["pongs", "pings", "empty texts", "texts", "binary"],
)
def test_who_sends_more_than_he_can_have_to_say_is_told_so(
    flood: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    @on_front(frames_per_s=50)
    async def story(front: Front) -> None:
        client = await opened(front)
        client.say(flood * 40_000)
        async with asyncio.timeout(PATIENCE_S):
            answer = await client.reader.read(-1)
        close = answer[answer.index(bytes([FIN | CLOSE])) :]
        assert struct.unpack("!H", close[2:4]) == (1008,)
        assert close[4:] == b"more than 50 frames in a second"
        await front.until(lambda: front.app.left == ["websocket"])
        await front.until(lambda: not front.connections)

    story(caplog)


@on_front(frames_per_s=50)
async def test_fragments_are_frames(front: Front) -> None:
    client = await opened(front)
    client.say(frame(TEXT), frame(CONT) * 40_000)
    assert await close_code(client) == 1008


@on_front()
async def test_frames_hold_nobody_up(front: Front) -> None:
    """However many are read at once, the loop goes on between some of them."""
    longest_s = 0.0

    async def watch() -> None:
        nonlocal longest_s
        while True:
            before = time.thread_time()
            await asyncio.sleep(0)
            longest_s = max(longest_s, time.thread_time() - before)

    clients = [await opened(front) for _ in range(4)]
    watcher = asyncio.create_task(watch())
    for client in clients:
        client.say(frame(FIN | PONG) * 40_000)
    for client in clients:
        assert await close_code(client) == 1008
    watcher.cancel()
    assert longest_s < 0.05


@pytest.mark.parametrize("rubbish", [frame(FIN | TEXT, b"\xff"), b"\xff" * 200, frame(FIN | CLOSE)])
def test_frames_before_the_handshake_is_answered(rubbish: bytes, caplog: pytest.LogCaptureFixture) -> None:
    @on_front()
    async def story(front: Front) -> None:
        client = await front.client()
        client.say(HANDSHAKE, b"\r\n", rubbish)
        client.say(rubbish)
        client.leave()
        await front.until(lambda: not front.connections)

    for _ in range(5):
        story(caplog)


@pytest.mark.parametrize(
    "header", [b"x: " + b"y" * 10_000 + b"\r\n", b"".join(b"x: y\r\n" for _ in range(200))]
)
def test_a_handshake_with_too_much_is_431(header: bytes, caplog: pytest.LogCaptureFixture) -> None:
    @on_front()
    async def story(front: Front) -> None:
        client = await front.client()
        client.say(HANDSHAKE, header, b"\r\n")
        assert (await client.answer())[0] == 431
        assert await client.ended()

    story(caplog)


@on_front(stall_s=0.05)
async def test_who_does_not_read_loses_the_socket_for_good(front: Front) -> None:
    front.app.go.set()
    client = await opened(front)
    client.writer.transport.pause_reading()  # type: ignore[attr-defined]  # a transport can
    await front.until(lambda: front.app.left == ["websocket"])
    await front.until(lambda: not front.connections)


@on_front(connections=1)
async def test_an_open_socket_takes_a_place(front: Front) -> None:
    await opened(front)
    client = await front.client()
    client.ask("/move")
    assert (await client.answer())[0] == 503


@on_front()
async def test_a_socket_is_not_opened_ahead_of_an_answer(front: Front) -> None:
    client = await front.client()
    client.ask("/wait")
    client.say(HANDSHAKE, b"\r\n")
    await front.until(lambda: front.app.begun == ["/wait"])
    front.app.go.set()
    assert (await client.answer())[0] == 200
    assert (await client.answer())[0] == 400


async def texts(client: Client, count: int) -> list[bytes]:
    """Read `count` text frames, as a server writes them."""
    found: list[bytes] = []
    async with asyncio.timeout(PATIENCE_S):
        while len(found) < count:
            first, length = await client.reader.readexactly(2)
            assert first == FIN | TEXT
            if length > 125:
                size = await client.reader.readexactly(2 if length == 126 else 8)
                length = int.from_bytes(size, "big")
            found.append(await client.reader.readexactly(length))
    return found


@on_front()
async def test_each_event_is_a_text_frame_whatever_its_length(front: Front) -> None:
    front.app.hub = hub = EventHub()
    client = await opened(front)
    written = [hub.publish("line.up", "/lines/a", {"x": "あ" * size}) for size in (0, 50, 30_000)]
    assert [json.loads(text) for text in await texts(client, 3)] == [json.loads(it.json) for it in written]
    client.say(frame(FIN | CLOSE, b"\x03\xe8"))
    assert await close_code(client) == 1000


@on_front()
async def test_all_events_that_are_sent_at_once_are_one_text_frame_for_who_asks_for_it(front: Front) -> None:
    front.app.hub = hub = EventHub()
    client = await opened(front, b"sec-websocket-protocol: cloudevents-batch.json\r\n")
    written = [hub.publish("line.up", "/lines/a", {"x": "あ" * size}) for size in (0, 50, 30_000)]
    [text] = await texts(client, 1)
    assert json.loads(text) == [json.loads(it.json) for it in written]


@on_front()
async def test_who_reads_again_is_sent_what_has_come_since(front: Front) -> None:
    front.app.hub = hub = EventHub()
    client = await opened(front)
    client.writer.transport.pause_reading()  # type: ignore[attr-defined]  # a transport can
    for _ in range(500):
        hub.publish("line.up", "/lines/a", {"x": "x" * 60_000})
        await asyncio.sleep(0)
    client.writer.transport.resume_reading()  # type: ignore[attr-defined]
    sequences = [json.loads(text)["sequence"] for text in await texts(client, 500)]
    assert sequences == [f"{number:012d}" for number in range(1, 501)]


@on_front()
async def test_an_open_socket_keeps_nothing_of_its_handshake(front: Front) -> None:
    front.app.hub = EventHub()
    await opened(front)
    [socket] = front.server.server_state.connections
    kept = vars(socket)
    await front.until(lambda: not any(isinstance(it, Request | Response) for it in kept.values()))


@pytest.mark.parametrize("last", [b"", b"\x83\x80\0\0\0\0"], ids=["well", "with nonsense"])
def test_who_has_left_leaves_nothing_to_the_garbage_collector(
    last: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    @on_front()
    async def story(front: Front) -> None:
        front.app.hub = EventHub()
        client = await opened(front)
        with garbage() as found:
            client.say(last)
            client.leave()
            await front.until(lambda: not front.connections and not front.server.server_state.tasks)
        assert not [it for it in found if type(it).__module__.startswith(("api", "websockets"))]

    story(caplog)
