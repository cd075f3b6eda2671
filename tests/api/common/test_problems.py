"""Problem documents of all errors, and the conclusions that their status allows."""

from collections.abc import AsyncIterator, Iterator
from typing import Annotated, Any, Literal

import httpx2
import pytest
from httpx2 import ASGITransport, AsyncClient
from pydantic import BaseModel, Field
from starlette.requests import Request

from api.app import Application, create_app
from api.common.problems import MEDIA_TYPE, RETRY_AFTER_S, wants_japanese
from gateway import texts
from gateway.core.errors import (
    Ambiguous,
    BodyBusy,
    BodyOffline,
    Cancelled,
    ControllerRefused,
    Expired,
    GarbledReply,
    GatewayError,
    InvalidRequest,
    MoveFailed,
    NoReply,
    NotAllowed,
    NotExecuted,
    NotFound,
    NotSent,
    PortNotOpen,
    PowerCycled,
    QueueFull,
    StoppedFirst,
)
from gateway.core.operation import Rows
from gateway.core.rights import Right
from gateway.door.problems import TYPE_PREFIX, problem_of
from gateway.fics.errors import RobotFailed, RobotOffline
from gateway.fics.errors import refused as robot_refused
from gateway.rorze.errors import refused as body_refused
from protocols.fics.inputs_outputs import GetInputChannel
from protocols.fics.jog import StartJog
from protocols.fics.macros import RunMacro
from protocols.fics.moves import MoveToPosition
from protocols.fics.status import GetAxisStatus
from protocols.rorze.encoder import SetEncoderRatio
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from tests.api.small import HERE, small_plant

DETAIL = "This happened; nothing was sent."


def refused(error: int | None) -> ControllerRefused:
    return body_refused("line1.3F", MoveClockwise(distance=500), error)


def refused_by_robot(error: str) -> ControllerRefused:
    return robot_refused("r1", MoveToPosition(position=1), error)


def every_kind(kind: type[GatewayError]) -> list[type[GatewayError]]:
    return [kind, *(found for child in kind.__subclasses__() for found in every_kind(child))]


def garbled(error: ControllerRefused) -> tuple[str, str, bool, str | None]:
    problem = problem_of(error, "/")
    return problem.type.removeprefix(TYPE_PREFIX), problem.moved, problem.retryable, problem.code


def test_what_the_line_has_damaged_is_not_the_clients_mistake() -> None:
    body = body_refused("arm.3F", GetPosition(), 0x4B)
    assert garbled(body) == ("command-garbled", "no", True, "0x4B")
    robot = robot_refused("r1", GetAxisStatus(), "E06")
    assert garbled(robot) == ("command-garbled", "no", True, "E06")
    assert problem_of(robot, "/").detail == (
        "ACD was sent as the manual has it, and r1 refused what arrived: The command is not written "
        "correctly. The line has damaged it, or the controller is not the one that is configured. Nothing "
        "moved because of it."
    )
    assert problem_of(robot, "/", japanese=True).title == "コマンドが通信中に壊れました"


# the status


@pytest.mark.parametrize(
    ("error", "status"),
    [
        (NotFound(DETAIL), 404),
        (Ambiguous(DETAIL), 409),
        (InvalidRequest(DETAIL), 422),
        (NotAllowed(DETAIL), 403),
        (BodyBusy(DETAIL), 409),
        (PortNotOpen(DETAIL), 503),
        (BodyOffline(DETAIL), 503),
        (RobotOffline(DETAIL), 503),
        (QueueFull(DETAIL), 503),
        (Expired(DETAIL), 503),
        (Cancelled(DETAIL), 409),
        (StoppedFirst(), 409),
        (PowerCycled(DETAIL), 409),
        (NoReply(DETAIL), 409),
        (GarbledReply(DETAIL), 409),
        (NotExecuted(DETAIL), 409),
        (MoveFailed(DETAIL), 409),
        (RobotFailed("r1", "LMA", "183"), 409),
        (refused(0x50), 409),
        (refused(0x4A), 422),
        (refused(None), 409),
        (refused_by_robot("E01"), 409),
        (refused_by_robot("E07"), 422),
        (robot_refused("r1", GetAxisStatus(), "E06"), 409),
        (robot_refused("r1", StartJog(axis="X", direction="+"), "E12"), 409),
        (robot_refused("r1", RunMacro(macro="PCK"), "E12"), 422),
        (robot_refused("r1", GetInputChannel(channel=99), "E05"), 422),
        (robot_refused("r1", MoveToPosition(position=1), "E05"), 409),
        (body_refused("arm.3F", GetPosition(), 0x49), 409),
        (body_refused("arm.3F", GetPosition(), 0x4A), 409),
        (body_refused("arm.3F", SetEncoderRatio(ratio=1.0), 0x4A), 422),
    ],
    ids=lambda it: type(it).__name__ if isinstance(it, GatewayError) else str(it),
)
def test_every_error_has_its_status(error: GatewayError, status: int) -> None:
    assert problem_of(error, "/bodies/3F").status == status


