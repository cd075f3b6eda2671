"""Admission of new work: allowed or not, and the reason."""

import pytest

from gateway.core.admission import Admission
from gateway.core.errors import GatewayEnding, HeldUp
from gateway.core.loop_watch import DOUBT_S, SUSPENDED_S, LoopWatch
from tests.plants import in_virtual_time


def test_where_nobody_watches_and_nothing_ends_everything_is_admitted() -> None:
    Admission().require()


def test_at_the_end_nothing_is() -> None:
    admission = Admission()
    admission.end()
    with pytest.raises(GatewayEnding) as refusal:
        admission.require()
    assert (refusal.value.moved, refusal.value.retryable) == ("no", True)


@in_virtual_time
async def test_what_may_have_come_while_the_gateway_was_suspended_is_not() -> None:
    now = 0.0
    watch = LoopWatch(lambda: now)
    watch.start()
    admission = Admission(watch)
    admission.require()
    now += SUSPENDED_S + 1.0
    with pytest.raises(HeldUp) as refusal:
        admission.require()
    assert (refusal.value.moved, refusal.value.retryable) == ("no", True)
    now += DOUBT_S
    admission.require()
    watch.close()
