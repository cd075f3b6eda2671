"""Errors that show that a body does not answer, and errors that do not."""

import pytest

from gateway.core.errors import (
    BodyOffline,
    Expired,
    GarbledReply,
    GatewayError,
    NoReply,
    PortNotOpen,
    QueueFull,
)
from gateway.rorze.line import Line
from tests.gateway.rorze.far_end import FarEnd, running_line, virtual


@pytest.mark.parametrize(
    ("error", "silent"),
    [
        (NoReply("no reply came"), True),
        (BodyOffline("it does not answer"), True),
        (GarbledReply("something came"), False),
        (PortNotOpen("the line is down"), False),
        (QueueFull("crowded"), False),
        (Expired(), False),
    ],
)
def test_only_a_body_that_does_not_answer_is_silent(error: GatewayError, silent: bool) -> None:
    @virtual
    async def story() -> None:
        async with running_line(FarEnd()) as line:
            assert line.shows_silence(error) is silent

    story()


async def _is_silence_with(line: Line, offline: set[int]) -> bool:
    line._session.offline = offline
    return line.shows_silence(BodyOffline("it does not answer"))


@virtual
async def test_a_line_on_which_nobody_is_heard_is_out_of_reach_unless_the_body_is_alone() -> None:
    async with running_line(FarEnd(), bodies=(2, 3)) as line:
        assert await _is_silence_with(line, {2})
        assert not await _is_silence_with(line, {2, 3})
    async with running_line(FarEnd(), bodies=(2,)) as line:
        assert await _is_silence_with(line, {2})


@virtual
async def test_an_answer_that_the_port_took_with_it_is_no_silence() -> None:
    far = FarEnd()
    async with running_line(far) as line:
        far.unplug()
        assert not line.shows_silence(NoReply("the line was lost before the reply came"))
