"""What the documentation tells of the routes of each place."""

from collections.abc import Mapping
from typing import Any, Final, NamedTuple

from api.common.problems import DECLARED

Responses = dict[int | str, dict[str, Any]]


class Words(NamedTuple):
    """What is told of a place's routes."""

    tag: str = "commands"
    replied: str = "The controller's reply."
    over: str = "The move is over; `status` says how it ended."
    begun: str = "The controller has accepted the move; ask again at Location."


_OF_ROBOTS = Words(
    "robot commands",
    "The robot's reply.",
    begun="The robot has not refused the move; ask again at Location.",
)
WORDS: Final[Mapping[str, Words]] = {
    "/bodies/{body_id}": Words(),
    "/lines/{line_id}": Words("line commands"),
    "/groups/{group_id}": Words(
        "group commands",
        over="All moves are over; `status` says how each ended.",
        begun="The moves are under way.",
    ),
    "/scaras/{scara_id}": Words(
        "scara moves", begun="The controllers have accepted the move; ask again at Location."
    ),
    "/robots/{robot_id}": _OF_ROBOTS,
    "/robots/{robot_id}/units/{unit}": _OF_ROBOTS,
}
"""Of the places that have routes of their own besides their commands."""


def words_of(path: str) -> Words:
    """What is told of a place; of a family without words of its own what is true of all."""
    return WORDS.get(path, Words())


def ends_declared(path: str, model: Any) -> Responses:
    """What a route answers that begins moves."""
    words = words_of(path)
    return {**DECLARED, 200: {"model": model, "description": words.over}, 202: {"description": words.begun}}
