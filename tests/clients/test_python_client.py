"""The Python client without a gateway: what it sends, what it repeats, and how it tells what went wrong."""

import json
import threading
from collections.abc import Callable
from typing import Any

import httpx
import pytest
from hypothesis import given
from hypothesis import strategies as st
from motion_gateway_client import AsyncGateway, Gateway, GatewayError, MoveNotSucceeded, NoAnswer, Refused
from motion_gateway_client.generated.types import AbsoluteMoveRequest
from motion_gateway_client.paths import path_of
from motion_gateway_client.server_sent import EventReader

HOME: AbsoluteMoveRequest = {"kind": "absolute", "position": {"value": 0, "unit": "pulse"}}
PROBLEM = {
    "type": "urn:motion-gateway:problem:body-busy",
    "title": "The body is busy",
    "status": 409,
    "detail": "3F moves; nothing was sent.",
    "moved": "no",
    "remedy": "Wait for the end.",
    "retryable": True,
    "request_id": "r-7",
}
Answer = Callable[[httpx.Request], httpx.Response]


class Line:
    """Stands for the gateway, and keeps what it was sent."""

    def __init__(self, *answers: httpx.Response | Exception) -> None:
        self.requests: list[httpx.Request] = []
        self._answers = list(answers)
        self.transport = httpx.MockTransport(self._answer)
        self.client = Gateway(key="k", http=httpx.Client(base_url="http://gateway", transport=self.transport))

    def _answer(self, request: httpx.Request) -> httpx.Response:
        self.requests.append(request)
        answer = self._answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        return answer

    @property
    def sent(self) -> list[str]:
        return [
            f"{request.method} {request.url.raw_path.decode()} {request.content.decode()}".strip()
            for request in self.requests
        ]


def move(status: str, **more: object) -> dict[str, Any]:
    return {"id": "m1", "body_id": "arm.3F", "status": status, "error": None, "request_id": "r", **more}


def test_it_sends_the_key_and_an_idempotency_key_only_where_it_is_given() -> None:
    line = Line(*[httpx.Response(202, json=move("sent"))] * 2)
    line.client.start_move("3F", HOME)
    line.client.start_move("3F", HOME, wait=2, idempotency_key="order 7")
    assert [request.headers["Authorization"] for request in line.requests] == ["Bearer k"] * 2
    assert [request.headers.get("Idempotency-Key") for request in line.requests] == [None, "order 7"]
    assert line.sent[1].startswith("POST /bodies/3F/moves?wait=2 {")
    assert json.loads(line.requests[1].content) == HOME


def test_url_and_key_come_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    line = Line(httpx.Response(200, json={"bodies": []}))
    monkeypatch.setenv("MOTION_GATEWAY_URL", "http://plant:1")
    monkeypatch.setenv("MOTION_GATEWAY_KEY", "secret")
    monkeypatch.setattr("httpx._client.HTTPTransport", lambda **_: line.transport)
    with Gateway() as gateway:
        gateway.list_bodies()
    (request,) = line.requests
    assert (str(request.url), request.headers["Authorization"]) == ("http://plant:1/bodies", "Bearer secret")


def test_a_problem_is_raised_with_all_it_says() -> None:
    line = Line(httpx.Response(409, json=PROBLEM, headers={"content-type": "application/problem+json"}))
    with pytest.raises(Refused, match=r"nothing was sent\. Wait for the end\.") as caught:
        line.client.start_move("3F", HOME)
    problem = caught.value
    assert (problem.kind, problem.status, problem.retryable) == ("body-busy", 409, True)
    assert (problem.moved, problem.remedy, problem.request_id) == ("no", "Wait for the end.", "r-7")


def test_what_answers_with_no_problem_is_an_error_too() -> None:
    line = Line(httpx.Response(502, text="Bad gateway"))
    with pytest.raises(GatewayError) as caught:
        line.client.get_body("3F")
    assert caught.value.moved == "unknown"


def test_a_move_is_never_sent_twice_and_nobody_knows_what_became_of_it() -> None:
    line = Line(httpx.ReadError("gone"))
    with pytest.raises(NoAnswer) as caught:
        line.client.start_move("3F", HOME)
    assert (caught.value.moved, caught.value.retryable, len(line.sent)) == ("unknown", False, 1)


def test_what_never_reached_the_gateway_moved_nothing() -> None:
    line = Line(httpx.ConnectError("refused"))
    with pytest.raises(NoAnswer) as caught:
        line.client.start_move("3F", HOME)
    assert (caught.value.moved, caught.value.retryable) == ("no", True)


def test_a_stop_is_sent_again_where_the_connection_breaks() -> None:
    line = Line(
        httpx.ReadError("gone"), httpx.ConnectError("gone"), httpx.Response(200, json={"confirmed": True})
    )
    assert line.client.stop("3F", "immediate")["confirmed"]
    assert line.sent == ['POST /bodies/3F/stop {"mode":"immediate"}'] * 3


