"""The security log at work: floods are counted, bursts are told, and a disk in trouble delays no caller."""

import asyncio
import errno
import os
from collections import Counter
from pathlib import Path

import pytest

from gateway.access.principal import Principal, asking
from gateway.access.roles import Role
from gateway.core.origin import Origin, acting
from gateway.security import entries
from gateway.security.chain import newest, verify
from gateway.security.entries import Entry, EntryType
from gateway.security.folding import LONGEST_S, SHORTEST_S
from gateway.security.log import AGAIN_S, Burst, Keeping, SecurityLog
from tests.plants import in_virtual_time

WRONG = "The key is not good."


def log_in(data: Path, **keeping: float) -> SecurityLog:
    return SecurityLog(data, Keeping(**keeping), asyncio.get_running_loop().time)  # type: ignore[arg-type]


def refuse(log: SecurityLog, address: str = "10.0.0.9", times: int = 1) -> None:
    for _ in range(times):
        with acting(Origin(f"http {address}", "r-1", address=address)):
            log.note(entries.SIGN_IN_REFUSED, "/sign-in", why=WRONG)


def refused(found: list[Entry]) -> int:
    return sum(it.count for it in found if it.type == "sign_in.refused")


@in_virtual_time
async def test_an_entry_names_its_caller_and_the_request(tmp_path: Path) -> None:
    log = log_in(tmp_path)
    who, origin = Principal("hanako", Role.ADMIN), Origin("hanako (http 10.0.0.9)", "r-7", address="10.0.0.9")
    with asking(who), acting(origin):
        await log.keep(entries.KEY_MADE, "mes", role="viewer", scope=None, expires_at=None)
    [entry] = newest(tmp_path, 10)  # on the disk when it is answered
    assert (entry.type, entry.caller, entry.address) == ("key.made", "hanako", "10.0.0.9")
    assert (entry.request_id, entry.target, entry.count) == ("r-7", "mes", 1)
    with acting(Origin("SIGHUP")):
        log.note(entries.RELOAD_REFUSED, why="no file")
    assert (await log.newest(1))[0].caller == "SIGHUP"


@in_virtual_time
async def test_of_a_flood_the_first_stand_singly_and_the_rest_are_counted(tmp_path: Path) -> None:
    log = log_in(tmp_path, refusals_per_minute=0)
    with acting(Origin("SIGHUP")):
        log.note(entries.KEY_REVOKED, "mes", role="viewer", scope=None)
    refuse(log, times=1500)
    refuse(log, "10.0.0.10")
    found = await log.newest(1000)
    assert refused(found) == 1501
    assert Counter(it.count for it in found if it.address == "10.0.0.9") == {1: 20, 1480: 1}
    assert Counter(it.count for it in found if it.address == "10.0.0.10") == {1: 1}
    [counted] = [it for it in found if it.count > 1]
    assert counted.since is not None
    assert found[-1].type == "key.revoked"  # nothing was pushed out


@in_virtual_time
async def test_counts_are_written_by_themselves_when_the_flood_is_over(tmp_path: Path) -> None:
    log = log_in(tmp_path)
    refuse(log, times=1500)
    await asyncio.sleep(2 * SHORTEST_S)
    assert refused(newest(tmp_path, 1000)) == 1500


@in_virtual_time
async def test_a_flood_of_a_day_from_many_addresses_takes_little_room(tmp_path: Path) -> None:
    log = log_in(tmp_path)
    for second in range(24 * 3600 // 10):
        refuse(log, f"10.{second % 7}.{second % 251}.9", times=3)
        refuse(log, f"2001:db8::{second:x}", times=3)
        await asyncio.sleep(10)
    found = await log.newest(100_000)
    assert refused(found) == 6 * 8640
    assert sum(path.stat().st_size for path in (tmp_path / "security").iterdir()) < 2_000_000
    assert log._foldings["sign_in.refused"].length_s == LONGEST_S
    await asyncio.sleep(8 * LONGEST_S)
    for _ in range(8):
        await asyncio.sleep(LONGEST_S)
        refuse(log)
    assert (await log.newest(1))[0].count == 1  # quiet again: each stands singly


@in_virtual_time
async def test_a_burst_of_refusals_is_told_once_while_it_lasts(tmp_path: Path) -> None:
    log = log_in(tmp_path, refusals_per_minute=10)
    told: list[Burst] = []
    log.on_burst = told.append
    for _ in range(20):
        refuse(log)
        await asyncio.sleep(6.1)
    assert (told, log.burst) == ([], None)
    refuse(log, times=200)
    [burst] = told
    assert (burst.refusals, burst.type, burst.address) == (11, "sign_in.refused", "10.0.0.9")
    assert log.burst is not None
    await asyncio.sleep(60)
    assert log.burst is None
    refuse(log, times=20)
    assert len(told) == 2
    await log.close()


@in_virtual_time
async def test_a_full_disk_is_told_and_what_waits_is_written_when_it_has_room(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    log = log_in(tmp_path)
    told: list[str | None] = []
    log.on_trouble = told.append

    def full(*_: object) -> int:
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as disk:
        disk.setattr("gateway.security.chain.os.write", full)
        disk.setattr("gateway.security.log.MOST_WAITING", 3)
        for number in range(5):
            await log.keep(entries.PORT_SCAN, f"port{number}", scan="1")
    assert told == ["No space left on device"]
    await asyncio.sleep(2 * AGAIN_S)
    assert told == ["No space left on device", None]
    lost, *kept = newest(tmp_path, 10)
    assert (lost.type, lost.data) == ("log.lost", {"lost": 2})
    assert [it.target for it in kept] == ["port2", "port1", "port0"]
    assert verify(tmp_path).fault is None


@in_virtual_time
async def test_the_end_is_the_last_entry(tmp_path: Path) -> None:
    log = log_in(tmp_path)
    refuse(log, times=30)
    await log.close()
    refuse(log)
    last, *others = newest(tmp_path, 100)
    assert (last.type, refused(others)) == ("gateway.ended", 30)


@in_virtual_time
async def test_without_a_directory_nothing_is_kept(tmp_path: Path) -> None:
    log = SecurityLog()
    refuse(log, times=50)
    assert log.burst is not None
    assert await log.newest(10) == []
    await log.close()


@in_virtual_time
async def test_an_entry_has_the_data_of_its_row_and_is_never_long(tmp_path: Path) -> None:
    log = log_in(tmp_path)
    with pytest.raises(TypeError, match=r"sign_in\.refused has the data \['why'\]"):
        log.note(entries.SIGN_IN_REFUSED, "/sign-in")
    log.note(entries.POSITION_NAMED, "x" * 100_000, names={str(it): "a" * 64 for it in range(1000)})
    await log.newest(1)
    [file] = (tmp_path / "security").glob("entries-*")
    assert file.stat().st_size < 6000


def test_each_type_says_when_it_is_written() -> None:
    types = [row for row in vars(entries).values() if isinstance(row, EntryType)]
    assert len(types) == len({row.name for row in types}) > 20
    for row in types:
        assert row.when
        assert not row.when.endswith(".")
