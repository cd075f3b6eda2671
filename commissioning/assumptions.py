"""The assumptions about real hardware, one row each: where held, how tried, what a failure means."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Final, Literal

Family = Literal["rorze", "fics", "both"]


class Level(StrEnum):
    """The effect of a trial on the machine; all but questions have to be allowed."""

    QUESTIONS = "questions"
    SETTINGS = "settings"
    """Sets something in the controller; no motor moves because of it."""
    MOTION = "motion"
    """Moves a motor slowly between two places that a person names."""


@dataclass(frozen=True, slots=True)
class Assumption:
    """One belief about a controller that the manual does not settle."""

    slug: str
    family: Family
    assumed: str
    held: str
    """The constant or setting that holds it."""
    probe: str
    """The trial, in a sentence."""
    false: str
    """The meaning of its failure."""
    needed: str
    """The needs of a trial that could not tell."""
    key: str = ""
    """The key of the line's table that makes the gateway right; empty where no setting does."""
    level: Level = Level.QUESTIONS
    motor: str = "nothing"
    """The effect that the trial may have on a motor."""
    person: bool = False
    """A person has to switch the power during the trial."""
    harmless: bool = False
    """True if the gateway is right even if the assumption fails: nothing has to be changed."""
    rest: str = ""
    """The shortcoming that is left, with the change where there is one."""


_SWITCH: Final = "A person at a terminal, who switches the power when asked, and `--allow settings`."
_CALM: Final = "The power is switched by hand while nothing moves."

RORZE: Final = (
    Assumption(
        "interjection",
        "rorze",
        "The RC-400 takes a frame (a stop) before it has answered the last one. The reply to a stop is not "
        "waited for either where a body does not answer.",
        "`stop_mode`; `after_reply` if it does not",
        "Three position entries are asked for in one go (3ND): each has to be answered.",
        "A stop that is sent before the last reply is lost, and only its repetition arrives.",
        "A body that answers.",
        key="stop_mode",
    ),
    Assumption(
        "order-per-body",
        "rorze",
        "What one body says comes in order, copies included; bodies may overtake each other.",
        "the fences stand on it (decisions 2 and 10); that of a group or the link master stands on the order "
        "of the line",
        "The numbers in the replies to all questions (3ND) come in the order in which they were asked for.",
        "A fence proves nothing: a reply may be credited to a later command.",
        "A body that answers, and a link master that takes a frame before its last reply.",
    ),
    Assumption(
        "copies-of-replies",
        "rorze",
        "No copy of a reply comes later than a late reply may.",
        "`late_reply_s`; `Copies` in `gateway/core/false_replies.py`; a strict line does without it",
        "Each question has a number of its own (3ND): a number that comes twice is a copy.",
        "A copy that comes later may be taken for the reply to a command.",
        "A body that answers.",
        key="late_reply_s",
        rest="a line that repeats replies so late is slow",
    ),
    Assumption(
        "silent-xid",
        "rorze",
        "An RC-400 that does not answer XID may be an old one: its bodies are served.",
        "`introducer`; `NO_LINK_MASTER` in `gateway/rorze/line.py`",
        "XID is asked, and bodies with `&`, `$` and `#` where it is silent.",
        "Bodies are addressed in a form that this link master does not know.",
        "A link master or a body that answers: check power, cable and baud rate.",
        key="introducer",
        rest="an old link master knows neither groups nor bodies beyond 0F",
    ),
    Assumption(
        "label-answers",
        "rorze",
        "UPD and UWD answer a label with the label itself, as the manual's examples do.",
        "`PlaceQuery` in `protocols/rorze/programs.py`",
        "The program of a body is read as far as its first label, then that label (UPD, UWD).",
        "A question for a label is never answered as the gateway expects: programs are not found by label.",
        "A body whose program has a label.",
    ),
    Assumption(
        "link-master-forgets",
        "rorze",
        "XID, XRS and XVS are forgotten at power-off.",
        "the line is set up again after any sign of a restart",
        "A virtual body is defined (XVS) and asked for before and after the RC-400 was off.",
        "The link master keeps its set-up: to set it up again does no harm.",
        _SWITCH,
        level=Level.SETTINGS,
        motor=_CALM,
        person=True,
        harmless=True,
    ),
    Assumption(
        "half-command",
        "rorze",
        "61 characters and CR end a half-received command without executing anything (23h).",
        "`half_commands`; `HALF_COMMAND_ENDS` in `protocols/rorze/link.py`",
        "Half a question is sent (3ND), then these characters: it must not be answered. Where it is, another "
        "CR and LF behind them are tried (17.1).",
        "What was cut off in the middle may be executed when the port is opened.",
        "A body that answers.",
        key="half_commands",
        rest="without it a command that was cut off in the middle may be carried out later",
    ),
    Assumption(
        "curve-tick",
        "rorze",
        "A controller samples its speed curve every 0.86 ms.",
        "`TICK_S` in `protocols/rorze/profile.py`",
        "A slow move is sampled, and compared with the speed curve of its settings.",
        "Moves take another time than is planned: their ends are looked for too early or too late.",
        "`--allow motion`, two places, and an answer for the body.",
        level=Level.MOTION,
        motor="It moves slowly to a place that is named, and back.",
    ),
    Assumption(
        "wrong-mode",
        "rorze",
        "A command in an operating mode it is not marked for answers 61h.",
        "`WRONG_MODE` in `protocols/rorze/row.py`",
        "A question of another operating mode is asked (PKD or CCD); its refusal stays in 9CD until 9CS.",
        "A refusal is not known for one, or what should be refused is done.",
        "A body that answers, and link settings by which refusals carry their codes.",
    ),
    Assumption(
        "power-on-position",
        "rorze",
        "Switching a controller on sets its position and its homing distance (0PD) to 0.",
        "`POWER_ON_POSITION` in `gateway/rorze/power.py`; only where no mark tells (decision 11). "
        "`keeps_position` of a simulated RC-420 is the contrary",
        "The position is read before and after the controller was off.",
        "A loss of power is not seen by the position.",
        f"A position other than 0. {_SWITCH}",
        key="bodies.{body}.silence_needs_acknowledgement",
        level=Level.SETTINGS,
        motor=_CALM,
        person=True,
        harmless=True,
    ),
    Assumption(
        "comment-kept",
        "rorze",
        "A user comment is kept as it was set until FIS or a loss of power, and is empty or what FIS saved "
        "after it.",
        "`power_comment`; a comment that cannot be set is done without",
        "A free user comment is set (9VS), read back, and read once more after the controller was off.",
        "The mark stands though the power was lost, or does not stand though it was kept.",
        _SWITCH,
        key="bodies.{body}.power_comment",
        level=Level.SETTINGS,
        motor=_CALM,
        person=True,
    ),
    Assumption(
        "lasting-errors",
        "rorze",
        "Limit, EMS, initialisation, range and STALL errors stay in 9CD until a command or a loss of power "
        "clears them.",
        "`LASTING_ERRORS` in `gateway/rorze/power.py`; only where no mark tells",
        "The status of each body is read twice (9CD).",
        "An error that goes by itself is taken for a loss of power, and has to be acknowledged.",
        "A body with an error that stands: press a limit switch by hand while it moves, or run it against "
        "one.",
        harmless=True,
    ),
)

