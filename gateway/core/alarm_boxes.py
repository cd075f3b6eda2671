"""Alarms that tell one event: a failed move beside its cause, bodies beside their line."""

from collections.abc import Callable, Sequence
from typing import Final

from gateway.core.alarms import Alarm

NEAR_S: Final = 5.0
"""Alarms that were raised so close to each other may tell the same event, in seconds."""
SAME_S: Final = 60.0
"""Seconds between alarms of one cause at several bodies of a line, which are asked one after the other."""
_SILENT: Final = ("body.offline", "robot.offline")
_POWER_CYCLED: Final = ("body.power_cycled", "robot.power_cycled")
_STOP_OR_MOVE: Final = (".move.", ".stop.unconfirmed")


def boxed(alarms: Sequence[Alarm], line_of: Callable[[str], str | None]) -> list[Alarm]:
    """Give alarms that stand, each with the one it is part of.

    `line_of` gives the id of the line of a subject such as /bodies/line1.3F; None where it has none.
    """
    lines = {alarm.id: line_of(alarm.subject) for alarm in alarms}
    oldest_first = sorted(alarms, key=lambda alarm: alarm.id)
    heads: dict[str, str] = {}
    for alarm in oldest_first:
        head = next((other for other in oldest_first if _tells(other, alarm, lines)), None)
        if head is not None:
            heads[alarm.id] = head.id
    return [alarm.model_copy(update={"part_of": _root(alarm.id, heads)}) for alarm in alarms]


def _root(alarm_id: str, heads: dict[str, str]) -> str | None:
    found = heads.get(alarm_id)
    while found in heads:
        found = heads[found]
    return found


def _tells(head: Alarm, alarm: Alarm, lines: dict[str, str | None]) -> bool:
    """Say whether `head` tells the event of `alarm`, too; never both of each other."""
    if _rank(head) > _rank(alarm) or lines[alarm.id] is None:
        return False
    if _rank(head) < _rank(alarm):
        is_its_line = head.subject == f"/lines/{lines[alarm.id]}"
        return (is_its_line and _during(head, alarm)) or (
            head.subject == alarm.subject and _near(head, alarm)
        )
    if head.subject == alarm.subject:
        return _explains(head, alarm)
    is_same = head.cause == alarm.cause and lines[head.id] == lines[alarm.id]
    return is_same and head.id < alarm.id and _near(head, alarm, SAME_S)


def _rank(alarm: Alarm) -> int:
    """Rank an alarm by its distance from the cause: lines, then their bodies, then the ends of moves."""
    if alarm.subject.startswith("/lines/"):
        return 0
    return 2 if any(part in alarm.cause for part in _STOP_OR_MOVE) else 1


def _near(one: Alarm, other: Alarm, within_s: float = NEAR_S) -> bool:
    return abs((one.raised_at - other.raised_at).total_seconds()) <= within_s


def _explains(power: Alarm, silence: Alarm) -> bool:
    """Say whether a loss of power, seen when the part answered again, explains its silence."""
    if power.cause not in _POWER_CYCLED or silence.cause not in _SILENT or silence.ended_at is None:
        return False
    return abs((power.raised_at - silence.ended_at).total_seconds()) <= NEAR_S


def _during(line: Alarm, alarm: Alarm) -> bool:
    """Say whether an alarm came while its line had one, or is the silence that led to the line's."""
    is_before_end = line.ended_at is None or alarm.raised_at <= line.ended_at
    return (
        _near(line, alarm)
        or (line.raised_at <= alarm.raised_at and is_before_end)
        or (alarm.cause in _SILENT and _led_to(alarm, line))
    )


def _led_to(silence: Alarm, line: Alarm) -> bool:
    """Say whether a silence lasted when the line was given up: its bodies are asked one after the other."""
    lasted = silence.ended_at is None or silence.ended_at >= line.raised_at
    return lasted and silence.raised_at <= line.raised_at and _near(line, silence, SAME_S)
