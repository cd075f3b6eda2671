"""Backups by night: what is quiet is read and kept, each with what it changes of the one before."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from datetime import datetime, timedelta, timezone
from pathlib import Path

import pytest

from gateway.config import parse
from gateway.core.errors import NotFound
from gateway.core.toml_files import ConfigError
from gateway.door.nightly import (
    QUIET_S,
    Nightly,
    get_nightly_backup,
    get_nightly_changes,
    keep,
    kept,
    list_nightly_backups,
    seconds_until,
)
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.speeds import SetMaximumSpeed
from tests.plants import SET_UP_S, Rig, configuration, in_virtual_time, rig, start

AT_NIGHT = '[backups]\nnightly_at = "02:30"\nkeep_days = 2\n'


@asynccontextmanager
async def by_night(folder: Path) -> AsyncIterator[tuple[Rig, Nightly]]:
    async with rig(more=AT_NIGHT) as it:
        await asyncio.sleep(SET_UP_S)
        yield it, Nightly(it.plant, folder)


def diffs(folder: Path) -> list[Path]:
    return list(folder.glob("*/*.diff"))


def today() -> str:
    return datetime.now().astimezone().date().isoformat()


@in_virtual_time
async def test_every_line_is_read_and_kept_and_given_again(tmp_path: Path) -> None:
    async with by_night(tmp_path) as (it, nightly):
        await nightly.read_all()
        [told] = (await list_nightly_backups(it.plant)).backups
        assert (told.target, told.date, told.changed) == ("line1", today(), None)
        text = (await get_nightly_backup(it.plant, "line1", today())).content
        assert "[body 3F]" in text
        with pytest.raises(NotFound, match=r"\.diff"):
            await get_nightly_changes(it.plant, "line1", today())
        for strange in ("..", "cell9"):
            with pytest.raises(NotFound):
                await get_nightly_backup(it.plant, strange, today())


@in_virtual_time
async def test_what_differs_from_the_night_before_stands_beside_it(tmp_path: Path) -> None:
    async with by_night(tmp_path) as (it, nightly):
        await it.body().ask(SetMaximumSpeed(speed_set=None, speed=4000))
        await nightly.read_all()
        yesterday = (datetime.now().astimezone() - timedelta(days=1)).date().isoformat()
        for file in (tmp_path / "line1").iterdir():
            file.rename(file.with_stem(yesterday))
        await it.body().ask(SetMaximumSpeed(speed_set=None, speed=5000))
        await nightly.read_all()
        changes = (await get_nightly_changes(it.plant, "line1", today())).content
        before, after = (line for line in changes.splitlines()[2:] if line[:1] in "+-")
        assert (before[0], "4000" in before, after[0], "5000" in after) == ("-", True, "+", True)
        newest, last = (await list_nightly_backups(it.plant)).backups
        assert (newest.date, newest.changed) == (today(), 2)
        assert (last.date, last.changed) == (yesterday, None)


@in_virtual_time
async def test_what_moves_is_waited_for(tmp_path: Path) -> None:
    async with by_night(tmp_path) as (it, nightly):
        move = await start(it, MoveClockwise(distance=100_000))
        began_at = asyncio.get_running_loop().time()
        await nightly.read_all()
        assert move.status == "succeeded"
        assert asyncio.get_running_loop().time() - began_at > QUIET_S
        assert len(kept(tmp_path)) == 1


@in_virtual_time
async def test_a_line_that_is_down_leaves_a_note_and_no_file(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async with by_night(tmp_path) as (it, nightly):
        it.wire.unplug()
        await asyncio.sleep(5.0)
        await nightly.read_all()
        assert kept(tmp_path) == []
        assert "the nightly backup of line1 was not kept" in caplog.text


@in_virtual_time
async def test_old_ones_are_forgotten(tmp_path: Path) -> None:
    keep(tmp_path, "line1", "2020-01-01", "old\n")
    keep(tmp_path, "line1", "2020-01-02", "older\n")
    assert [it.changed for it in kept(tmp_path)] == [2, None]
    async with by_night(tmp_path) as (_, nightly):
        await nightly.read_all()
        assert [it.date for it in kept(tmp_path)] == [today()]
        assert diffs(tmp_path) == [tmp_path / "line1" / f"{today()}.diff"]


@in_virtual_time
async def test_it_is_read_at_its_hour_night_after_night(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("gateway.door.nightly.seconds_until", lambda *_: 3600.0)
    async with by_night(tmp_path) as (_, nightly):
        nightly.start()
        await asyncio.sleep(3000.0)
        assert kept(tmp_path) == []
        await asyncio.sleep(3600.0)
        assert len(kept(tmp_path)) == 1
        await nightly.close()


def test_the_next_hour_is_today_or_tomorrow() -> None:
    japan = timezone(timedelta(hours=9))
    now = datetime(2026, 11, 28, 2, 0, tzinfo=japan)
    assert seconds_until("02:30", now) == 1800
    assert seconds_until("01:30", now) == 23.5 * 3600
    assert seconds_until("02:00", now) == 1.0


@in_virtual_time
async def test_where_none_are_read_there_are_none() -> None:
    async with rig() as it:
        with pytest.raises(NotFound, match="No backups are kept by night"):
            await list_nightly_backups(it.plant)


def test_an_hour_that_is_none_is_refused() -> None:
    with pytest.raises(ConfigError, match="must be a time such as 02:30"):
        parse(configuration() + '[backups]\nnightly_at = "25:00"\n', "test.toml")
