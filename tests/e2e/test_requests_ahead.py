"""Moves that are waited for: their clients leave, or send requests ahead of the answer."""

import json
import socket
from urllib.parse import urlsplit

from tests.e2e.processes import PATIENCE_S, Gateway, SimulatedLine, until

FAR = 900_000_000


def connected(gateway: Gateway) -> socket.socket:
    url = urlsplit(gateway.url)
    return socket.create_connection((str(url.hostname), url.port or 0), PATIENCE_S)


def post(path: str, content: object) -> bytes:
    body = json.dumps(content)
    return (
        f"POST {path} HTTP/1.1\r\nhost: 127.0.0.1\r\ncontent-type: application/json\r\n"
        f"content-length: {len(body)}\r\n\r\n{body}"
    ).encode()


def far() -> object:
    return {"kind": "relative", "direction": "cw", "distance": {"value": FAR, "unit": "pulse"}}


def moves(gateway: Gateway, body: str) -> bool:
    return gateway.get(f"/bodies/{body}")["moving"] is True


def test_a_move_sent_ahead_is_not_begun_when_its_client_has_left(
    gateway: Gateway, line: SimulatedLine
) -> None:
    with connected(gateway) as client:
        client.sendall(post("/bodies/3F/moves?wait=20", far()) + post("/bodies/00/moves", far()))
        until(lambda: moves(gateway, "3F"), "the first body moves")
    gateway.http.post("/bodies/3F/stop").raise_for_status()
    until(lambda: not moves(gateway, "3F"), "the first body stands still")
    gateway.get("/bodies/00/position")
    assert {fact.body for fact in line.truth("pulses_start")} == {"3F"}


def test_a_move_goes_on_when_the_client_that_waits_for_its_end_has_left(
    gateway: Gateway, line: SimulatedLine
) -> None:
    with connected(gateway) as client:
        client.sendall(post("/bodies/3F/moves?wait=20", far()))
        until(lambda: moves(gateway, "3F"), "the body moves")
    move, *_ = gateway.get("/bodies/3F/moves")["moves"]
    assert move["status"] in ("sent", "moving")
    assert not line.truth("pulses_stop")
    gateway.http.post("/bodies/3F/stop").raise_for_status()
    assert gateway.ended("3F", move["id"])["status"] == "stopped"


def test_a_stop_sent_ahead_goes_at_once(gateway: Gateway, line: SimulatedLine) -> None:
    with connected(gateway) as client:
        client.sendall(post("/bodies/3F/moves?wait=20", far()))
        until(lambda: moves(gateway, "3F"), "the body moves")
        client.sendall(post("/bodies/3F/stop", {"mode": "immediate"}))
        answers = b""
        while b'"confirmed"' not in answers:
            answers += client.recv(65_536)
    # The move ended because of the stop, and is answered before it.
    assert answers.index(b'"status":"stopped"') < answers.index(b'"confirmed":true')
    assert len(line.truth("pulses_stop")) == 1
