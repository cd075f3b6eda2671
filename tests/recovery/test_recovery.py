"""Each story leads back to work in at most three taps, by the calls that the alarm itself offers."""

import asyncio
from pathlib import Path
from typing import Any, get_args

import pytest

from app.demo_faults import Kind
from tests.app.demo_plant import Demo, demo
from tests.recovery.page import PAGES, label_of
from tests.recovery.stories import DISK, END, HOME, STORIES, Story
from tests.virtual_time import run_virtual

NOTICED_S = 15.0
"""Seconds after which the gateway has seen the fault, or that it is mended."""
MOST_TAPS = 3
AWAY = {"kind": "relative", "direction": "cw", "distance": {"value": 50_000, "unit": "pulse"}, "pattern": 12}
STEP = {"kind": "relative", "direction": "cw", "distance": {"value": 500, "unit": "pulse"}}
AWAY_OF_ROBOT = {"kind": "relative", "axes": {"Z": {"value": 20, "unit": "mm"}}}
STEP_OF_ROBOT = {"kind": "relative", "axes": {"Z": {"value": 1, "unit": "mm"}}}


@pytest.mark.parametrize("place", ["line1", "r1"])
def test_the_alarm_leads_back_to_the_next_good_move(place: str) -> None:
    """They are played one after the other: none leaves anything behind."""

    async def played() -> None:
        async with demo() as running:
            for story in STORIES:
                if story.target.startswith(place):
                    await play(story, Player(running, story))

    run_virtual(played())


async def play(story: Story, player: "Player") -> None:
    first, *others = story.taps
    assert 1 + len(others) <= MOST_TAPS
    await player.prepare()
    await player.ask("POST", END, {"kind": story.kind, "target": story.target})
    await asyncio.sleep(NOTICED_S)
    if story.is_told_when_mended:
        await player.tap(first)
    alarm = await player.alarm()
    assert story.told in alarm["en"]["happened"], story.id
    if not story.is_told_when_mended:
        await player.tap(first)
    for tap in others:
        await player.tap(tap, alarm)
    await player.moves_again()
    await player.reset_alarms()


class Player:
    """An operator at the console, as the gateway sees the requests."""

    def __init__(self, running: Demo, story: Story) -> None:
        self.http = running.client
        self.story = story
        self.is_robot = story.target == "r1"
        self.moves = "/robots/r1/units/1/moves" if self.is_robot else "/bodies/line1.3F/moves"

    async def prepare(self) -> None:
        """Bring it to where the fault meets it."""
        if self.is_robot:
            await self.ask("POST", f"{self.moves}?wait=30", {"kind": "home"})
        if self.story.moving:
            await self.ask("POST", self.moves, AWAY_OF_ROBOT if self.is_robot else AWAY)
            await asyncio.sleep(0.3)

    async def alarm(self) -> dict[str, Any]:
        """Give the alarm that tells of the fault."""
        told = (await self.ask("GET", "/alarms"))["alarms"]
        return dict(next(alarm for alarm in told if alarm["cause"] == self.story.cause))

    async def tap(self, tap: str, alarm: dict[str, Any] | None = None) -> None:
        """Press a button: that of the panel, or one that the alarm offers."""
        if tap == END:
            await self.ask("DELETE", END)
            await asyncio.sleep(NOTICED_S)
        elif tap == HOME and self.is_robot:
            await self.ask("POST", f"{self.moves}?wait=30", {"kind": "home"})
        else:
            assert alarm is not None
            (call,) = [call for call in alarm["next"] if call["path"].endswith(tap)]
            assert call["en"].removesuffix(".") == label_of(self.story, tap)
            waits = "?wait=30" if tap == HOME else ""
            await self.ask(call["method"], call["path"] + waits, call.get("body"))

    async def moves_again(self) -> None:
        """See that the next move is a good one."""
        move = await self.ask("POST", f"{self.moves}?wait=20", STEP_OF_ROBOT if self.is_robot else STEP)
        assert move["status"] == "succeeded", move

    async def reset_alarms(self) -> None:
        """See that nothing stands any more, and tidy up."""
        await asyncio.sleep(NOTICED_S)
        for alarm in (await self.ask("GET", "/alarms"))["alarms"]:
            await self.ask("POST", f"/alarms/{alarm['id']}/reset")

    async def ask(self, method: str, path: str, content: Any = None) -> dict[str, Any]:
        answer = await self.http.request(method, path, json=content)
        assert answer.is_success, answer.text
        return dict(answer.json())


def test_each_kind_of_fault_has_a_story() -> None:
    assert set(get_args(Kind)) == {story.kind for story in (*STORIES, DISK)}


@pytest.mark.parametrize("file", PAGES, ids=lambda file: file.parent.name)
def test_the_pages_in_the_docs_are_up_to_date(file: Path) -> None:
    assert file.read_text("utf-8") == PAGES[file], "write it anew: python -m tests.recovery.page"
