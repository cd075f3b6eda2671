"""The position: written, read again, and held by one bridge at a time."""

import asyncio
from pathlib import Path

import pytest

from bridges.common.position import WRITTEN_EVERY_S, InUse, Position
from tests.virtual_time import run_virtual


def test_what_is_reached_is_written_soon_and_read_by_the_next_life(tmp_path: Path) -> None:
    async def story() -> None:
        with Position(tmp_path / "new" / "folder", "mqtt") as position:
            assert position.cursor is None
            keeping = asyncio.create_task(position.keep())
            for number in range(100):
                position.reach(f"e-{number}")
                await asyncio.sleep(WRITTEN_EVERY_S / 10)
            await asyncio.sleep(2 * WRITTEN_EVERY_S)
            written = (tmp_path / "new" / "folder" / "mqtt.position").read_text()
            keeping.cancel()
        assert written == "e-99\n"

    run_virtual(story())
    with Position(tmp_path / "new" / "folder", "mqtt") as position:
        assert position.cursor == "e-99"


def test_two_bridges_of_a_kind_never_share_a_directory(tmp_path: Path) -> None:
    with Position(tmp_path, "mqtt"), Position(tmp_path, "opcua"), pytest.raises(InUse):
        Position(tmp_path, "mqtt").__enter__()


@pytest.mark.parametrize("text", ["", "\n\n", "two words", "\0", "é"])
def test_a_broken_file_is_told_and_counts_as_none(
    tmp_path: Path, text: str, caplog: pytest.LogCaptureFixture
) -> None:
    (tmp_path / "mqtt.position").write_text(text)
    with Position(tmp_path, "mqtt") as position:
        assert position.cursor is None
    assert "cannot be read" in caplog.text


def test_a_disk_that_takes_nothing_is_told_once_and_tried_again(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    async def story() -> None:
        with Position(tmp_path, "mqtt") as position:
            keeping = asyncio.create_task(position.keep())
            (tmp_path / "mqtt.new").mkdir()  # cannot be opened as a file
            position.reach("e-1")
            await asyncio.sleep(10 * WRITTEN_EVERY_S)
            assert caplog.text.count("cannot be written") == 1
            (tmp_path / "mqtt.new").rmdir()
            await asyncio.sleep(2 * WRITTEN_EVERY_S)
            assert (tmp_path / "mqtt.position").read_text() == "e-1\n"
            keeping.cancel()

    run_virtual(story())