def test_waiting_goes_on_over_a_broken_connection() -> None:
    line = Line(
        httpx.ReadError("gone"),
        httpx.Response(200, json=move("moving")),
        httpx.Response(200, json=move("succeeded")),
    )
    started: Any = move("sent")
    assert line.client.wait_for_move(started, timeout=5)["status"] == "succeeded"
    assert all(sent.startswith("GET /bodies/arm.3F/moves/m1?wait=") for sent in line.sent)


def test_a_move_that_has_failed_is_raised_with_its_reason() -> None:
    error = {"type": "controller-failed", "detail": "It hit a limit.", "moved": "yes", "remedy": "Home it."}
    failed: Any = move("failed", error=error)
    with pytest.raises(MoveNotSucceeded, match=r"has ended: failed. It hit a limit. Home it.") as caught:
        Line().client.wait_for_move(failed)
    assert (caught.value.kind, caught.value.moved) == ("controller-failed", "yes")


def test_events_that_were_refused_are_not_asked_for_again() -> None:
    line = Line(httpx.Response(422, json={**PROBLEM, "retryable": False}))
    with pytest.raises(Refused):
        next(line.client.events(bodies=["nobody"]))
    assert line.sent == ["GET /events/stream?bodies=nobody"]


def test_a_stream_goes_on_after_the_last_event_it_gave() -> None:
    lines = ': events after a-1\n\nid: a-2\nevent: line.up\ndata: {"id": "%s"}\n\nid: a-3\nda'
    line = Line(
        httpx.Response(200, text=lines % "a-2"),
        httpx.Response(503, json={**PROBLEM, "status": 503}),
        httpx.Response(200, text=lines.replace("a-2", "a-3") % "a-3"),
    )
    events = line.client.events(types=["line.*", "body.*"])
    assert [next(events)["id"], next(events)["id"]] == ["a-2", "a-3"]
    assert [request.url.params.get("after") for request in line.requests] == [None, "a-2", "a-2"]
    assert line.requests[0].url.params["types"] == "line.*,body.*"


def test_a_stream_tells_how_its_connection_is_and_asks_for_a_snapshot_until_it_has_one() -> None:
    def sse(cursor: str) -> str:
        return f'id: {cursor}\ndata: {{"id": "{cursor}"}}\n\n'

    said: list[str | None] = []
    line = Line(
        httpx.ConnectError("nobody there"),
        httpx.Response(200, text=f": events after e-6\n\n{sse('e-6')}"),
        httpx.Response(200, text=sse("e-7")),
    )
    heard = line.client.events(
        snapshot=True, on_connection=lambda error: said.append(None if error is None else error.kind)
    )
    assert [next(heard)["id"], next(heard)["id"]] == ["e-6", "e-7"]
    assert said == ["no-answer", None, "no-answer", None]
    assert [request.url.query.decode() for request in line.requests] == ["snapshot=true"] * 2 + ["after=e-6"]


def test_an_answer_is_handed_on_as_it_is_with_the_leases_of_others() -> None:
    line = Line(
        httpx.Response(202, json=move("sent"), headers={"Idempotency-Replayed": "true"}),
        httpx.Response(409, json=PROBLEM),
    )
    answer = line.client.ask("POST", "/bodies/3F/moves", idempotency_key="k-1", lease_tokens=["4", "5"])
    assert (answer.status, answer.content["id"], answer.replayed) == (202, "m1", True)
    assert line.requests[0].headers["lease-token"] == "4, 5"
    refusal = line.client.ask("POST", "/bodies/3F/moves")
    assert (refusal.is_success, refusal.content, refusal.replayed) == (False, PROBLEM, False)


def test_a_reader_knows_where_the_stream_began_before_any_event() -> None:
    reader = EventReader(None)
    assert not list(reader.take(": events after a-1\n\n: still"))
    assert reader.cursor == "a-1"


@given(st.lists(st.text(), min_size=1), st.data())
def test_a_reader_gives_every_event_however_its_text_is_cut(names: list[str], data: st.DataObject) -> None:
    events = [{"id": f"a-{number}", "subject": name} for number, name in enumerate(names)]
    lines = [
        f"id: {event['id']}\nevent: x\ndata: {json.dumps(event, ensure_ascii=False)}\n\n" for event in events
    ]
    text, reader = "".join(lines), EventReader(None)
    cut = data.draw(st.integers(0, len(text)))
    taken: list[Any] = [*reader.take(text[:cut]), *reader.take(text[cut:])]
    assert taken == events
    assert reader.cursor == events[-1]["id"]


