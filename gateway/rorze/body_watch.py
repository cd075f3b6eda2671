"""The watch over a body: whether it answers, what it does without us, and whether it has kept its power."""

import asyncio
from collections.abc import Callable
from contextlib import suppress
from math import inf

from gateway.core.errors import ControllerRefused, GatewayError
from gateway.core.exchange import Lane
from gateway.core.times import happens
from gateway.rorze.bodies import NO_PROGRAM_S, STATUS, Body, Group
from gateway.rorze.config import Events
from gateway.rorze.line import Line
from gateway.rorze.probes import (
    HEALTH_POLL_S,
    IDLE_POLL_S,
    Health,
    Sweep,
    background_of,
    group_s,
    is_prompt,
    mark_s,
    poll_s,
    status_s,
)
from protocols.rorze.inputs_outputs import GetInputs, GetSensors
from protocols.rorze.modes import GetEventKinds, GetEventMask, SetEventKinds, SetEventMask
from protocols.rorze.programs import GetProgramStatus

CLOCK_S = 0.001
"""Seconds by which a timer may be early."""


class BodyWatch:
    """Notices what happens to one body without us."""

    def __init__(self, body: Body, health: Health, sweep: Sweep, stopping: Callable[[Line], bool]) -> None:
        self._body = body
        self._health = health
        self._sweep = sweep
        self._stopping = stopping
        """True if a line has a stop that is not confirmed: its time belongs to that."""
        self._woke_at = -inf
        self._look_at = self._mark_at = self._ask_at = -inf
        """Times at which the questions for the state, the mark and the presence are due."""
        self._asked_at = -inf
        self._unreadable: str | None = None
        """Why its state could not be learnt, as was told last."""

    async def run(self) -> None:
        """Watch until cancelled."""
        body = self._body
        while True:
            self._woke_at, wanted = _now(), body.life.look_due.is_set()
            body.life.look_due.clear()
            if body.line.state == "ready" and body.online:
                try:
                    await self._attend(wanted=wanted)
                    self._unreadable = None
                except GatewayError as error:
                    self._tell_unreadable(error.detail)
            await happens(body.life.look_due, self._pause_s())

    def _tell_unreadable(self, why: str) -> None:
        """Tell it once, until its state is learnt or something else is in the way."""
        if why != self._unreadable:
            self._unreadable = why
            self._body.on_news("body.unreadable", {"detail": why})

    def _pause_s(self) -> float:
        """Until the next question, if it is not heard before."""
        now = _now()
        if not is_prompt(self._body.line):
            mark_at = self._mark_at if self._has_mark() else inf
            return max(min(self._look_at, mark_at, self._ask_at) - now, IDLE_POLL_S)
        due_in_s = (self._body.last_heard_at or -inf) + IDLE_POLL_S - now
        return due_in_s if due_in_s > 0 else max(self._woke_at + IDLE_POLL_S - now, 0.0)

    async def _attend(self, *, wanted: bool) -> None:
        body, now = self._body, _now()
        if body.move is None:
            if wanted or now >= self._look_at:
                if self._is_over(self._look_at, now):
                    self._look_at = self._health.next_poll(now)
                await self._look(self._health.lane_of_called_for(now) if wanted else background_of(body.line))
            elif self._is_unheard(now) and not self._stopping(body.line):
                async with self._health.turn(status_s(body.line)):
                    await self._see_whether_it_is_there()
        if self._mark_wanted(now):
            if self._is_over(self._mark_at, now):
                self._mark_at = self._health.next_mark(now)
            async with self._health.turn(mark_s(body.line, written=body.power.mark.text is not None)):
                await body.mark.tend(background_of(body.line))

    async def _see_whether_it_is_there(self) -> None:
        """Ask for its program, now and then, else for its status.

        Where it is known that no program runs a stop of many need not ask for that.
        """
        body = self._body
        if self._program_is_due():
            with suppress(ControllerRefused):  # one without programs refuses
                await body.ask(GetProgramStatus(), lane=background_of(body.line))
                return
        await body.ask(STATUS, lane=background_of(body.line))

    def _program_is_due(self) -> bool:
        line = self._body.line
        return not is_prompt(line) and _is_due(self._body.told.no_program_at)

    async def _look(self, lane: Lane) -> None:
        """Look at once among clients' reads, and in the background when it has its turn."""
        if lane is not Lane.BACKGROUND:
            await self._body.poll(lane)
            return
        async with self._health.turn(poll_s(self._body.line)):
            if self._body.move is None:
                await self._body.poll(lane)

    def _is_unheard(self, now: float) -> bool:
        """True if it is to be asked if it is there; on a line of many, when its turn has come."""
        heard_at = self._body.last_heard_at or -inf
        if is_prompt(self._body.line):
            return now - heard_at >= IDLE_POLL_S - CLOCK_S
        if now < self._ask_at:
            return False
        if self._sweep.covers(self._body):
            self._ask_at = now + HEALTH_POLL_S
            return False
        asked_at, self._asked_at = self._asked_at, now
        self._ask_at = self._health.next_status(now)
        return heard_at <= asked_at or self._program_is_due()

    def _mark_wanted(self, now: float) -> bool:
        return self._has_mark() and (self._body.power.mark.due or now >= self._mark_at)

    def _has_mark(self) -> bool:
        return bool(self._body.power.mark.comment) and not self._body.power.mark.taken

    def _is_over(self, at: float, now: float) -> bool:
        """True if another moment is due; on a line of many a moment that was kept stays so."""
        return now >= at or is_prompt(self._body.line)


