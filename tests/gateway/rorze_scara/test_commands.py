"""The command line knows the moves of SCARA robots."""

from typing import get_args

from app.commands.moves import MoveKind
from gateway.rorze_scara.record import ScaraMoveKind


def test_the_kinds_of_moves_are_those_of_the_interface() -> None:
    assert set(get_args(MoveKind)) == {"relative", "absolute", "position", "home", *get_args(ScaraMoveKind)}
