"""Backups of controllers that answer as they are told: how each ends, and its events."""

import asyncio
from dataclasses import dataclass

import pytest

from gateway.core.backup_record import Backup
from gateway.core.backups import Backups, commented, parts_of, section
from gateway.core.errors import BodyBusy, InvalidText, NoReply, NotFound
from gateway.core.readings import HISTORY, ProgressListener
from tests.plants import in_virtual_time

TARGET = "/machines/m"


@dataclass
class Machine:
    """A machine that answers `answers` questions, one a second."""

    address: str
    answers: int = 3
    baud: int | None = None
    scale: None = None
    is_known: bool = True
    is_ready: bool = True
    silent: bool = False

    async def require_ready(self) -> None:
        await asyncio.sleep(1.0)
        if not self.is_ready:
            raise BodyBusy("It is being restored.")

    async def read(self, progress: ProgressListener) -> str:
        progress.expect(self.answers if self.is_known else None)
        for _ in range(self.answers):
            await asyncio.sleep(1.0)
            if self.silent:
                raise NoReply("It does not answer.")
            progress.has_read()
        return f"[{self.address}]\n"


def backups() -> tuple[Backups, list[tuple[str, Backup]]]:
    told: list[tuple[str, Backup]] = []
    return Backups(lambda what, record: told.append((what, record))), told


async def over(of: Backups, *machines: Machine, target: str = TARGET) -> Backup:
    begun = await of.start(target, "; a backup\n", machines)
    await of.wait(begun, 100.0)
    return begun


@in_virtual_time
async def test_controllers_are_read_one_after_the_other() -> None:
    of, told = backups()
    record = await over(of, Machine("a"), Machine("b"))
    assert (record.status, record.text) == ("succeeded", "; a backup\n[a]\n[b]\n")
    assert (record.controllers, record.read, record.expected) == (["a", "b"], 6, 6)
    assert await of.get(TARGET, "current") is await of.get(TARGET, record.id) is record
    kinds = [what for what, _ in told]
    assert (kinds[0], set(kinds[1:-1]), kinds[-1]) == ("started", {"progress"}, "succeeded")
    assert {it.text for _, it in told} == {None}


@in_virtual_time
async def test_where_nobody_knows_how_much_there_is_it_says_so() -> None:
    of, _ = backups()
    assert (await over(of, Machine("a"), Machine("b", is_known=False))).expected is None


@in_virtual_time
async def test_a_controller_that_does_not_answer_leaves_no_backup() -> None:
    of, told = backups()
    record = await over(of, Machine("a"), Machine("b", silent=True))
    assert (record.status, record.text, record.controller) == ("failed", None, "b")
    assert record.error is not None
    assert (record.error.detail, told[-1][0]) == ("It does not answer.", "failed")


@in_virtual_time
async def test_a_controller_that_is_being_changed_is_not_read() -> None:
    of, told = backups()
    with pytest.raises(BodyBusy):
        await of.start(TARGET, "", [Machine("a"), Machine("b", is_ready=False)])
    with pytest.raises(NotFound):
        await of.get(TARGET, "current")
    assert told == []


@in_virtual_time
async def test_of_one_target_one_is_read_at_a_time() -> None:
    of, _ = backups()
    begun = await of.start(TARGET, "", [Machine("a")])
    with pytest.raises(BodyBusy, match="A backup of /machines/m is being read"):
        await of.start(TARGET, "", [Machine("a")])
    assert (await over(of, Machine("b"), target="/machines/n")).status == "succeeded"
    await of.wait(begun, 100.0)
    assert (await over(of, Machine("a"))).status == "succeeded"


@in_virtual_time
async def test_two_who_begin_at_once_do_not_both_read() -> None:
    of, _ = backups()
    begun = [of.start(TARGET, "", [Machine("a")]) for _ in range(2)]
    outcomes = await asyncio.gather(*begun, return_exceptions=True)
    assert sorted(type(it).__name__ for it in outcomes) == ["Backup", "BodyBusy"]
    await of.close()


@in_virtual_time
async def test_a_backup_is_cancelled_at_once() -> None:
    of, told = backups()
    with pytest.raises(NotFound):
        await of.cancel(TARGET)
    begun = await of.start(TARGET, "", [Machine("a", answers=100)])
    await asyncio.sleep(5.5)
    record = await of.cancel(TARGET)
    assert record is begun
    assert (record.status, record.read, told[-1][0]) == ("cancelled", 5, "cancelled")
    assert record.error is not None
    assert "by request" in record.error.detail


@in_virtual_time
async def test_the_end_of_the_gateway_ends_it() -> None:
    of, _ = backups()
    record = await of.start(TARGET, "", [Machine("a")])
    await asyncio.sleep(0.5)
    await of.close()
    assert record.error is not None
    assert (record.status, record.error.type) == ("cancelled", "shutting-down")


@in_virtual_time
async def test_the_newest_are_kept_and_what_is_under_way_is_never_forgotten() -> None:
    of, _ = backups()
    slow = await of.start("/machines/slow", "", [Machine("s", answers=1000)])
    kept = [await over(of, Machine("a", answers=1)) for _ in range(HISTORY + 3)]
    assert await of.get("/machines/slow", slow.id) is slow
    with pytest.raises(NotFound):
        await of.get(TARGET, kept[0].id)
    assert await of.get(TARGET, kept[-1].id) is kept[-1]
    await of.close()


TEXT = (
    "; a comment\n\n[body 3F] ; the lift\n[ settings ]\nA\n\n ; B\n[program]\n[body 40]\n[settings]\nC ; D\n"
)


def test_a_text_has_parts_and_these_have_sections() -> None:
    one, other = parts_of(TEXT, "body")
    assert (one.name, one.line, list(one.sections)) == ("3F", 3, ["settings", "program"])
    assert [tuple(line) for line in one.sections["settings"]] == [(5, "A"), (6, ""), (7, " ; B")]
    assert other.sections == {"settings": [(11, "C ; D")]}


def test_all_faults_are_told_in_the_order_of_the_lines() -> None:
    with pytest.raises(
        InvalidText, match=r"Line 1, column 1: A heading .* There are 4 faults in all"
    ) as refusal:
        parts_of("lost\n[settings]\n[body 1]\n[body 2]\n[a]\n[a]\n", "body")
    assert [fault.line for fault in refusal.value.faults] == [1, 2, 3, 6]


def test_what_is_written_is_aligned() -> None:
    assert section("a", [commented("X", "one"), commented("Y" * 40, "two")]) == (
        f"\n[a]\n{'X':30}; one\n{'Y' * 40} ; two\n"
    )
