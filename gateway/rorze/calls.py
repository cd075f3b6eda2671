"""The calls that help where something is wrong with a body, by what is wrong."""

from collections.abc import Mapping, Sequence
from typing import Final

from gateway.core.errors import ControllerRefused, GatewayError, calls_for
from gateway.core.next_calls import ACKNOWLEDGE, ALARMS, LINE_STATE, STOP, NextCall, filled_in, get, post
from gateway.core.rights import RIGHT_OF, Right
from protocols.rorze.commands import BY_NAME

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
"""By the controller's error code (RC-420 manual 21) or the kind of the error; what only the sender can know
is left out of the calls."""
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
"""By command and code, where the command's own page gives the code another meaning (RC-420 manual 14)."""
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
