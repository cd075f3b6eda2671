"""A fault of the gateway itself amid long work: the record says how far it had come; it may begin anew."""

import asyncio
from collections.abc import Sequence
from typing import Any

import pytest

from gateway.core import backups as readings
from gateway.core import restores
from gateway.core.backup_record import Restore
from gateway.core.errors import Cancelled
from gateway.core.origin import Origin
from gateway.core.works import OWN_FAULT
from gateway.door import backups
from gateway.fics.backup_restore import RobotRestore
from gateway.fics.door import backups as of_robots
from gateway.rorze import positions, program_uploads
from gateway.rorze.door import backups as of_bodies
from gateway.rorze.door.programs import ProgramSource
from gateway.rorze.positions import NamedPosition, TablePosition, WantedPosition
from gateway.rorze.program_runs import ProgramRuns
from gateway.rorze.program_uploads import ProgramUploads
from gateway.rorze.scans import Scans
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.programs import RunProgram
from tests.fics_plants import FicsRig, fics_rig
from tests.own_faults import Place, fail_once
from tests.plants import Rig, finished, in_virtual_time, rig
from tests.through_the_door import ask

ME = Origin("test")
LONGEST_S = 60.0
SOURCE = "".join(f"SETOD{number % 16}\n" for number in range(60))
SPEEDS = "".join(f"OLSS[{it}],60\nOHSS[{it}],40000\nOSSS[{it}],90000\n" for it in range(4))
TABLE = "".join(f"{number} X={number} Z=-7\n" for number in range(1, 12))
WAITING = ("*W", "WAT50", "JMP*W")
MOVE = MoveClockwise(distance=300)


async def upload(it: Rig) -> program_uploads.ProgramUpload:
    wanted = ProgramSource(source=SOURCE, flash=True)
    begun: program_uploads.ProgramUpload = await ask(
        it.plant, "uploadProgram", body_id="3F", request=wanted, wait=LONGEST_S
    )
    return begun


async def restore(it: Rig) -> Restore:
    found = of_bodies.check_bodies(f"[body 3F]\n[speed-sets]\n{SPEEDS}")
    wanted = of_bodies.for_body(it.plant, "3F", found, None)
    return await backups.start(it.plant, wanted, False, False, LONGEST_S)


async def restore_robot(it: FicsRig) -> Restore:
    found = of_robots.check_robot(it.plant, "r1", f"[robot r1]\n[unit 1 positions]\n{TABLE}")
    wanted = of_robots.for_robot(it.plant, "r1", found)
    return await backups.start(it.plant, wanted, False, False, LONGEST_S)


@pytest.mark.parametrize(
    ("place", "stored"),
    [
        ((program_uploads, "_clear"), "Nobody knows whether the former program was cleared in RAM."),
        ((program_uploads, "_add"), "RAM holds the first 0 of 60 instructions, and perhaps one more."),
        ((ProgramUploads, "_verify"), "All 60 instructions were sent, and 0 of them were read back"),
        ((program_uploads, "_save"), "Nobody knows what flash memory holds."),
    ],
    ids=["clearing", "writing", "verifying", "saving"],
)
@in_virtual_time
async def test_an_upload_that_a_fault_has_ended_says_what_it_has_left(
    place: Place, stored: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(groups={}) as it:
        assert fail_once(monkeypatch, place) == []
        record = await upload(it)
        assert (record.status, record.ended_at is None) == ("failed", False)
        assert stored in record.stored
        assert record.error is not None
        assert (record.error.type, record.error.remedy) == (OWN_FAULT.kind, "Upload the program again.")
        assert "body.program.upload.failed" in it.types()
        assert (await upload(it)).status == "succeeded"
        assert (await finished(it, MOVE)).status == "succeeded"


@pytest.mark.parametrize("name", ["_written", "_compared", "_found_out", "_status"])
@pytest.mark.parametrize("family", ["body", "robot"])
@in_virtual_time
async def test_a_restore_that_a_fault_has_ended_says_how_far_it_had_come(
    name: str, family: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    if name == "_found_out":
        monkeypatch.setattr(restores, "_written", cancelled)
    async with rig(groups={}) as body, fics_rig() as robot:
        fail_once(monkeypatch, (restores, name))
        record = await (restore(body) if family == "body" else restore_robot(robot))
        assert (record.status, record.differences, record.ended_at is None) == ("failed", None, False)
        assert record.error is not None
        assert record.error.type == OWN_FAULT.kind
        assert "nobody knows what" in record.error.detail
        monkeypatch.undo()
        record = await (restore(body) if family == "body" else restore_robot(robot))
        assert record.status in ("verified", "differs")


async def cancelled(*_: Any) -> Sequence[Any]:
    raise Cancelled("As asked.", "Begin anew.")


@in_virtual_time
async def test_a_robot_that_a_fault_has_met_amid_writing_is_free_again(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with fics_rig() as it:
        fail_once(monkeypatch, (RobotRestore, "write"))
        assert (await restore_robot(it)).status == "failed"
        assert not it.plant.fics.restores.is_under_way("r1")


@in_virtual_time
async def test_readings_and_stored_tables_that_a_fault_has_ended_say_so(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with rig(groups={}) as it:
        fail_once(monkeypatch, (readings, "_read"))
        backup = await backups.read(it.plant, of_bodies.of_body(it.plant, "3F"), LONGEST_S)
        assert (backup.status, backup.error and backup.error.type) == ("failed", OWN_FAULT.kind)
        assert (
            await backups.read(it.plant, of_bodies.of_body(it.plant, "3F"), LONGEST_S)
        ).status == "succeeded"

        async def nobody(_: Sequence[TablePosition]) -> list[NamedPosition]:
            return []

        fail_once(monkeypatch, (positions, "_set"))
        table = [WantedPosition(number, number + 1) for number in range(10)]
        stored = it.plant.rorze.position_uploads.start(it.body(), table, flash=False, named=nobody)
        await it.plant.rorze.position_uploads.wait(stored, LONGEST_S)
        assert stored.error is not None
        assert (stored.status, stored.error.type) == ("failed", OWN_FAULT.kind)


@pytest.mark.parametrize("name", ["_look", "_end"])
@in_virtual_time
async def test_a_program_that_runs_is_followed_on_after_a_fault(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with rig(groups={}) as it:
        it.axis().program = WAITING
        failed = fail_once(monkeypatch, (ProgramRuns, name))
        run = await it.plant.rorze.runs.start(it.body(), RunProgram())
        await asyncio.sleep(3.0)
        await it.plant.stops.stop([it.body()], "immediate")
        await it.plant.rorze.runs.wait(run, 10.0)
        assert failed
        assert (run.status, run.end_cause) == ("ended", "stopped")
        assert not it.body().life.in_program


@in_virtual_time
async def test_a_scan_that_a_fault_has_ended_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    async with rig(groups={}) as it:
        fail_once(monkeypatch, (Scans, "_ask_everybody"))
        scan = it.plant.scans.start(it.plant.line("line1"))
        await it.plant.scans.wait(scan, 1.0)
        assert (scan.status, scan.error) == ("failed", f"{OWN_FAULT.what}.")
        assert "line.scan.failed" in it.types()