FICS: Final = (
    Assumption(
        "half-robot-command",
        "fics",
        "`!` and CR end a half-received command of a robot without executing anything (E06).",
        "`CLEARING` in `gateway/fics/line.py`",
        "Half a question is sent (VER), then `!` and CR: it must not be answered.",
        "What was cut off in the middle may be executed when the port is opened.",
        "A robot that answers.",
        rest="a command that was cut off in the middle may be carried out later: the C-HOST manual names no "
        "other way to end a line without executing it, and no time after which half a line is forgotten",
    ),
    Assumption(
        "robot-terminator",
        "fics",
        "A C-HOST line ends with CR.",
        "`terminator`; readers take CR LF as well",
        "The version is asked for (VER) with either end of a line.",
        "The robot does not understand what it is sent.",
        "A robot that answers: check power, cable and baud rate.",
        key="terminator",
    ),
    Assumption(
        "robot-decimals",
        "fics",
        "Coordinates have three decimals and lie within the widths of `protocols/fics/notation.py`.",
        "there; the manual's figures are lost",
        "Positions, variables and the table of positions are read (APS, MPS, POR).",
        "Coordinates are read wrongly, or refused.",
        "A robot that is homed, or has stored positions.",
    ),
    Assumption(
        "status-bits",
        "fics",
        "The second digit of ACD: homed, servo ready, moving, alarm; ASD: origin, plus limit, minus limit.",
        "`status_bits` of the robot; `protocols/fics/status.py`",
        "The status of a robot at rest (ACD) is compared with what its positions and errors tell.",
        "The status that is shown is another than that of the robot.",
        "A robot that stands still, is homed and has no error.",
        key="robot.status_bits",
    ),
    Assumption(
        "dpram-map",
        "fics",
        "A dual-port RAM begins map 0 and bears accesses of a byte; with wider ones the other bytes of an "
        "access "
        "may be written again as they are.",
        "`map`, `offset`, `stride` and `width` of its address",
        "The version is asked for at the address that is configured (VER).",
        "The gateway writes beside the RAM.",
        "A line at a dual-port RAM, and its layout from the maker of the board or of its driver.",
        key="address",
        rest="tried at the RAM alone, without stories and seeds",
    ),
    Assumption(
        "dpram-times",
        "fics",
        "A Fics takes a message from its dual-port RAM within a second, and a message without CR is whole "
        "10 ms "
        "after its flag.",
        "`stuck_ms` of its address; `transports/dpram.py`",
        "The time is measured that the robot takes to fetch a question.",
        "The port is given up though the robot lives.",
        "A line at a dual-port RAM.",
        key="address",
        rest="tried at the RAM alone, without stories and seeds",
    ),
    Assumption(
        "hidden-positions",
        "fics",
        "An axis tells `#####` because of several units only while something runs in it.",
        "`gateway/fics/units.py`",
        "The positions of a robot that stands still and is homed are read (ACD, APS).",
        "A robot at rest tells no positions: it counts as not homed.",
        "A robot that stands still and is homed.",
    ),
    Assumption(
        "upload-end",
        "fics",
        "POF 2 without an upload is refused with E08.",
        "`NO_UPLOAD` in `gateway/fics/session.py`",
        "POF 2 is sent where no upload is open.",
        "The gateway cannot tell whether an upload was left open.",
        "`--allow settings`, and an answer for the robot.",
        level=Level.SETTINGS,
    ),
    Assumption(
        "homing-outlasts",
        "fics",
        "Homing outlasts everything but homing, macros and a loss of power.",
        "`gateway/fics/power.py`",
        "The status is read before and after a slow move (ACD).",
        "A robot that was homed is taken for one that has lost its power.",
        "A robot that is homed, `--allow motion`, two places, and an answer for the robot.",
        level=Level.MOTION,
        motor="One axis moves slowly to a place that is named, and back.",
    ),
    Assumption(
        "por-end",
        "fics",
        "POR ends at the first number that is not set; in Ver.3, where that is the number asked for, E09 "
        "means "
        "the same as POE alone.",
        "`gateway/fics/units.py`",
        "Stored positions are read at once and one by one (POR).",
        "Positions behind a hole are stored under other numbers than they have.",
        "Stored positions with a hole among the numbers 1 to 8, such as 1 and 3.",
    ),
    Assumption(
        "displayed-hundredths",
        "fics",
        "A robot displays hundredths of mm and degrees; start and end are both rounded.",
        "`DISPLAYED` in `gateway/fics/axes.py`",
        "The decimals of all positions are counted (APS, MPS).",
        "A move that ended where it should is told as one that ended beside its place, or the other way "
        "round.",
        "A robot that is homed, with axes in mm or degrees.",
    ),
    Assumption(
        "power-loss-read",
        "fics",
        "For reads: no loss of power is shorter than half a second; none that nobody sees falls into the "
        "work of "
        "the teaching terminal.",
        "`UNIT_HOLDS_S` in `gateway/fics/knowledge.py`, `_select_to_read` in `gateway/fics/conversation.py`",
        "The power is switched off and on, as fast as somebody can, who answers at that moment: the silence, "
        "and the time from the switch to the first answer, are measured.",
        "A unit may be another than the one that was selected.",
        _SWITCH,
        level=Level.SETTINGS,
        motor=_CALM,
        person=True,
    ),
    Assumption(
        "power-loss-motion",
        "fics",
        "For motions: no robot loses its power and is up again between its answer to the last question and "
        "the "
        "motion that follows, some milliseconds later; `reply_timeout_s` where the gateway was held up.",
        "`Proof` in `gateway/fics/exchange.py`",
        "The power is switched off and on, as fast as somebody can, who answers at that moment: the silence, "
        "and the time from the switch to the first answer, are measured.",
        "A motion may go to a unit that nobody has selected.",
        _SWITCH,
        level=Level.SETTINGS,
        motor=_CALM,
        person=True,
    ),
    Assumption(
        "jog-mode",
        "fics",
        "A robot whose axis jogs tells motion mode 1 (JOG) from when it has taken the command, and after a "
        "loss "
        "of power nothing jogs.",
        "`_missing_jog` in `gateway/fics/knowledge.py`",
        "An axis jogs for a moment, bounded by the places that are named, and ACD is asked meanwhile; what a "
        "loss of power leaves is not tried.",
        "A second axis is not let join a JOG. One that is told as standing still contradicts the gateway.",
        "A robot that is homed, `--allow motion`, two places, and an answer for the robot.",
        level=Level.MOTION,
        motor="One axis jogs slowly towards a place that is named, for a second at most, and is stopped.",
        harmless=True,
    ),
    Assumption(
        "positions-after-power",
        "fics",
        "After a loss of power a robot tells no position of a unit (`#####` for all its axes) until it is "
        "homed.",
        "`gateway/fics/power.py`",
        "The positions are read before and after the robot was off (APS).",
        "A loss of power is not seen by the positions: a robot that is not homed counts as homed.",
        _SWITCH,
        level=Level.SETTINGS,
        motor=_CALM,
        person=True,
    ),
    Assumption(
        "copies-of-answers",
        "fics",
        "No copy of an answer comes later than `late_reply_s` after it, nor after that to a later question.",
        "`late_reply_s`; `gateway/core/false_replies.py`",
        "Each question has a number of its own (VAR): a number that comes twice is a copy.",
        "A copy that comes later may be taken for the answer to a later question.",
        "A robot that answers.",
        key="late_reply_s",
        rest="a line that repeats replies so late is slow",
    ),
    Assumption(
        "numbers-as-set",
        "fics",
        "It displays all other numbers as they were set, up to what 32 bits hold.",
        "`PRECISION` in `gateway/fics/agreement.py`",
        "A variable is set to numbers, read back, and set as it was (VAR).",
        "What was set is told as not set.",
        "`--allow settings`, and an answer for the robot.",
        level=Level.SETTINGS,
    ),
    Assumption(
        "pos-left-out",
        "fics",
        "POS with an axis left out stores a position without it, whatever was stored there before.",
        "`agrees` in `gateway/fics/tables.py`",
        "A position without one axis is stored over another at number 1999, which has to be free (POF, POS, "
        "POR).",
        "An upload is told as failed though it is not, or the other way round.",
        "`--allow settings`, an answer for the robot, and a free position 1999.",
        level=Level.SETTINGS,
    ),
    Assumption(
        "error-after-power",
        "fics",
        "The last error of communication is gone after a loss of power, and POF 2 during motion is refused "
        "with "
        "E01.",
        "`REFUSAL_SHOWS_POWER` in `gateway/fics/moves.py`",
        "A question in a wrong form is asked, and the error is read after the robot was off (ERR).",
        "A loss of power during a move is not seen in mode 2.",
        _SWITCH,
        level=Level.SETTINGS,
        motor=_CALM,
        person=True,
    ),
    Assumption(
        "upload-refusal",
        "fics",
        "A robot refuses commands between POF 1 and POF 2 with E03.",
        "`protocols/fics/row.py`",
        "An upload is opened at number 1999 (POF 1), a question is asked, and the upload is ended (POF 2).",
        "An upload that was left open is not seen: stops are refused meanwhile.",
        "`--allow settings`, and an answer for the robot.",
        level=Level.SETTINGS,
    ),
)

