"""Commands: each is carried out once or refused, answered where that is possible, and always counted."""

import asyncio
import logging
from collections.abc import Callable
from typing import Any, Final, NamedTuple
from urllib.parse import urlencode

import aiomqtt
from motion_gateway_client import Answer, NoAnswer
from motion_gateway_client.errors import PREFIX

from bridges.common.callers import Caller, Callers
from bridges.common.state import Figures, Outcome
from bridges.mqtt import requests
from bridges.mqtt.broker import JSON
from bridges.mqtt.operations import UNKNOWN, WITHIN, Operation
from bridges.mqtt.outbox import MOST_TRIES, Letter, Outbox
from bridges.mqtt.requests import Request
from bridges.mqtt.sparkplug_payload import NAMESPACE
from bridges.mqtt.topics import COMMANDS, SHOWN, written

log = logging.getLogger(__name__)

MOST_AT_ONCE: Final = 64
"""Commands under way; further ones are refused, stops never."""
MOST_ANSWERS: Final = 1000
LONGEST_WITHIN_S: Final = 60.0
SECRETS: Final = ("/access", "/tickets", "/sign-in", "/sign-out", "/pendant")
"""Their answers are secrets, which have no place in a message."""
FAULT: Final = "The bridge itself has failed; the command may have been carried out."
UNREAD: Final = frozenset({400, 413, 415, 422})
"""The gateway has not understood what stands beside the path."""
LONGEST_TOPIC, MOST_LEVELS = 1000, 100
"""Bytes and parts of a response topic: a broker ends the connection for a longer one."""
NOT_YET: Final = frozenset({"queued", "rejected", "cancelled"})
NOBODY_KNOWS: Final = frozenset({"unknown", "lost"})
"""Statuses of moves that are no proof of motion."""


class Refusal(NamedTuple):
    """Why a command is not carried out."""

    kind: str
    status: int
    detail: str
    remedy: str

    def problem(self) -> dict[str, Any]:
        """Tell it as the gateway tells its own."""
        return {
            "type": f"{PREFIX}{self.kind}",
            "title": "The bridge has refused the command",
            "status": self.status,
            "detail": f"{self.detail}; nothing was sent.",
            "moved": "no",
            "remedy": self.remedy,
            "retryable": self.status in (429, 503),
        }


