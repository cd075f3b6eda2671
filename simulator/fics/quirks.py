"""Robots that are otherwise than the gateway believes: a switch for each belief, by its name."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Final

from simulator.fics.line import SimulatedFics
from simulator.quirks import SLOW_S, with_late_copies, with_late_replies, with_settings

Quirk = Callable[[SimulatedFics], None]


def _robot(**switches: Any) -> Quirk:
    def turn(line: SimulatedFics) -> None:
        line.robot.settings = replace(line.robot.settings, **switches)

    return turn


QUIRKS: Final[Mapping[str, Quirk]] = MappingProxyType(
    {
        "echo": with_settings(echoes=True),
        "late-replies": with_late_replies,
        "turnaround": with_settings(reply_delay_s=SLOW_S),
        "half-robot-command": with_settings(half_commands="executed"),
        "robot-terminator": with_settings(hears="crlf"),
        "robot-decimals": _robot(displayed_decimals=4),
        "status-bits": _robot(status_bits=("moving", "alarm", "origin_done", "servo_ready")),
        "hidden-positions": _robot(hidden_positions="at_rest", origin_bit="lasting"),
        "upload-end": _robot(upload_end="done"),
        "homing-outlasts": _robot(homing="lost_by_moves"),
        "por-end": _robot(download_end="skips_holes"),
        "displayed-hundredths": _robot(displayed_decimals=1),
        "power-loss-read": with_settings(boot_s=0.0),
        "power-loss-motion": with_settings(boot_s=0.0),
        "jog-mode": _robot(jog_mode="move"),
        "positions-after-power": _robot(positions_after_power="kept"),
        "copies-of-answers": with_late_copies,
        "numbers-as-set": _robot(numbers="whole"),
        "pos-left-out": _robot(left_out="kept"),
        "error-after-power": _robot(error_after_power="kept"),
        "upload-refusal": _robot(upload_refusal="E01"),
        "stop-overtakes": _robot(stop_while_braking="refused"),
    }
)
"""The quirk that makes each assumption false. A dual-port RAM's are made false at its port."""
