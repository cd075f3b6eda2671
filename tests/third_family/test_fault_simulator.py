"""The fault simulator judges the third family as it judges the others."""

import asyncio
import logging
import re
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from random import Random
from typing import Any
from unittest.mock import patch

import pytest

from gateway.access.principal import EVERYBODY, asking
from gateway.config import parse
from gateway.core.targets import AnyCommand
from gateway.families import FAMILIES
from protocols.table import Effect, Reply
from simulator.truth import Fact
from tests.drawing import drawn
from tests.fault_simulator.families import Family, Wish
from tests.fault_simulator.seed import COMMANDS, Report, Seed
from tests.fault_simulator.world import Cable
from tests.open_access import OPEN
from tests.third_family.family import Toys
from tests.third_family.machine import BY_BYTE, ToyMachine
from tests.third_family.rows import FRAME, Frame, GetStatus, Go, Home, SetSpeed, ToyCommand
from tests.third_family.session import ToyExchange
from tests.third_family.test_third_family import LINE, TOY
from tests.virtual_time import run_virtual

SEEDS, TOGETHER = 1_000, 10
DRAWN = 1
"""Tens of seeds that run in `make test`."""


def _bytes_of(text: str) -> bytes:
    """The frame that stands as text in the journal and in the history."""
    return re.sub(r"\\x([89a-f][0-9a-f])", lambda match: chr(int(match[1], 16)), text).encode("latin-1")


class ToyFamily(Family):
    """One axis."""

    name = "toy"
    topic = "toy"
    targets = (TOY,)

    def __init__(self, seed: int) -> None:
        self.config = parse(LINE + OPEN, "toy.toml")
        self.machine = ToyMachine(seed)

    def wish(self, dice: Random) -> Wish:
        command = dice.choice(
            (
                GetStatus(),
                SetSpeed(speed=dice.randint(100, 900)),
                Home(),
                Go(place=dice.randint(-500, 500)),
                Go(place=dice.randint(-5_000, 5_000)),
            )
        )
        return Wish(TOY, command)

    def effect_of(self, frame: str) -> Effect:
        return BY_BYTE[Frame(*FRAME.unpack_from(_bytes_of(frame))[1:]).code].effect

    def texts(self, written: str) -> Collection[Any]:
        return [_bytes_of(written)]

    def carries(self, frame: str, command: AnyCommand) -> bool:
        written = Frame(*FRAME.unpack_from(_bytes_of(frame))[1:])
        return isinstance(command, ToyCommand) and command.frame(written.number) == written.packed()

    def reach(self, _path: str) -> frozenset[str]:
        return frozenset({TOY})

    def has_done(self, fact: Fact, command: AnyCommand) -> bool:
        return self.was_taken(fact) and fact.facts["what"] == command

    def was_taken(self, fact: Fact) -> bool:
        return fact.kind == "command" and not fact.facts["refused"]

    def moving(self, _subject: str) -> bool:
        return bool(self.machine.moves(asyncio.get_running_loop().time()))

    def upset(self, cable: Cable, dice: Random, now: float) -> float:
        self.machine.power(now, on=False)
        cable.turn()
        return dice.choice((0.05, 0.3, 2.0))

    def restore(self, cable: Cable, now: float) -> None:
        self.machine.power(now, on=True)
        cable.turn()


class ToySeed(Seed):
    """A seed of one axis, that also watches to which frame its replies are credited."""

    def __init__(self, seed: int) -> None:
        super().__init__(seed, family=ToyFamily(seed))
        self.cable.ends = lambda _: True

    @contextmanager
    def _watched(self) -> Iterator[None]:
        credit = ToyExchange.credit

        def credited(exchange: ToyExchange, frame: Frame, at: float = 0.0) -> Any:
            outcome = credit(exchange, frame, at)
            if isinstance(outcome, Reply):
                self._judge_credit(exchange, frame)
            return outcome

        with super()._watched(), patch.object(ToyExchange, "credit", credited):
            yield


def run(seed: int) -> Report:
    """Run one seed in virtual time."""

    async def story() -> Report:
        return await ToySeed(seed).run()

    with patch.dict(FAMILIES, toy=Toys), asking(EVERYBODY):
        return run_virtual(story())


@pytest.mark.parametrize("first", drawn(range(0, SEEDS, TOGETHER), DRAWN, "seeds of the third family"))
def test_whatever_goes_wrong_what_is_told_of_a_toy_is_true(
    first: int, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.CRITICAL, "gateway")
    reports = {seed: run(seed) for seed in range(first, first + TOGETHER)}
    assert {seed: report.violations for seed, report in reports.items() if report.violations} == {}
    assert sum(report.wanted for report in reports.values()) >= COMMANDS * TOGETHER
    assert sum(report.faults for report in reports.values()) >= 10 * TOGETHER
    assert sum(report.crashes for report in reports.values()) >= 2 * TOGETHER
    assert sum(report.told["begun"] for report in reports.values()) >= 5 * TOGETHER
