"""The mirror: what is read, when, and what its protocol is told."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from typing import Any

import httpx
from motion_gateway_client import GatewayError

from bridges.common.mirror import AGAIN_S, SWEEP_S, TRY_AGAIN_S, Mirror
from tests.bridges.fake_gateway import FakeGateway, body
from tests.virtual_time import run_virtual

EVERYTHING = {
    "/lines/line1",
    "/bodies/line1.00",
    "/bodies/line1.3F",
    "/robots/r1",
    "/robots/r1/units/1",
    "/scaras/wafer",
    "/alarms/a-1",
}


class Kept:
    """A mirror at work, and what it has told."""

    def __init__(self, gateway: FakeGateway) -> None:
        self.gateway = gateway
        self.mirror = Mirror(gateway.client())
        self.told: list[tuple[str, dict[str, Any] | None]] = []
        self.troubles: list[GatewayError] = []
        self.mirror.on_change = lambda path, document: self.told.append((path, document))
        self.mirror.on_trouble = self.troubles.append

    def read(self) -> set[str]:
        """Paths that were read since the last call."""
        read = {path for path, _ in self.told}
        self.told.clear()
        return read


@asynccontextmanager
async def keeping(gateway: FakeGateway) -> AsyncIterator[Kept]:
    kept = Kept(gateway)
    work = asyncio.create_task(kept.mirror.run())
    try:
        await kept.mirror.known.wait()
        kept.read()
        yield kept
    finally:
        work.cancel()
        await asyncio.gather(work, return_exceptions=True)


def test_knows_everything_once_it_has_read_all() -> None:
    async def story() -> None:
        async with keeping(FakeGateway()) as kept:
            assert kept.mirror.documents.keys() == EVERYTHING

    run_virtual(story())


def test_reads_what_an_event_is_about_and_what_depends_on_it() -> None:
    async def story() -> None:
        gateway = FakeGateway()
        async with keeping(gateway) as kept:
            for subject, read in (
                ("/bodies/line1.3F", {"/bodies/line1.3F", "/alarms/a-1"}),
                ("/bodies/line1.00", {"/bodies/line1.00", "/scaras/wafer"}),
                ("/robots/r1/units/1", {"/robots/r1", "/robots/r1/units/1"}),
                ("/lines/line1", {"/lines/line1", "/bodies/line1.00", "/bodies/line1.3F", "/scaras/wafer"}),
                ("/gateway", set[str]()),
            ):
                kept.mirror.note(gateway.tell(1, "something", subject))
                await asyncio.sleep(1)
                assert kept.read() == read, subject

    run_virtual(story())


def test_many_events_about_a_body_cause_few_readings() -> None:
    async def story() -> None:
        gateway = FakeGateway()
        async with keeping(gateway) as kept:
            before = gateway.asked["/bodies/line1.00"]
            for _ in range(100):
                kept.mirror.note(gateway.tell(1, "body.move.sent", "/bodies/line1.00"))
                await asyncio.sleep(0.01)
            await asyncio.sleep(1)
            assert gateway.asked["/bodies/line1.00"] - before <= 1 / AGAIN_S + 2

    run_virtual(story())


def test_an_alarm_comes_with_its_event_and_goes_with_its_reset() -> None:
    async def story() -> None:
        gateway = FakeGateway()
        async with keeping(gateway) as kept:
            gateway.documents["/alarms/a-2"] = {"id": "a-2", "subject": "/gateway", "reset_at": None}
            kept.mirror.note(gateway.tell(1, "alarm.raised", "/gateway", id="a-2"))
            await asyncio.sleep(1)
            assert "/alarms/a-2" in kept.mirror.documents
            gateway.documents["/alarms/a-2"]["reset_at"] = "2026-01-31T12:00:00Z"
            kept.mirror.note(gateway.tell(2, "alarm.reset", "/gateway", id="a-2"))
            await asyncio.sleep(1)
            assert kept.told[-1] == ("/alarms/a-2", None)
            assert "/alarms/a-2" not in kept.mirror.documents

    run_virtual(story())


def test_a_gap_a_crash_and_a_reload_have_everything_read_again_and_what_is_gone_is_told() -> None:
    async def story() -> None:
        gateway = FakeGateway()
        async with keeping(gateway) as kept:
            for type_ in ("stream.gap", "gateway.crashed", "gateway.reloaded"):
                kept.mirror.note(gateway.tell(1, type_))
                await asyncio.sleep(1)
                assert kept.read() == EVERYTHING, type_
            del gateway.documents["/bodies/line1.3F"]
            gateway.documents["/lines/line1"]["bodies"] = ["line1.00"]
            kept.mirror.note(gateway.tell(2, "gateway.reloaded", "/gateway"))
            await asyncio.sleep(1)
            assert ("/bodies/line1.3F", None) in kept.told

    run_virtual(story())


def test_everything_is_read_again_in_each_sweep_for_values_that_no_event_tells() -> None:
    async def story() -> None:
        gateway = FakeGateway()
        async with keeping(gateway) as kept:
            gateway.documents["/bodies/line1.00"] = body("line1.00", position=7)
            await asyncio.sleep(2 * SWEEP_S)
            assert kept.mirror.documents["/bodies/line1.00"]["position"] == 7
            assert kept.read() == EVERYTHING

    run_virtual(story())


def test_goes_on_when_the_gateway_is_back_and_says_what_was_wrong() -> None:
    async def story() -> None:
        gateway = FakeGateway()
        async with keeping(gateway) as kept:
            gateway.refusal = httpx.Response(503, json={"detail": "It starts."})
            kept.mirror.note(gateway.tell(1, "body.online", "/bodies/line1.00"))
            await asyncio.sleep(5 * TRY_AGAIN_S)
            assert {str(it) for it in kept.troubles} == {"It starts."}
            assert kept.mirror.documents.keys() == EVERYTHING
            gateway.refusal = None
            await asyncio.sleep(2 * TRY_AGAIN_S)
            assert "/bodies/line1.00" in kept.read()

    run_virtual(story())