async def watch_groups(health: Health, sweep: Sweep) -> None:
    """Keep the groups for sweeps defined, and ask one group after the other who is there.

    So it is noticed, too, that a link master has restarted: by the groups that it has forgotten.
    """
    line, learnt = health.line, 0
    while True:
        for group in sweep.groups:
            await sweep.define()
            if line.state != "ready":
                break
            if learnt != line.set_ups and not is_prompt(line):
                learnt = line.set_ups
                await _learn_all_programs(health, sweep)
            await _ask_in_turn(health, sweep, group)
        await asyncio.sleep(IDLE_POLL_S)


async def _ask_in_turn(health: Health, sweep: Sweep, group: Group) -> None:
    """Ask a group when the line has the time: on a line of few bodies only to see that it is known."""
    line = health.line
    if is_prompt(line) and group in sweep.own:
        return
    await asyncio.sleep(health.next_of_group(_now(), len(group.members), len(sweep.groups)) - _now())
    if line.state != "ready":
        return
    await sweep.look_at(group)
    if not is_prompt(line):
        await _learn_programs(health, sweep, group)


async def _learn_all_programs(health: Health, sweep: Sweep) -> None:
    """Where no program runs is known soon after a set-up, for a stop of all may come as soon."""
    wanted = (sweep.represented_by(group) for group in sweep.groups)
    parts = [
        bodies for bodies in wanted if any(body.online and not body.runs_no_program() for body in bodies)
    ]
    moments = [health.next_moment(_now(), group_s(health.line, len(part))) for part in parts]
    for part, at in zip(parts, moments, strict=True):
        await asyncio.sleep(at - _now())
        await sweep.ask(part, GetProgramStatus(), Lane.BACKGROUND)


async def _learn_programs(health: Health, sweep: Sweep, group: Group) -> None:
    """Know where no program runs: a stop of many need not ask each for it."""
    members = sweep.represented_by(group)
    if any(member.online and _is_due(member.told.no_program_at) for member in members):
        await asyncio.sleep(health.next_of_group(_now(), len(members), len(sweep.groups)) - _now())
        await sweep.ask(members, GetProgramStatus(), Lane.BACKGROUND)


def _is_due(no_program_at: float | None) -> bool:
    """True if to ask for a program, before that none runs is believed no more."""
    return no_program_at is None or no_program_at < _now() - NO_PROGRAM_S / 2


def _now() -> float:
    return asyncio.get_running_loop().time()


# the changes that a body reports unasked

CHECK_S = 1.0
"""True if it may have forgotten its settings is considered this often; that asks nothing."""
RETRY_S = 60.0
"""Seconds between two readings where nothing is known to have happened."""


async def watch_events(body: Body, events: Events) -> None:
    """See again and again that a body reports what it should."""
    settled: tuple[object, ...] | None = None
    look_at = 0.0
    while True:
        life, now = _life_of(body), asyncio.get_running_loop().time()
        if body.line.state == "ready" and body.online and (life != settled or now >= look_at):
            with suppress(GatewayError):
                if await _settle(body, events):
                    settled, look_at = life, now + RETRY_S
        await asyncio.sleep(CHECK_S)


def _life_of(body: Body) -> tuple[object, ...]:
    """Changes where it may have lost its settings."""
    return body.line.set_ups, body.power.losses, body.power.mark.text


async def _settle(body: Body, events: Events) -> bool:
    """Set what is not as it should be, and know the state from which edges count; False while it moves.

    :raises GatewayError: it was not done, or not read back.
    """
    mask, _ = await body.ask(GetEventMask(), lane=Lane.BACKGROUND)
    kinds, _ = await body.ask(GetEventKinds(), lane=Lane.BACKGROUND)
    wanted = events.mask
    masked = all((bits or 0) == getattr(wanted, kind) for kind, bits in mask.mask)
    right = masked and kinds.kinds == events.kinds
    if not right and (body.move is not None or body.moving is not False):
        return False
    if not right:
        await body.ask(SetEventMask(mask=wanted), lane=Lane.BACKGROUND)
        await body.ask(SetEventKinds(kinds=events.kinds), lane=Lane.BACKGROUND)
    if events.sensors:
        await body.ask(GetSensors(), lane=Lane.BACKGROUND)
    if events.inputs:
        await body.ask(GetInputs(), lane=Lane.BACKGROUND)
    return right
