"""A toy oven is asked for all that a firing needs, and for nothing twice, before the firing is written."""

import asyncio
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import pytest

from gateway.core.errors import NotSent
from gateway.core.preparation import Asked, Missing, prepare
from gateway.core.sequence_lock import SequenceLock
from tests.plants import in_virtual_time

History = Sequence[Asked[str, str]]


class Stale(NotSent):
    """The proof is too old."""


@dataclass
class Oven:
    """An oven that answers, and what is known of it."""

    answers: dict[str, list[str]]
    lock: SequenceLock = field(default_factory=SequenceLock)
    asked: list[str] = field(default_factory=list)
    door: str = ""
    """The state of the door as it was told last; a loss of power, or another host, would clear it."""

    async def ask(self, question: str) -> str:
        self.asked.append(question)
        await asyncio.sleep(1.0)
        answer = self.answers[question].pop(0)
        if question == "door?":
            self.door = answer
        return answer

    def door_closed(self, heard: History) -> str | None:
        """Ask for the door, close it once if it is open, and look again."""
        if self.door == "closed":
            return None
        if not heard or heard[-1].question == "close":
            return "door?"
        if any(asked.question == "close" for asked in heard):
            raise NotSent("The door stays open; nothing was sent.")
        return "close"

    @staticmethod
    def cold(heard: History) -> str | None:
        """Ask for the temperature each time."""
        if not heard:
            return "temperature?"
        if heard[-1].outcome == "hot":
            raise NotSent("The oven is hot; nothing was sent.")
        return None

    @property
    def needs(self) -> list[Missing[str, str]]:
        return [self.door_closed, self.cold]

    async def prepare(self) -> None:
        async with self.lock.held():
            await prepare(self.lock, self.needs, self.ask)


@in_virtual_time
async def test_what_is_missing_is_asked_for_in_its_order() -> None:
    oven = Oven({"door?": ["open", "closed"], "close": ["ok"], "temperature?": ["cold"]})
    await oven.prepare()
    assert oven.asked == ["door?", "close", "door?", "temperature?"]


@in_virtual_time
async def test_what_is_known_is_not_asked_for() -> None:
    oven = Oven({"temperature?": ["cold", "cold"]}, door="closed")
    await oven.prepare()
    oven.door = ""  # somebody has opened it
    oven.answers["door?"] = ["closed"]
    await oven.prepare()
    assert oven.asked == ["temperature?", "door?", "temperature?"]


@in_virtual_time
async def test_a_refusal_ends_the_preparation() -> None:
    oven = Oven({"door?": ["open", "open"], "close": ["ok"]})
    with pytest.raises(NotSent, match="stays open"):
        await oven.prepare()
    assert oven.asked == ["door?", "close", "door?"]


@in_virtual_time
async def test_a_later_need_is_looked_at_when_those_before_it_are_met() -> None:
    oven = Oven({"door?": ["closed"], "temperature?": ["cold"]})

    def needs() -> Iterator[Missing[str, str]]:
        yield oven.door_closed
        assert oven.asked == ["door?"]
        yield oven.cold

    async with oven.lock.held():
        await prepare(oven.lock, needs(), oven.ask)
    assert oven.asked == ["door?", "temperature?"]


@in_virtual_time
async def test_nothing_is_asked_while_somebody_else_could_write_in_between() -> None:
    oven = Oven({"door?": ["closed"], "temperature?": ["cold"]})
    with pytest.raises(RuntimeError, match="needs the sequence lock"):
        await prepare(oven.lock, oven.needs, oven.ask)
    holding = asyncio.create_task(oven.prepare())
    await asyncio.sleep(0.5)
    asked = list(oven.asked)
    with pytest.raises(RuntimeError, match="needs the sequence lock"):
        await prepare(oven.lock, oven.needs, oven.ask)
    assert oven.asked == asked
    await holding
