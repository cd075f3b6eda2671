"""Limits of HTTP clients: none holds the event loop, delays a stop, or begins something after it has left."""

import asyncio
import json
import random
import time

import pytest

from api.front.turnstile import Turnstile
from tests.api.front_stand import HOST, SOON_S, Client, Front, garbage, on_front

KIB = 1024


def told(answer: tuple[int, bytes]) -> tuple[int, str]:
    """The status and the kind of a problem that says that nothing was sent."""
    status, body = answer
    problem = json.loads(body)
    assert (problem["status"], problem["moved"]) == (status, "no")
    assert "Nothing was sent." in problem["detail"]
    return status, problem["type"].rpartition(":")[2]


async def expect_431(client: Client) -> None:
    assert told(await client.answer()) == (431, "request-header-fields-too-large")
    assert await client.ended()


# heads


@on_front()
async def test_an_honest_head_of_16_kib_is_read(front: Front) -> None:
    client = await front.client()
    head = b"GET /a HTTP/1.1\r\n" + HOST + b"x: "
    client.say(head, b"y" * (16 * KIB - len(head) - 4), b"\r\n\r\n")
    assert (await client.answer())[0] == 200


@on_front()
async def test_a_head_that_is_one_byte_longer_ends_the_connection(front: Front) -> None:
    client = await front.client()
    head = b"GET /a HTTP/1.1\r\n" + HOST + b"x: "
    client.say(head, b"y" * (16 * KIB - len(head) - 3), b"\r\n\r\n")
    await expect_431(client)
    assert front.app.begun == []


@on_front(receive_s=0.2)
async def test_a_refusal_has_the_id_of_its_request_as_far_as_that_was_read(front: Front) -> None:
    slow, long = await front.client(), await front.client()
    mine = b"x-request-id: job-17\r\n"
    slow.say(b"POST /a HTTP/1.1\r\n", HOST, mine, b"content-length: 9\r\n\r\nhalf")
    long.say(b"GET /a HTTP/1.1\r\n", HOST, mine, b"x: ", b"y" * (16 * KIB))
    for client, status in ((slow, b"408"), (long, b"431")):
        head, _, body = (await client.reader.read()).partition(b"\r\n\r\n")
        assert head.split(b" ")[1] == status
        assert b"\r\nx-request-id: job-17\r\n" in head + b"\r\n"
        assert json.loads(body)["request_id"] == "job-17"


@on_front()
async def test_a_refusal_of_what_is_no_request_has_an_id_too(front: Front) -> None:
    client = await front.client()
    client.say(b"\x00\x01\r\n\r\n")
    status, body = await client.answer()
    assert (status, len(json.loads(body)["request_id"])) == (400, 32)


