"""The stories of each family on lines that are otherwise than is assumed, with the proposed change."""

import logging
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack, contextmanager, nullcontext
from random import Random
from types import MappingProxyType
from typing import Any, Final, cast
from unittest.mock import patch

import pytest

from commissioning.findings import Result
from gateway.config import Config
from gateway.config import parse as parsed
from simulator.fics.line import build_line as build_fics
from simulator.fics.quirks import QUIRKS as FICS_QUIRKS
from simulator.rorze.line import build_line as build_rc400
from simulator.rorze.quirks import QUIRKS as RC400_QUIRKS
from tests import fics_plants, plants
from tests.commissioning.benches import with_changes
from tests.commissioning.test_quirks import CASES, DEEDS, Case
from tests.drawing import commit
from tests.drawn_faults import Story
from tests.gateway import test_drawn_faults
from tests.gateway.test_drawn_faults import BODY_STORIES, ROBOT_STORIES
from tests.virtual_time import run_virtual

FEW: Final = 6
"""Stories that run in `make test`; the commit draws them."""
RIGHT: Final = {(it.line_id, it.slug): it for it in (*CASES, *DEEDS) if it.result is Result.DIFFERS}
"""The quirks of which a change, or nothing, makes the gateway right."""
SLOW: Final = "each reply takes so long that moves are refused in time, and stops confirmed after it"
LEFT_OUT: Final[Mapping[tuple[str, str], str]] = MappingProxyType(
    {
        ("late-replies", ""): SLOW,
        ("turnaround", ""): SLOW,
        ("silent-xid", ""): "an old link master knows neither groups nor the body 3F of the stories",
        ("copies-of-replies", "the_configuration_is_read_anew"): "it sets another `late_reply_s` itself",
        ("comment-kept", "a_body_loses_its_power"): "a body at 0 without an origin has nothing to lose",
    }
)
"""Stories that are not told of a quirk, all of them where none is named, and why."""
STORIES: Final = tuple(
    (case, story)
    for case in RIGHT.values()
    for story in (BODY_STORIES if case.line_id == "robot" else ROBOT_STORIES)
    if LEFT_OUT.keys().isdisjoint({(case.slug, ""), (case.slug, story.__name__)})
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

    with ExitStack() as stack:
        for module in (plants, fics_plants, test_drawn_faults):
            stack.enter_context(patch.object(module, "parse", parse))
        if case.line_id == "robot":
            stack.enter_context(patch.object(plants, "build_line", turned(build_rc400, RC400_QUIRKS)))
        else:
            stack.enter_context(patch.object(fics_plants, "build_line", turned(build_fics, FICS_QUIRKS)))
        yield


def tell(case: Case, story: Story) -> None:
    with otherwise(case):
        run_virtual(story(cast("Any", nullcontext)))


def name_of(value: object) -> str:
    return value.slug if isinstance(value, Case) else getattr(value, "__name__", "")


@pytest.mark.parametrize(("case", "story"), Random(commit()).sample(STORIES, FEW), ids=name_of)
def test_a_drawn_story_is_true_with_the_change(case: Case, story: Story) -> None:
    tell(case, story)


@pytest.mark.prove
@pytest.mark.parametrize(("case", "story"), STORIES, ids=name_of)
def test_each_story_is_true_with_the_change(case: Case, story: Story) -> None:
    tell(case, story)