@pytest.mark.parametrize(
    ("address", "path"),
    [
        ("3F", "/bodies/3F"),
        ("arm.3f", "/bodies/arm.3f"),
        ("80", "/groups/80"),
        ("arm.9E", "/groups/arm.9E"),
        ("r1", "/robots/r1"),
        ("a1", "/robots/a1"),
        ("r1/units/2", "/robots/r1/units/2"),
    ],
)
def test_addresses_lead_to_what_they_name(address: str, path: str) -> None:
    assert path_of(address) == path


JOG = {"id": "j1", "unit": 2, "axis": "X", "direction": "+", "heartbeat_within_ms": 20, "ends_as": None}


class Robot:
    """Stands for a gateway with a robot whose axis jogs for a few heartbeats, and then is told to stop."""

    def __init__(self, *, heartbeats: int, looks: int = 1) -> None:
        self.sent: list[str] = []
        self._heartbeats, self._looks = heartbeats, looks
        self.enough = threading.Event()
        self.transport = httpx.MockTransport(self._answer)

    def _answer(self, request: httpx.Request) -> httpx.Response:
        self.sent.append(request.url.path)
        if request.url.path.endswith("/heartbeat"):
            self._heartbeats -= 1
            if self._heartbeats < 0:
                self.enough.set()
                return httpx.Response(409, json={**PROBLEM, "detail": "It is over."})
        if request.url.path.endswith("/j1/stop"):
            self._looks -= 1
            if self._looks < 0:
                raise httpx.ReadError("gone")
            return httpx.Response(200, json={**JOG, "state": "stopping" if self._looks else "ended"})
        return httpx.Response(201, json={**JOG, "state": "jogging"})


def test_a_jog_that_the_gateway_has_ended_is_stopped_and_raised() -> None:
    robot = Robot(heartbeats=3, looks=2)
    client = Gateway(http=httpx.Client(base_url="http://gateway", transport=robot.transport))
    with (
        pytest.raises(Refused, match=r"It is over\."),
        client.jog("r1", unit=2, axis="X", direction="+"),
    ):
        assert robot.enough.wait(5)
    beats = ["/robots/r1/jogs/j1/heartbeat"] * 4
    assert robot.sent == ["/robots/r1/jogs", *beats, *["/robots/r1/jogs/j1/stop"] * 2]


@pytest.mark.anyio
async def test_a_jog_whose_end_is_not_answered_stops_the_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("motion_gateway_client.async_gateway.PAUSES_S", (0.0, 0.0))
    robot = Robot(heartbeats=0, looks=0)
    http = httpx.AsyncClient(base_url="http://gateway", transport=robot.transport)
    with pytest.raises(ValueError, match="the block's own"):
        async with AsyncGateway(http=http) as client, client.jog("r1", unit=2, axis="X", direction="-"):
            raise ValueError("the block's own")
    assert robot.sent == ["/robots/r1/jogs", *["/robots/r1/jogs/j1/stop"] * 2, "/robots/r1/stop"]


class Leased:
    """Stands for a gateway that gives a lease and renews it a few times, and then says that it is lost."""

    def __init__(self, *, renewals: int) -> None:
        self.sent: list[tuple[str, str | None]] = []
        self._renewals = renewals
        self.enough = threading.Event()
        self.transport = httpx.MockTransport(self._answer)

    def _answer(self, request: httpx.Request) -> httpx.Response:
        self.sent.append((f"{request.method} {request.url.path}", request.headers.get("Lease-Token")))
        if request.url.path.endswith("/renew"):
            self._renewals -= 1
            if self._renewals < 0:
                self.enough.set()
                return httpx.Response(409, json={**PROBLEM, "detail": "Somebody took it over."})
        return httpx.Response(200, json={"lease": "lease-1", "token": 7})


def test_a_lease_goes_with_what_is_sent_in_its_block_and_ends_with_it() -> None:
    gateway = Leased(renewals=1000)
    client = Gateway(http=httpx.Client(base_url="http://gateway", transport=gateway.transport))
    with client.lease("3F", ttl_s=30) as taken:
        assert taken["token"] == 7
        client.start_move("3F", HOME)
    client.start_move("3F", HOME)
    assert gateway.sent == [
        ("POST /leases", None),
        ("POST /bodies/3F/moves", "7"),
        ("DELETE /leases/lease-1", "7"),
        ("POST /bodies/3F/moves", None),
    ]


def test_a_lease_that_was_taken_over_is_raised_at_the_end_of_its_block() -> None:
    gateway = Leased(renewals=2)
    client = Gateway(http=httpx.Client(base_url="http://gateway", transport=gateway.transport))
    with pytest.raises(Refused, match="Somebody took it over"), client.lease("3F", ttl_s=0.1):
        assert gateway.enough.wait(5)
    renewals = [("POST /leases/lease-1/renew", "7")] * 3
    assert gateway.sent == [("POST /leases", None), *renewals, ("DELETE /leases/lease-1", "7")]
