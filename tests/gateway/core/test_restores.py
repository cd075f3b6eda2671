"""Restores of a controller that does as it is told: how each ends, and its events."""

import asyncio
from collections.abc import Callable

import pytest

from gateway.core.backup_record import BackupComparison, Difference, Restore
from gateway.core.backups import Comparisons
from gateway.core.errors import BodyBusy, GatewayError, NoReply, NotFound, NotSent, StoppedFirst
from gateway.core.restores import BACK_WITHIN_S, TOLD, Comparison, ComparisonListener, Restores, Watcher
from tests.plants import in_virtual_time

TARGET = "/machines/m"


class Machine:
    """Holds numbers, a backup of which has 1 for each; each deed takes a second."""

    address = "m"
    answers = 1
    baud = None
    scale = None

    def __init__(self, count: int = 1) -> None:
        self.held = [0] * count
        self.on_write: Callable[[], None] = lambda: None
        self.on_save: Callable[[], None] = lambda: None
        self.on_cycle: Callable[[], None] = lambda: None
        self.silent_until = 0.0
        self.writes = 1

    async def require_rest(self) -> None:
        await asyncio.sleep(1.0)

    async def compare(
        self, reader: ComparisonListener, *, lasting: bool = False, sure: bool = True
    ) -> Comparison:
        await asyncio.sleep(1.0)
        if asyncio.get_running_loop().time() < self.silent_until:
            raise NoReply("It does not answer.")
        reader.has_read()
        found = [
            Difference(target="m", section="a", name=str(it), wanted="1", held=str(held), restorable=True)
            for it, held in enumerate(self.held)
            if held != 1
        ]
        return Comparison([f"SET {it.name}" for it in found], found, proved=not lasting and sure)

    async def write(self, watcher: Watcher) -> None:
        for _ in range(self.writes):
            await asyncio.sleep(1.0)
            watcher.require_wanted()
        self.on_write()
        self.held = [1] * len(self.held)
        watcher.has_written()

    async def save(self, _: Watcher) -> None:
        self.on_save()

    async def power_cycled(self, _: Watcher) -> None:
        self.on_cycle()


def raising(error: GatewayError) -> Callable[[], None]:
    def deed() -> None:
        raise error

    return deed


def restores() -> tuple[Restores[Machine], list[tuple[str, Restore]]]:
    told: list[tuple[str, Restore]] = []
    return Restores(lambda what, record: told.append((what, record))), told


async def over(
    of: Restores[Machine], machine: Machine, *, flash: bool = False, power_cycle: bool = False
) -> Restore:
    begun = await of.start(TARGET, [machine], flash=flash, power_cycle=power_cycle)
    await of.wait(begun, 1000.0)
    return begun


@in_virtual_time
async def test_what_differs_is_written_and_read_back() -> None:
    of, told = restores()
    record = await over(of, Machine(), flash=True, power_cycle=True)
    assert (record.status, record.phase, record.differences, record.saved) == ("verified", "done", [], True)
    assert (record.commands, record.written, record.read) == (1, 1, 3)
    assert [what for what, _ in told if what != "progress"] == ["started", "verified"]
    assert await of.get(TARGET, "current") is await of.get(TARGET, record.id) is record
    with pytest.raises(NotFound):
        await of.get("/machines/other", record.id)


@in_virtual_time
async def test_where_nothing_differs_nothing_is_written() -> None:
    of, _ = restores()
    machine = Machine(0)
    assert (await of.plan(TARGET, [machine])).commands == []
    record = await over(of, machine)
    assert (record.status, record.written) == ("verified", 0)


@in_virtual_time
async def test_a_comparison_tells_what_a_restore_would_write_and_writes_nothing() -> None:
    of, _ = restores()
    machine = Machine(2)
    told: list[tuple[str, BackupComparison]] = []
    comparisons = Comparisons(lambda what, record: told.append((what, record)))
    begun = comparisons.start(TARGET, of, [machine])
    assert (begun.status, begun.commands) == ("running", None)
    with pytest.raises(BodyBusy, match="A comparison of /machines/m is being read"):
        comparisons.start(TARGET, of, [machine])
    await comparisons.wait(begun, 100.0)
    assert (begun.status, begun.commands, begun.read, begun.expected) == (
        "succeeded",
        ["SET 0", "SET 1"],
        1,
        1,
    )
    assert [it.name for it in begun.differences or ()] == ["0", "1"]
    assert machine.held == [0, 0]
    assert [(what, record.differences) for what, record in told if what != "progress"] == [
        ("started", None),
        ("succeeded", None),
    ]