@pytest.mark.parametrize(
    "begin",
    [
        b"GET /a HTTP/1.1\r\nhost: 127.0.0.1\r\nx: ",
        b"GET /a HTTP/1.1\r\nhost: evil.example\r\nx: ",
        b"GET /events HTTP/1.1\r\nhost: 127.0.0.1\r\nconnection: upgrade\r\nupgrade: websocket\r\nx: ",
        b"GET /",
        b"GET /a HTTP/1.1\r\n",
        b"POST /a HTTP/1.1\r\nhost: 127.0.0.1\r\ntransfer-encoding: chunked\r\n\r\n1\r\na\r\n0\r\n",
        b"POST /a HTTP/1.1\r\nhost: 127.0.0.1\r\ntransfer-encoding: chunked\r\n\r\n1;",
    ],
    ids=["value", "foreign", "websocket", "target", "names", "trailer", "extension"],
)
@pytest.mark.parametrize("unit", [b"x", b"a:b\r\n"], ids=["one", "many"])
def test_no_head_grows_without_end(begin: bytes, unit: bytes, caplog: pytest.LogCaptureFixture) -> None:
    """However it grows, and in whatever pieces it comes, it is not read any further than 16 KiB."""

    @on_front()
    async def story(front: Front) -> None:
        client = await front.client()
        client.say(begin)
        try:
            for _ in range(40):
                client.say(unit * (KIB // len(unit) + 1))
                await client.writer.drain()
                await asyncio.sleep(0)
        except ConnectionError:
            pass
        status, _ = told(await client.answer())
        assert status in (400, 431)
        assert await client.ended()
        assert front.app.done == []

    story(caplog)


@on_front()
async def test_empty_lines_before_a_request_have_an_end_too(front: Front) -> None:
    client = await front.client()
    client.say(b"\r\n" * 16 * KIB)
    await expect_431(client)


@on_front()
async def test_a_megabyte_at_once_holds_nobody_up(front: Front) -> None:
    held: list[float] = []

    async def watch() -> None:
        while True:
            before = time.thread_time()
            await asyncio.sleep(0)
            held.append(time.thread_time() - before)

    watcher = asyncio.create_task(watch())
    clients = [await front.client() for _ in range(4)]
    clients[0].say(b"GET /a HTTP/1.1\r\n", HOST, b"a:b\r\n" * 200_000)
    clients[1].say(
        b"POST /a HTTP/1.1\r\n", HOST, b"transfer-encoding: chunked\r\n\r\n", b"1\r\nx\r\n" * 90_000
    )
    clients[2].say((b"GET /wait HTTP/1.1\r\n" + HOST + b"\r\n") * 20_000)
    await asyncio.sleep(4 * SOON_S)
    front.app.go.set()
    watcher.cancel()
    assert max(held) < 0.1
    assert len(front.app.begun) < 10


# time


@on_front(receive_s=0.1)
async def test_a_slow_head_ends_in_time(front: Front) -> None:
    client = await front.client()
    client.say(b"GET /a HTTP/1.1\r\n", HOST)
    assert told(await client.answer()) == (408, "request-timeout")
    assert await client.ended()


@on_front(receive_s=0.1)
async def test_a_byte_now_and_then_makes_a_head_no_faster(front: Front) -> None:
    client = await front.client()
    client.say(b"GET /a HTTP/1.1\r\nx:")
    answer = asyncio.create_task(client.answer())
    while not answer.done():
        client.say(b"y")
        await asyncio.sleep(0.01)
    assert told(await answer)[0] == 408


@on_front(receive_s=0.1)
async def test_a_slow_body_ends_in_time_and_nothing_is_done(front: Front) -> None:
    client = await front.client()
    client.say(b"POST /move HTTP/1.1\r\n", HOST, b"content-length: 10\r\n\r\n", b"12345")
    assert told(await client.answer()) == (408, "request-timeout")
    assert await client.ended()
    assert front.app.done == []
    assert front.app.left == ["/move"]


@on_front(receive_s=0.05)
async def test_the_wait_for_an_answer_and_idle_connections_are_not_cut(front: Front) -> None:
    idle, waiting = await front.client(), await front.client()
    waiting.ask("/wait")
    await asyncio.sleep(0.15)
    front.app.go.set()
    assert (await waiting.answer())[0] == 200
    await asyncio.sleep(0.1)
    for client in (idle, waiting):
        client.ask("/again")
        assert (await client.answer())[0] == 200


@on_front(receive_s=0.1)
async def test_a_slow_head_behind_a_request_does_not_cut_its_answer(front: Front) -> None:
    client = await front.client()
    client.ask("/wait")
    client.say(b"GET /a HTTP/1.1\r\n")
    await asyncio.sleep(0.25)
    front.app.go.set()
    assert await client.answer() == (200, b"/wait ")
    assert told(await client.answer())[0] == 408


# requests that are sent ahead


@on_front()
async def test_requests_sent_ahead_are_done_one_after_the_other(front: Front) -> None:
    client = await front.client()
    for name in ("/wait", "/b", "/c"):
        client.ask(name, name.encode())
    await front.until(lambda: bool(front.app.begun))
    await asyncio.sleep(SOON_S)
    assert front.app.begun == ["/wait"]
    front.app.go.set()
    assert [await client.answer() for _ in range(3)] == [
        (200, b"/wait /wait"),
        (200, b"/b /b"),
        (200, b"/c /c"),
    ]
    assert [name for name, _ in front.app.done] == ["/wait", "/b", "/c"]


@on_front()
async def test_what_was_sent_ahead_is_not_begun_when_its_client_has_left(front: Front) -> None:
    client = await front.client()
    client.ask("/wait")
    client.ask("/move", b"now")
    await front.until(lambda: bool(front.app.begun))
    client.leave()
    await front.until(lambda: not front.connections)
    front.app.go.set()
    await asyncio.sleep(SOON_S)
    assert front.app.begun == ["/wait"]


@on_front()
async def test_a_long_body_sent_ahead_hides_no_client_that_has_left(front: Front) -> None:
    client = await front.client()
    client.ask("/wait")
    client.ask("/move", b"x" * 100_000)
    await front.until(lambda: bool(front.app.begun))
    await client.writer.drain()
    client.leave()
    await front.until(lambda: not front.connections)
    front.app.go.set()
    await front.until(lambda: bool(front.app.done))
    await asyncio.sleep(SOON_S)
    assert [name for name, _ in front.app.done] == ["/wait"]


@on_front()
async def test_a_stop_sent_ahead_goes_at_once_and_is_answered_in_its_turn(front: Front) -> None:
    client = await front.client()
    client.ask("/wait")
    client.ask("/move")
    client.ask("/bodies/3F/stop", b"now")
    await front.until(lambda: ("/bodies/3F/stop", b"now") in front.app.done)
    assert front.app.begun == ["/wait", "/bodies/3F/stop"]
    front.app.go.set()
    assert [(await client.answer())[1] for _ in range(3)] == [b"/wait ", b"/move ", b"/bodies/3F/stop now"]


@on_front()
async def test_a_stop_is_done_though_its_client_has_left_at_once(front: Front) -> None:
    for _ in range(20):
        client = await front.client()
        client.ask("/wait")
        client.ask("/bodies/3F/commands/stop-immediately", b"now")
        client.leave()
    await front.until(lambda: len(front.app.done) == 20)
    assert {name for name, _ in front.app.done} == {"/bodies/3F/commands/stop-immediately"}


@on_front(requests_ahead=3)
async def test_too_many_requests_ahead_end_the_connection_after_the_first(front: Front) -> None:
    client = await front.client()
    for name in ("/wait", "/b", "/c", "/d", "/e"):
        client.ask(name)
    await front.until(lambda: bool(front.app.begun))
    front.app.go.set()
    assert await client.answer() == (200, b"/wait ")
    assert told(await client.answer()) == (503, "service-unavailable")
    assert await client.ended()
    assert front.app.begun == ["/wait"]


@on_front(requests_ahead=2)
async def test_a_stop_still_goes_where_no_more_requests_do(front: Front) -> None:
    client = await front.client()
    for name in ("/wait", "/b", "/stop"):
        client.ask(name)
    await front.until(lambda: [name for name, _ in front.app.done] == ["/stop"])


@on_front()
async def test_rubbish_behind_a_request_is_not_its_answer(front: Front) -> None:
    client = await front.client()
    client.ask("/wait")
    client.say(b"rubbish\r\n\r\n")
    await asyncio.sleep(SOON_S)
    front.app.go.set()
    assert await client.answer() == (200, b"/wait ")
    assert told(await client.answer()) == (400, "bad-request")


@on_front()
async def test_rubbish_in_a_body_leaves_it_undone(front: Front) -> None:
    client = await front.client()
    client.say(
        b"POST /move HTTP/1.1\r\n", HOST, b"transfer-encoding: chunked\r\n\r\n", b"1\r\nx\r\nrubbish\r\n"
    )
    assert told(await client.answer()) == (400, "bad-request")
    assert await client.ended()
    assert front.app.done == []


# the forms of requests


@pytest.mark.parametrize(
    "head",
    [
        b"GET http://127.0.0.1/a HTTP/1.1\r\nhost: 127.0.0.1\r\n\r\n",
        b"GET a HTTP/1.1\r\nhost: 127.0.0.1\r\n\r\n",
        b"OPTIONS * HTTP/1.1\r\nhost: 127.0.0.1\r\n\r\n",
        b"CONNECT 127.0.0.1:80 HTTP/1.1\r\nhost: 127.0.0.1\r\n\r\n",
        b"GET /a HTTP/1.1\r\nhost: 127.0.0.1\r\nhost: 127.0.0.1\r\n\r\n",
        b"GET /a HTTP/1.1\r\nhost: evil.example\r\nHOST: 127.0.0.1\r\n\r\n",
        b"GET /a HTTP/1.1\r\n\r\n",
        b"GET /a HTTP/1.1\r\nhost: 127.0.0.1\r\nhost : a\r\n\r\n",
        b"POST /a HTTP/1.1\r\nhost: a\r\ncontent-length: 5\r\ntransfer-encoding: chunked\r\n\r\n0\r\n\r\n",
        b"POST /a HTTP/1.1\r\nhost: a\r\ncontent-length: 1\r\ncontent-length: 2\r\n\r\nab",
        b"POST /a HTTP/1.1\r\nhost: a\r\ncontent-length: -1\r\n\r\n",
        b"POST /a HTTP/1.1\r\nhost: a\r\ncontent-length: 1_0\r\n\r\n",
        b"POST /a HTTP/1.1\r\nhost: a\r\ntransfer-encoding: chunked, gzip\r\n\r\n",
        b"POST /a HTTP/1.1\r\nhost: a\r\ntransfer-encoding: chunked\r\n\r\nfffffffffffffffffff\r\n",
        b"GET /\xe3\x81\x82 HTTP/1.1\r\nhost: 127.0.0.1\r\n\r\n",
        b"GET /a HTTP/0.9\r\nhost: 127.0.0.1\r\n\r\n",
        b"GET /a HTTP/2.0\r\nhost: 127.0.0.1\r\n\r\n",
        b"GET /a HTTP/9.9\r\nhost: 127.0.0.1\r\n\r\n",
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
        b"PRI * HTTP/2.0\r\n\r\nSM\r\n\r\n",
        b"GET /events HTTP/1.1\r\nhost: a\r\nconnection: upgrade\r\nupgrade: websocket\r\n\r\n",
        b"POST /events HTTP/1.1\r\nhost: a\r\nconnection: upgrade\r\nupgrade: websocket\r\n"
        b"sec-websocket-version: 13\r\nsec-websocket-key: AAAAAAAAAAAAAAAAAAAAAA==\r\n\r\n",
    ],
)
def test_what_is_not_one_request_is_400(head: bytes, caplog: pytest.LogCaptureFixture) -> None:
    @on_front()
    async def story(front: Front) -> None:
        client = await front.client()
        client.say(head)
        assert told(await client.answer()) == (400, "bad-request")
        assert await client.ended()
        assert front.app.done == []

    story(caplog)


@on_front()
async def test_http_1_0_is_answered_and_closed(front: Front) -> None:
    client = await front.client()
    client.say(b"GET /a HTTP/1.0\r\n\r\n")
    assert (await client.answer())[0] == 200
    assert await client.ended()


@on_front()
async def test_a_client_that_waits_for_100_is_told_to_go_on(front: Front) -> None:
    client = await front.client()
    client.say(b"POST /a HTTP/1.1\r\n", HOST, b"content-length: 2\r\nexpect: 100-continue\r\n\r\n")
    assert await client.reader.readuntil(b"\r\n\r\n") == b"HTTP/1.1 100 Continue\r\n\r\n"
    client.say(b"ab")
    assert await client.answer() == (200, b"/a ab")


@on_front()
async def test_chunks_with_trailers_are_one_body(front: Front) -> None:
    client = await front.client()
    chunks = b"1\r\na\r\n2;x=y\r\nbc\r\n0\r\nchecksum: 1\r\n\r\n"
    for byte in b"POST /a HTTP/1.1\r\n" + HOST + b"transfer-encoding: chunked\r\n\r\n" + chunks:
        client.say(bytes([byte]))
        await asyncio.sleep(0)
    assert await client.answer() == (200, b"/a abc")
    client.ask("/b", b"d")
    assert await client.answer() == (200, b"/b d")


@on_front()
async def test_a_long_body_comes_as_a_whole(front: Front) -> None:
    client = await front.client()
    body = bytes(range(256)) * 4000
    client.ask("/a", body)
    assert await client.answer() == (200, b"/a " + body)


@on_front(connection_s=0.0)
async def test_who_was_refused_before_the_body_was_read_is_heard_again(front: Front) -> None:
    client = await front.client()
    client.ask("/early", b"x" * KIB * KIB)
    await front.until(lambda: front.app.begun == ["/early"])
    await asyncio.sleep(SOON_S)
    front.app.go.set()
    for _ in range(2):
        assert (await client.answer())[0] == 200
        client.ask("/early", b"x" * KIB * KIB)
    client.leave()
    await front.until(lambda: not front.connections)


@on_front(connection_s=0.0)
async def test_the_last_answer_is_read_by_a_client_that_still_sends(front: Front) -> None:
    client = await front.client()
    head = b"POST /early HTTP/1.1\r\ncontent-length: 10000000\r\nconnection: close\r\n"
    client.say(head, HOST, b"\r\n")
    await front.until(lambda: front.app.begun == ["/early"])
    front.app.go.set()
    for _ in range(20):
        client.writer.write(bytes(10 * KIB))
        await asyncio.sleep(SOON_S / 10)
    assert (await client.answer())[0] == 200
    assert await client.ended()


@on_front()
async def test_an_offer_of_another_protocol_takes_no_body_away(front: Front) -> None:
    """Java offers HTTP/2 with its first request; `{"mode":"immediate"}` must not get lost by that."""
    client = await front.client()
    offer = (b"connection: Upgrade, HTTP2-Settings", b"upgrade: h2c", b"http2-settings: AAEAAEAA")
    client.ask("/bodies/3F/stop", b'{"mode":"immediate"}', *offer)
    assert await client.answer() == (200, b'/bodies/3F/stop {"mode":"immediate"}')
    client.ask("/b")
    assert (await client.answer())[0] == 200


WHOLE = (
    b"GET /a HTTP/1.1\r\n" + HOST + b"\r\n",
    b"POST /wait HTTP/1.1\r\n" + HOST + b"content-length: 3\r\n\r\nabc",
    b"POST /bodies/3F/stop HTTP/1.1\r\n" + HOST + b"transfer-encoding: chunked\r\n\r\n3\r\nabc\r\n0\r\n\r\n",
    b"POST /b HTTP/1.1\r\n" + HOST + b"connection: upgrade\r\nupgrade: h2c\r\ncontent-length: 3\r\n\r\nabc",
)
FRAGMENTS = (
    *WHOLE * 4,
    b"GET /a HTTP/1.1\r\n",
    b"POST /wait HTTP/1.1\r\n",
    b"POST /bodies/3F/stop HTTP/1.1\r\n",
    HOST,
    HOST,
    b"\r\n",
    b"\r\n",
    b"content-length: 3\r\n",
    b"transfer-encoding: chunked\r\n",
    b"expect: 100-continue\r\n",
    b"connection: upgrade\r\nupgrade: h2c\r\n",
    b"connection: upgrade\r\nupgrade: websocket\r\nsec-websocket-version: 13\r\n"
    b"sec-websocket-key: AAAAAAAAAAAAAAAAAAAAAA==\r\n",
    b"connection: close\r\n",
    b"3\r\nabc\r\n",
    b"0\r\n\r\n",
    b"abc",
    b"x: " + b"y" * 9000 + b"\r\n",
    b"\x00\xff",
    b"\x81\x81\x01\x02\x03\x04\xfe",
)


@on_front(connections=8, receive_s=0.05, stall_s=0.05)
async def test_no_bytes_in_no_pieces_are_a_fault_of_the_gateway(front: Front) -> None:
    """The stand fails where anything was logged with a traceback, or a connection or a task is left."""
    chance = random.Random(8)
    for _ in range(150):
        client = await front.client()
        data = b"".join(chance.choices(FRAGMENTS, k=chance.randint(1, 14)))
        while data and not client.writer.is_closing():
            cut = chance.choice((1, 7, 100, 20_000))
            client.say(data[:cut])
            data = data[cut:]
            if chance.random() < 0.2:
                await asyncio.sleep(0)
        if chance.random() < 0.5:
            client.leave()
        if chance.random() < 0.1:
            front.app.go.set()
    client = await front.client()
    client.ask("/stop")
    assert (await client.answer())[0] == 200


@on_front()
async def test_heartbeats_and_livez_do_not_wait_where_others_do(front: Front) -> None:
    front.http.turnstile = Turnstile(at_once=0)
    others, urgent = await front.client(), await front.client()
    others.ask("/bodies/3F/moves")
    for method, path in (("POST", "/bodies/3F/jogs/1/heartbeat"), ("GET", "/livez")):
        urgent.ask(path, method=method)
        assert (await urgent.answer())[0] == 200
    assert "/bodies/3F/moves" not in front.app.begun


@on_front()
async def test_connect_is_answered_once_and_closed(front: Front) -> None:
    """The parser then waits for another protocol; parsing its input again would never end."""
    client = await front.client()
    client.say(b"CONNECT /x HTTP/1.1\r\n", HOST, b"\r\n")
    client.writer.write_eof()
    status, body = await client.answer()
    assert (status, "no proxy" in body.decode() or "proxies" in body.decode()) == (400, True)
    assert await client.ended()
    await front.until(lambda: not front.connections)


TRAILER = b"x-forwarded-for: 10.0.0.9\r\n\r\n"


@on_front()
async def test_trailers_are_dropped(front: Front) -> None:
    client = await front.client()
    head = b"POST /headers HTTP/1.1\r\nauthorization: Bearer a\r\n" + HOST
    client.say(head, b"transfer-encoding: chunked\r\n\r\n", b"0\r\nauthorization: Bearer b\r\n", TRAILER)
    _, told = await client.answer()
    assert b"Bearer a" in told
    assert b"Bearer b" not in told
    assert b"x-forwarded-for" not in told, "a proxy that is trusted passes trailers of others on"


@on_front()
async def test_a_head_has_not_thousands_of_lines(front: Front) -> None:
    client = await front.client()
    client.say(b"GET /a HTTP/1.1\r\n", HOST, b"a:\r\n" * 99, b"\r\n")
    assert (await client.answer())[0] == 200
    client.say(b"GET /a HTTP/1.1\r\n", HOST, b"a:\r\n" * 100, b"\r\n")
    assert (await client.answer())[0] == 431
    assert await client.ended()


# the limit of connections


@on_front(connections=2, receive_s=0.3)
async def test_at_the_limit_only_stops_are_served(front: Front) -> None:
    for _ in range(2):
        (await front.client()).ask("/wait")
    await front.until(lambda: len(front.app.begun) == 2)
    refused, stop = await front.client(), await front.client()
    refused.ask("/move")
    assert told(await refused.answer()) == (503, "service-unavailable")
    assert await refused.ended()
    stop.ask("/stop", b"now")
    assert await stop.answer() == (200, b"/stop now")
    assert await stop.ended()
    assert "/move" not in front.app.begun


@on_front(connections=1)
async def test_beyond_the_limit_the_gateway_still_says_that_it_lives(front: Front) -> None:
    """An orchestrator would kill it in motion."""
    (await front.client()).ask("/wait")
    await front.until(lambda: len(front.app.begun) == 1)
    for method in ("GET", "GET"):
        client = await front.client()
        client.ask("/livez", method=method)
        assert (await client.answer())[0] == 200
        assert await client.ended()
    other = await front.client()
    other.ask("/livez")
    assert (await other.answer())[0] == 503


@on_front(connections=1, receive_s=0.3)
async def test_slow_heads_beyond_the_limit_make_room_for_a_stop(front: Front) -> None:
    (await front.client()).ask("/wait")
    await front.until(lambda: len(front.app.begun) == 1)
    for _ in range(100):
        (await front.client()).say(b"POST /stop HTTP/1.1\r\n")
    stop = await front.client()
    stop.ask("/stop", b"now")
    assert await stop.answer() == (200, b"/stop now")


@on_front(connections=2)
async def test_there_is_room_again_when_others_have_left(front: Front) -> None:
    first = [await front.client() for _ in range(2)]
    for client in first:
        client.ask("/a")
        await client.answer()
        client.leave()
    await front.until(lambda: not front.connections)
    client = await front.client()
    client.ask("/b")
    assert (await client.answer())[0] == 200


# clients that do not read


@on_front(stall_s=0.05)
async def test_who_does_not_take_an_answer_loses_the_connection(front: Front) -> None:
    client = await front.client()
    client.writer.transport.pause_reading()  # type: ignore[attr-defined]  # a transport can
    for _ in range(6):
        client.ask("/a", b"x" * 2_000_000)
    await front.until(lambda: not front.connections)


@on_front(stall_s=0.5)
async def test_who_takes_an_answer_slowly_gets_it_all(front: Front) -> None:
    client = await front.client()
    client.ask("/a", b"x" * 12_000_000)
    taken = 0
    while taken < 12_000_000:
        piece = await client.reader.read(1_000_000)
        assert piece, "the connection was ended"
        taken += len(piece)
        await asyncio.sleep(0.01)


# clients that have left


@pytest.mark.parametrize("requests", [0, 1, 3])
def test_who_has_left_leaves_nothing_to_the_garbage_collector(
    requests: int, caplog: pytest.LogCaptureFixture
) -> None:
    """Neither a request that is under way, nor those that never began."""

    @on_front()
    async def story(front: Front) -> None:
        client = await front.client()
        client.ask("/a")
        await client.answer()
        for _ in range(requests):
            client.ask("/wait")
        await front.until(lambda: front.app.begun.count("/wait") == min(requests, 1))
        with garbage() as found:
            client.leave()
            await front.until(lambda: not front.connections)
            front.app.go.set()
            await front.until(lambda: not front.server.server_state.tasks)
        assert not [it for it in found if type(it).__module__.startswith(("api", "uvicorn", "uvloop"))]

    story(caplog)