def test_a_status_that_clients_repeat_unasked_means_that_nothing_was_sent() -> None:
    plain = [it for it in every_kind(GatewayError) if it.__init__ is GatewayError.__init__]
    repeated = [
        it for it in plain if problem_of(it(DETAIL), "/").status in (408, 425, 429, 500, 502, 503, 504)
    ]
    assert len(repeated) > 4
    assert all(issubclass(it, NotSent) and it.retryable and it.moved == "no" for it in repeated)


def test_a_problem_says_everything_about_its_error() -> None:
    problem = problem_of(
        NoReply("1+M was sent, and no reply came.", "Read the position."), "/bodies/3F/moves"
    )
    assert problem.model_dump(exclude_none=True) == {
        "type": f"{TYPE_PREFIX}no-reply",
        "title": "No reply",
        "status": 409,
        "detail": "1+M was sent, and no reply came.",
        "instance": "/bodies/3F/moves",
        "moved": "unknown",
        "remedy": "Read the position.",
        "retryable": False,
    }


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (refused(0x5), "0x05"),
        (refused(None), None),
        (refused_by_robot("E07"), "E07"),
        (RobotFailed("r1", "LMA", "183"), "183"),
        (NoReply(DETAIL), None),
    ],
    ids=lambda it: str(it),
)
def test_a_controllers_own_code_is_told_as_its_manual_writes_it(
    error: GatewayError, code: str | None
) -> None:
    assert problem_of(error, "/").code == code


# Japanese


@pytest.mark.parametrize(
    "error", [refused(0x50), refused_by_robot("E07"), RobotFailed("r1", "LMA", "183")], ids=repr
)
def test_what_a_controller_says_is_told_in_japanese_and_means_the_same(error: GatewayError) -> None:
    english, japanese = problem_of(error, "/"), problem_of(error, "/", japanese=True)
    for text in (japanese.title, japanese.detail):
        assert not text.isascii()
    changed = {"title", "detail", "remedy"}
    assert english.model_dump(exclude=changed) == japanese.model_dump(exclude=changed)


def test_what_the_gateway_says_itself_has_its_kind_in_japanese_and_the_rest_in_english() -> None:
    problem = problem_of(NoReply(DETAIL), "/", japanese=True)
    assert problem.title == "応答がありません"
    assert problem.detail == f"応答がありません。この要求でモータが動いたかどうかは分かりません。（{DETAIL}）"
    assert problem.remedy == problem_of(NoReply(DETAIL), "/").remedy


@pytest.mark.parametrize(
    "error", [PortNotOpen(DETAIL, "Wait."), BodyBusy(DETAIL, "Wait."), Expired(), StoppedFirst()]
)
def test_the_remedy_of_what_happens_every_day_is_told_in_japanese(error: GatewayError) -> None:
    problem = problem_of(error, "/", japanese=True)
    assert problem.remedy == texts.text(f"remedies.{error.kind}", remedy=error.remedy).ja


def kinds_below(error: type[GatewayError]) -> Iterator[type[GatewayError]]:
    for kind in error.__subclasses__():
        yield from (kind, *kinds_below(kind))


def test_every_kind_of_refusal_has_a_title_in_japanese() -> None:
    own = [it for it in kinds_below(GatewayError) if it.__module__.startswith("gateway.")]
    assert [it for it in own if it.title_ja == it.title] == []
    assert texts.entry("ja", "remedies").keys() <= {it.kind for it in own}


@pytest.mark.parametrize(
    ("header", "japanese"),
    [
        ("ja", True),
        ("ja,en", True),
        ("ja-JP,en;q=0.5", True),
        (" JA ; q=1", True),
        ("en,ja", False),
        ("jam", False),
        ("*", False),
        ("", False),
    ],
)
def test_japanese_is_for_those_who_ask_for_it_first(header: str, japanese: bool) -> None:
    scope = {"type": "http", "headers": [(b"accept-language", header.encode())]}
    assert wants_japanese(Request(scope)) is japanese


# over HTTP


class Round(BaseModel):
    kind: Literal["round"]
    radius: float


class Square(BaseModel):
    kind: Literal["square"]
    sides: list[float]


class Order(BaseModel):
    shape: Annotated[Round | Square, Field(discriminator="kind")]


SHOP = Rows("orders")


@SHOP.get("/down/{name}", Right.OPEN)
async def down(name: str) -> None:
    raise PortNotOpen(DETAIL, "Wait.")


@SHOP.get("/refused", Right.OPEN)
async def refuse() -> None:
    raise refused(0x50)


@SHOP.get("/fault", Right.OPEN)
async def fault() -> None:
    raise ZeroDivisionError("a secret")


@SHOP.get("/orders", Right.OPEN)
async def list_orders(*, count: int) -> None: ...


