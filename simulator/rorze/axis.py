"""The axis of an RC-420: its motor and sensors, its memories, and the counters that tell where it is."""

from dataclasses import replace

from protocols.rorze.row import WRONG_MODE
from simulator.rorze.motor import Motor
from simulator.rorze.settings import FARTHEST, Flash, Settings
from simulator.rorze.world import World

ENCODER_MODE = 1


def held(count: int) -> int:
    """A count as its register holds it: it goes no further than nine digits."""
    return max(-FARTHEST, min(FARTHEST, count))


class Axis:
    """The common ground of the parts of a controller.

    Pulses are counted in two ways: since the axis was built, as the shaft knows them (`motor`, `world`),
    and as the positions a host reads, which 6PS and an origin search shift and a loss of power clears.
    """

    settings: Settings
    """The settings in RAM, where the positions are, too."""
    positions: list[int]

    def __init__(self, motor: Motor) -> None:
        self.motor = motor
        self.world = World()
        self.flash = Flash()
        self.keeps_position = False
        """True if a loss of power leaves the position as it is: the manual does not say."""
        self.keeps_comments = False
        """True if user comments (9VS) outlast a loss of power, in a memory with a battery, say: as above."""
        self.compares_inclusively = False
        """True if `<` and `>` of JCP hold for equal values: its page says so, chapter 20 does not."""
        self.refuses_stale_positions = False
        """True if HPS must have told where the axis really is: the manual does not say."""
        self.labels_lead_on = False
        """True if UPD and UWD answer a label with the instruction behind it: not in the manual's examples."""
        self.wrong_mode_error = WRONG_MODE
        """The refusal of a command in an operating mode it is not marked for: the manual gives none."""
        self.forgets_errors = False
        """True if the errors in 9CD are gone once they were told: the manual says that 9CS clears them."""
        self.pace = 1.0
        """Speed of the motor as a multiple of the speed that its settings give."""
        self.refuses_second_stop = False
        """True if 5IS is refused after 5SS: the manual does not say."""

    def power_on(self, now: float) -> None:
        """Load flash into RAM; the counters start from 0 (RC-420 manual 18).

        The defaults stand in for settings that cannot be read, an assumption.
        """
        comments = self.settings.comments if self.keeps_comments else None
        self.settings = Settings() if self.flash.damaged else self.flash.settings
        if comments is not None:
            self.settings = replace(self.settings, comments=comments)
        self.positions = list(self.flash.positions)
        if self.keeps_position:
            return
        self._zero = self.motor.pulses(now)
        self._encoder_zero: float = self._shaft(now)

    # Counters

    def to_pulses(self, amount: int) -> int:
        """An amount in the unit of the operating mode, in pulses: encoder mode counts by the encoder."""
        if self.settings.mode == ENCODER_MODE:
            return round(amount * self.settings.encoder_ratio)
        return amount

    def pulse_position(self, now: float) -> int:
        """The position in output pulses, whatever the operating mode."""
        return held(self.motor.pulses(now) - self._zero)

    @property
    def _pulses_per_count(self) -> float:
        return self.world.encoder / self.settings.encoder_multiplier

    def _counts(self, shaft: int) -> float:
        return (shaft - self._encoder_zero) / self._pulses_per_count

    def encoder(self, now: float) -> int:
        """The encoder counter."""
        return held(round(self._counts(self._shaft(now))))

    def pulses_to_count(self, count: int, now: float) -> int:
        """The pulses that bring the encoder counter there, CW positive; 0 only if it is there."""
        if self.encoder(now) == count:
            return 0
        missing = (count - self._counts(self._shaft(now))) * self._pulses_per_count
        return round(missing) or (1 if missing > 0 else -1)

    def encoder_in_pulses(self, now: float) -> int:
        """The encoder counter converted to output pulses (6MD)."""
        return held(round(self.encoder(now) * self.settings.encoder_ratio))

    def position(self, now: float) -> int:
        """The position in the unit of the operating mode (6PD)."""
        return self.encoder(now) if self.settings.mode == ENCODER_MODE else self.pulse_position(now)

    def set_pulse_position(self, pulses: int, now: float) -> None:
        """Call the present position this many pulses."""
        self._zero = self.motor.pulses(now) - pulses

    def set_encoder(self, count: int, now: float) -> None:
        """Call the present encoder count this."""
        self._encoder_zero = self._shaft(now) - count * self._pulses_per_count

    def _shaft(self, now: float) -> int:
        return self.world.shaft(self.motor.pulses(now))
