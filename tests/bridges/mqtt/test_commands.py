"""The checks of a command before the gateway is asked."""

import asyncio
import json
from types import SimpleNamespace
from typing import Any, Final

import pytest
from aiomqtt import Message
from motion_gateway_client import Answer, NoAnswer
from motion_gateway_client.async_gateway import STOP_TRIES

from bridges.common.callers import Caller, Callers, Doors
from bridges.common.settings import CallerTable, GatewayTable
from bridges.common.state import Figures
from bridges.mqtt import requests
from bridges.mqtt.broker import StopsFirst
from bridges.mqtt.commands import Commands
from bridges.mqtt.operations import Operation
from bridges.mqtt.outbox import Letter

MOVE, STOP = Operation(moves=True), Operation(stops=True)


@pytest.mark.parametrize(
    ("operation", "retain", "stored", "is_refused"),
    [
        (MOVE, False, False, False),
        (MOVE, False, True, False),
        (MOVE, True, False, True),
        (MOVE, True, True, True),
        (STOP, False, False, False),
        (STOP, False, True, False),
        (STOP, True, False, False),
        (STOP, True, True, True),
    ],
)
def test_what_comes_while_the_bridge_subscribes_is_stored_only_if_it_is_retained(
    operation: Operation, retain: bool, stored: bool, is_refused: bool
) -> None:
    callers = Callers(Doors(GatewayTable(url="http://127.0.0.1:1")), {"mes": CallerTable()})
    commands = Commands("root", callers, Figures(), lambda _: operation)
    told = SimpleNamespace(CorrelationData=b"c", MessageExpiryInterval=9)
    message = Message("root/cmd/mes/bodies/3F/stop", b"", 1, retain, 1, told)  # type: ignore[arg-type]
    refusal = commands._judge(requests.read(message, "root"), operation, stored=stored)
    assert (refusal is not None and refusal.kind == "retained") == is_refused


class Gateway(Callers):
    """A gateway that answers as a test says, in the name of everybody."""

    def __init__(self, *answers: Answer | Exception) -> None:
        self._answers = list(answers)
        self.asked: list[tuple[str, Any]] = []

    stop = Caller.stop

    def get(self, _name: str) -> Any:
        return self

    async def ask(self, _method: str, path: str, *, body: Any = None, **_: Any) -> Answer:
        self.asked.append((path, body))
        answer = self._answers.pop(0) if self._answers else DONE
        if isinstance(answer, Exception):
            raise answer
        return answer


DONE: Final = Answer(200, {"confirmed": True}, False)
UNREAD: Final = Answer(422, {"type": "urn:motion-gateway:problem:invalid-request"}, False)


def commanded(
    gateway: Gateway, operation: Operation, payload: bytes = b"", *, asked: str = "/x/stop", **told: Any
) -> tuple[Any, Figures]:
    """Command, and give the answer and the figures."""
    figures, answers = Figures(), []

    async def run() -> None:
        commands = Commands("root", gateway, figures, lambda _: operation)

        async def hear(letter: Letter) -> None:
            answers.append(json.loads(letter.payload))

        delivering = asyncio.create_task(commands.answers.deliver(hear))
        properties = SimpleNamespace(ResponseTopic="answers/mes", **told)
        commands.take(Message(f"root/cmd/mes{asked}", payload, 1, False, 1, properties))  # type: ignore[arg-type]
        await commands.end()
        await commands.answers.empty()
        delivering.cancel()

    asyncio.run(run())
    [answer] = answers
    return answer, figures


