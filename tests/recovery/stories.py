"""The stories as rows: what breaks, what the console tells, and the taps that lead back to work."""

from typing import Final, NamedTuple

END: Final = "/demo/faults"
HOME: Final = "/moves"
CLEAR: Final = "/commands/clear-controller-status"
PANEL: Final = "End all faults"
"""The button of the panel: what a person does at the machine, such as to release the stop button."""


class Story(NamedTuple):
    """A fault that meets something at work, or at rest."""

    kind: str
    target: str
    title: str
    broken: str
    """The event at the machine."""
    cause: str
    """Cause of the alarm that tells it."""
    told: str
    """A part of the alarm's sentence."""
    taps: tuple[str, ...]
    """`END`, or the end of the path of a call that the alarm offers."""
    hand: str
    """Action of a person at the machine, in place of `END`."""
    why: str
    """Explanation that is left to give."""
    moving: bool = False
    """True if the story begins in the middle of a move."""

    @property
    def is_told_when_mended(self) -> bool:
        """True if the gateway knows the fault only when the controller answers again."""
        return self.cause.endswith("power_cycled")

    @property
    def id(self) -> str:
        """Its name among the tests."""
        return f"{self.kind}-{self.target}"


STORIES: Final = (
    Story(
        "ems",
        "line1.3F",
        "The stop circuit of an axis opens",
        "The EMS input of the lift comes on in the middle of a move.",
        "body.ems_error",
        "The EMS input of line1.3F was on.",
        (END, CLEAR),
        "Release the stop button",
        "The motor stands still and knows where: it needs no homing. While the input is on every move is "
        "refused. An axis that stood still has no alarm: its lamp EMS is on, and the next move is refused.",
        moving=True,
    ),
    Story(
        "limit",
        "line1.3F",
        "An axis runs onto its limit",
        "The CW limit sensor of the lift comes on in the middle of a move.",
        "body.limit_error",
        "A limit sensor of line1.3F was reached.",
        (END, CLEAR),
        "See why it went so far, and move it away from the limit",
        "While the sensor is on the axis takes moves away from the limit only.",
        moving=True,
    ),
    Story(
        "power",
        "line1.3F",
        "A controller loses its power",
        "The lift's controller is without power for a while.",
        "body.power_cycled",
        "line1.3F has lost its power: its mark is gone.",
        (END, HOME),
        "Restore the power",
        "The position in the controller means nothing any more: moves to places are refused until it is "
        "homed, or until somebody who knows better has acknowledged the power cycle.",
    ),
    Story(
        "cable",
        "line1",
        "The cable of a line is pulled",
        "Nothing passes between the computer and the link master.",
        "body.offline",
        "does not answer any more.",
        (END,),
        "Plug the cable in",
        "Motors go on with what they were told last, and no stop arrives: use the hardware stop if something "
        "must not move on. The controllers keep their positions.",
    ),
    Story(
        "driver",
        "line1.3F",
        "A motor loses steps",
        "The controller of the lift finds that the motor has stepped out (STALL).",
        "body.stall_error",
        "line1.3F has lost steps (STALL).",
        (END, HOME),
        "See what holds the motor",
        "It stands elsewhere than the controller counts: home it. To clear the STALL alone leaves the "
        "position wrong.",
    ),
    Story(
        "dead",
        "line1.3F",
        "A controller falls silent",
        "The lift's controller lives on, and nothing reaches it: its RS-485 branch is broken.",
        "body.offline",
        "line1.3F does not answer any more.",
        (END,),
        "Mend the wire, or swap the controller",
        "Others on the line go on. It kept its power and its position.",
    ),
    Story(
        "ems",
        "r1",
        "The stop circuit of a robot opens",
        "The stop input of the robot comes on in the middle of a move.",
        "robot.error",
        "r1 reports error 001",
        (END, "/errors/reset"),
        "Release the stop button",
        "The robot knows where it is: it needs no homing.",
        moving=True,
    ),
    Story(
        "power",
        "r1",
        "A robot loses its power",
        "The robot is without power for a while.",
        "robot.power_cycled",
        "r1 has lost its power.",
        (END, "/power-cycle/acknowledge", HOME),
        "Restore the power",
        "Nothing is homed then, and speeds the gateway does not know are 100 % again.",
    ),
    Story(
        "cable",
        "r1",
        "A robot does not answer",
        "Nothing passes between the computer and the robot.",
        "robot.offline",
        "r1 does not answer any more.",
        (END,),
        "Mend the connection",
        "It keeps its power, its origins and its speeds.",
    ),
    Story(
        "driver",
        "r1",
        "A driver reports an error",
        "The driver of axis Z of unit 1 reports error 31h.",
        "robot.error",
        "The driver of axis Z of unit 1 reports error 31h.",
        (END, "/errors/reset"),
        "See the driver's manual, and remove the cause",
        "The error keeps the whole robot from moving.",
    ),
)
DISK: Final = Story(
    "disk",
    "gateway",
    "The disk is full",
    "The journal of the gateway cannot be written.",
    "gateway.journal.trouble",
    "The journal cannot be written",
    (END,),
    "Make room on the disk",
    "Nothing with an effect is sent, for nothing is sent that is not written down. Stops and reads go on, "
    "and so do moves under way. The gateway tries again every few seconds.",
)