BOTH: Final = (
    Assumption(
        "echo",
        "both",
        "A line does not say back what is written to it.",
        "`gateway/core/false_replies.py` (decision 78)",
        "What is heard is compared with what was sent.",
        "Echoes are no answers: switch the adapter's local echo off.",
        "Somebody who answers.",
    ),
    Assumption(
        "late-replies",
        "both",
        "No reply is later than two seconds.",
        "`late_reply_s`",
        "The latest reply to many questions is measured.",
        "A reply may be taken for that to a later command, once it was given up.",
        "Somebody who answers.",
        key="late_reply_s",
        rest="what waits for a late reply is as late: a stop may be told as not confirmed, and be confirmed "
        "some seconds later",
    ),
    Assumption(
        "turnaround",
        "both",
        "A link takes 3 ms from a question to its reply, besides the bytes; a port that does not tell its "
        "speed "
        "leads to 9600 baud.",
        "`TURNAROUND_S` and `SLOWEST_BYTE_S` in `gateway/rorze/probes.py`: how often idle bodies are "
        "asked; `reply_timeout_s`",
        "The times from question to reply are measured.",
        "Commands are told as unanswered before their replies can be there.",
        "Somebody who answers.",
        key="reply_timeout_s",
        rest="on a line on which each reply takes a quarter of a second, jogs of bodies and moves of SCARA "
        "robots do not begin in time, and are refused: nothing is sent",
    ),
    Assumption(
        "stop-overtakes",
        "both",
        "An immediate stop may overtake a decelerating one that waits.",
        "`gateway/fics/session.py`, `gateway/rorze/session.py`",
        "A slow move is stopped by both, one right after the other.",
        "A stop waits for the end of the ramp.",
        "`--allow motion`, two places, and an answer for the body or robot.",
        level=Level.MOTION,
        motor="It moves slowly towards a place that is named, and is stopped.",
        harmless=True,
    ),
)

ASSUMPTIONS: Final = (*RORZE, *FICS, *BOTH)
BY_SLUG: Final = {row.slug: row for row in ASSUMPTIONS}


def of_family(family: str) -> tuple[Assumption, ...]:
    """The assumptions about lines of a family, `rorze` or `fics`, in the order in which they are tried."""
    *general, stops = BOTH
    return tuple(row for row in (*general, *RORZE, *FICS, stops) if row.family in (family, "both"))
