"""Stops of all axes (C-HOST manual 2-7, 2-8)."""

from protocols.fics.row import RobotAction
from protocols.table import Retry


class StopAllImmediately(RobotAction, code="AES", blocked="b", retry=Retry.STOP, example=("AES", "AES")):
    """非常停止指令: software stop of all axes, at once.

    The system is then in the state EMERGENCY until its errors are reset.
    """


class StopAllDecelerating(RobotAction, code="ASS", blocked="b", retry=Retry.STOP, example=("ASS", "ASS")):
    """減速停止指令: software stop of all moving axes, decelerating.

    Ends a running macro or homing too.
    """
