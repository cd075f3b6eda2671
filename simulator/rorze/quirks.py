"""RC-400 lines that are otherwise than the gateway believes: a switch for each belief, by its name."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final

from simulator.faults import Direction, Fault, Switch
from simulator.rorze.line import Rc400Line

LATE_S, SLOW_S, COPIED_S = 3.0, 0.4, 3.0
"""A reply later than is waited for, one that takes most of its time, and a copy that nobody expects."""
OTHER_REFUSAL: Final = 0x4A
SLUGGISH: Final = 0.7

Quirk = Callable[[Rc400Line], None]


def _link(**switches: Any) -> Quirk:
    def turn(line: Rc400Line) -> None:
        line.settings = replace(line.settings, **switches)

    return turn


def _bodies(**switches: Any) -> Quirk:
    def turn(line: Rc400Line) -> None:
        for axis in line.axes.values():
            for name, value in switches.items():
                setattr(axis, name, value)

    return turn


def _copies(line: Rc400Line) -> None:
    line.faults.set(Switch(Fault.DOUBLED, Direction.REPLIES, probability=0.1, delay_s=COPIED_S))


QUIRKS: Final[Mapping[str, Quirk]] = MappingProxyType(
    {
        "echo": _link(echoes=True),
        "late-replies": _link(reply_delay_s=LATE_S),
        "turnaround": _link(reply_delay_s=SLOW_S),
        "interjection": _link(interjection="drop"),
        "order-per-body": _link(reply_order="swapped"),
        "copies-of-replies": _copies,
        "silent-xid": _link(introducers="$#"),
        "label-answers": _bodies(labels_lead_on=True),
        "link-master-forgets": _link(set_up="kept"),
        "half-command": _link(overlong="executed"),
        "curve-tick": _bodies(pace=SLUGGISH),
        "wrong-mode": _bodies(wrong_mode_error=OTHER_REFUSAL),
        "power-on-position": _bodies(keeps_position=True),
        "comment-kept": _bodies(keeps_comments=True),
        "lasting-errors": _bodies(forgets_errors=True),
        "stop-overtakes": _bodies(refuses_second_stop=True),
    }
)
"""What makes each of them false."""
