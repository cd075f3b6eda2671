"""A swap of a controller: the new one is recognised, compared with the last night, and made to hold it."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import pytest
from pydantic import ValidationError

from gateway.core.backup_record import Restore
from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.events import Event
from gateway.door import backups
from gateway.door.nightly import Nightly
from gateway.fics.door.backups import RobotComparisonRequest, compare_robot
from gateway.rorze.door.backups import (
    BodyComparisonRequest,
    BodyRestoreRequest,
    check_bodies,
    compare_body,
    of_body,
    restore_body,
)
from protocols.rorze.flash import SavePositions, SaveProgram, SaveSettings
from protocols.rorze.origin import SetOriginOffset
from tests.fics_plants import FicsRig, fics_rig
from tests.gateway.door.test_backups import swap, teach
from tests.gateway.door.test_nightly import AT_NIGHT
from tests.gateway.door.test_robot_backups import teach as teach_robot
from tests.plants import SET_UP_S, Rig, in_virtual_time, rig

RECOGNISED_S = 30.0
"""Seconds after which a controller that came back has been compared with its backup of the last night."""

MARKED_S = 20.0
"""Seconds after which the gateway has left its mark again, which the flash memory does not have."""


@asynccontextmanager
async def after_a_night(folder: Path, baud: int | None = None) -> AsyncIterator[Rig]:
    """A body that holds something of everything, as its backup of the last night has it."""
    async with rig(bodies=(0x3F,), groups={}, more=AT_NIGHT, baud=baud) as it:
        await asyncio.sleep(SET_UP_S)
        await teach(it)
        nightly = Nightly(it.plant, folder)
        await nightly.read_all()
        nightly.start()
        yield it
        await nightly.close()


async def save(it: Rig) -> None:
    """Let the body keep without power what it holds."""
    for command in (SavePositions(), SaveProgram(), SaveSettings()):
        await it.body().ask(command)
    await asyncio.sleep(MARKED_S)


def swaps(it: Rig | FicsRig) -> list[Event]:
    return [event for event in it.events() if event.type.endswith(".swapped")]


@in_virtual_time
async def test_a_factory_fresh_body_is_recognised_by_its_comment_and_its_settings(tmp_path: Path) -> None:
    async with after_a_night(tmp_path) as it:
        swap(it)
        await asyncio.sleep(RECOGNISED_S)
        [event] = swaps(it)
        assert (event.subject, event.data["certain"]) == ("/bodies/line1.3F", True)
        assert event.data["differing"] > len(event.data["told"]) == 5
        [alarm] = [alarm for alarm in it.plant.alarms.standing() if alarm.cause == "body.swapped"]
        assert "It is another controller" in alarm.en.happened
        assert "別のコントローラです" in alarm.ja.happened
        [call] = [call for call in alarm.next if call.path.endswith("/comparisons")]
        assert (call.path, call.body) == ("/bodies/line1.3F/comparisons", {"nightly": "last"})


@in_virtual_time
async def test_the_same_body_that_kept_everything_is_no_other(tmp_path: Path) -> None:
    async with after_a_night(tmp_path) as it:
        await save(it)
        now = asyncio.get_running_loop().time()
        it.machine.brown_out(0x3F, 1.0, now)
        it.wire.turn()
        await asyncio.sleep(RECOGNISED_S)
        assert it.types("body.power_cycled")[:1] == ["body.power_cycled"]
        assert swaps(it) == []


@in_virtual_time
async def test_settings_that_were_never_saved_may_be_lost_or_those_of_another(tmp_path: Path) -> None:
    async with after_a_night(tmp_path) as it:
        await it.body().ask(SetOriginOffset(offset=77))
        await save(it)
        now = asyncio.get_running_loop().time()
        it.machine.brown_out(0x3F, 1.0, now)
        it.wire.turn()
        await asyncio.sleep(RECOGNISED_S)
        [event] = swaps(it)
        assert (event.data["certain"], event.data["differing"]) == (False, 1)
        assert event.data["told"] == ["0SS25 -> 0SS77"]


async def restored(it: Rig, **wanted: object) -> Restore:
    over = await restore_body(
        it.plant, "3F", BodyRestoreRequest.model_validate({"nightly": "last", **wanted}), wait=3000.0
    )
    assert isinstance(over, Restore)
    return over


@pytest.mark.parametrize("baud", [9600, 38400])
def test_it_is_told_what_differs_and_how_long_a_restore_takes(tmp_path: Path, baud: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with after_a_night(tmp_path, baud) as it:
            swap(it)
            await asyncio.sleep(RECOGNISED_S)
            wanted = BodyComparisonRequest(nightly="last")
            begun = await compare_body(it.plant, "3F", wanted)
            await asyncio.sleep(0.1)
            before_s, loop = begun.left_s, asyncio.get_running_loop()
            began_at = loop.time()
            await it.plant.works.comparisons.wait(begun, 3000.0)
            assert before_s == pytest.approx(loop.time() - began_at, rel=0.3)
            assert (begun.status, begun.baud, begun.left_s) == ("succeeded", baud, None)
            assert begun.differing is not None
            assert begun.differing.keys() >= {"settings", "positions", "speed-sets"}
            assert (begun.differing["positions"], begun.differing["program"]) == (2, 1)
            began_at = loop.time()
            over = await restored(it, flash=True)
            assert (over.status, over.saved, over.left_s) == ("verified", True, None)
            assert begun.restore_s == pytest.approx(loop.time() - began_at, rel=0.3)

    story()


@in_virtual_time
async def test_a_restore_tells_how_long_it_takes_still(tmp_path: Path) -> None:
    async with after_a_night(tmp_path, 9600) as it:
        swap(it)
        await asyncio.sleep(RECOGNISED_S)
        wanted = BodyRestoreRequest(nightly="last", without=["positions"])
        begun = await restore_body(it.plant, "3F", wanted)
        assert isinstance(begun, Restore)
        loop = asyncio.get_running_loop()
        told: list[tuple[float, float]] = []
        while begun.status == "running":
            told.append((loop.time(), begun.left_s or 0.0))
            await asyncio.sleep(2.0)
        middle = told[len(told) // 2]
        assert middle[1] == pytest.approx(loop.time() - middle[0], rel=0.5)


@in_virtual_time
async def test_without_positions_the_table_stays_as_it_is(tmp_path: Path) -> None:
    async with after_a_night(tmp_path) as it:
        swap(it)
        now = asyncio.get_running_loop().time()
        await asyncio.sleep(RECOGNISED_S)
        it.axis().execute("3PSP[5],77", now)
        over = await restored(it, without=["positions"])
        assert over.status == "verified"
        held = check_bodies(await backups.text(of_body(it.plant, "3F")))[0x3F].places
        assert [it.written() for it in held["positions"].values()] == ["P[5],77"]
        assert held["settings"]["0SD"].written() == "25"


@in_virtual_time
async def test_a_night_that_was_not_read_is_refused_and_so_are_two_backups(tmp_path: Path) -> None:
    async with after_a_night(tmp_path) as it:
        with pytest.raises(NotFound, match="line1/2020-01-01"):
            await compare_body(it.plant, "3F", BodyComparisonRequest(nightly="2020-01-01"))
        for given in ({}, {"backup": "[body 3F]", "nightly": "last"}):
            with pytest.raises(ValidationError, match="give backup or nightly"):
                BodyComparisonRequest.model_validate(given)
        everything = ["settings", "speed-sets", "patterns", "positions", "memories", "program"]
        left_out = BodyComparisonRequest.model_validate({"nightly": "last", "without": everything})
        with pytest.raises(InvalidRequest, match="without"):
            await compare_body(it.plant, "3F", left_out)


@in_virtual_time
async def test_a_robot_that_lost_its_positions_is_recognised_compared_and_restored(tmp_path: Path) -> None:
    async with fics_rig(units=2, more=AT_NIGHT) as it:
        teach_robot(it)
        nightly = Nightly(it.plant, tmp_path)
        await nightly.read_all()
        nightly.start()
        it.fics.units[1].positions.clear()
        it.brown_out(1.0)
        await asyncio.sleep(RECOGNISED_S)
        [event] = swaps(it)
        assert (event.subject, event.data["differing"]) == ("/robots/r1", 2)
        wanted = RobotComparisonRequest(nightly="last", without=["variables"])
        compared = await compare_robot(it.plant, "r1", wanted, wait=600.0)
        assert compared.differing == {"positions": 2}
        again = RobotComparisonRequest(nightly="last", without=["positions", "variables"])
        assert (await compare_robot(it.plant, "r1", again, wait=600.0)).differing == {}
        await nightly.close()
