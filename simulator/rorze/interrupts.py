"""The effect of an edge on input 8 or 9 during a move (RC-420 manual 13.9.4)."""

from simulator.rorze.axis import Axis
from simulator.rorze.outputs import Outputs
from simulator.rorze.settings import InterruptActions

INTERRUPT_INPUTS = (8, 9)

OFF, FALLING, RISING = range(3)
"""The edge that sets off an interrupt (CPS)."""

MOVE_CODES = "12"
"""An interrupt waits for an edge in the next move of these command codes, and is off after it."""


class Interrupts:
    """The two interrupts; each goes off once."""

    def __init__(self, axis: Axis, outputs: Outputs) -> None:
        self._axis = axis
        self._outputs = outputs

    def arm(self, port: int, edge: int) -> None:
        """Choose the edge; what is to be recorded is cleared, the output to be pulsed made ready (CPS)."""
        self._choose(port, edge)
        actions = self._actions(port)
        for number in (actions.position, actions.encoder, actions.encoder_in_pulses):
            if number is not None:
                self._axis.positions[number] = 0
        if actions.output is not None:
            self._outputs.set(actions.output.output, not actions.output.level)

    def edge(self, port: int, edge: int, now: float) -> None:
        """Heed an edge that is waited for, in a move and in the valid section (CSS)."""
        axis, place = self._axis, INTERRUPT_INPUTS.index(port)
        first, last = axis.settings.interrupt_sections[place]
        armed = axis.settings.interrupt_modes[place] == edge
        if armed and axis.motor.moving and self._in_move() and first <= axis.position(now) <= last:
            self._choose(port, OFF)
            self._go_off(self._actions(port), now)

    def move_ended(self) -> None:
        """Switch both off after the move they were armed for."""
        if self._in_move():
            for port in INTERRUPT_INPUTS:
                self._choose(port, OFF)

    def _go_off(self, actions: InterruptActions, now: float) -> None:
        axis, pulse = self._axis, actions.output
        if actions.position is not None:
            axis.positions[actions.position] = axis.position(now)
        if actions.encoder is not None:
            axis.positions[actions.encoder] = axis.encoder(now)
        if actions.encoder_in_pulses is not None:
            axis.positions[actions.encoder_in_pulses] = axis.encoder_in_pulses(now)
        if pulse is not None:
            self._outputs.pulse(pulse.output, bool(pulse.level), pulse.duration_ms, now)

    def _in_move(self) -> bool:
        return self._axis.motor.code[:1] in MOVE_CODES

    def _actions(self, port: int) -> InterruptActions:
        return self._axis.settings.interrupt_actions[INTERRUPT_INPUTS.index(port)]

    def _choose(self, port: int, edge: int) -> None:
        place, settings = INTERRUPT_INPUTS.index(port), self._axis.settings
        if settings.interrupt_modes[place] != edge:
            self._axis.settings = settings.with_item("interrupt_modes", place, edge)
