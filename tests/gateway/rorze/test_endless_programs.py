"""Programs with a move that only a stop ends, where the configuration allows no such moves."""

import asyncio

import pytest

from gateway.core.errors import BodyBusy, ControllerRefused, InvalidText
from gateway.door import Door
from gateway.rorze.door.programs import check
from gateway.rorze.stored_program import has_no_end
from protocols.rorze.programs import AddProgramInstruction, RunProgram, StepProgram
from protocols.rorze.user_program.instruction import parse
from tests.plants import Rig, in_virtual_time, rig

BOUNDED = "allow_endless_moves = false"
ENDLESS = """
*S        ; the beginning
  1+M500
  2-MA[3],Z
  1+MZ
  END
"""


def sent(it: Rig, code: str) -> list[str]:
    return [frame for frame in it.wire.frames() if frame.startswith(f"&3F{code}")]


@pytest.mark.parametrize(
    ("text", "endless"),
    [
        ("1+MZ", True),
        ("1-MZ", True),
        ("2+MA[3],Z", True),
        ("2-MZ", True),
        ("1+M500", False),
        ("1+MP[5]", False),
        ("1+MD5", False),
        ("*Z", False),
        ("1AM500", False),
    ],
)
def test_a_move_without_an_end_is_told_from_others(text: str, endless: bool) -> None:
    assert has_no_end(parse(text)) is endless


@in_virtual_time
async def test_an_upload_is_refused_with_its_lines() -> None:
    async with rig(bodies=(0x3F,), groups={}, server=BOUNDED) as it:
        with pytest.raises(InvalidText, match="Line 4: The move has no end") as refused:
            await it.plant.rorze.uploads.start(it.body(), check(ENDLESS))
        assert [fault.line for fault in refused.value.faults] == [4, 5]
        assert not sent(it, "U")


@pytest.mark.parametrize("dry_run", [True, False])
def test_a_restore_is_refused_with_the_lines_of_the_backup(dry_run: bool) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig(bodies=(0x3F,), groups={}, server=BOUNDED) as it:
            text = "[body 3F]\n\n[program]\n1+M500\n1+MZ\nEND\n"
            door = Door(it.plant)
            with pytest.raises(
                InvalidText, match=r"Line 5: The move has no end.* Nothing was sent"
            ) as refused:
                await door.call("restoreBody", {"body_id": "3F"}, {"backup": text, "dry_run": dry_run})
            assert [fault.line for fault in refused.value.faults] == [5]
            assert not sent(it, "U")
            compared = await door.call("compareBody", {"body_id": "3F", "wait": 60}, {"backup": text})
            assert compared["status"] == "succeeded"

    story()


@in_virtual_time
async def test_a_program_that_is_there_already_is_not_started() -> None:
    async with rig(bodies=(0x3F,), groups={}, server=BOUNDED) as it:
        it.axis().program = ("*S", "1+MZ", "END")
        with pytest.raises(InvalidText, match=r"Line 2: .* was not started") as refused:
            await it.plant.rorze.runs.start(it.body(), RunProgram())
        assert [fault.line for fault in refused.value.faults] == [2]
        for command in (RunProgram(), StepProgram(address=1)):
            with pytest.raises(InvalidText):
                await it.plant.target("/bodies/3F").ask(command)
            with pytest.raises(BodyBusy, match="may have another program"):
                await it.body().ask(command)
        assert not sent(it, "URG")
        assert not sent(it, "USG")


@in_virtual_time
async def test_a_program_of_moves_with_ends_is_read_once_and_started() -> None:
    async with rig(bodies=(0x3F,), groups={}, server=BOUNDED) as it:
        it.axis().program = ("1+M500", "END")
        runs = it.plant.rorze.runs
        for _ in range(2):
            await runs.wait(await runs.start(it.body(), RunProgram()), 20.0)
        assert len(sent(it, "UPD")) == 2
        it.axis().program = ("1+M500",)
        await it.body().ask(AddProgramInstruction(instruction="1+MZ"))
        with pytest.raises(InvalidText, match="Line 2"):
            await runs.start(it.body(), RunProgram())


@in_virtual_time
async def test_a_loss_of_power_before_the_start_is_no_move_without_an_end() -> None:
    options = "needs_origin = false"
    async with rig(bodies=(0x3F,), groups={}, server=BOUNDED, body_options=options) as it:
        runs = it.plant.rorze.runs
        await it.body().ask(AddProgramInstruction(instruction="END"))
        await runs.wait(await runs.start(it.body(), RunProgram()), 20.0)
        it.machine.brown_out(0x3F, 0.02, asyncio.get_running_loop().time())
        await asyncio.sleep(0.1)
        with pytest.raises(BodyBusy, match="its power or line was away; URG"):
            await runs.start(it.body(), RunProgram())
        with pytest.raises(ControllerRefused, match="There is no user program"):
            await runs.start(it.body(), RunProgram())


@in_virtual_time
async def test_where_endless_moves_are_allowed_programs_are_not_looked_into() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        it.axis().program = ("1+MZ", "END")
        run = await it.plant.rorze.runs.start(it.body(), RunProgram())
        assert run.status == "running"
        assert not sent(it, "UPD")
        await it.plant.stops.stop([it.body()], "immediate")
