"""RC-400 lines that are otherwise than the gateway believes: a switch for each belief, by its name."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any, Final

from simulator.quirks import SLOW_S, with_late_copies, with_late_replies, with_settings
from simulator.rorze.line import Rc400Line

OTHER_REFUSAL: Final = 0x4A
SLUGGISH: Final = 0.7
THINKS_S: Final = 0.03
"""Seconds to a reply that are longer than a frame takes at 4800 baud: another one then comes before it."""

Quirk = Callable[[Rc400Line], None]


def _bodies(**switches: Any) -> Quirk:
    def turn(line: Rc400Line) -> None:
        for axis in line.axes.values():
            for name, value in switches.items():
                setattr(axis, name, value)

    return turn


QUIRKS: Final[Mapping[str, Quirk]] = MappingProxyType(
    {
        "echo": with_settings(echoes=True),
        "late-replies": with_late_replies,
        "turnaround": with_settings(reply_delay_s=SLOW_S),
        "interjection": with_settings(interjection="drop", reply_delay_s=THINKS_S),
        "order-per-body": with_settings(reply_order="swapped"),
        "copies-of-replies": with_late_copies,
        "silent-xid": with_settings(introducers="$#"),
        "label-answers": _bodies(labels_lead_on=True),
        "link-master-forgets": with_settings(set_up="kept"),
        "half-command": with_settings(overlong="executed"),
        "curve-tick": _bodies(pace=SLUGGISH),
        "wrong-mode": _bodies(wrong_mode_error=OTHER_REFUSAL),
        "power-on-position": _bodies(keeps_position=True),
        "comment-kept": _bodies(keeps_comments=True),
        "lasting-errors": _bodies(forgets_errors=True),
        "stop-overtakes": _bodies(refuses_second_stop=True),
    }
)
"""The quirk that makes each of them false."""
