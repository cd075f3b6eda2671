"""Backups of bodies: read whole, brought back, and whatever happens meanwhile is told exactly."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import replace
from itertools import zip_longest
from random import Random
from typing import NamedTuple

import pytest

from gateway.core.backup_record import Restore, RestorePlan, Units
from gateway.core.errors import BodyBusy, GatewayError, InvalidRequest, NotFound
from gateway.core.origin import Origin
from gateway.door import backups, doing, stopping
from gateway.rorze.asked_body import is_mark
from gateway.rorze.bodies import Configured
from gateway.rorze.door import backups as of_bodies
from gateway.rorze.door.programs import ProgramSource
from gateway.rorze.units import Scale
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from protocols.rorze.speeds import SetMaximumAcceleration, SetMaximumSpeed, SetStartSpeed
from simulator.faults import Direction, Fault, Switch
from simulator.rorze.controller import Rc420
from tests.plants import Rig, in_virtual_time, lose, rig
from tests.through_the_door import ask
from tests.virtual_time import run_virtual

ME = Origin("test")


@asynccontextmanager
async def one_body(baud: int | None = None) -> AsyncIterator[Rig]:
    async with rig(bodies=(0x3F,), groups={}, baud=baud) as it:
        yield it


async def teach(it: Rig, number: int = 0x3F) -> None:
    """Let a body keep something of everything, by its own commands."""
    axis, now = it.axis(number), asyncio.get_running_loop().time()
    for text in TAUGHT:
        assert not axis.execute(text, now).payload.startswith("@"), text


TAUGHT = (
    *("EPS-500,90000", "0SS25", "DCS3,7", "DISH0005", "9VS2,left lift; 12", "CESE,2,1", "CESL,3,0"),
    *("CPS8,1", "CFS8,P:25", "CFS8,O:5,1,10", "CSS9,-50,50", "HZS1,100000.500", "3IS7", "COSH8001"),
    *("OLSS[4],100", "OHSS[4],5000", "OSSS[4],80000", "OASS[4],30", "OBSS[4],0", "OHS40000"),
    *("SPSA[2],A:S[4],D:S[4]", "SESA[2],1,F20000,S3000", "SESA[2],0,F1000,S4000"),
    *("3PSP[0],-5", "3PSP[2047],999999999", "UDSD0,5", "UDSD199,-2", "UDSC3,12"),
    *("UCS", "UWS*BLINK", "UWSSETOD0", "UWSWAT5", "UWSEND", "UAS0"),
)
SMALL = "[body 3F]\n[speed-sets]\nOLS60\nOHS40000\nOSS100000\nOAS50\nOBS50\n[program]\n*A\n1AM50\nEND\n"
"""A backup that is quickly compared."""


async def planned(it: Rig, text: str, units: Units | None = None) -> RestorePlan:
    wanted = of_bodies.for_body(it.plant, "3F", of_bodies.check_bodies(text), None, units)
    return await backups.plan(it.plant, wanted)


async def restored(
    it: Rig, text: str, *, flash: bool = False, wait_s: float = 3000.0, units: Units | None = None
) -> Restore:
    wanted = of_bodies.for_body(it.plant, "3F", of_bodies.check_bodies(text), None, units)
    return await backups.start(it.plant, wanted, flash, False, wait_s)


async def read(it: Rig) -> str:
    return await backups.text(of_bodies.of_body(it.plant, "3F"))


def parts(text: str, *names: str) -> str:
    """The sections of these names."""
    body, *sections = text.split("\n[")
    return "\n[".join([body, *(it for it in sections if it.startswith(("body", *names)))])


def swap(it: Rig) -> None:
    """Put a new controller in the place of the old one."""
    now = asyncio.get_running_loop().time()
    it.machine.switch_body(0x3F, on=False, now=now)
    axis = it.axis()
    axis.flash = type(axis.flash)()
    it.machine.switch_body(0x3F, on=True, now=now)
    it.wire.turn()


@in_virtual_time
async def test_a_backup_has_all_that_a_body_keeps_in_a_stable_order() -> None:
    async with one_body() as it:
        await teach(it)
        text = await read(it)
        lines = [line.partition(" ;")[0].strip() for line in text.splitlines()]
        kept = [it for it in TAUGHT if it[:3] not in ("UWS", "UCS")]
        assert set(lines) >= {*kept, "*BLINK", "SET OD0", "WAT 5", "END"}
        assert "OLSS[4],100                   ; start speed, pps" in text
        assert not any(line[5:] and is_mark(line[5:]) for line in lines if line.startswith("9VS"))
        assert await read(it) == text
        assert (await planned(it, text)).differences == []


@in_virtual_time
async def test_a_share_of_zero_is_written_to_a_set_that_only_has_speeds() -> None:
    async with one_body() as it:
        text = "[body 3F]\n[speed-sets]\nOLSS[4],100\nOHSS[4],5000\nOSSS[4],80000\nOASS[4],0\nOBSS[4],0\n"
        now = asyncio.get_running_loop().time()
        for command in ("OLSS[4],100", "OHSS[4],5000", "OSSS[4],80000"):
            it.axis().execute(command, now)
        wanted = text + "OLS50\nOHS50000\nOSS100000\nOAS50\nOBS50\n"
        assert (await planned(it, wanted)).commands == ["&3FOASS[4],0", "&3FOBSS[4],0"]
        over = await restored(it, wanted)
        assert (over.status, over.written) == ("verified", 2)
        assert (await planned(it, wanted)).commands == []
        assert (it.axis().settings.speeds[4].rising, it.axis().settings.speeds[4].falling) == (0, 0)


SCALED = Scale(unit="mm", pulses_per_unit=100.0)
AT_250 = "250 pulses/mm"


@in_virtual_time
async def test_a_backup_tells_places_by_their_names_and_in_the_unit_of_the_body() -> None:
    async with one_body() as it:
        it.plant.body("3F").configured = Configured(scale=SCALED)
        now = asyncio.get_running_loop().time()
        it.axis().execute("3PSP[3],-999999999", now)
        it.axis().execute("UDSD5,-77", now)
        await it.plant.names.name("line1.3F", {0: "home", 3: "far end"})
        text = await read(it)
        assert "\n[scale]\n100 pulses/mm\n" in text
        assert (
            "3PSP[0],0                     ; 0 mm, home\n3PSP[3],-999999999            ; -9999999.99 mm, far"
            in text
        )
        assert "UDSD5,-77 " in text
        assert (await planned(it, text)).differences == []


@pytest.mark.parametrize(("units", "pulses"), [("keep_pulses", 1200), ("convert", 3000)])
def test_a_backup_of_another_scale_is_refused_until_it_is_said_what_shall_stay(
    units: Units, pulses: int
) -> None:
    text = (
        "[body 3F]\n[scale]\n100 pulses/mm\n[settings]\nEPS-999999999,5000\n0SS20\n"
        "[speed-sets]\nOLSS[4],100\nOHSS[4],5000\nOSSS[4],80000\nOASS[4],30\nOBSS[4],0\n"
        "OLS50\nOHS50000\nOSS100000\nOAS50\nOBS50\n[positions]\n3PSP[7],1200 ; 12 mm\n3PSP[8],1\n"
    )

    @in_virtual_time
    async def story() -> None:
        async with one_body() as it:
            it.plant.body("3F").configured = Configured(scale=Scale(unit="um", pulses_per_unit=0.25))
            with pytest.raises(
                InvalidRequest, match=r"100 pulses/mm, and line1\.3F has 0\.25 pulses/um: the same"
            ):
                await planned(it, text)
            it.plant.body("3F").configured = Configured(scale=Scale(unit="mm", pulses_per_unit=250.0))
            with pytest.raises(InvalidRequest, match=AT_250):
                await restored(it, text)
            plan, over = await planned(it, text, units), await restored(it, text, units=units)
            assert over.status == "verified"
            for told in (plan, over):
                [scale] = told.scales
                assert (scale.backup, scale.controller, scale.units) == ("100 pulses/mm", AT_250, units)
            kept = it.axis().settings
            factor = pulses / 1200
            assert it.axis().positions[7] == pulses
            assert it.axis().positions[8] == round(factor)
            assert kept.movable_range == (-999_999_999, 5000 * factor)
            assert (kept.speeds[4].low, kept.speeds[4].high, kept.speeds[4].rising) == (
                100 * factor,
                5000 * factor,
                30,
            )
            assert (kept.speeds[4].acceleration, f"&3F0SS{20 * factor:g}" in plan.commands) == (
                80_000 * factor,
                True,
            )

    story()


@pytest.mark.parametrize(
    ("more", "why"),
    [
        ("[program]\n1AM50\nEND\n", r"\[program\] may have amounts in pulses"),
        ("[memories]\nUDSD0,5\n", "data memories"),
        ("[settings]\nEAS1\n", "encoder counts"),
        ("[positions]\n3PSP[7],900000000\n", r"comes to pulses 2250000000, which 3PS does not take"),
        ("[positions]\n3PSP[7],-999999999\n", r"comes to pulses -2499999998, which 3PS does not take"),
    ],
)
def test_what_no_scale_converts_is_refused_by_name(more: str, why: str) -> None:
    @in_virtual_time
    async def story() -> None:
        async with one_body() as it:
            it.plant.body("3F").configured = Configured(scale=Scale(unit="mm", pulses_per_unit=250.0))
            with pytest.raises(InvalidRequest, match=why):
                await planned(it, f"[body 3F]\n[scale]\n100 pulses/mm\n{more}", "convert")
            it.plant.body("3F").configured = Configured(scale=Scale(unit="deg", pulses_per_unit=100.0))
            with pytest.raises(InvalidRequest, match="one is not converted to the other"):
                await planned(it, f"[body 3F]\n[scale]\n100 pulses/mm\n{more}", "convert")

    story()


@in_virtual_time
async def test_a_dead_controller_is_swapped_by_one_file() -> None:
    async with one_body() as it:
        await teach(it)
        text, before = await read(it), it.axis().settings
        swap(it)
        plan = await planned(it, text)
        assert "&3F3PSP[2047],999999999" in plan.commands
        assert {"target": "line1.3F", "wanted": "0SS25", "held": "0SS10"}.items() <= next(
            found.model_dump().items() for found in plan.differences if found.name == "origin offset, pulses"
        )
        assert not it.executed("0SS25")[1:]
        over = await restored(it, text, flash=True)
        assert (over.status, over.differences, over.error) == ("verified", [], None)
        assert (over.saved, over.power_proved, over.written) == (True, True, over.commands)
        comments = it.axis().settings.comments  # the last has another mark
        assert replace(it.axis().settings, outputs=0) == replace(before, outputs=0, comments=comments)
        assert (it.axis().flash.settings.outputs, comments[:6]) == (0x8001, before.comments[:6])
        assert it.axis().flash.program == ("*BLINK", "SETOD0", "WAT5", "END")
        assert it.axis().flash.positions[2047] == 999_999_999
        assert [frame[3:6] for frame in it.wire.frames() if frame[3] == "F"] == ["FPS", "FUS", "FIS"]
        assert it.types("body.restore")[-1] == "body.restore.verified"


@in_virtual_time
async def test_a_restore_takes_away_what_the_backup_does_not_have() -> None:
    async with one_body() as it:
        text = parts(await read(it), "speed-sets", "patterns", "positions", "program")
        await teach(it)
        over = await restored(it, text)
        left = {found.wanted or found.held: found.restorable for found in over.differences or []}
        assert over.status == "differs"
        assert left == {
            **dict.fromkeys(("OLSS[4],100", "OHSS[4],5000", "OSSS[4],80000"), False),
            **dict.fromkeys(("OASS[4],30", "OBSS[4],0", "SPSA[2],A:S[4],D:S[4]"), False),
        }
        assert (it.axis().program, it.axis().positions[2047], it.axis().speed_changes) == ((), 0, {})


@in_virtual_time
async def test_what_depends_on_each_other_is_written_in_an_order_that_works() -> None:
    async with one_body() as it:
        await teach(it)
        text = parts(await read(it), "settings", "speed-sets", "patterns")
        wanted = text.replace("CESE,2,1", "CESE,3,1").replace("CESL,3,0", "CESL,2,0")
        wanted = wanted.replace("CPS8,1", "CPS8,2").replace("SESA[2],1,F20000", "SESA[2],1,F21000")
        over = await restored(it, wanted)
        assert (over.status, over.differences) == ("verified", [])
        assert (await planned(it, wanted)).commands == []


@in_virtual_time
async def test_a_backup_restored_is_verified_once_more_after_a_power_cycle() -> None:
    async with one_body() as it:
        contents = of_bodies.check_bodies(SMALL)
        wanted = of_bodies.for_body(it.plant, "3F", contents, None)
        with pytest.raises(InvalidRequest, match="lost with the power"):
            await backups.start(it.plant, wanted, False, True, 0.0)
        begun = await backups.start(it.plant, wanted, True, True, 60.0)
        assert (begun.status, begun.phase, begun.saved) == ("running", "awaiting_power_cycle", False)
        it.machine.brown_out(0x3F, 3.0, asyncio.get_running_loop().time())
        it.wire.turn()
        over = await ask(it.plant, "getBodyRestore", body_id="3F", restore_id="current", wait=60.0)
        assert (over.status, over.phase, over.saved, over.differences) == ("verified", "done", True, [])


@in_virtual_time
async def test_a_setting_that_is_not_named_is_left_as_it_is_and_a_table_is_complete() -> None:
    async with one_body() as it:
        await teach(it)
        over = await restored(it, "[body 3F]\n[settings]\n0SS12\n9VS2,\nCSS9\n[speed-sets]\nOHS45000\n")
        settings = it.axis().settings
        assert (settings.origin_offset, settings.comments[1]) == (12, "")
        assert settings.interrupt_sections[1] == (-999_999_999, 999_999_999)
        assert (settings.movable_range, settings.noise_counts[3]) == ((-500, 90_000), 7)
        assert (settings.speeds[30].low, settings.speeds[30].high) == (50, 45_000)
        assert {found.held for found in over.differences or []} == {
            *("OLSS[4],100", "OHSS[4],5000", "OSSS[4],80000", "OASS[4],30", "OBSS[4],0"),
        }


@in_virtual_time
async def test_reading_a_body_leaves_the_wire_no_rest_and_others_are_served() -> None:
    async with one_body(baud=9600) as it:
        now, taken = asyncio.get_running_loop().time, []
        sent, began = len(it.wire.sent), now()
        reading = asyncio.create_task(read(it))
        for _ in range(50):
            asked = now()
            await doing.do(it.plant, ME, "/bodies/3F", GetPosition())
            taken.append(now() - asked)
            await asyncio.sleep(0.2)
        await reading
        assert max(taken) < 0.25
        took_s = now() - began
        busy = sum(len(frame) + 1 for frame in it.wire.frames(sent))
        busy += sum(len(data) for at, data in it.wire.heard if at >= began)
        assert busy * it.wire.byte_time_s >= 0.95 * took_s
        assert took_s < 120.0


# in the way of others


@in_virtual_time
async def test_nothing_else_changes_a_body_meanwhile_and_reads_are_served_at_once() -> None:
    async with one_body(baud=9600) as it:
        await teach(it)
        text = await read(it)
        swap(it)
        await asyncio.sleep(5.0)
        begun = await restored(it, text, wait_s=0.0)
        await it.wire.begun("&3FOLSS[4],100")
        assert (begun.status, begun.phase) == ("running", "writing")
        for command in (SetStartSpeed(speed=70), MoveClockwise(distance=50)):
            with pytest.raises(BodyBusy, match=r"A backup is being restored to line1\.3F"):
                await doing.do(it.plant, ME, "/bodies/3F", command)
        with pytest.raises(BodyBusy, match="is being restored"):
            await read(it)
        with pytest.raises(BodyBusy, match="is being restored"):
            await restored(it, SMALL)
        with pytest.raises(BodyBusy, match=r"A backup is being restored to line1\.3F"):
            await ask(
                it.plant,
                "uploadProgram",
                body_id="3F",
                request=ProgramSource(source="END\n", flash=False),
                wait=0.0,
            )
        now, taken = asyncio.get_running_loop().time, []
        for _ in range(50):
            began = now()
            await doing.do(it.plant, ME, "/bodies/3F", GetPosition())
            taken.append(now() - began)
            await asyncio.sleep(0.1)
        assert max(taken) < 0.25
        over = await ask(it.plant, "getBodyRestore", body_id="3F", restore_id="current", wait=600.0)
        assert (over.status, over.differences) == ("verified", [])
        assert "body.restore.progress" in it.types("body.restore")


@in_virtual_time
async def test_a_stop_ends_a_restore_which_tells_what_differs() -> None:
    async with one_body(baud=9600) as it:
        begun = await restored(it, SMALL, wait_s=0.0)
        await it.wire.begun("&3FUWSEND")
        assert (begun.status, begun.phase) == ("running", "writing")
        began = asyncio.get_running_loop().time()
        await stopping.stop(it.plant, ME, "/bodies/3F", "immediate")
        [stop] = [sent for sent in it.wire.sent if sent.frame == "&3F5IS"]
        assert stop.at - began < 0.03
        over = await ask(it.plant, "getBodyRestore", body_id="3F", restore_id=begun.id, wait=60.0)
        assert over.status == "cancelled"
        assert over.error is not None
        assert "A stop came first" in over.error.detail
        assert over.differences == (await planned(it, SMALL)).differences != []


@in_virtual_time
async def test_a_cancelled_restore_tells_what_differs() -> None:
    async with one_body(baud=9600) as it:
        begun = await restored(it, SMALL, wait_s=0.0)
        await it.wire.begun("&3FUWSEND")
        over = await ask(it.plant, "cancelBodyRestore", body_id="3F")
        assert (over.id, over.status) == (begun.id, "cancelled")
        assert over.differences == (await planned(it, SMALL)).differences != []
        with pytest.raises(NotFound):
            await ask(it.plant, "cancelBodyRestore", body_id="3F")


@in_virtual_time
async def test_no_backup_is_restored_while_the_motor_moves() -> None:
    async with one_body() as it:
        for command in (
            SetStartSpeed(speed=50),
            SetMaximumSpeed(speed=500),
            SetMaximumAcceleration(acceleration=500),
        ):
            await doing.do(it.plant, ME, "/bodies/3F", command)
        await doing.do(it.plant, ME, "/bodies/3F", MoveClockwise(distance=50_000))
        with pytest.raises(BodyBusy, match="still has the move"):
            await restored(it, SMALL)


# what goes wrong


@pytest.mark.parametrize("direction", list(Direction))
def test_a_lost_frame_does_no_harm(direction: Direction) -> None:
    async def story() -> None:
        async with one_body() as it:
            restoring = asyncio.create_task(restored(it, SMALL))
            await it.wire.begun("&3FOLS60")
            lose(it, direction)
            over = await restoring
            assert (over.status, over.written) == ("verified", over.commands)

    run_virtual(story())


@in_virtual_time
async def test_a_body_that_stays_away_leaves_the_restore_failed() -> None:
    async with one_body(baud=9600) as it:
        await restored(it, SMALL, wait_s=0.0)
        await it.wire.begun("&3FUWSEND")
        it.machine.switch_body(0x3F, on=False, now=asyncio.get_running_loop().time())
        it.wire.turn()
        over = await ask(it.plant, "getBodyRestore", body_id="3F", restore_id="current", wait=600.0)
        assert (over.status, over.differences) == ("failed", None)
        assert over.error is not None


@in_virtual_time
async def test_a_refused_command_is_told_by_what_differs() -> None:
    async with one_body() as it:
        over = await restored(it, "[body 3F]\n[patterns]\nSESA[5],0,F100,S1000\n")
        assert [(found.wanted, found.held) for found in over.differences or []] == [
            ("SESA[5],0,F100,S1000", None)
        ]
        assert over.status == "differs"


@pytest.mark.parametrize("seed", range(8))
def test_on_a_bad_line_what_a_restore_tells_is_true(seed: int) -> None:
    dice = Random(seed)

    async def story() -> None:
        async with rig(bodies=(0x3F,), groups={}, seed=seed) as it:
            for number in range(5):
                wanted = Kept(number, ("*A", f"1AM{number}", "END"))
                for fault in (Fault.LOST, Fault.GARBLED, Fault.DOUBLED):
                    for direction in Direction:
                        it.machine.faults.set(Switch(fault, direction, probability=dice.uniform(0.0, 0.05)))
                try:
                    over = await restored(it, wanted.text())
                except GatewayError:  # it was not begun
                    continue
                finally:
                    it.machine.faults.clear()
                await asyncio.sleep(10.0)
                held = kept(it.axis(), whole=True)
                if over.differences is not None:
                    assert {(it.name, it.held) for it in over.differences} == wanted.missed_by(held)
                assert over.status != "verified" or held == wanted

    run_virtual(story())


async def one_cut(it: Rig, dice: Random, text: str, within: int = 0) -> Restore:
    """Restore a backup to a controller that loses its power at a random frame."""
    begun = await restored(it, text, flash=dice.random() < 0.5, wait_s=0.0)
    after, for_s = dice.randrange(within or (90 if "SPS" in text else 30)), dice.choice((0.02, 0.5, 4.0))
    write = it.wire.write

    def cut(data: bytes) -> None:
        nonlocal after
        after -= 1
        write(data)
        if after == 0:
            it.machine.brown_out(0x3F, for_s, asyncio.get_running_loop().time())
            it.wire.turn()

    it.wire.write = cut  # type: ignore[method-assign]
    try:
        over: Restore = await ask(it.plant, "getBodyRestore", body_id="3F", restore_id=begun.id, wait=600.0)
        return over
    finally:
        it.wire.write = write  # type: ignore[method-assign]


@pytest.mark.parametrize("seed", range(10))
def test_whenever_the_power_is_cut_a_restore_is_verified_or_tells_what_differs(seed: int) -> None:
    dice = Random(seed)

    async def story() -> None:
        async with one_body() as it:
            ends = []
            for number in range(50):
                whole = number % 5 == 0
                wanted = Kept(number % 30 if whole else None, ("*A", f"1AM{number}", "END"))
                over = await one_cut(it, dice, wanted.text())
                ends.append(over.status)
                held = kept(it.axis(), whole=whole)
                assert over.status == (
                    "differs" if held != wanted else "verified" if over.error is None else over.status
                )
                assert {(found.name, found.held) for found in over.differences or []} == wanted.missed_by(
                    held
                )
                if over.saved:
                    assert in_flash(it.axis(), whole=whole) == wanted
            assert {"verified", "differs"} <= set(ends)

    run_virtual(story())


@pytest.mark.parametrize("seed", range(3))
def test_a_swapped_controller_that_loses_its_power_holds_the_file_or_it_is_told_what_not(seed: int) -> None:
    dice = Random(seed)

    async def story() -> None:
        async with one_body() as it:
            await teach(it)
            text = parts(await read(it), "settings", "speed-sets", "patterns", "program")
            for _ in range(4):
                swap(it)
                await asyncio.sleep(5.0)
                over = await one_cut(it, dice, text, within=450)
                told = (await planned(it, text)).differences
                assert over.differences == told
                assert over.status == (
                    "differs" if told else "verified" if over.error is None else over.status
                )

    run_virtual(story())


class Kept(NamedTuple):
    """The content of a small backup, and of a controller."""

    deceleration: int | None
    program: tuple[str, ...]

    def text(self) -> str:
        patterns = (
            "" if self.deceleration is None else f"[patterns]\nSPSA[1],A:S[1],D:S[{self.deceleration}]\n"
        )
        program = "\n".join(self.program)
        return f"[body 3F]\n{patterns}[program]\n{program}\n"

    def missed_by(self, held: "Kept") -> set[tuple[str, str | None]]:
        """Differences that have to be reported."""
        lines = zip_longest(self.program, held.program)
        missed: set[tuple[str, str | None]] = {
            (f"address {address}", found) for address, (line, found) in enumerate(lines) if line != found
        }
        if held.deceleration != self.deceleration:
            found = None if held.deceleration is None else f"SPSA[1],A:S[1],D:S[{held.deceleration}]"
            missed.add(("speed sets of a pattern", found))
        return missed


def kept(axis: Rc420, *, whole: bool) -> Kept:
    """Content of the RAM."""
    pattern = axis.settings.patterns[1]
    return Kept(pattern.deceleration if whole and pattern else None, axis.program)


def in_flash(axis: Rc420, *, whole: bool) -> Kept:
    """Content of the flash memory."""
    pattern = axis.flash.settings.patterns[1]
    return Kept(pattern.deceleration if whole and pattern else None, axis.flash.program)


# the text


@in_virtual_time
async def test_a_section_that_is_not_there_is_left_as_it_is() -> None:
    async with one_body() as it:
        await teach(it)
        over = await restored(it, "[body 3F]\n[memories]\nUDSD0,6 ; blanks and comments\n\n; are free\n")
        assert over.status == "verified"
        assert it.axis().positions[0] == -5
        assert {frame for frame in it.wire.frames() if frame[3:6] == "UDS"} == {
            *("&3FUDSD0,6", "&3FUDSD199,0", "&3FUDSC3,0"),
        }


# whose it is


@in_virtual_time
async def test_a_backup_of_a_line_has_all_its_bodies_and_goes_back_to_chosen_ones() -> None:
    async with rig(bodies=(0x00, 0x01), groups={}) as it:
        await teach(it, 0x01)
        text = await backups.text(of_bodies.of_line(it.plant, "line1"))
        contents = of_bodies.check_bodies(parts(text, "settings", "program"))
        assert list(contents) == [0x00, 0x01]
        await teach(it, 0x00)
        every = await backups.plan(it.plant, of_bodies.for_line(it.plant, "line1", contents, None))
        assert {found.target for found in every.differences} == {"line1.00"}
        one = of_bodies.for_line(it.plant, "line1", contents, ["01"])
        over = await backups.start(it.plant, one, False, False, 3000.0)
        assert (over.status, over.target, over.controllers) == ("verified", "/lines/line1", ["line1.01"])
        assert it.types("line.restore") == ["line.restore.started", "line.restore.verified"]
        assert await ask(it.plant, "getLineRestore", line_id="line1", restore_id=over.id, wait=0.0) is over


@in_virtual_time
async def test_a_line_is_backed_up_without_those_who_do_not_answer_only_when_that_is_said() -> None:
    async with rig(bodies=(0x00, 0x01), present=(0x01,), groups={}) as it:
        sent = len(it.wire.sent)
        with pytest.raises(GatewayError, match="00"):
            await backups.text(of_bodies.of_line(it.plant, "line1"))
        assert not [frame for frame in it.wire.frames(sent) if frame[3:6] == "EAD"]
        text = await backups.text(of_bodies.of_line(it.plant, "line1", ["01"]))
        assert list(of_bodies.check_bodies(text)) == [0x01]


@in_virtual_time
async def test_a_backup_of_another_body_is_taken_only_when_that_is_said() -> None:
    async with rig(bodies=(0x00, 0x3F), groups={}) as it:
        contents = of_bodies.check_bodies(SMALL)
        with pytest.raises(InvalidRequest, match="nothing of body 00; there is 3F"):
            of_bodies.for_body(it.plant, "00", contents, None)
        wanted = of_bodies.for_body(it.plant, "00", contents, "3F")
        assert (await backups.start(it.plant, wanted, False, False, 600.0)).status == "verified"
        assert it.axis(0x00).program == ("*A", "1AM50", "END")
        for chosen in (["00"], ["01"]):
            with pytest.raises((InvalidRequest, NotFound)):
                of_bodies.for_line(it.plant, "line1", contents, chosen)


@in_virtual_time
async def test_a_text_of_somebody_in_the_comment_of_the_mark_is_kept_and_no_power_is_proved() -> None:
    async with one_body() as it:
        over = await restored(it, "[body 3F]\n[settings]\n9VS7,ours\n")
        assert (over.status, over.power_proved) == ("verified", False)
        assert it.axis().settings.comments[6] == "ours"
