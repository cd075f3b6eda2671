"""Commands as they come: a topic, a payload and properties, or an envelope that says the same."""

import json
import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from hashlib import sha256
from typing import Any, Final
from urllib.parse import parse_qsl, quote, unquote

from aiomqtt import Message

from bridges.mqtt.topics import COMMANDS, written

ENVELOPE: Final = frozenset({"correlation", "response_topic", "expires_at", "lease_token", "body"})
"""Members of a payload that says what properties say in MQTT 5."""
MARKS: Final = ("correlation", "response_topic", "expires_at")
"""No request of the API has such a member: one of them makes an envelope."""
LEASE_TOKEN: Final = "lease-token"  # noqa: S105  # the name of a user property
MOST_BYTES: Final = 1 << 20
LONGEST_PATH: Final = 2000
"""Longest path accepted, in characters; every path of the API is shorter."""
_SEGMENT: Final = re.compile(r"(?!\.{1,2}$)[^/\x00-\x1f\x7f]+")
"""A part of a path, decoded. One with a slash in it would be two parts to the gateway."""
_TOKEN: Final = re.compile("[0-9]{1,19}")
_WAIT: Final = re.compile(r"[0-9]{1,4}(\.[0-9]{1,6})?")
_PLAIN: Final = re.compile("[!-~]{1,150}")
_PLAIN_IN_PATHS: Final = "~!$&'()*,;=:@+"


@dataclass(frozen=True)
class Request:
    """A command as it was received, before any check of its caller or its content."""

    who: str
    path: str
    """Path of the API, with a slash before it, each part quoted in one way; empty where there is none."""
    query: Mapping[str, str]
    body: Any
    malformed: str | None
    """Why the message cannot be read; None: it can."""
    correlation: str | None
    """Correlation data of the message, in the characters of an idempotency key; None without."""
    response_topic: str | None
    correlation_data: bytes | None
    """Goes back with the answer."""
    echo: str | None
    """The correlation of an envelope: goes back within the answer."""
    expires_in_s: float | None
    """Seconds from its arrival; 0 or less is too late."""
    lease_tokens: tuple[str, ...]
    retain: bool


def read(message: Message, root: str) -> Request:
    """Take a message apart."""
    who, path, query = _place(str(message.topic).removeprefix(f"{root}/{COMMANDS}/"))
    content, fault = _content(bytes(message.payload))
    told = _properties(message)
    correlation_data = told["correlation"]
    envelope = content if _is_envelope(content) else None
    if envelope is not None:
        told |= {name: envelope[name] for name in MARKS if envelope.get(name) is not None}
        content = envelope.get("body")
    lease = envelope.get("lease_token") if envelope else None
    leases = (*told["leases"], *([str(lease)] if lease is not None else []))
    expires_in_s, late_fault = _expiry(told)
    faults = (fault, late_fault, _fault_of_leases(leases), _fault_of_wait(query))
    return Request(
        who=who,
        path=path,
        query=query,
        body=content,
        malformed=next(filter(None, faults), None),
        correlation=_correlation(told["correlation"]),
        response_topic=_text(told["response_topic"]),
        correlation_data=correlation_data,
        echo=_text(envelope.get("correlation")) if envelope else None,
        expires_in_s=expires_in_s,
        lease_tokens=leases,
        retain=bool(message.retain),
    )


def _place(rest: str) -> tuple[str, str, dict[str, str]]:
    who, _, asked = rest.partition("/")
    path, _, query = asked.partition("?")
    segments = [unquote(part) for part in path.split("/")]
    if not all(map(_SEGMENT.fullmatch, segments)):
        return who, "", {}
    # Quoted anew: `/%6Doves` would be another operation here than at the gateway.
    quoted = "".join(f"/{quote(segment, safe=_PLAIN_IN_PATHS)}" for segment in segments)
    its_query = dict(parse_qsl(query[:LONGEST_PATH], keep_blank_values=True))
    return who, quoted if len(quoted) <= LONGEST_PATH else "", its_query


def _fault_of_leases(tokens: Iterable[str]) -> str | None:
    return (
        None if all(map(_TOKEN.fullmatch, tokens)) else "A lease token is the number that came with a lease"
    )


def _fault_of_wait(query: Mapping[str, str]) -> str | None:
    if "wait" not in query or _WAIT.fullmatch(query["wait"]):
        return None
    return "wait in the topic has to be a number of seconds such as 10"


def _content(payload: bytes) -> tuple[Any, str | None]:
    if not payload.strip():
        return None, None
    if len(payload) > MOST_BYTES:
        return None, f"The payload is longer than {MOST_BYTES} bytes"
    try:
        content = json.loads(payload)
        written(content)  # not so what is no JSON after all: NaN, halves of characters, too many brackets
    except (ValueError, RecursionError):
        return None, "The payload is no JSON"
    return content, None


def _is_envelope(content: Any) -> bool:
    return isinstance(content, dict) and bool(content.keys() & set(MARKS)) and content.keys() <= ENVELOPE


def _properties(message: Message) -> dict[str, Any]:
    """Give what the properties of MQTT 5 say."""
    its = message.properties
    given = getattr(its, "UserProperty", None) or []
    return {
        "correlation": getattr(its, "CorrelationData", None),
        "response_topic": getattr(its, "ResponseTopic", None),
        "expires_in_s": getattr(its, "MessageExpiryInterval", None),
        "leases": tuple(value for name, value in given if name.lower() == LEASE_TOKEN),
    }


def _expiry(told: Mapping[str, Any]) -> tuple[float | None, str | None]:
    """Give the seconds left, and what is wrong with an `expires_at`."""
    if (at := told.get("expires_at")) is None:
        return told["expires_in_s"], None
    try:
        moment = datetime.fromisoformat(at)
        return (moment - datetime.now(UTC)).total_seconds(), None
    except (TypeError, ValueError):
        return None, "expires_at is no time with its zone, such as 2026-01-31T12:00:00Z"


def _correlation(given: object) -> str | None:
    """Write a correlation as an idempotency key: as it is, or as what stands for it alone."""
    if given is None or given in (b"", ""):
        return None
    data = given if isinstance(given, bytes) else str(given).encode()
    text = data.decode("latin-1")
    return text if _PLAIN.fullmatch(text) else f"sha256-{sha256(data).hexdigest()}"


def _text(value: object) -> str | None:
    return value if isinstance(value, str) and value else None
