"""What goes wrong with bodies, in words for a technician (RC-420 manual 10.2, 13.8)."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Final

from gateway.core.alarms import Cause, CauseKind, Facts, causes_of_moves, stopped
from gateway.core.next_calls import ACKNOWLEDGE, LINE_STATE, STOP, NextCall
from gateway.core.power_alarms import facts_of_power_loss, swapped
from gateway.core.restore_alarms import causes_of_restores
from gateway.rorze.bodies import Body
from gateway.rorze.calls import (
    CLEAR_COMMENT,
    CLEAR_ENCODER_STALL,
    CLEAR_STALL_SENSOR,
    CLEAR_STATUS,
    GROUP,
    HOME,
    MOVE,
    POSITION,
    READ_COMMENT,
    STATUS,
    TABLE_UPLOAD,
    UPLOAD,
)
from gateway.rorze.line import Line
from protocols.rorze.status import CONTROLLER_STATUS_BITS

ERROR_BITS: Final[Mapping[str, tuple[str, tuple[NextCall, ...]]]] = {
    "limit_error": ("RC-420 manual 13.8.2, 13.9.2", (STATUS, CLEAR_STATUS)),
    "ems_error": ("RC-420 manual 13.8.2, 13.9.2", (STATUS, CLEAR_STATUS)),
    "initialisation_error": ("RC-420 manual 13.8.2", (STATUS, CLEAR_STATUS)),
    "range_error": ("RC-420 manual 13.8.2", (STATUS, POSITION, CLEAR_STATUS)),
    "stall_error": ("RC-420 manual 13.6, 13.7", (STATUS, CLEAR_STALL_SENSOR, CLEAR_ENCODER_STALL, HOME)),
}
"""The errors of the controller status that stay until they are cleared (9CD)."""


def _shows(mask: int, body: Body) -> bool:
    return bool((body.told.status_bits or 0) & mask)


def _tells(name: str, data: Facts) -> bool:
    return name in data["status"]


def _facts_of_upload(record: Facts) -> Facts:
    return {**_facts_of_table_upload(record), "stored": record["stored"]}


def _facts_of_table_upload(record: Facts) -> Facts:
    error = record["error"] or {}
    return {
        "upload_id": record["id"],
        "request_id": record["request_id"],
        "detail": error.get("detail", ""),
        "remedy": error.get("remedy") or "Upload it again.",
    }


BODIES: Final[Sequence[CauseKind[Body]]] = (
    CauseKind(
        "body.offline",
        "RC-420 manual 10.2",
        (LINE_STATE, STOP),
        lambda body: not body.online,
        is_told=lambda body: body.number in body.line.roll.unasked,
        disproved=lambda body: body.number in body.line.presence.answered_late,
    ),
    CauseKind(
        "body.power_cycled",
        "RC-420 manual 5.4.2",
        (STATUS, HOME, ACKNOWLEDGE),
        lambda body: body.power.cycled,
        facts=facts_of_power_loss,
    ),
    swapped("body", "RC-420 manual 18"),
    CauseKind(
        "body.stop.unconfirmed",
        "RC-420 manual 5.4.1, 14.6",
        (STATUS, STOP, LINE_STATE),
        lambda body: body.life.being_stopped,
        is_told=lambda body: body.line.tells_of_stops,
        disproved=lambda body: body.motion.stop_was_proved,
    ),
    stopped("body", "RC-420 manual 5.4.1", (STATUS, POSITION), lambda body: body.life.being_stopped),
    CauseKind(
        "body.motion.foreign",
        "RC-420 manual 13.8.2, 13.8.4",
        (STATUS, STOP),
        lambda body: body.moving is True and body.move is None,
    ),
    CauseKind(
        "body.power_mark.missing",
        "RC-420 manual 14 (9VS)",
        (READ_COMMENT, CLEAR_COMMENT),
        lambda body: body.power.mark.taken,
    ),
    CauseKind(
        "body.program.upload.failed",
        "RC-420 manual 14.U, 15.2.6",
        (UPLOAD,),
        facts=_facts_of_upload,
    ),
    CauseKind(
        "body.position_upload.failed",
        "RC-420 manual 13.4",
        (TABLE_UPLOAD,),
        facts=_facts_of_table_upload,
    ),
    CauseKind(
        "group.strangers",
        "RC-420 manual 12, 17.2",
        (GROUP, LINE_STATE),
    ),
    *(
        CauseKind(
            f"body.{name}",
            manual,
            calls,
            partial(_shows, 1 << CONTROLLER_STATUS_BITS.index(name)),
            partial(_tells, name),
            event="body.status.changed",
        )
        for name, (manual, calls) in ERROR_BITS.items()
    ),
)


STOPS_OF_LINE: Final = CauseKind[Line](
    "line.stops.unconfirmed",
    "RC-420 manual 5.4.1, 10.2",
    (LINE_STATE,),
    lambda line: line.tells_of_stops,
)


def causes(find: Callable[[str], Body | None], find_line: Callable[[str], Line | None]) -> Iterator[Cause]:
    """The causes of bodies and their lines, found by their addresses; None: it is configured no more."""
    yield STOPS_OF_LINE.among(find_line)
    for kind in BODIES:
        yield kind.among(find)
    yield from causes_of_restores("body", "RC-420 manual 14, 18")
    yield from causes_of_restores("line", "RC-420 manual 14, 18")
    yield from causes_of_moves("body", "RC-420 manual 13.8.3", (MOVE, STATUS, POSITION))
