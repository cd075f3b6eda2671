"""The plant's own groups on a full line: they serve sweeps and proofs, and cost no more than their share."""

import asyncio

import pytest

from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from tests.gateway.rorze.full_line import FULL, SWEEP_GROUPS, busy_s, teach
from tests.gateway.rorze.test_body_power import now
from tests.gateway.rorze.test_full_line import MOVERS
from tests.plants import Rig, in_virtual_time, rig, start

GROUPS = {f"{0x80 + n:02X}": [f"{15 * n + member:02X}" for member in range(15)] for n in range(8)}
HEALTH_AT_REST = 0.12
HEALTH_AT_THE_START = 0.5
BEGINNING_S = 60
WINDOW_S = 10.0
BOTH = [(GROUPS, ""), (GROUPS, SWEEP_GROUPS), ({}, SWEEP_GROUPS), ({}, "")]
STOPPED_WITHIN_S = (6.0, 6.0, 6.0, 9.0)
DECLARED = dict(zip(("own", "both", "sweep", "none"), zip(BOTH, STOPPED_WITHIN_S, strict=True), strict=True))


def health(it: Rig) -> float:
    return it.plant.line("line1").load_percent().get("health", 0.0) / 100


@pytest.mark.parametrize("declared", DECLARED)
@in_virtual_time
async def test_health_takes_its_share_whatever_is_declared(declared: str) -> None:
    (groups, options), _ = DECLARED[declared]
    async with rig(bodies=FULL, groups=groups, baud=9600, options=options) as it:
        await asyncio.sleep(60.0)
        for _ in range(6):
            since = now()
            await asyncio.sleep(WINDOW_S)
            assert busy_s(it, since) <= HEALTH_AT_REST * WINDOW_S


@pytest.mark.parametrize("declared", DECLARED)
@in_virtual_time
async def test_at_the_start_half_of_the_line_is_left_to_others(declared: str) -> None:
    (groups, options), _ = DECLARED[declared]
    async with rig(bodies=FULL, groups=groups, baud=9600, options=options, beginning=True) as it:
        shares = []
        for _ in range(BEGINNING_S):
            await asyncio.sleep(1.0)
            shares.append(health(it))
        assert max(shares) <= HEALTH_AT_THE_START
        assert all(body.power.mark.text for body in it.plant.bodies())


@pytest.mark.parametrize("declared", DECLARED)
@in_virtual_time
async def test_all_stops_are_confirmed_soon_while_30_motors_move_and_nobody_is_alarmed(declared: str) -> None:
    (groups, options), within_s = DECLARED[declared]
    async with rig(bodies=FULL, groups=groups, baud=9600, options=options) as it:
        await asyncio.sleep(60.0)
        await teach(it, MOVERS)
        for mover in MOVERS:
            await start(it, MoveClockwise(distance=500_000), mover)
        await asyncio.sleep(1.0)
        asked_at = now()
        reports = await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert now() - asked_at <= within_s
        assert {report.state for report in reports} == {"confirmed"}
        assert it.types("body.stop.unconfirmed") == []
        assert it.plant.alarms.standing() == []


@in_virtual_time
async def test_the_plants_own_groups_serve_a_sweep() -> None:
    async with rig(bodies=FULL, groups=GROUPS, baud=9600) as it:
        sent = len(it.wire.sent)
        told = await it.plant.rorze.sweep_of(it.plant.rorze.lines["line1"]).ask(
            it.plant.bodies(), GetPosition()
        )
        assert len(told) == len(FULL)
        assert sum(frame[1] == "8" and frame.endswith("6PD") for frame in it.wire.frames(sent)) == len(GROUPS)


@in_virtual_time
async def test_a_group_that_is_defined_while_the_gateway_runs_serves_too() -> None:
    async with rig(bodies=FULL, groups={}, baud=9600) as it:
        sweep = it.plant.rorze.sweep_of(it.plant.rorze.lines["line1"])
        assert not sweep.covers(it.body("00"))
        await it.plant.define_group("82", ["00", "01", "02"])
        assert sweep.covers(it.body("00"))
        await it.plant.define_group("82", ["01", "02"])
        assert [body.short for body in it.plant.bodies() if sweep.covers(body)] == ["01", "02"]


@in_virtual_time
async def test_groups_that_the_link_master_has_forgotten_delay_no_stop() -> None:
    async with rig(bodies=FULL, groups=GROUPS, baud=9600) as it:
        await asyncio.sleep(60.0)
        it.machine._groups.clear()
        reports = await it.plant.stops.stop(it.plant.bodies(), "immediate")
        assert {report.state for report in reports} == {"confirmed"}
        assert it.plant.alarms.standing() == []
        await asyncio.sleep(30.0)
        assert len(it.machine._groups) == len(GROUPS)


@in_virtual_time
async def test_a_motor_that_runs_on_among_120_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig(bodies=FULL, groups=GROUPS, baud=9600) as it:
        await teach(it, ["33"])
        await start(it, MoveClockwise(distance=500_000), "33")
        await asyncio.sleep(0.5)
        execute = it.axis(0x33).execute
        monkeypatch.setattr(
            it.axis(0x33),
            "execute",
            lambda text, at: execute("9CD", at) if text == "5IS" else execute(text, at),
        )
        await it.plant.stops.stop(it.plant.bodies(), "immediate")
        told = [event.subject for event in it.events("body.stop.unconfirmed")]
        assert told == ["/bodies/line1.33"]
