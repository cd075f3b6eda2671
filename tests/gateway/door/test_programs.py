"""User programs of bodies: uploaded whole or said not to be, run, followed and stopped."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from gateway.core.errors import BodyBusy, GatewayError, InvalidRequest, InvalidText, NotFound, PowerCycled
from gateway.core.journal.intents import Intents
from gateway.core.origin import Origin
from gateway.door import doing, stopping
from gateway.rorze import stored_program
from gateway.rorze.door.programs import ProgramSource, RunRequest, check
from gateway.rorze.errors import PartlyDone
from gateway.rorze.memories import write
from gateway.rorze.program_uploads import ProgramUpload
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from protocols.rorze.programs import AddProgramInstruction, RunProgram
from protocols.rorze.speeds import SetMaximumAcceleration, SetMaximumSpeed, SetStartSpeed
from protocols.rorze.user_program.assembler import assemble
from simulator.faults import Direction, Fault, Switch
from tests.model_book import ModelBook
from tests.plants import Rig, in_virtual_time, lose, rig
from tests.protocols.rorze.user_program.examples import INSTRUCTIONS
from tests.through_the_door import ask
from tests.virtual_time import run_virtual

ME = Origin("test")
BLINK = "*BLINK\n  SET OD0 ; on\n  WAT 5\n  RST OD0\n  END\n"
LONG = "".join(f"LD D{number % 200}, {number}\n" for number in range(300))
WAITING = "*W\n  WAT 50\n  JMP *W\n"


@asynccontextmanager
async def one_body(baud: int | None = None) -> AsyncIterator[Rig]:
    async with rig(bodies=(0x3F,), groups={}, baud=baud) as it:
        yield it


async def uploaded(it: Rig, source: str, *, flash: bool = False, wait_s: float = 600.0) -> ProgramUpload:
    wanted = ProgramSource(source=source, flash=flash)
    upload: ProgramUpload = await ask(it.plant, "uploadProgram", body_id="3F", request=wanted, wait=wait_s)
    return upload


def changes(it: Rig) -> list[str]:
    """Frames that change a program, start one or write flash memory."""
    return [frame for frame in it.wire.frames() if frame[3:6] in {"UCS", "UWS", "FUS", "URG", "USG"}]


# uploads


@in_virtual_time
async def test_a_program_is_uploaded_and_read_back() -> None:
    async with one_body() as it:
        upload = await uploaded(it, BLINK)
        assert (upload.status, upload.written, upload.verified, upload.error) == ("succeeded", 5, 5, None)
        assert upload.stored == "RAM holds the program: 5 instructions, read back. Flash memory is as it was."
        assert changes(it) == [
            "&3FUCS",
            *(f"&3FUWS{text}" for text in ("*BLINK", "SETOD0", "WAT5", "RSTOD0", "END")),
        ]
        stored = await ask(it.plant, "getProgram", body_id="3F")
        assert stored.source == "*BLINK\nSET OD0\nWAT 5\nRST OD0\nEND\n"
        assert (stored.labels, stored.running) == ({"BLINK": 0}, False)
        assert stored.steps == upload.steps
        first, *progress, last = it.types("body.program.upload")
        assert (first, last) == ("body.program.upload.started", "body.program.upload.succeeded")
        assert set(progress) <= {"body.program.upload.progress"}


@in_virtual_time
async def test_an_empty_program_empties_the_body() -> None:
    async with one_body() as it:
        await uploaded(it, BLINK)
        assert (await uploaded(it, "; nothing\n")).status == "succeeded"
        assert (await ask(it.plant, "getProgram", body_id="3F")).source == ""


@in_virtual_time
async def test_a_program_with_faults_is_refused_with_its_places_and_nothing_is_sent() -> None:
    async with one_body() as it:
        with pytest.raises(InvalidText, match="Line 2, column 7: There is no label") as refusal:
            await uploaded(it, "SET OD0\n  JMP *NOWHERE\n  FUS\n")
        assert [(fault.line, fault.column) for fault in refusal.value.faults] == [(2, 7), (3, 3)]
        assert not changes(it)


@in_virtual_time
async def test_an_upload_is_written_to_flash_memory_where_that_is_asked_for() -> None:
    async with one_body() as it:
        upload = await uploaded(it, BLINK, flash=True)
        assert (upload.saved, upload.phase, changes(it)[-1]) == (True, "done", "&3FFUS")
        assert upload.stored.endswith("Flash memory holds it too.")


@in_virtual_time
async def test_no_program_is_uploaded_while_one_runs_or_the_motor_moves() -> None:
    async with one_body() as it:
        await uploaded(it, WAITING)
        await ask(it.plant, "runProgram", body_id="3F", request=RunRequest(), wait=0.0)
        sent = len(changes(it))
        with pytest.raises(BodyBusy, match=r"A user program runs in .*; nothing was changed"):
            await uploaded(it, BLINK)
        await stopping.stop(it.plant, ME, "/bodies/3F", "decelerate")
        await teach_speeds(it)
        await doing.do(it.plant, ME, "/bodies/3F", MoveClockwise(distance=50_000))
        with pytest.raises(BodyBusy, match="still has the move"):
            await uploaded(it, BLINK)
        assert len(changes(it)) == sent


@in_virtual_time
async def test_while_a_program_is_uploaded_nothing_else_changes_it_and_reads_are_served_at_once() -> None:
    async with one_body(baud=9600) as it:
        await teach_speeds(it)
        upload = await uploaded(it, LONG, wait_s=0.0)
        await asyncio.sleep(2.0)
        for command in (
            AddProgramInstruction(instruction="END"),
            RunProgram(),
            MoveClockwise(distance=50),
        ):
            with pytest.raises(BodyBusy, match="A program is being uploaded to"):
                await doing.do(it.plant, ME, "/bodies/3F", command)
        with pytest.raises(BodyBusy, match="is being uploaded"):
            await ask(it.plant, "getProgram", body_id="3F")
        with pytest.raises(BodyBusy, match="is being uploaded"):
            await uploaded(it, BLINK)
        now, taken = asyncio.get_running_loop().time, []
        for _ in range(50):
            began = now()
            await doing.do(it.plant, ME, "/bodies/3F", GetPosition())
            taken.append(now() - began)
            await asyncio.sleep(0.1)
        assert max(taken) < 0.25
        assert upload.status == "running"
        over = await ask(it.plant, "getProgramUpload", body_id="3F", upload_id="current", wait=600.0)
        assert (over.status, over.verified) == ("succeeded", 300)
        assert "body.program.upload.progress" in it.types("body.program")


@in_virtual_time
async def test_an_upload_keeps_the_wire_busy_though_the_journal_takes_its_time() -> None:
    async with one_body(baud=9600) as it:
        line, book = it.body().line, ModelBook(takes_s=0.01)
        line.intents = Intents(book, line.address_of)
        loop = asyncio.get_running_loop()
        began, sent, heard = loop.time(), len(it.wire.sent), len(it.wire.heard)
        assert (await uploaded(it, LONG)).status == "succeeded"
        took_s = loop.time() - began
        told = sum(len(data) for _, data in it.wire.heard[heard:])
        asked = sum(len(frame) + 1 for frame in it.wire.frames(sent))
        assert (told + asked) * 10 / 9600 >= 0.95 * took_s
        intents = [intent["frame"] for _, intent in book.intents()]
        assert intents == [f"{frame}\r" for frame in changes(it)]
        assert len({at for at, _ in book.intents()}) < len(intents) / 10


@in_virtual_time
async def test_a_cancelled_upload_says_what_is_stored() -> None:
    async with one_body(baud=9600) as it:
        await uploaded(it, LONG, wait_s=2.0)
        over = await ask(it.plant, "cancelProgramUpload", body_id="3F")
        assert (over.status, over.phase) == ("cancelled", "writing")
        assert (
            over.stored
            == f"RAM holds the first {over.written} of 300 instructions. Flash memory is as it was."
        )
        assert over.written == (await ask(it.plant, "getProgram", body_id="3F")).instructions > 0
        with pytest.raises(NotFound):
            await ask(it.plant, "cancelProgramUpload", body_id="3F")


@in_virtual_time
async def test_a_stop_goes_first_and_ends_an_upload() -> None:
    async with one_body(baud=9600) as it:
        await uploaded(it, LONG, wait_s=2.0)
        began = asyncio.get_running_loop().time()
        stopped = await stopping.stop(it.plant, ME, "/bodies/3F", "immediate")
        assert stopped.confirmed
        [stop] = [sent for sent in it.wire.sent if sent.frame == "&3F5IS"]
        assert stop.at - began < 0.03
        over = await ask(it.plant, "getProgramUpload", body_id="3F", upload_id="current", wait=60.0)
        assert over.status == "cancelled"
        assert over.error is not None
        assert "A stop came first" in over.error.detail
        assert over.written == len(it.axis().program)


@pytest.mark.parametrize("direction", list(Direction))
def test_a_lost_frame_neither_doubles_nor_drops_an_instruction(direction: Direction) -> None:
    async def story() -> None:
        async with one_body() as it:
            uploading = asyncio.create_task(uploaded(it, BLINK))
            await it.wire.begun("&3FUWSWAT5")
            lose(it, direction)
            assert (await uploading).status == "succeeded"
            assert it.axis().program == check(BLINK).texts()

    run_virtual(story())


@in_virtual_time
async def test_a_body_that_holds_another_program_is_found_out_by_the_line() -> None:
    async with one_body() as it:
        uploading = asyncio.create_task(uploaded(it, BLINK))
        await it.wire.begun("&3FUPD0")
        it.axis().program = (*it.axis().program[:2], "WAT6", *it.axis().program[3:])
        over = await uploading
        assert (over.status, over.verified) == ("failed", 2)
        assert over.error is not None
        assert (over.error.type, over.error.line) == ("program-differs", 3)
        assert "address 2 of line1.3F holds WAT6, not WAT5" in over.error.detail


@in_virtual_time
async def test_an_upload_over_a_line_that_goes_down_says_what_is_stored() -> None:
    async with one_body(baud=9600) as it:
        await uploaded(it, LONG, wait_s=2.0)
        it.wire.unplug()
        over = await ask(it.plant, "getProgramUpload", body_id="3F", upload_id="current", wait=60.0)
        assert over.status == "failed"
        assert over.stored.startswith(f"RAM holds the first {over.written} of 300 instructions")


@in_virtual_time
async def test_a_body_that_falls_silent_leaves_one_instruction_in_doubt() -> None:
    async with one_body() as it:
        uploading = asyncio.create_task(uploaded(it, BLINK))
        await it.wire.begun("&3FUWSWAT5")
        it.axis().power_off(asyncio.get_running_loop().time())
        over = await uploading
        assert over.status == "failed"
        assert over.stored.startswith("RAM holds the first 2 of 5 instructions, and perhaps one more.")
        alarms = {alarm.cause: alarm for alarm in it.plant.alarms.standing()}
        failed = alarms["body.program.upload.failed"]
        assert over.stored in failed.en.motor
        assert [call.path for call in failed.next] == [f"/bodies/line1.3F/program/uploads/{over.id}"]


def cut_power(it: Rig) -> None:
    """Switch the body off and on, too quickly for its silence to be noticed."""
    now = asyncio.get_running_loop().time()
    it.axis().power_off(now)
    it.axis().power_on(now)


@pytest.mark.parametrize("frame", ["&3FUWSWAT5", "&3FUPD0", "&3FUPD3"])
def test_a_body_that_loses_its_power_amid_an_upload_holds_another_program(frame: str) -> None:
    async def story() -> None:
        async with one_body() as it:
            uploading = asyncio.create_task(uploaded(it, BLINK))
            await it.wire.begun(frame)
            cut_power(it)
            over = await uploading
            assert over.status == "failed"
            assert over.error is not None
            assert over.error.type == "power-cycled"
            assert over.stored.startswith("RAM holds what flash memory held, and perhaps some")

    run_virtual(story())


@in_virtual_time
async def test_a_loss_of_power_before_the_flash_memory_is_written_is_told() -> None:
    async with one_body() as it:
        uploading = asyncio.create_task(uploaded(it, BLINK, flash=True))
        await it.wire.begun("&3FFUS")
        cut_power(it)
        over = await uploading
        assert (over.status, over.phase, over.saved) == ("failed", "saving", False)
        assert over.error is not None
        assert over.error.type == "save-uncertain"
        assert over.stored.endswith("Nobody knows what flash memory holds.")


@pytest.mark.prove
@settings(max_examples=30)
@given(
    faults=st.dictionaries(
        st.tuples(st.sampled_from(Direction), st.sampled_from([Fault.LOST, Fault.GARBLED, Fault.DOUBLED])),
        st.floats(0.01, 0.2),
        max_size=3,
    ),
    seed=st.integers(0, 1000),
)
@example(
    faults={
        (Direction.REQUESTS, Fault.GARBLED): 0.125,
        (Direction.REQUESTS, Fault.DOUBLED): 0.125,
        (Direction.REPLIES, Fault.LOST): 0.09375,
    },
    seed=864,
)
@example(
    faults={
        (Direction.REQUESTS, Fault.DOUBLED): 0.09375,
        (Direction.REPLIES, Fault.LOST): 0.09375,
        (Direction.REPLIES, Fault.GARBLED): 0.1875,
    },
    seed=93,
)
def test_on_a_bad_line_what_an_upload_tells_is_true(
    faults: dict[tuple[Direction, Fault], float], seed: int
) -> None:
    async def story() -> None:
        texts = check(BLINK).texts()
        async with rig(bodies=(0x3F,), groups={}, seed=seed) as it:
            for (direction, fault), probability in faults.items():
                it.machine.faults.set(Switch(fault, direction, probability=probability))
            try:
                over = await uploaded(it, BLINK)
            except GatewayError:
                assert not changes(it)
                return
            it.machine.faults.clear()
            await asyncio.sleep(10.0)
            held = it.axis().program
            if over.status == "succeeded":
                assert held == texts
            elif over.phase == "writing" and "perhaps" not in over.stored:
                assert len(held) == over.written

    run_virtual(story())


@settings(max_examples=25)
@given(
    st.lists(INSTRUCTIONS, max_size=8).map("\n".join)
    | st.text("*+-0123456789ACDEHJLMNORSTWU,; \n", max_size=60)
)
def test_any_text_reads_back_identical_or_is_refused_with_a_place_and_nothing_sent(source: str) -> None:
    async def story() -> None:
        async with one_body() as it:
            if isinstance(assembled := assemble(source), tuple):
                with pytest.raises(InvalidText) as refusal:
                    await uploaded(it, source)
                places = [(fault.line, fault.column) for fault in refusal.value.faults]
                assert places == [(fault.line, fault.column) for fault in assembled]
                assert not changes(it)
                return
            assert (await uploaded(it, source)).status == "succeeded"
            stored = await stored_program.read(it.body())
            assert stored.instructions == it.axis().program == assembled.texts()
            assert check(stored.source).texts() == stored.instructions

    run_virtual(story())


# runs


async def teach_speeds(it: Rig) -> None:
    for command in (
        SetStartSpeed(speed=5_000),
        SetMaximumSpeed(speed=50_000),
        SetMaximumAcceleration(acceleration=100_000),
    ):
        await doing.do(it.plant, ME, "/bodies/3F", command)


@in_virtual_time
async def test_a_program_is_run_from_a_label_to_its_end() -> None:
    async with one_body() as it:
        await uploaded(it, BLINK)
        run = await ask(it.plant, "runProgram", body_id="3F", request=RunRequest(label="BLINK"), wait=0.0)
        state = await ask(it.plant, "getProgramState", body_id="3F")
        assert (state.running, state.line, state.instruction, state.run) == (True, 3, "WAT 5", run)
        over = await ask(it.plant, "getProgramRun", body_id="3F", run_id=run.id, wait=10.0)
        assert (over.status, over.end_cause, over.ended_at_address) == ("ended", "normal", 4)
        assert it.types("body.program.")[-2:] == ["body.program.started", "body.program.ended"]


@in_virtual_time
async def test_one_instruction_is_executed_at_a_time() -> None:
    async with one_body() as it:
        await uploaded(it, BLINK)
        for address in (2, 3):
            step = RunRequest(single_step=True, address=1 if address == 2 else None)
            run = await ask(it.plant, "runProgram", body_id="3F", request=step, wait=10.0)
            assert (run.end_cause, run.single_step) == ("single_step", True)
            if address == 2:
                assert run.ended_at_address == 2


@in_virtual_time
async def test_a_stop_ends_a_program_too() -> None:
    async with one_body() as it:
        await uploaded(it, WAITING)
        run = await ask(it.plant, "runProgram", body_id="3F", request=RunRequest(), wait=0.0)
        with pytest.raises(BodyBusy, match="is not over"):
            await ask(it.plant, "runProgram", body_id="3F", request=RunRequest(), wait=0.0)
        assert (await stopping.stop(it.plant, ME, "/bodies/3F", "decelerate")).confirmed
        over = await ask(it.plant, "getProgramRun", body_id="3F", run_id=run.id, wait=10.0)
        assert over.end_cause == "stopped"


@in_virtual_time
async def test_no_program_is_run_after_a_loss_of_power() -> None:
    async with one_body() as it:
        await uploaded(it, BLINK)
        it.body().power.lost(certain=True)
        with pytest.raises(PowerCycled):
            await ask(it.plant, "runProgram", body_id="3F", request=RunRequest(), wait=0.0)
        assert "&3FURG" not in it.wire.frames()


@in_virtual_time
async def test_an_unknown_run_is_not_found() -> None:
    async with one_body() as it:
        with pytest.raises(NotFound, match="has no program run"):
            await ask(it.plant, "getProgramRun", body_id="3F", run_id="0", wait=0.0)


# memories


@in_virtual_time
async def test_memories_of_which_only_some_were_set_are_told() -> None:
    async with one_body(baud=9600) as it:
        wanted = [(f"D{number}", number) for number in range(20)]
        task = asyncio.create_task(write(it.body(), wanted))
        await asyncio.sleep(0.5)
        it.machine.switch_body(0x3F, on=False, now=asyncio.get_running_loop().time())
        with pytest.raises(PartlyDone, match=r"took UDSD0,0, .* was not sent"):
            await task


@in_virtual_time
async def test_memories_are_set_and_read_by_the_ranges_of_their_banks() -> None:
    async with one_body() as it:
        wanted = [("d7", -5), ("C29", 9_999_999)]
        held = {memory.name: memory.value for memory in await write(it.body(), wanted)}
        assert held == {"D7": -5, "C29": 9_999_999}
        found = await ask(it.plant, "getMemories", body_id="3F", first="D6", count=2)
        assert [(memory.name, memory.value) for memory in found.memories] == [("D6", 0), ("D7", -5)]
        sent = len(it.wire.sent)
        for name, value in (("C0", -1), ("T0", 10_000_000), ("D0", 1_000_000_000), ("D200", 0), ("M0", 1)):
            with pytest.raises(InvalidRequest):
                await write(it.body(), [(name, value)])
        with pytest.raises(InvalidRequest, match="the last of T is T29"):
            await ask(it.plant, "getMemories", body_id="3F", first="T25", count=6)
        assert len(it.wire.sent) == sent
