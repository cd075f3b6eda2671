"""One client sends all it can, of every kind: stops, heartbeats and the dead man's switch hold their times.

The machine may be as busy as it likes: no time counts for which the gateway waited for a processor, and a
delay that one kind caused only once was the machine's. A flood's own effect on the gateway comes each time.
"""

from random import Random
from typing import Final

import pytest
import uvloop

from benchmarks.floods import FLOODS
from benchmarks.under_flood import STOP_MS, Found, p99, poured
from tests.drawing import commit

SECONDS: Final = 0.2
"""Seconds for which each kind is poured; with the silence that follows it takes one second."""
QUICK: Final = 27
"""Kinds of floods, drawn by the commit, that are poured in `make test`."""
MOST_IDLE: Final = 0.5
"""The part of a processor that is left to the gateway's own questions afterwards, on a busy machine."""
MOST_MIB: Final = 150.0
"""Memory that all of them together leave behind: the rings of the lines, of events and of moves fill up."""
CROWDED: Final = 503
"""Answered to who asks for more than his share."""
SWITCHED: Final = 101
"""A WebSocket was opened."""
ANSWERS: Final = {
    200: "upgrade-to-nonsense pipelined-gets half-closed not-reading stream-openers traces filtered-traces "
    "event-lists documents metrics audits plans",
    400: "connect connect-held tls-on-the-plain-port rubbish bad-json big-numbers",
    401: "pipelined-refusals no-key wrong-keys sign-ins options",
    403: "keyed-json-of-a-viewer keyed-nesting-of-a-viewer",
    404: "not-there",
    413: "chunks-of-a-byte keyed-nesting",
    422: "keyed-wide-json idempotency-keys nested-json wide-json whole-tables long-texts csv good-program "
    "bad-program bad-backup",
    429: "sign-ins wrong-keys",
    431: "empty-lines endless-heads many-headers trailers long-queries",
    SWITCHED: "frames-ahead-of-the-answer pongs pings empty-texts empty-continuations texts-of-a-byte "
    "huge-frames frames-without-an-end socket-openers trace-followers",
    # Frames ahead of the answer to a handshake are passed over, and perhaps only a part of one.
    1002: "frames-ahead-of-the-answer",
    1008: "frames-ahead-of-the-answer pongs pings empty-texts empty-continuations texts-of-a-byte "
    "huge-frames trace-followers",
    1009: "frames-without-an-end",
}
"""Kinds of floods by their answer or their WebSocket's code; connections without a request get none."""


def drawn() -> list[str]:
    return Random(f"{commit()} floods").sample(sorted(FLOODS), QUICK)


@pytest.mark.long
@pytest.mark.parametrize(
    "kinds",
    [pytest.param(drawn(), id="drawn"), pytest.param(list(FLOODS), id="all", marks=pytest.mark.prove)],
)
def test_whoever_sends_all_he_can_takes_nothing_from_the_others(kinds: list[str]) -> None:
    found = uvloop.run(poured(SECONDS, kinds))  # once for all that is asked of it
    holds_neither_the_loop_nor_a_stop_nor_a_jog(found)
    is_answered_as_it_should_be(found)
    leaves_nothing(found)


def holds_neither_the_loop_nor_a_stop_nor_a_jog(found: Found) -> None:
    assert len(found.floods) >= 25
    assert found.faults == {}
    late_ms = [
        (ms - p99(found.alone.stops_ms)) / flood.stretch
        for flood in found.floods.values()
        for ms in flood.stops_ms
    ]
    assert p99(late_ms) <= STOP_MS


def is_answered_as_it_should_be(found: Found) -> None:
    strange = {
        name: told
        for name, measured in found.floods.items()
        if (told := measured.told.keys() - answers_to(name))
    }
    assert strange == {}
    assert sum(bool(measured.told) for measured in found.floods.values()) > len(found.floods) / 2


def leaves_nothing(found: Found) -> None:
    assert found.sockets[1] <= found.sockets[0]
    assert found.idle < MOST_IDLE
    assert found.resident_mib[1] - found.resident_mib[0] < MOST_MIB


def answers_to(name: str) -> set[int]:
    return {CROWDED} | {status for status, names in ANSWERS.items() if name in names.split()}
