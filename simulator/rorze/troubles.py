"""Troubles of a line as people meet them: each lasts until it is mended."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Final

from simulator.faults import cut
from simulator.rorze.controller import Rc420
from simulator.rorze.line import Rc400Line
from simulator.rorze.world import CW_LIMIT, EMS

Mend = Callable[[float], object]
"""Ends a trouble at a time."""


def _press_ems(line: Rc400Line, axis: Rc420, now: float) -> Mend:
    return _hold(EMS, line, axis, now)


def _hold_limit(line: Rc400Line, axis: Rc420, now: float) -> Mend:
    return _hold(CW_LIMIT, line, axis, now)


def _hold(sensor: int, line: Rc400Line, axis: Rc420, now: float) -> Mend:
    held = axis.world.forced
    _touch(line, axis, lambda: held.__setitem__(sensor, True), now)
    return partial(_touch, line, axis, lambda: held.pop(sensor, None))


def _cut_power(line: Rc400Line, axis: Rc420, now: float) -> Mend:
    line.switch_body(axis.body, on=False, now=now)
    return lambda now: line.switch_body(axis.body, on=True, now=now)


def _break_driver(line: Rc400Line, axis: Rc420, now: float) -> Mend:
    """Let the motor lose steps; the STALL stands until it is cleared (RC-420 manual 13.6, 13.7)."""
    _touch(line, axis, lambda: axis.step_out(now), now)
    return lambda _now: None


def _cut_off(line: Rc400Line, axis: Rc420, now: float) -> Mend:
    _touch(line, axis, lambda: line.cut_off.add(axis.body), now)
    return partial(_touch, line, axis, lambda: line.cut_off.discard(axis.body))


def _touch(line: Rc400Line, axis: Rc420, deed: Callable[[], object], now: float) -> None:
    """Do something to a controller, and let it and the line notice."""
    axis.advance(now)
    deed()
    axis.sense(now)
    line.look_after(axis.body)


OF_BODIES: Final[Mapping[str, Callable[[Rc400Line, Rc420, float], Mend]]] = {
    "ems": _press_ems,
    "limit": _hold_limit,
    "power": _cut_power,
    "driver": _break_driver,
    "dead": _cut_off,
}
"""Troubles of one controller: it alone is touched."""


def break_body(line: Rc400Line, body: int, kind: str, now: float) -> Mend:
    """Let a trouble of `OF_BODIES` begin; what is given ends it."""
    return OF_BODIES[kind](line, line.axes[body], now)


def pull_cable(line: Rc400Line, _now: float) -> Mend:
    """Lose all frames between the host and the link master, both ways."""
    cut(line.faults)
    return lambda _now: line.faults.clear()
