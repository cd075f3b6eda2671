"""Inputs, outputs and sensors of bodies."""

from typing import Final

from gateway.core.rights import Right
from gateway.operations.of_bodies import of_body
from gateway.rorze import signals

inputs: Final = of_body(Right.VIEW, signals.inputs)
outputs: Final = of_body(Right.VIEW, signals.outputs)
sensors: Final = of_body(Right.VIEW, signals.sensors)
switch: Final = of_body(Right.OPERATE, signals.switch)
pulse: Final = of_body(Right.OPERATE, signals.pulse)
error_outputs: Final = of_body(Right.VIEW, signals.error_outputs)
set_error_output: Final = of_body(Right.SETUP, signals.set_error_output)
take_back_errors: Final = of_body(Right.OPERATE, signals.take_back_errors)
