"""Writing, reading and erasing the flash memory: commands F (RC-420 manual 14, 18)."""

from dataclasses import replace

from protocols.rorze.flash import (
    FLASH_S,
    EraseFlash,
    LoadPositions,
    LoadProgram,
    SavePositions,
    SaveProgram,
    SaveSettings,
)
from simulator.rorze.actions import Delayed, acts_out
from simulator.rorze.acts.programs import require_no_run
from simulator.rorze.controller import Rc420
from simulator.rorze.settings import Flash

DONE = Delayed(None, FLASH_S)
"""The deed is done at once, an assumption; only the reply comes later."""


@acts_out(SaveSettings)
def save_settings(axis: Rc420, command: SaveSettings, now: float) -> Delayed:
    axis.settings = replace(axis.settings, outputs=axis.io.outputs.steady)
    axis.flash.settings, axis.flash.damaged = axis.settings, False
    return DONE


@acts_out(SavePositions)
def save_positions(axis: Rc420, command: SavePositions, now: float) -> Delayed:
    axis.flash.positions = tuple(axis.positions)
    return DONE


@acts_out(LoadPositions)
def load_positions(axis: Rc420, command: LoadPositions, now: float) -> Delayed:
    axis.positions = list(axis.flash.positions)
    return DONE


@acts_out(SaveProgram)
def save_program(axis: Rc420, command: SaveProgram, now: float) -> Delayed:
    axis.flash.program = axis.program
    return DONE


@acts_out(LoadProgram)
def load_program(axis: Rc420, command: LoadProgram, now: float) -> Delayed:
    """Not under a program that runs, an assumption after UCS: the page is lost."""
    require_no_run(axis)
    axis.program = axis.flash.program
    return DONE


@acts_out(EraseFlash)
def erase_flash(axis: Rc420, command: EraseFlash, now: float) -> Delayed:
    match command.store:
        case "positions":
            axis.flash.positions = Flash().positions
        case "settings":
            axis.flash.settings, axis.flash.damaged = Flash().settings, False
        case "program":
            axis.flash.program = Flash().program
    return DONE
