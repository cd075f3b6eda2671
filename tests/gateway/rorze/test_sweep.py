"""A sweep: many bodies asked in few frames, and an answer for each."""

import asyncio
from types import SimpleNamespace

import pytest

from gateway.core.errors import GatewayError
from gateway.rorze.bodies import Body
from gateway.rorze.probes import Sweep, SweepAnswer, parts_of
from protocols.rorze.link_master import MOST_MEMBERS
from protocols.rorze.position import GetPosition, SignedPulses
from protocols.rorze.status import GetControllerStatus
from simulator.faults import Direction
from tests.gateway.rorze.full_line import SWEEP_GROUPS, full_line
from tests.gateway.rorze.test_body_power import now
from tests.plants import Rig, in_virtual_time, lose, rig

POSITIONS_WITHIN_S = 2.4
BODIES = range(8)


def sweep_of(rig: Rig) -> Sweep:
    return rig.plant.rorze.sweep_of(rig.plant.rorze.lines["line1"])


async def positions(rig: Rig) -> dict[str, int | None]:
    """Position that each body told, by its digits; None where it told none."""
    told = await sweep_of(rig).ask(rig.plant.bodies(), GetPosition())
    return {
        body.short: it.reply.pulses
        if isinstance(it, SweepAnswer) and isinstance(it.reply, SignedPulses)
        else None
        for body, it in told.items()
    }


@pytest.mark.parametrize("bodies", [0, 1, 2, 17, 18, 35, 120])
def test_every_body_is_in_one_group_that_one_definition_can_hold(bodies: int) -> None:
    line = SimpleNamespace(id="line1")
    all_bodies: list[Body] = [Body(line, number) for number in range(bodies)]  # type: ignore[arg-type]
    parts = parts_of(all_bodies)
    if bodies > 1:
        assert [it for part in parts for it in part] == all_bodies
    assert all(2 <= len(part) <= MOST_MEMBERS for part in parts)


@in_virtual_time
async def test_120_positions_take_at_most_2_4_s_of_a_9600_baud_line() -> None:
    async with full_line() as it:
        for number in range(120):
            it.axis(number).set_pulse_position(number, now())
        sent, began_at = len(it.wire.sent), now()
        told = await positions(it)
        assert list(told.values()) == list(range(120))
        assert now() - began_at <= POSITIONS_WITHIN_S
        assert sum(frame[1] == "9" and frame.endswith("6PD") for frame in it.wire.frames(sent)) == 8


@in_virtual_time
async def test_without_groups_of_its_own_each_is_asked_alone() -> None:
    async with rig() as it:
        sent = len(it.wire.sent)
        assert len(await positions(it)) == 3
        assert it.wire.frames(sent) == ["&006PD", "&016PD", "&3F6PD"]


@in_virtual_time
async def test_who_is_missing_in_the_reply_is_asked_alone_and_told_as_silent() -> None:
    async with rig(bodies=BODIES, groups={}, options=SWEEP_GROUPS) as it:
        it.machine.switch_body(5, on=False, now=now())
        sent = len(it.wire.sent)
        told = await sweep_of(it).ask(it.plant.bodies(), GetControllerStatus())
        silent = [body.short for body, what in told.items() if isinstance(what, GatewayError)]
        assert silent == ["05"]
        assert it.wire.frames(sent)[0] == "&909CD"
        assert "&059CD" in it.wire.frames(sent)


@in_virtual_time
async def test_a_link_master_that_forgot_the_group_is_told_it_again() -> None:
    async with rig(bodies=BODIES, groups={}, options=SWEEP_GROUPS) as it:
        it.machine._groups.clear()
        assert set((await positions(it)).values()) == {0}
        await asyncio.sleep(5.0)
        assert it.wire.frames().count("&7FXVS90,00,01,02,03,04,05,06,07") == 2


@in_virtual_time
async def test_a_group_that_others_obey_is_defined_anew_and_its_own_are_asked_alone() -> None:
    async with rig(bodies=BODIES, groups={}, options=SWEEP_GROUPS) as it:
        it.machine._groups[0x90] = [0, 1, 2]
        assert len([it for it in (await positions(it)).values() if it is not None]) == len(BODIES)


@in_virtual_time
async def test_a_lost_reply_costs_no_answers() -> None:
    async with rig(bodies=BODIES, groups={}, options=SWEEP_GROUPS) as it:
        lose(it, Direction.REPLIES)
        assert None not in (await positions(it)).values()


@in_virtual_time
async def test_the_numbers_of_sweeps_are_nobody_elses() -> None:
    async with rig(bodies=BODIES, groups={}, options=SWEEP_GROUPS) as it:
        with pytest.raises(GatewayError, match="keeps for itself"):
            await it.plant.rorze.define_group("line1.95", ["00", "01"])
        line = it.plant.line("line1")
        assert it.plant.rorze.info(line)["groups"] == []