@pytest.mark.parametrize(
    ("asked", "payload", "told"),
    [
        ("/stop", b"NaN", {}),
        ("/stop", b'{"mode": 1e999}', {}),
        ("/stop", b"[" * 100_000, {}),
        ("/stop?wait=abc", b"", {}),
        ("/stop?mode=immediate", b"", {"UserProperty": [("lease-token", "é")]}),
        ("/stop", b'{"correlation": {"a": [1]}, "expires_at": "2001-01-31T12:00:00Z"}', {}),
    ],
)
def test_nothing_beside_its_topic_keeps_a_stop_from_being_sent(
    asked: str, payload: bytes, told: dict[str, Any]
) -> None:
    gateway = Gateway()
    answer, _ = commanded(gateway, STOP, payload, asked=asked, **told)
    assert (answer["status"], gateway.asked) == (200, [("/stop", None)])


def test_a_stop_whose_content_the_gateway_does_not_understand_is_sent_without_it() -> None:
    gateway = Gateway(UNREAD)
    answer, figures = commanded(gateway, STOP, b'{"mode": "at once"}')
    assert answer["status"] == 200
    assert gateway.asked == [("/x/stop", {"mode": "at once"}), ("/x/stop", None)]
    assert figures.registry.get_sample_value("motion_gateway_bridge_commands_total", {"outcome": "done"}) == 1


def test_a_stop_is_sent_again_where_the_connection_breaks_and_a_move_is_not() -> None:
    broken = [NoAnswer("The connection broke.") for _ in range(STOP_TRIES)]
    gateway = Gateway(*broken[1:])
    assert commanded(gateway, STOP)[0]["status"] == 200
    assert len(gateway.asked) == STOP_TRIES
    assert commanded(Gateway(*broken), STOP)[0]["status"] == 504
    gateway = Gateway(*broken)
    answer, _ = commanded(gateway, MOVE, CorrelationData=b"c", MessageExpiryInterval=9, asked="/x/moves")
    assert (answer["status"], answer["moved"], len(gateway.asked)) == (504, "unknown", 1)


def test_a_fault_of_the_bridge_is_answered_and_counted() -> None:
    told: dict[str, Any] = {"CorrelationData": b"c", "MessageExpiryInterval": 9}
    answer, figures = commanded(Gateway(ArithmeticError("?")), MOVE, **told)
    assert (answer["status"], answer["moved"]) == (504, "unknown")
    assert (
        figures.registry.get_sample_value("motion_gateway_bridge_commands_total", {"outcome": "unknown"}) == 1
    )


@pytest.mark.parametrize("within", [b"1e400", b"-1", b"0", b"null", b"true", b'"x"', b"9" * 400])
def test_how_long_a_move_may_wait_is_bounded_by_the_expiry_whatever_its_payload_says(within: bytes) -> None:
    told: dict[str, Any] = {"CorrelationData": b"c", "MessageExpiryInterval": 9}
    gateway = Gateway()
    timed = Operation(moves=True, takes_within=True)
    answer, _ = commanded(gateway, timed, b'{"start_within_s": %s}' % within, **told)
    if answer["status"] == 200:
        assert gateway.asked[0][1]["start_within_s"] in (9, 1)


@pytest.mark.parametrize(
    "topic",
    [
        "spBv1.0/g/DCMD/n/d",
        "a\0b",
        "a\x01b",
        "a/" * 101,
        "ä" * 600,
        "a/+",
        "#",
        "$SYS/a",
        "x/cmd/y",
        "root/a",
    ],
)
def test_no_answer_goes_where_it_could_harm_or_a_broker_would_end_the_connection(topic: str) -> None:
    commands = Commands("root", Gateway(), Figures(), lambda _: MOVE)
    assert not commands._may_answer_at(topic)


def test_a_flood_of_commands_does_not_keep_a_stop_waiting() -> None:
    async def run() -> list[str]:
        queue = StopsFirst()
        for path in ("a/moves", "b/moves", "c/stop", "d/moves", "e/stop"):
            queue.put_nowait(Message(f"root/cmd/mes/{path}", b"", 1, False, 1, None))
        return [(await queue.get()).topic.value.rpartition("/")[2] for _ in range(5)]

    assert asyncio.run(run()) == ["stop", "stop", "moves", "moves", "moves"]
