"""The causes of alarms: those of lines and of the gateway itself, and those of every family."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from functools import partial
from typing import Final

from gateway.core.alarms import Cause, CauseKind, Facts
from gateway.core.family import AnyLine, Registered
from gateway.core.line_state import LineState
from gateway.core.next_calls import ALARMS, LINE_STATE, READY, get, post
from gateway.core.rights import Right
from gateway.texts import Text, japanese, text

AUDIT = get("/audit", "gateway.audit")
EVENTS = get("/events", "gateway.events")

SECURITY = get(
    "/security",
    "gateway.security",
    Right.ADMIN,
)

KEYS = get("/access/keys", "gateway.keys", Right.ADMIN)

RELOAD = post("/system/reload", Right.ADMIN, "gateway.reload")

LINE_DOWN = "line.down"
CONFIGURED_ANEW = "it is configured anew"
"""Reason of a line that was closed because its configuration changed, which needs no look."""
UNUSABLE = (LineState.DOWN, LineState.SILENT)


def _facts_of_line(down: Facts) -> Facts:
    """The reason in both languages, where it is one of ours; systems have their own."""
    return {**down, "reason": Text(down["reason"], japanese(down["reason"]))}


def _facts_of_burst(burst: Facts) -> Facts:
    address = burst["address"]
    return {**burst, "whence": address or text("phrases.unknown-address")}


def _facts_of_crash(crash: Facts) -> Facts:
    """Moves under way at the crash, each with its motor, and the time as people write it."""
    seen_at = crash["last_seen_at"]
    return {
        "last_seen": seen_at and f"{datetime.fromisoformat(seen_at):%Y-%m-%d %H:%M:%S} UTC",
        "moves": [
            f"{move_id} ({move})" for move, move_id in zip(crash["moves"], crash["targets"], strict=True)
        ],
        "commands": crash["commands"],
    }


def _is_anothers(line: AnyLine) -> bool:
    """True if the line is another gateway's by plan: neither in trouble, nor open here."""
    return line.owner.stands_by() is not None


LINES: Final[Sequence[CauseKind[AnyLine]]] = (
    CauseKind(
        LINE_DOWN,
        "RC-420 manual 10.2; C-HOST manual 1-1",
        (LINE_STATE,),
        lambda line: line.state in UNUSABLE,
        facts=_facts_of_line,
        applies=lambda event: event["reason"] != CONFIGURED_ANEW,
        is_told=_is_anothers,
        disproved=_is_anothers,
    ),
    CauseKind(
        "line.taken_over",
        "RC-420 manual 10.2; C-HOST manual 1-1",
        next=(LINE_STATE,),
        lasts=_is_anothers,
        latches=False,
    ),
    CauseKind(
        "line.order.violated",
        "RC-420 manual 17.1; C-HOST manual 1-1",
        (LINE_STATE,),
    ),
)
GATEWAY: Final[Sequence[CauseKind[str]]] = (
    CauseKind(
        "gateway.journal.trouble",
        next=(READY,),
        lasts=lambda _why: True,
    ),
    CauseKind(
        "gateway.journal.set_aside",
        next=(EVENTS,),
    ),
    CauseKind(
        "gateway.crashed",
        next=(EVENTS, AUDIT),
        facts=_facts_of_crash,
    ),
    CauseKind(
        "gateway.held_up",
        next=(ALARMS, EVENTS),
        applies=lambda data: bool(data["cancelled"]),
        event="gateway.loop.held",
    ),
    CauseKind(
        "gateway.reload_failed",
        next=(RELOAD,),
    ),
    CauseKind(
        "gateway.security.trouble",
        next=(SECURITY,),
        lasts=lambda _why: True,
        latches=False,
    ),
    CauseKind(
        "gateway.refusals.burst",
        next=(SECURITY,),
        facts=_facts_of_burst,
        lasts=lambda _why: True,
        latches=False,
    ),
    CauseKind(
        "gateway.key.ends_soon",
        next=(KEYS,),
        latches=False,
    ),
    CauseKind(
        "plant.unreachable",
        next=(READY,),
        lasts=lambda _why: True,
        latches=False,
    ),
)
"""Causes at the gateway itself; they last while there is a reason.

A refused request keeps nothing from moving: a stranger could cause refusals.
"""


def _reason(trouble: Callable[[], str | None] | None, _: str) -> str | None:
    return None if trouble is None else trouble()


def causes_of(
    registered: Collection[Registered],
    ports: Mapping[str, AnyLine],
    troubles: Mapping[str, Callable[[], str | None]],
    *,
    latch: bool,
) -> Iterator[Cause]:
    """All causes that a plant knows.

    With `latch` the stops that callers asked for, too; a part that is held has an alarm of its own then.
    """
    for kind in LINES:
        yield kind.among(ports.get)
    for trouble in GATEWAY:
        yield trouble.among(partial(_reason, troubles.get(trouble.name)))
    for package in registered:
        for cause in package.causes():
            if latch:
                yield replace(cause, is_told=lambda _: False)
            elif not cause.wanted:
                yield cause
