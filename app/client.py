"""The HTTP interface as commands use it: every failure is a sentence and an exit code."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any
from uuid import uuid4

import typer

from app import exits, http
from app.exits import Failure, Misuse
from app.output import ProgressLine

LOCAL = "http://127.0.0.1:8420"
KEY_VARIABLE = "MOTION_GATEWAY_KEY"
LEASE_VARIABLE = "MOTION_GATEWAY_LEASE"
EPOCH_VARIABLE = "MOTION_GATEWAY_OWNER_EPOCH"
STEP_S = 2.0
"""A long wait is made of requests of this length, with a word to people after each."""
ANSWER_S = 10.0
"""Seconds for an answer, beyond the wait that was asked for."""

OVER = frozenset({"succeeded", "failed", "stopped", "rejected", "cancelled", "lost", "unknown"})
"""The statuses of moves that are over."""
UNANSWERED = frozenset({"no-reply", "garbled-reply"})
AMBIGUOUS = "ambiguous-address"
"""Kinds of problems. All these are those of `gateway.core`, which takes long to load."""

Url = Annotated[str, typer.Option(help="Where the gateway listens.", envvar="MOTION_GATEWAY_URL")]
KeyFile = Annotated[
    Path | None,
    typer.Option(
        help=f"A file that holds the API key; the variable {KEY_VARIABLE} holds the key itself.",
        envvar="MOTION_GATEWAY_KEY_FILE",
    ),
]
Json = Annotated[bool, typer.Option("--json", help="Print JSON.")]
Seconds = Annotated[float, typer.Option(min=0, help="Seconds to wait for the end of a move.")]


@dataclass(frozen=True, slots=True)
class Client:
    """A gateway that is asked, and the key it is asked with."""

    url: str
    key: str = ""
    lease: str = ""
    """Tokens of leases, with commas."""
    epoch: str = ""
    """The epoch since which the gateway has the line, as far as the one who asks knows."""

    @classmethod
    def at(cls, url: str, key_file: Path | None) -> "Client":
        """Take the key from the file, or else the environment; and the token of a lease from that."""
        lease = _sound(os.environ.get(LEASE_VARIABLE, "").strip(), "token of the lease")
        epoch = _sound(os.environ.get(EPOCH_VARIABLE, "").strip(), "epoch of the owner")
        if key_file is None:
            return cls(url.rstrip("/"), _sound(os.environ.get(KEY_VARIABLE, "").strip()), lease, epoch)
        try:
            key = key_file.read_text("ascii").strip()
        except OSError as error:
            raise Misuse(f"The key file {key_file} cannot be read: {error.strerror}") from None
        except UnicodeDecodeError:
            raise Misuse(f"The key file {key_file} holds no key: a key is ASCII text") from None
        if not key:
            raise Misuse(f"The key file {key_file} is empty")
        return cls(url.rstrip("/"), _sound(key), lease, epoch)

    @property
    def trust_environment(self) -> bool:
        """True if proxies and authorities of the environment count: no stop goes in plain text to a proxy."""
        return self.url.startswith("https:")

    def headers(self) -> dict[str, str]:
        """The headers of every request: its own id, the key, and the lease's token."""
        return {
            "X-Request-Id": uuid4().hex,
            **({"Authorization": f"Bearer {self.key}"} if self.key else {}),
            **({"Lease-Token": self.lease} if self.lease else {}),
            **({"Owner-Epoch": self.epoch} if self.epoch else {}),
        }

    def request(self, method: str, path: str, content: object = None, *, wait_s: float = 0) -> dict[str, Any]:
        """Ask the gateway.

        :raises Failure: it was refused, or its outcome is unknown; the sentence names the request's id.
        """
        headers, url = self.headers(), self.url + path
        if wait_s:
            headers["Prefer"] = f"wait={wait_s:g}"
        try:
            answer = http.request(
                method,
                url,
                json=content,
                headers=headers,
                timeout=wait_s + ANSWER_S,
                trust_env=self.trust_environment,
            )
            if not answer.is_success:
                problem = _data(answer)
                if answer.status_code == http.UNAUTHORIZED and not self.key:
                    problem["remedy"] = f"Put your key into {KEY_VARIABLE}, or name its file by --key-file."
                raise refusal(answer.status_code, problem, headers["X-Request-Id"])
            return _data(answer)
        except http.NotReached as error:
            raise Failure(f"{why_not_reached(url, error)} Nothing was sent.", exits.NOT_SENT) from None
        except (http.AnswerLost, TypeError, ValueError) as error:
            lost = f"The gateway at {url} was asked, and its answer was lost: {str(error).rstrip('.')}."
            if method == "GET":
                raise Failure(f"{lost} It was only a question; nothing was sent.", exits.NOT_SENT) from None
            raise Failure(
                f"{lost} The command may have been carried out: read status and position before anything "
                f"else. The line's trace has what was sent, as request {headers['X-Request-Id']}.",
                exits.UNKNOWN,
            ) from None

    def made(self, kind: str) -> list[dict[str, Any]]:
        """All of what an extension makes, such as `scaras`; none where the gateway does not have that.

        :raises Failure: the gateway did not tell.
        """
        try:
            listed: list[dict[str, Any]] = self.request("GET", f"/{kind}")[kind]
        except Failure as failure:
            if failure.code != exits.USAGE:
                raise
            return []
        return listed

    def begin(
        self, path: str, content: object, wait_s: float, progress: ProgressLine
    ) -> list[dict[str, Any]]:
        """Start a motion, and give its moves: one, or those of a group's members.

        They are followed for `wait_s` seconds at most. A failure ends the command.
        """
        with going_on_after("the move"):
            answer = self.request("POST", path, content, wait_s=min(wait_s, STEP_S))
            return self._follow(answer.get("moves", [answer]), wait_s, progress)

    def _follow(
        self, moves: list[dict[str, Any]], wait_s: float, progress: ProgressLine
    ) -> list[dict[str, Any]]:
        while (wait_s := wait_s - STEP_S) > 0:
            running = [move for move in moves if move["status"] not in OVER]
            if not running:
                break
            progress.say("; ".join(f"{move['body_id']} {move['status']}" for move in running))
            first = self._look(running[0], min(wait_s, STEP_S))
            others = {move["id"]: self._look(move, 0) for move in running[1:]}
            moves = [others.get(move["id"], first if move is running[0] else move) for move in moves]
        return moves

    def _look(self, move: dict[str, Any], wait_s: float) -> dict[str, Any]:
        """Read the state of a move that was started, when it has ended or `wait_s` seconds have passed."""
        kind = "scaras" if "scara_id" in move else "robots" if "/units/" in move["body_id"] else "bodies"
        path = f"/{kind}/{move['body_id']}/moves/{move['id']}"
        try:
            return self.request("GET", path, wait_s=wait_s)
        except Failure as failure:
            raise Failure(
                f"The move {move['id']} of {move['body_id']} was started, and its end was not seen: "
                f"{failure} Read status and position before anything else.",
                exits.UNKNOWN,
            ) from None


