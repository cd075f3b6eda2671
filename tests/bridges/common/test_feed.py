"""The feed: where it begins, how it goes on, and what it tells of gaps and lost connections."""

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import httpx
import pytest

from bridges.common.feed import SIDE, Feed
from bridges.common.mirror import Mirror
from bridges.common.position import Position
from bridges.common.state import Figures, State
from tests.bridges.fake_gateway import FakeGateway
from tests.virtual_time import run_virtual


class Followed:
    """A feed at work, and the events it has given."""

    def __init__(self, gateway: FakeGateway, position: Position) -> None:
        self.position, self.figures = position, Figures()
        self.state = State([SIDE], self.figures)
        client = gateway.client()
        self.mirror = Mirror(client)
        self._feed = Feed(client, position, self.mirror, self.state, self.figures, lambda _side: None)
        self.taken: list[Any] = []

    async def take(self, event: Any) -> None:
        self.taken.append(event["id"])
        self.position.reach(event["cursor"])

    @asynccontextmanager
    async def at_work(self) -> AsyncIterator[None]:
        tasks = [asyncio.create_task(it) for it in (self._feed.run(self.take), self.mirror.run())]
        try:
            yield
        finally:
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)


def test_the_first_life_begins_with_a_snapshot_and_its_place_is_on_the_disk_before_anything_else(
    tmp_path: Path,
) -> None:
    async def story() -> None:
        gateway = FakeGateway()
        with Position(tmp_path, "mqtt") as position:
            followed = Followed(gateway, position)
            async with followed.at_work():
                gateway.tell(1, "stream.snapshot")
                await asyncio.sleep(1)
                assert (tmp_path / "mqtt.position").read_text() == "e-1\n"
                gateway.tell(2, "line.up", "/lines/line1")
                await asyncio.sleep(1)
        assert gateway.queries == [{"snapshot": "true"}]
        assert followed.taken == ["e-1", "e-2"]

    run_virtual(story())


def test_the_next_life_goes_on_after_what_was_delivered(tmp_path: Path) -> None:
    async def story() -> None:
        gateway = FakeGateway()
        with Position(tmp_path, "mqtt") as position:
            position.begin("e-7")
        with Position(tmp_path, "mqtt") as position:
            followed = Followed(gateway, position)
            async with followed.at_work():
                gateway.tell(8, "line.up", "/lines/line1")
                await asyncio.sleep(1)
                gateway.cut()
                await asyncio.sleep(1)
        assert gateway.queries == [{"after": "e-7"}, {"after": "e-8"}]
        assert followed.taken == ["e-8"]

    run_virtual(story())


def test_a_gap_is_handed_on_counted_and_has_all_states_read_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def story() -> None:
        gateway = FakeGateway()
        with Position(tmp_path, "mqtt") as position:
            position.begin("old-7")
            followed = Followed(gateway, position)
            async with followed.at_work():
                await followed.mirror.known.wait()
                before = gateway.asked["/bodies/line1.00"]
                gateway.tell(1, "stream.gap", requested="old-7", first_available="e-1")
                await asyncio.sleep(1)
                assert gateway.asked["/bodies/line1.00"] > before
        assert followed.taken == ["e-1"]
        assert followed.figures.registry.get_sample_value("motion_gateway_bridge_gaps_total") == 1
        assert "events after old-7 are missing" in caplog.text

    run_virtual(story())


def test_a_key_that_the_gateway_refuses_is_told_until_it_is_good(tmp_path: Path) -> None:
    async def story() -> None:
        gateway = FakeGateway()
        with Position(tmp_path, "mqtt") as position:
            followed = Followed(gateway, position)
            gateway.refusal = httpx.Response(401, json={"detail": "There is no such key."})
            async with followed.at_work():
                await asyncio.sleep(5)
                assert not followed.state.online
                assert "401" in str(followed.state.reason)
                gateway.refusal = None
                await asyncio.sleep(5)
                assert followed.state.online

    run_virtual(story())
