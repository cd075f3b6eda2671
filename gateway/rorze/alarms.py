"""Alarms of bodies, in words for a technician (RC-420 manual 10.2, 13.8)."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Final

from gateway.core.alarms import (
    Cause,
    CauseKind,
    Facts,
    causes_of_moves,
    causes_of_restores,
    facts_of_power_loss,
    stopped,
    swapped,
)
from gateway.core.errors import ControllerRefused, GatewayError, calls_for
from gateway.core.next_calls import ACKNOWLEDGE, ALARMS, LINE_STATE, STOP, NextCall, filled_in, get, post
from gateway.core.rights import RIGHT_OF, Right
from gateway.rorze.bodies import Body
from gateway.rorze.line import Line
from protocols.rorze.commands import BY_NAME
from protocols.rorze.status import CONTROLLER_STATUS_BITS

STATUS: Final = get("{subject}/status", "bodies.status")
POSITION: Final = get("{subject}/position", "bodies.position")
MOVE: Final = get("{subject}/moves/{move_id}", "bodies.move")
MOVES: Final = get("{subject}/moves", "bodies.moves")
HOME: Final = post("{subject}/moves", Right.OPERATE, "bodies.home", kind="home")
PROGRAM_RUN: Final = get(
    "{subject}/program/runs/current",
    "bodies.program-run",
)
UPLOAD: Final = get("{subject}/program/uploads/{upload_id}", "bodies.upload")
TABLE_UPLOAD: Final = get(
    "{subject}/positions/uploads/{upload_id}",
    "bodies.table-upload",
)
GROUP: Final = get("{subject}", "bodies.group")
SENSORS: Final = get("{subject}/sensors", "bodies.sensors")
COMMANDS: Final = get("/commands", "bodies.commands")


def _command(name: str) -> NextCall:
    return post(f"{{subject}}/commands/{name}", RIGHT_OF[BY_NAME[name].effect], f"commands.{name}")


CLEAR_STATUS: Final = _command("clear-controller-status")
READ_COMMENT: Final = _command("get-information")
CLEAR_COMMENT: Final = _command("set-user-comment")
CLEAR_ENCODER_STALL: Final = _command("clear-encoder-stall-error")
CLEAR_STALL_SENSOR: Final = _command("clear-stall-sensor-error")
SET_START_SPEED: Final = _command("set-start-speed")
SET_MAXIMUM_SPEED: Final = _command("set-maximum-speed")
SET_RISING: Final = _command(
    "set-rising-acceleration-share",
)
SET_FALLING: Final = _command(
    "set-falling-acceleration-share",
)
SET_INTERVAL: Final = _command("set-stall-sensor-interval")
PROGRAM_END: Final = _command(
    "get-last-program-address",
)

_LOOK = (STATUS, POSITION)
CALLS: Final[Mapping[str, Sequence[NextCall]]] = {
    "0x40": (SET_START_SPEED,),
    "0x41": (SET_MAXIMUM_SPEED,),
    "0x42": (
        _command(
            "set-maximum-acceleration",
        ),
    ),
    "0x43": (SET_RISING,),
    "0x44": (SET_FALLING,),
    "0x45": (SET_START_SPEED, SET_MAXIMUM_SPEED),
    "0x46": (SET_RISING, SET_FALLING),
    "0x47": (_command("set-pattern"),),
    "0x4A": (COMMANDS,),
    "0x4C": (MOVES, STOP),
    "0x50": (MOVES, STOP),
    "0x51": (STATUS, CLEAR_STATUS),
    "0x52": (CLEAR_STALL_SENSOR, CLEAR_ENCODER_STALL, HOME),
    "0x54": (
        _command(
            "set-stall-sensor-detection",
        ),
        SET_INTERVAL,
    ),
    "0x55": (STATUS, CLEAR_STATUS, HOME),
    "0x5A": (PROGRAM_RUN, STOP),
    "0x5B": (PROGRAM_END,),
    "0x5D": (COMMANDS,),
    "0x66": (_command("clear-error-output-status"),),
    "controller-refused": (STATUS,),
    "power-cycled": (STATUS, HOME, ACKNOWLEDGE),
    "body-busy": (MOVES, STOP),
    "body-offline": (LINE_STATE, STOP),
    "line-down": (LINE_STATE,),
    "journal-unavailable": (ALARMS,),
    "no-reply": _LOOK,
    "garbled-reply": _LOOK,
    "not-executed": _LOOK,
    "move-failed": _LOOK,
    "cancelled": _LOOK,
    "command-garbled": (LINE_STATE,),
}
"""Calls by the controller's error code (RC-420 manual 21) or the kind of the error, without those that need
knowledge which only the sender has."""
OWN_CALLS: Final[Mapping[tuple[str, str], Sequence[NextCall]]] = {
    ("0QM", "0x52"): (
        SENSORS,
        _command("set-sensor-logic"),
    ),
    ("0QM", "0x55"): (SENSORS,),
    ("UWS", "0x5B"): (
        _command(
            "get-free-program-steps",
        ),
    ),
}
"""Calls by command and code, if the command's own page gives the code another meaning (RC-420 manual 14)."""
CALLS_OF_GROUPS: Final[Mapping[str, Sequence[NextCall]]] = {
    "body-busy": (GROUP, STOP),
    "line-down": (LINE_STATE,),
    "journal-unavailable": (ALARMS,),
}

CALLS_OF_LINES: Final[Mapping[str, Sequence[NextCall]]] = {
    "line-down": (LINE_STATE,),
    "body-busy": (LINE_STATE,),
    "controller-refused": (LINE_STATE,),
    "no-reply": (LINE_STATE,),
}


def calls_for_body(error: GatewayError, address: str) -> Sequence[NextCall]:
    """The calls that help where something is wrong with a body."""
    names = {"subject": f"/bodies/{address}", "line": address.partition(".")[0]}
    if isinstance(error, ControllerRefused) and not error.next:
        own = OWN_CALLS.get((error.command_code, error.error_code or ""))
        if own is not None:
            return filled_in(own, names)
    return calls_for(error, CALLS, **names)


def calls_for_group(error: GatewayError, address: str) -> Sequence[NextCall]:
    """The calls that help where something is wrong with a group."""
    return calls_for(error, CALLS_OF_GROUPS, subject=f"/groups/{address}", line=address.partition(".")[0])


def calls_for_line(error: GatewayError, line_id: str) -> Sequence[NextCall]:
    """The calls that help where something is wrong with a line."""
    return calls_for(error, CALLS_OF_LINES, line=line_id)


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