@contextmanager
def going_on_after(what: str) -> Iterator[None]:
    """Say of what Ctrl-C does not end that it goes on: who pressed it may have meant a stop.

    :raises Failure: Ctrl-C was pressed.
    """
    try:
        yield
    except KeyboardInterrupt:
        raise Failure(
            f"Only the wait was interrupted: {what} goes on if it was begun. `motion-gateway stop` stops it "
            "by software.",
            exits.UNKNOWN,
        ) from None


def _data(answer: http.HttpAnswer) -> dict[str, Any]:
    """Read an object.

    :raises TypeError: it is none; it may come from no gateway.
    """
    data = answer.json()
    if not isinstance(data, dict):
        raise TypeError(f"status {answer.status_code}, and no object")
    return data


def why_not_reached(url: str, error: Exception) -> str:
    """Say why a gateway was not reached: no answer, or a certificate that is not trusted."""
    if "CERTIFICATE_VERIFY_FAILED" in str(error):
        return f"The certificate of {url} is not trusted ({error}): name its authority by SSL_CERT_FILE."
    return f"No gateway answers at {url}: {str(error).rstrip('.')}."


def refusal(status: int, problem: dict[str, Any], request_id: str) -> Failure:
    """Turn a problem into its sentence, the request's id and an exit code."""
    sentence = f"{problem.get('detail', f'HTTP status {status}.')} {problem.get('remedy', '')}".strip()
    return Failure(f"{sentence} (request {request_id})", _exit_code(status, problem))


def _exit_code(status: int, problem: dict[str, Any]) -> int:
    kind = str(problem.get("type", "")).rpartition(":")[2]
    if problem.get("moved") == "unknown" or kind in UNANSWERED:
        return exits.UNKNOWN
    if kind == AMBIGUOUS:
        return exits.USAGE
    if status == http.UNAVAILABLE:
        return exits.NOT_SENT
    refused = status in (http.UNAUTHORIZED, http.FORBIDDEN, http.CONFLICT)
    return exits.REFUSED if refused or problem.get("code") else exits.USAGE


def exit_of_moves(moves: list[dict[str, Any]], *, awaited: bool) -> int:
    """The exit code of moves as they are now."""
    return exits.worst(*(_exit_of_move(move, awaited=awaited) for move in moves))


def _exit_of_move(move: dict[str, Any], *, awaited: bool) -> int:
    status = move["status"]
    if status not in OVER:
        return exits.UNDER_WAY if awaited else exits.DONE
    if status == "succeeded":
        return exits.DONE
    moved = (move["error"] or {}).get("moved")
    return exits.UNKNOWN if "unknown" in (status, moved) else exits.REFUSED


def exit_of_stop(stop: dict[str, Any]) -> int:
    """The exit code of a stop: done is standstill that every controller reports."""
    if stop["confirmed"]:
        return exits.DONE
    unsent = all(report["state"] == "not_sent" for report in (*stop["bodies"], *stop["robots"]))
    return exits.NOT_SENT if unsent else exits.UNKNOWN


def _sound(secret: str, what: str = "key") -> str:
    if not secret.isascii() or not (secret.isprintable() or not secret):
        raise Misuse(f"The {what} has other characters than a {what} has")
    return secret