@in_virtual_time
async def test_what_is_being_restored_is_not_compared() -> None:
    of, _ = restores()
    machine = Machine()
    await of.start(TARGET, [machine])
    with pytest.raises(BodyBusy, match="A backup is being restored to m"):
        Comparisons(lambda *_: None).start(TARGET, of, [machine])
    await of.close()


@in_virtual_time
async def test_a_controller_that_was_lost_is_read_when_it_is_back_and_events_stay_short() -> None:
    of, told = restores()
    machine = Machine(TOLD + 5)

    def go() -> None:
        machine.silent_until = asyncio.get_running_loop().time() + BACK_WITHIN_S / 2
        raise NoReply("It went.")

    machine.on_write = go
    begun = await over(of, machine)
    assert (begun.status, len(begun.differences or [])) == ("differs", TOLD + 5)
    assert begun.error is not None
    assert begun.error.detail == "It went."
    assert len(told[-1][1].differences or []) == TOLD


@in_virtual_time
async def test_a_controller_that_stays_away_leaves_nobody_wiser() -> None:
    of, _ = restores()
    machine = Machine()
    machine.silent_until = 10_000.0
    record = await over(of, machine)
    assert (record.status, record.differences) == ("failed", None)


@in_virtual_time
async def test_flash_memory_that_nobody_knows_of_is_no_success() -> None:
    of, _ = restores()
    machine = Machine()
    machine.on_save = raising(NoReply("No reply."))
    record = await over(of, machine, flash=True)
    assert (record.status, record.differences, record.saved) == ("failed", [], False)


@in_virtual_time
async def test_an_error_amid_a_restore_tells_what_had_been_written() -> None:
    of, _ = restores()
    machine = Machine()
    machine.on_save = raising(NotSent("It does not answer; nothing was sent."))
    record = await over(of, machine, flash=True)
    assert record.error is not None
    assert record.error.detail == "It does not answer. 1 of 1 commands had been written."


@in_virtual_time
async def test_a_power_cycle_that_was_not_seen_is_no_success() -> None:
    of, _ = restores()
    machine = Machine()
    machine.on_cycle = raising(BodyBusy("Nobody came."))
    record = await over(of, machine, flash=True, power_cycle=True)
    assert (record.status, record.differences, record.saved) == ("failed", [], True)


@in_virtual_time
async def test_a_stop_cancels_and_what_differs_is_told() -> None:
    of, _ = restores()
    machine = Machine()
    machine.on_write = raising(StoppedFirst())
    record = await over(of, machine)
    assert (record.status, len(record.differences or [])) == ("cancelled", 1)


@in_virtual_time
async def test_cancelled_twice_it_ends_at_once() -> None:
    of, _ = restores()
    machine = Machine()
    machine.writes = 100
    begun = await of.start(TARGET, [machine])
    await asyncio.sleep(3.0)
    machine.silent_until = 10_000.0
    assert (await of.cancel(TARGET)).status == "running"
    record = await of.cancel(TARGET)
    assert (record.id, record.status, record.differences) == (begun.id, "cancelled", None)
    with pytest.raises(NotFound, match="No backup is being restored"):
        await of.cancel(TARGET)


@in_virtual_time
async def test_what_was_broken_off_before_it_was_saved_is_not_called_saved() -> None:
    of, _ = restores()
    machine = Machine()
    machine.writes = 100
    begun = await of.start(TARGET, [machine], flash=True)
    await asyncio.sleep(3.0)
    machine.silent_until = 10_000.0
    await of.cancel(TARGET)
    await of.cancel(TARGET)
    machine.silent_until = 0.0
    ended = await of.start(TARGET, [machine], flash=True)
    await asyncio.sleep(3.0)
    await of.close()
    assert [(it.status, it.saved) for it in (begun, ended)] == [("cancelled", False)] * 2


@in_virtual_time
async def test_a_controller_has_one_restore_at_a_time_and_is_kept_for_it() -> None:
    of, told = restores()
    machine = Machine()
    starting = asyncio.create_task(of.start(TARGET, [machine]))
    await asyncio.sleep(0.5)
    assert of.amid("m") is machine
    with pytest.raises(BodyBusy, match="A backup is being restored to m"):
        await of.start(TARGET, [machine])
    with pytest.raises(BodyBusy):
        await of.plan(TARGET, [machine])
    begun = await starting
    await of.close()
    assert (begun.status, begun.error is not None, of.amid("m")) == ("cancelled", True, None)
    assert told[-1][0] == "cancelled"
