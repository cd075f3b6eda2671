"""One client sends all it can, of every kind: stops, heartbeats and the dead man's switch hold their times.

The gateway and the flooder are processes of their own. Times are without those in which the machine let them
wait for a processor, and the loop is measured by what it took of one.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import pytest
import uvloop

from benchmarks.floods import FLOODS
from benchmarks.under_flood import HEARTBEAT_S, Measured, stand

SECONDS: Final = 0.3
"""With the silence that follows each flood takes a second."""
LONGEST_MS: Final = 20.0
"""The loop is held by one turn no longer; once, by a garbage collection, it may be `ONCE_MS`."""
ONCE_MS: Final = 50.0
STOP_MS: Final = 20.0
"""A stop takes so much longer than without a flood."""
BEAT_MS: Final = 50.0
MOST_IDLE: Final = 0.3
"""The part of a processor that is left to the gateway's own questions afterwards, on a busy machine."""
MOST_MIB: Final = 130.0
"""Memory that all of them together leave behind: the rings of the lines, of events and of moves fill up."""


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
        await standing.measure("", SECONDS)
        alone = await standing.measure("", 3 * SECONDS)
        _, before_mib = await standing.rest()
        sockets = standing.connections()
        floods = {name: await standing.measure(name, SECONDS) for name in FLOODS}
        idle, after_mib = await standing.rest()
        return Found(alone, floods, (sockets, standing.connections()), (before_mib, after_mib), idle)


@pytest.fixture(scope="module")
def found() -> Iterator[Found]:
    yield uvloop.run(flood())


@pytest.mark.long
def test_no_flood_holds_the_loop_a_stop_or_a_jog(found: Found) -> None:
    assert len(found.floods) >= 25
    faults = {name: told for name, measured in found.floods.items() if (told := faults_of(measured, found))}
    assert faults == {}
    assert found.sockets[1] <= found.sockets[0]
    assert found.idle < MOST_IDLE
    assert found.resident_mib[1] - found.resident_mib[0] < MOST_MIB


def faults_of(measured: Measured, found: Found) -> list[str]:
    """All that one flood has brought about, in words."""
    faults = list(measured.failures)
    *_, second, longest = sorted([0.0, 0.0, *measured.holds_ms])
    if second > LONGEST_MS or longest > ONCE_MS:
        faults.append(f"the loop was held for {second:.0f} and {longest:.0f} ms")
    if (usual := middle(measured.stops_ms)) > middle(found.alone.stops_ms) + STOP_MS:
        faults.append(f"a stop took {usual:.0f} ms")
    if (beat := max(measured.beats_ms, default=0.0)) > BEAT_MS:
        faults.append(f"a heartbeat was answered after {beat:.0f} ms")
    faults += [
        f"the dead man's switch stopped after {silence:.0f} ms"
        for silence in measured.silences_ms
        if silence > 1000 * HEARTBEAT_S + BEAT_MS
    ]
    return faults if len(measured.silences_ms) == 2 else [*faults, "a jog was not ended"]


def middle(values: list[float]) -> float:
    return sorted(values)[len(values) // 2]
