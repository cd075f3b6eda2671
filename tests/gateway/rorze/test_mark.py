"""The mark of a body's power: how it comes to stand; no late copy hides a loss of power."""

import asyncio

import pytest

from gateway.core.errors import NotSent
from gateway.core.exchange import Lane
from gateway.rorze.asked_body import is_mark
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import GetPositionEntry
from protocols.rorze.status import SetUserComment
from simulator.rorze.controller import Response
from tests.plants import Rig, in_virtual_time, rig

COMMENT = 7


def comment(rig: Rig) -> str:
    return rig.axis().settings.comments[COMMENT - 1]


def forget(rig: Rig) -> None:
    """Let the gateway know of no mark, as after a loss of power."""
    rig.axis().settings = rig.axis().settings.with_item("comments", COMMENT - 1, "")
    rig.body().power.lost(certain=True)


@in_virtual_time
async def test_a_mark_is_read_back_before_it_counts() -> None:
    async with rig() as it:
        forget(it)
        await it.body().mark.ensure(Lane.VERIFY)
        assert comment(it) == it.body().power.mark.text
        assert is_mark(comment(it))
        assert await it.body().mark.stands(Lane.VERIFY)


@in_virtual_time
async def test_a_copy_of_the_mark_that_waits_for_its_turn_is_not_written_later() -> None:
    async with rig(bodies=(0x3F,), groups={}, baud=9600) as it:
        mark = it.body().mark
        forget(it)
        slow = asyncio.create_task(mark.ensure(Lane.READ))
        await it.wire.begun("&3F9VD7")
        entries = [GetPositionEntry(entry=PositionReference(position=n)) for n in range(20)]
        crowd = [asyncio.create_task(it.body().ask(entry)) for entry in entries]
        await asyncio.sleep(0.1)
        await mark.ensure(Lane.VERIFY)
        sent = len(it.wire.sent)
        assert not slow.done()
        await asyncio.gather(*crowd, return_exceptions=True)
        await slow  # who was slower has a mark, too
        assert not [frame for frame in it.wire.frames(sent) if frame.startswith("&3F9VS")]
        assert await mark.stands(Lane.VERIFY)


@in_virtual_time
async def test_a_mark_that_was_saved_before_it_was_read_back_is_not_used() -> None:
    async with rig(baud=9600) as it:
        forget(it)
        writing = asyncio.create_task(it.body().mark.ensure(Lane.VERIFY))
        await it.wire.begun("&3F9VD7")
        await asyncio.sleep(0.05)  # its reply, and the writing
        saved = it.body().power.mark.candidate
        assert saved
        it.body().power.done(_save(), certain=False)
        await writing
        assert it.body().power.mark.text not in (None, saved)
        assert comment(it) == it.body().power.mark.text


def _save() -> SetUserComment:
    """A comment that another host writes there."""
    return SetUserComment(comment_number=COMMENT, text="something else")


@in_virtual_time
async def test_a_controller_that_never_keeps_a_mark_is_told_and_nothing_is_moved(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    async with rig() as it:
        forget(it)
        execute = it.axis().execute
        monkeypatch.setattr(
            it.axis(),
            "execute",
            lambda text, now: Response("") if text.startswith("9VS") else execute(text, now),
        )
        with pytest.raises(NotSent, match="did not keep a mark in user comment 7"):
            await it.body().mark.ensure(Lane.VERIFY)


@in_virtual_time
async def test_what_people_write_into_other_comments_is_not_dropped() -> None:
    async with rig(baud=9600) as it:
        forget(it)
        theirs = [
            SetUserComment(comment_number=2, text="GW-00000000"),
            SetUserComment(comment_number=3, text=""),
        ]
        asked = [asyncio.create_task(it.body().ask(row)) for row in theirs]
        await it.body().mark.ensure(Lane.VERIFY)
        await asyncio.gather(*asked)
        assert it.axis().settings.comments[1] == "GW-00000000"
