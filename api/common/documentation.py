"""What the documentation tells of its sections, and of the routes of each place."""

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from api.common.problems import DECLARED

CORE: Final[Mapping[str, str]] = {
    "stops": "Software stops, ahead of everything else. They do not replace a hardware stop.",
    "bodies": "RC-420 controllers: what they are, where they stand, and their state.",
    "moves": "Moves of bodies and groups: each has a record, and is followed to its end.",
    "positions": "The table of positions that a body keeps, as JSON and as CSV.",
    "groups": "Bodies that one frame reaches together.",
    "robots": "Fics robots: units, axes, state, errors, inputs, outputs and variables.",
    "robot moves": "Moves of a robot's units, and runs of its macros.",
    "lines": "The lines: their state, their load, the trace of what they carry, and searches for bodies.",
    "events": "What has happened, in order, and as it happens.",
    "alarms": "What stands and needs somebody: what happened, what the motor did, what to do next.",
    "system": "The gateway: who may do what, its weakened defaults, and tickets for WebSockets.",
    "health": "Whether the gateway runs, whether it is ready, and its version.",
}
"""The sections of what is needed first: to move, to stop, and to see what has happened."""

SECTIONS: Final[Mapping[str, str]] = {
    **CORE,
    "sessions": "Who has signed in with a browser.",
    "security log": "Who was let in, who was refused, who changed what.",
    "samples": "What was measured during a move, beside what was planned.",
    "jogs": "Moves that last while somebody holds them: without heartbeats they end.",
    "inputs and outputs": "Inputs, outputs, sensors and error outputs of a body, by their names.",
    "captures": "Positions that a body takes down when an input changes.",
    "body settings": "What a body keeps: settings, homing, encoder, speed sets, patterns with their curves.",
    "programs": "The user program of a body: upload, run, and its memories.",
    "scaras": "SCARA robots of two or three bodies: coordinates, geometry and kinematics.",
    "scara moves": "Lines, paths, and moves along the arm: all axes start with one command.",
    "scara paths": "The paths that the bodies of a SCARA robot keep.",
    "robot positions": "The table of positions that a robot keeps, as JSON and as CSV.",
    "robot settings": "Speeds, soft limits and homing of a robot's axes.",
    "backups": "Everything that a body, a line or a robot keeps, as one text: read, compare, restore.",
    "recordings": "What went over the lines, with all that happened meanwhile, as files.",
    "configuration": "Which lines are served: found at ports, added, and read anew from the file.",
    "audit": "Who has asked for what, and what became of it.",
    "leases": "Who may move what, for a while.",
    "access keys": "Keys of people and programs: made and shown once, listed, revoked.",
    "commands": "Every command of the RC-420 manual to a body, under the name that `GET /commands` lists.",
    "group commands": "The commands of the RC-420 manual to all members of a group.",
    "line commands": "The commands to the link master of a line (RC-400).",
    "robot commands": "Every command of the C-HOST manual to a robot or to one of its units.",
}
"""All sections of the documentation, by their tags, in the order in which it shows them."""


_ORDER: Final = tuple(SECTIONS)


class Words(NamedTuple):
    """The words of a place's routes."""

    replied: str = "The controller's reply."
    over: str = "The move is over; `status` says how it ended."
    begun: str = "The controller has accepted the move; ask again at Location."


_OF_ROBOTS = Words(
    "The robot's reply.",
    begun="The robot has not refused the move; ask again at Location.",
)
WORDS: Final[Mapping[str, Words]] = {
    "/bodies/{body_id}": Words(),
    "/lines/{line_id}": Words(),
    "/groups/{group_id}": Words(
        over="All moves are over; `status` says how each ended.",
        begun="The moves are under way.",
    ),
    "/scaras/{scara_id}": Words(begun="The controllers have accepted the move; ask again at Location."),
    "/robots/{robot_id}": _OF_ROBOTS,
    "/robots/{robot_id}/units/{unit}": _OF_ROBOTS,
}
"""Of the places that have routes of their own besides their commands."""


def place_of(path: tuple[str, Mapping[str, Any]]) -> tuple[int, str]:
    """Where the documents tell of a path: in the first of the sections of its routes, by its name."""
    name, routes = path
    return min(_ORDER.index(tag) for route in routes.values() for tag in route["tags"]), name


def words_of(path: str) -> Words:
    """The words of a place; a family without words of its own has those that are true of all."""
    return WORDS.get(path, Words())


def begins(model: Any, over: str, model_when_over: Any = None) -> dict[str, Any]:
    """Declare a route that begins what takes long: 202 with its record, 200 once it is over."""
    ended = {"model": model_when_over or model, "description": over}
    return {"status_code": 202, "response_model": model, "responses": {**DECLARED, 200: ended}}


def begins_moves(path: str, model: Any, model_when_over: Any = None) -> dict[str, Any]:
    """Declare a route that begins moves of what stands at a path."""
    words = words_of(path)
    declared = begins(model, words.over, model_when_over)
    declared["responses"][202] = {"description": words.begun}
    return declared
