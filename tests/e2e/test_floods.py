"""One client sends all it can, of every kind: stops, heartbeats and the dead man's switch hold their times.

The gateway and the flooder are processes of their own. Times are without those in which the machine let them
wait for a processor, and the loop is measured by what it took of one.
"""

from dataclasses import dataclass
from statistics import median
from typing import Final

import pytest
import uvloop

from benchmarks.floods import FLOODS
from benchmarks.under_flood import HEARTBEAT_S, Measured, stand

SECONDS: Final = 0.2
"""With the silence that follows each flood takes a second."""
LONGEST_MS: Final = 20.0
"""The loop is held by one turn no longer."""
STOP_MS: Final = 20.0
"""A stop takes so much longer than without a flood."""
BEAT_MS: Final = 50.0
"""A heartbeat is answered, and the dead man's switch stops a jog, so much later than at once."""
NOISE: Final = 10.0
"""So many times the longest answer of a bare server, at the same moments, is added for the machine."""
MOST_IDLE: Final = 0.5
"""The part of a processor that is left to the gateway's own questions afterwards, on a busy machine."""
MOST_MIB: Final = 130.0
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
    SWITCHED: "pongs pings empty-texts empty-continuations texts-of-a-byte huge-frames frames-without-an-end "
    "socket-openers trace-followers",
    # Frames ahead of the answer to a handshake are passed over; of a huge one perhaps only a part.
    1002: "empty-continuations texts-of-a-byte huge-frames",
    1008: "pongs pings empty-texts empty-continuations texts-of-a-byte huge-frames trace-followers",
    1009: "frames-without-an-end",
}
"""How each kind is answered, or its WebSocket closed; connections that ask for nothing are not."""


@dataclass
class Found:
    """All floods, one after the other."""

    alone: Measured
    floods: dict[str, Measured]
    sockets: tuple[int, int]
    """Before and after them."""
    resident_mib: tuple[float, float]
    idle: float


async def flood() -> Found:
    async with stand() as standing:
        sockets = standing.sockets()
        await standing.measure("", SECONDS)
        alone = await standing.measure("", 3 * SECONDS)
        _, before_mib = await standing.rest(sockets)
        floods = {name: await standing.measure(name, SECONDS) for name in FLOODS}
        for name in [it for it, measured in floods.items() if faults_of(measured, alone)]:
            # What a flood does it does again; what the machine did was only then.
            floods[name] = await standing.measure(name, SECONDS)
        idle, after_mib = await standing.rest(sockets)
        return Found(alone, floods, (sockets, standing.sockets()), (before_mib, after_mib), idle)


@pytest.fixture(scope="module")
def found() -> Found:
    return uvloop.run(flood())


@pytest.mark.prove
@pytest.mark.long
def test_no_flood_holds_the_loop_a_stop_or_a_jog(found: Found) -> None:
    assert len(found.floods) >= 25
    faults = {
        name: told for name, measured in found.floods.items() if (told := faults_of(measured, found.alone))
    }
    assert faults == {}


@pytest.mark.prove
@pytest.mark.long
def test_each_flood_is_answered_as_it_should_be(found: Found) -> None:
    strange = {
        name: told
        for name, measured in found.floods.items()
        if (told := measured.told.keys() - answers_to(name))
    }
    assert strange == {}
    assert found.floods["connect"].told
    assert any(1008 in measured.told for measured in found.floods.values())


@pytest.mark.prove
@pytest.mark.long
def test_nothing_of_a_flood_is_left(found: Found) -> None:
    assert found.sockets[1] <= found.sockets[0]
    assert found.idle < MOST_IDLE
    assert found.resident_mib[1] - found.resident_mib[0] < MOST_MIB


def answers_to(name: str) -> set[int]:
    return {CROWDED} | {status for status, names in ANSWERS.items() if name in names.split()}


def faults_of(measured: Measured, alone: Measured) -> list[str]:
    """All that one flood has brought about, in words."""
    faults = list(measured.failures)
    if (longest := max(measured.holds_ms, default=0.0)) > LONGEST_MS:
        faults.append(f"the loop was held for {longest:.0f} ms")
    noise_ms = NOISE * max(measured.echoes_ms, default=0.0)
    if not measured.stops_ms:
        faults.append("no stop was answered")
    elif (usual := median(measured.stops_ms)) > median(alone.stops_ms) + STOP_MS + noise_ms:
        faults.append(f"a stop took {usual:.0f} ms")
    if (beat := max(measured.beats_ms, default=0.0)) > BEAT_MS + noise_ms:
        faults.append(f"a heartbeat was answered after {beat:.0f} ms")
    faults += [
        f"the dead man's switch stopped after {silence:.0f} ms"
        for silence in measured.silences_ms
        if silence > 1000 * HEARTBEAT_S + BEAT_MS + noise_ms
    ]
    return faults if len(measured.silences_ms) == 2 else [*faults, "a jog was not ended"]