class Commands:
    """Takes commands off the broker, and asks the gateway for each in the name of who gave it."""

    def __init__(
        self,
        root: str,
        callers: Callers,
        figures: Figures,
        find: Callable[[str], Operation | None],
    ) -> None:
        self._root, self._callers, self._figures, self._find = root, callers, figures, find
        self._under_way: set[asyncio.Task[None]] = set()
        self.answers = Outbox(MOST_ANSWERS, kept_s=0, most_tries=MOST_TRIES)

    def take(self, message: aiomqtt.Message, *, stored: bool = False) -> None:
        """Begin to see to a command; a retained one that may have been `stored` is refused, a stop too."""
        request = requests.read(message, self._root)
        operation = self._find(request.path)
        refusal = self._judge(request, operation, stored=stored)
        seeing_to = (
            self._refuse(request, refusal) if refusal else self._carry_out(request, operation or UNKNOWN)
        )
        task = asyncio.create_task(seeing_to, name="command")
        self._under_way.add(task)
        task.add_done_callback(self._under_way.discard)

    async def end(self) -> None:
        """Wait until all commands under way have their answers."""
        while self._under_way:
            await asyncio.wait(self._under_way)

    def _judge(self, request: Request, operation: Operation | None, *, stored: bool) -> Refusal | None:
        """Say why a command is not carried out; a stop needs a caller and nothing else."""
        if self._callers.get(request.who) is None:
            return Refusal(
                "caller-not-mapped",
                403,
                f"The bridge has no key for {request.who[:SHOWN]!r}",
                "Name a caller of the bridge's file in the topic: [callers.NAME].",
            )
        if not request.path:
            return Refusal(
                "malformed-request",
                400,
                "The topic has no path of the API",
                "Publish to cmd/NAME/bodies/3F/moves.",
            )
        stops = operation is not None and operation.stops
        if request.retain and (stored or not stops):
            return Refusal(
                "retained",
                400,
                "The command is retained: it would come again with each connection",
                "Publish it without retain, and clear what is retained at its topic.",
            )
        if request.path.startswith(SECRETS):
            return Refusal(
                "not-over-mqtt", 403, f"The answer of {request.path} is a secret", "Ask for it over HTTPS."
            )
        if operation is None:
            return Refusal(
                "starting",
                503,
                "The bridge has not read yet what the gateway can do",
                "Repeat it in a moment.",
            )
        return None if stops else self._judge_content(request, operation)

    def _judge_content(self, request: Request, operation: Operation) -> Refusal | None:
        if request.malformed:
            return Refusal("malformed-request", 400, request.malformed, "Send the JSON that the API takes.")
        if request.response_topic and not self._may_answer_at(request.response_topic):
            return Refusal(
                "response-topic",
                400,
                f"No answer is published at {request.response_topic[:SHOWN]!r}: it could pass for a command "
                "or a state, or the broker could refuse it",
                f"Take a response topic elsewhere, such as {self._root}/answers/{request.who}.",
            )
        if request.expires_in_s is not None and request.expires_in_s <= 0:
            return Refusal(
                "expired", 503, "The command has come too late", "Send it anew if it is still wanted."
            )
        if operation.changes and request.correlation is None:
            return Refusal(
                "correlation-missing",
                400,
                "The command has no correlation data, by which it would be carried out once",
                "Give each command correlation data of its own, and repeat it with the same.",
            )
        if operation.moves and request.expires_in_s is None:
            return Refusal(
                "expiry-missing",
                400,
                "The command can move a motor and has no message expiry: it could come late",
                "Publish it with a message expiry interval of a few seconds.",
            )
        if len(self._under_way) >= MOST_AT_ONCE:
            return Refusal(
                "too-many-requests", 429, f"{MOST_AT_ONCE} commands are under way", "Wait for answers."
            )
        return None

    def _may_answer_at(self, topic: str) -> bool:
        """Tell if an answer can do no harm at a topic: it would be published with the bridge's own rights."""
        levels = topic.split("/")
        if set(topic) & set("+#") or not topic.isprintable() or topic.startswith(("$", NAMESPACE)):
            return False
        if len(topic.encode()) > LONGEST_TOPIC or len(levels) > MOST_LEVELS or COMMANDS in levels:
            return False
        return not topic.startswith(f"{self._root}/") or topic.startswith(f"{self._root}/answers/")

    async def _refuse(self, request: Request, refusal: Refusal) -> None:
        await self._answer(request, Answer(refusal.status, refusal.problem(), False), "refused")

    async def _carry_out(self, request: Request, operation: Operation) -> None:
        caller = self._callers.get(request.who)
        assert caller is not None, "it was judged before"  # noqa: S101  # for the type
        try:
            answer = await self._ask(caller, request, operation)
        except NoAnswer as error:
            await self._answer(request, _unanswered(error), "refused" if error.moved == "no" else "unknown")
            return
        except Exception:  # the command is answered and counted nevertheless
            log.exception("a command has met a fault of the bridge itself")
            await self._answer(request, _unanswered(NoAnswer(FAULT)), "unknown")
            return
        outcome: Outcome = "replayed" if answer.replayed else "done" if answer.is_success else "refused"
        await self._answer(request, answer, outcome)

    async def _ask(self, caller: Caller, request: Request, operation: Operation) -> Answer:
        if operation.stops:
            return await self._stop(caller, request)
        body = request.body
        if operation.takes_within and isinstance(body, dict) and request.expires_in_s is not None:
            within_s = min(request.expires_in_s, LONGEST_WITHIN_S, _number(body.get(WITHIN)))
            body = {**body, WITHIN: round(within_s, 3)}
        key = f"{request.who}:{request.correlation}" if operation.changes and request.correlation else None
        return await caller.ask(
            "POST",
            request.path,
            query=dict(request.query),
            body=body,
            idempotency_key=key,
            lease_tokens=request.lease_tokens,
        )

    async def _stop(self, caller: Caller, request: Request) -> Answer:
        """Stop; nothing that stands beside the topic keeps a stop from being sent.

        :raises NoAnswer: the gateway does not answer.
        """
        answer = await caller.stop(request.path, request.body)
        if request.body is not None and answer.status in UNREAD:
            answer = await caller.stop(request.path)
        return answer

    async def _answer(self, request: Request, answer: Answer, outcome: Outcome) -> None:
        self._figures.command(outcome)
        _log(request, answer, outcome)
        topic = request.response_topic
        if topic is None or not self._may_answer_at(topic):
            return
        told = {
            "status": answer.status,
            "moved": _moved(answer),
            "replayed": answer.replayed,
            "body": answer.content,
            **({"correlation": request.echo} if request.echo else {}),
        }
        await self.answers.put(Letter(topic, written(told), JSON, request.correlation_data))


def _number(value: object) -> float:
    """Give a number of seconds; what is none the gateway will refuse."""
    return value if isinstance(value, int | float) and 0 < value < LONGEST_WITHIN_S else LONGEST_WITHIN_S


def _unanswered(error: NoAnswer) -> Answer:
    status = 503 if error.moved == "no" else 504
    problem = {
        "type": error.type,
        "title": "No answer",
        "status": status,
        "detail": error.detail,
        "moved": error.moved,
        "remedy": error.remedy,
        "retryable": error.retryable,
    }
    return Answer(status, problem, False)


def _moved(answer: Answer) -> str:
    """Tell whether a motor moves, or has moved, because of the command: no, yes or unknown."""
    content = answer.content if isinstance(answer.content, dict) else {}
    if not answer.is_success:
        return str(content.get("moved", "unknown"))
    moves = content.get("moves", [content] if "event_cursor" in content else ())
    told = {_moved_by(move.get("status")) for move in moves if isinstance(move, dict)}
    if "heartbeat_within_ms" in content:
        told.add("yes")
    return next((answer for answer in ("yes", "unknown") if answer in told), "no")


def _moved_by(status: object) -> str:
    return "no" if status in NOT_YET else "unknown" if status in NOBODY_KNOWS else "yes"


def _log(request: Request, answer: Answer, outcome: Outcome) -> None:
    content = answer.content if isinstance(answer.content, dict) else {}
    facts = {"who": request.who[:SHOWN], "path": _shown(request), "status": answer.status}
    if outcome in ("done", "replayed"):
        log.info("command %s", outcome, extra={"facts": facts})
        return
    facts["kind"] = str(content.get("type", "")).removeprefix(PREFIX) or None
    log.warning("command %s: %s", outcome, content.get("detail", answer.status), extra={"facts": facts})


def _shown(request: Request) -> str:
    return f"{request.path}{'?' if request.query else ''}{urlencode(request.query)}"[:SHOWN]
