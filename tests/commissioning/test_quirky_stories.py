"""The stories of each family on lines that are otherwise than is assumed, with the proposed change."""

import asyncio
import logging
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, nullcontext
from functools import cache
from pathlib import Path
from random import Random
from types import MappingProxyType, ModuleType
from typing import Any, Final, cast
from unittest.mock import patch

import pytest

from commissioning.assumptions import BY_SLUG
from commissioning.findings import Result
from gateway.config import Config
from gateway.config import parse as parsed
from gateway.core.errors import Expired
from gateway.core.move_record import MoveStatus
from gateway.rorze.move_requests import BodyJogRequest
from simulator.fics.line import build_line as build_fics
from simulator.fics.quirks import QUIRKS as FICS_QUIRKS
from simulator.rorze.line import build_line as build_rc400
from simulator.rorze.quirks import QUIRKS as RC400_QUIRKS
from tests import fics_plants, plants
from tests.commissioning.benches import with_changes
from tests.commissioning.test_quirks import CASES, DEEDS, Case
from tests.drawing import commit
from tests.drawn_faults import AGAIN_S, Story, Strike
from tests.gateway import test_drawn_faults
from tests.gateway.rorze_scara.cell import cell, mm
from tests.gateway.test_drawn_faults import BODY_STORIES, ROBOT_STORIES
from tests.plants import rig
from tests.virtual_time import run_virtual

FEW: Final = 6
"""Stories that run in `make test`; the commit draws them."""
RIGHT: Final = {(it.line_id, it.slug): it for it in (*CASES, *DEEDS) if it.result is Result.DIFFERS}
"""The quirks of which a change, or nothing, makes the gateway right."""
LATE_S: Final = 10.0
"""Seconds after which a stop whose proof waits for late replies is confirmed."""
TOO_LATE: Final = (
    "a jog that has not begun two seconds after it was asked for is not begun: a hand may be off it"
)
LEFT_OUT: Final[Mapping[str, Mapping[str, str]]] = MappingProxyType(
    {
        "turnaround": {
            "a_body_jogs_and_is_left_alone": TOO_LATE,
            "a_suspended_process_stops_what_jogs": TOO_LATE,
            "a_scara_moves": "three axes have to have proved within two seconds that they kept their power: "
            "where each reply takes 0.26 s the first proof is older when the third is there",
        },
        "silent-xid": {
            "a_group_moves": "virtual bodies are 80 to 9E, and behind $ and # stands one digit (12)",
            "a_scara_moves": "a SCARA robot takes a group",
        },
    }
)
"""Stories that are not told of a quirk, and why."""
OLD: Final = "silent-xid"
STORIES: Final = tuple(
    (case, story)
    for case in RIGHT.values()
    for story in (BODY_STORIES if case.line_id == "robot" else ROBOT_STORIES)
    if story.__name__ not in LEFT_OUT.get(case.slug, {})
)


@pytest.fixture(autouse=True)
def _quiet(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.CRITICAL, "gateway")


@contextmanager
def otherwise(case: Case) -> Iterator[None]:
    """Let each line that is built have the quirk, and each configuration the proposed change."""

    def turned(build: Callable[..., Any], quirks: Mapping[str, Callable[[Any], None]]) -> Callable[..., Any]:
        def built(*values: Any, **options: Any) -> Any:
            machine = build(*values, **options)
            quirks[case.slug](machine)
            return machine

        return built

    def parse(text: str, name: str) -> Config:
        return with_changes(parsed(text, name), case.proposed)

    bodies, stories = below_10() if case.slug == OLD else (plants, test_drawn_faults)
    with ExitStack() as stack:
        if case.slug == "late-replies":
            stack.enter_context(patch.object(test_drawn_faults, "CONFIRMED_S", LATE_S))
        for module in (bodies, fics_plants, stories):
            stack.enter_context(patch.object(module, "parse", parse))
        if case.line_id == "robot":
            stack.enter_context(patch.object(bodies, "build_line", turned(build_rc400, RC400_QUIRKS)))
        else:
            stack.enter_context(patch.object(fics_plants, "build_line", turned(build_fics, FICS_QUIRKS)))
        yield


@cache
def below_10() -> tuple[ModuleType, ModuleType]:
    """The plants and stories with body 0F in the place of 3F, which an old link master cannot address."""
    told: list[ModuleType] = []
    for module in (plants, test_drawn_faults):
        text = Path(module.__file__ or "").read_text("utf-8").replace("3F", "0F")
        other = ModuleType(module.__name__)
        with patch.dict(sys.modules, {it.__name__: it for it in told}):
            exec(compile(text, str(module.__file__), "exec"), other.__dict__)  # noqa: S102  # our own
        told.append(other)
    return told[0], told[1]


def tell(case: Case, story: Story) -> None:
    if case.slug == OLD:
        story = getattr(below_10()[1], story.__name__)
    with otherwise(case):
        run_virtual(story(cast("Any", nullcontext)))


def name_of(value: object) -> str:
    return value.slug if isinstance(value, Case) else getattr(value, "__name__", "")


def test_the_page_tells_what_is_left_where_stories_are_left_out() -> None:
    assert {slug for slug in LEFT_OUT if not BY_SLUG[slug].rest} == set()


async def a_jog_is_refused(_struck: Strike) -> None:
    async with rig(groups={}) as plant:
        with pytest.raises(Expired, match="nothing was sent"):
            await plant.plant.rorze.jogs.start(plant.body(), BodyJogRequest(direction="cw"))
        await asyncio.sleep(AGAIN_S)
        assert plant.axis().position(asyncio.get_running_loop().time()) == 0
        assert not plant.axis().motor.moving


async def a_scara_is_refused(_struck: Strike) -> None:
    async with cell() as robot:
        with pytest.raises(Expired, match="nothing was sent"):
            await robot.start("line", x=mm(20), y=mm(130))
        await asyncio.sleep(AGAIN_S)
        assert [move.status for move in robot.moves.log.of("wafer")] == [MoveStatus.CANCELLED]
        assert not any(robot.moving())


@pytest.mark.parametrize("story", [a_jog_is_refused, a_scara_is_refused])
def test_stories_of_a_slow_line_that_are_left_out_are_refused_and_nothing_moves(story: Story) -> None:
    tell(RIGHT["robot", "turnaround"], story)


@pytest.mark.parametrize(("case", "story"), Random(commit()).sample(STORIES, FEW), ids=name_of)
def test_a_drawn_story_is_true_with_the_change(case: Case, story: Story) -> None:
    tell(case, story)


@pytest.mark.prove
@pytest.mark.parametrize(("case", "story"), STORIES, ids=name_of)
def test_each_story_is_true_with_the_change(case: Case, story: Story) -> None:
    tell(case, story)
