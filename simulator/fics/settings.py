"""Switches for all that the C-HOST manual leaves open about the robot."""

from dataclasses import dataclass
from typing import Literal

from protocols.fics.status import SENSOR_BITS, STATUS_BITS, B, rename_bits


@dataclass(frozen=True, slots=True)
class RobotSettings:
    """Settings that the C-HOST manual leaves open about the robot; each value is an assumption.

    :raises ValueError: not each bit is named once.
    """

    stop_while_braking: Literal["overtakes", "refused"] = "overtakes"
    """The fate of AES while ASS is braking: it stops at once (1-7), or is refused with E04 (2-12)."""
    emergency_stop: Literal["at_once", "brakes"] = "at_once"
    """The stop by AES and the stop input: the axes stop where they are, or on their ramps (2-7, 2-10)."""
    status_bits: tuple[str, ...] = STATUS_BITS
    """The meaning of bits 0 to 3 of the second digit of ACD (2-10)."""
    sensor_bits: tuple[str, ...] = SENSOR_BITS
    """The meaning of bits 0 to 2 of ASD (2-11)."""
    origin_bit: Literal["homed", "lasting"] = "homed"
    """Lasting: a loss of power does not clear it in ACD, and only positions tell, by `#####` (2-9, 2-10)."""
    hidden_positions: Literal["several_units", "always", "at_rest"] = "several_units"
    """The systems whose positions automatic operation, homing and macros hide: those of several units, or
    all (2-9). At rest: positions are never told."""
    mode_change: Literal["new_mode", "old_mode"] = "new_mode"
    """The mode that decides whether MOD n is answered (2-37)."""

    displayed_decimals: int = 2
    """Decimals of mm and degrees in APS and MPS (1-5)."""
    upload_end: Literal["refused", "done"] = "refused"
    """The fate of POF 2 where no upload is open (2-17)."""
    upload_refusal: Literal["E03", "E01"] = "E03"
    """The refusal of commands between POF 1 and POF 2 (1-7)."""
    download_end: Literal["first_hole", "skips_holes"] = "first_hole"
    """The action of POR at a number that is not set (2-19)."""
    left_out: Literal["without", "kept"] = "without"
    """The value that POS stores of an axis that is left out: none, or what stood there before (2-18)."""
    numbers: Literal["as_set", "whole"] = "as_set"
    """The form in which variables are kept (2-35)."""
    homing: Literal["lasting", "lost_by_moves"] = "lasting"
    """The effect of a move on homing (2-10)."""
    jog_mode: Literal["jog", "move", "standing"] = "jog"
    """The motion mode that ACD tells of a JOG of the host (2-10)."""
    positions_after_power: Literal["unknown", "kept"] = "unknown"
    """The rest of the positions, and of homing, after a loss of power (2-9)."""
    error_after_power: Literal["gone", "kept"] = "gone"
    """The rest of the last error of communication after a loss of power (2-12)."""

    def __post_init__(self) -> None:
        for given, known in ((self.status_bits, STATUS_BITS), (self.sensor_bits, SENSOR_BITS)):
            if sorted(given) != sorted(known):
                raise ValueError(f"the bits are {', '.join(known)}, each of them once")

    def told(self, axis: B) -> B:
        """The status or the sensors of an axis, changed so that their notation has this order of bits."""
        return rename_bits(axis, self.status_bits + self.sensor_bits, STATUS_BITS + SENSOR_BITS)