@SHOP.post("/orders", Right.OPEN)
async def order(order: Order, *, count: int = 1) -> None: ...


def shop() -> Application:
    return create_app(small_plant(mode="open"), besides=SHOP)


@pytest.fixture
async def client(anyio_backend: str) -> AsyncIterator[AsyncClient]:
    transport = ASGITransport(shop(), raise_app_exceptions=False)
    async with AsyncClient(transport=transport, base_url=HERE) as client:
        yield client


def told(answer: httpx2.Response) -> dict[str, Any]:
    assert answer.headers["content-type"] == MEDIA_TYPE
    problem: dict[str, Any] = answer.json()
    assert problem["status"] == answer.status_code
    return problem


@pytest.mark.anyio
async def test_what_may_be_repeated_says_when_and_names_the_path_as_a_uri(client: AsyncClient) -> None:
    answer = await client.get("/down/%E8%85%95")
    assert told(answer)["instance"] == "/down/%E8%85%95"
    assert answer.headers["retry-after"] == str(RETRY_AFTER_S)
    refusal = await client.get("/refused")
    assert "retry-after" not in refusal.headers


@pytest.mark.anyio
async def test_an_answer_tells_its_language_where_there_is_a_choice(client: AsyncClient) -> None:
    english = await client.get("/refused")
    japanese = await client.get("/refused", headers={"Accept-Language": "ja"})
    own = await client.get("/down/x", headers={"Accept-Language": "ja"})
    unknown = await client.get("/nowhere", headers={"Accept-Language": "ja"})
    assert told(english)["title"] == "The controller refused"
    assert told(japanese)["title"] == "コントローラが実行を拒否しました"
    assert told(own)["title"] == "回線が使用できません"
    assert told(unknown)["detail"].startswith(
        "見つかりません。この要求でモータは動いていません。（There is nothing"
    )
    answers = (english, japanese, own, unknown)
    assert [answer.headers.get("content-language") for answer in answers] == [None, "ja", "ja", "ja"]
    assert {answer.headers["vary"] for answer in answers} == {"Accept-Language"}


@pytest.mark.anyio
async def test_a_fault_of_the_gateway_claims_nothing_and_tells_no_secrets(client: AsyncClient) -> None:
    problem = told(await client.get("/fault"))
    assert (problem["status"], problem["moved"], problem["retryable"]) == (500, "unknown", False)
    assert "secret" not in str(problem)


@pytest.mark.anyio
async def test_what_is_not_there_and_what_cannot_be_done_are_problems_too(client: AsyncClient) -> None:
    missing, wrong = await client.get("/nowhere"), await client.delete("/refused")
    assert told(missing)["detail"] == "There is nothing at /nowhere; nothing was sent."
    assert told(wrong)["detail"] == "DELETE is not possible at /refused; nothing was sent."
    assert wrong.headers["allow"] == "GET"
    assert [told(answer)["type"] for answer in (missing, wrong)] == [
        f"{TYPE_PREFIX}not-found",
        f"{TYPE_PREFIX}method-not-allowed",
    ]


@pytest.mark.anyio
@pytest.mark.parametrize(
    ("order", "field"),
    [
        ({"shape": {"kind": "round", "radius": "wide"}}, "shape.radius"),
        ({"shape": {"kind": "round"}}, "shape.radius"),
        ({"shape": {"kind": "square", "sides": [1.0, "long"]}}, "shape.sides.1"),
        ({"shape": {"kind": "flat"}}, "shape.kind"),
        ({}, "shape"),
    ],
)
async def test_a_field_is_named_by_its_place_in_the_request(
    client: AsyncClient, order: dict[str, object], field: str
) -> None:
    problem = told(await client.post("/orders", json=order))
    assert [error["field"] for error in problem["errors"]] == [field]
    assert problem["detail"].startswith(f"{field}: ")
    assert problem["detail"].endswith("; nothing was sent.")
    assert (problem["status"], problem["type"]) == (422, f"{TYPE_PREFIX}invalid-request")


@pytest.mark.anyio
async def test_all_that_is_wrong_is_told_at_once(client: AsyncClient) -> None:
    problem = told(
        await client.post("/orders?count=x", json={"shape": {"kind": "square", "sides": ["a", "b"]}})
    )
    assert {error["field"] for error in problem["errors"]} == {"count", "shape.sides.0", "shape.sides.1"}


@pytest.mark.anyio
async def test_a_part_of_the_query_has_its_name_where_nothing_has_a_body(client: AsyncClient) -> None:
    problem = told(await client.get("/orders?count=x"))
    assert [error["field"] for error in problem["errors"]] == ["count"]


@pytest.mark.anyio
async def test_where_there_is_no_body_it_is_the_body_that_is_missing(client: AsyncClient) -> None:
    problem = told(await client.post("/orders"))
    assert problem["detail"].startswith("The request body: ")
