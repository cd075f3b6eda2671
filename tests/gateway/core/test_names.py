"""Names outlive the gateway, and a file that cannot be read is no reason not to begin."""

import asyncio
from pathlib import Path

import pytest

from gateway.core.names import FILE, Names, NotKept


def kept(directory: Path) -> Names:
    names = Names()
    names.keep_in(directory)
    return names


def test_names_are_there_after_a_restart(tmp_path: Path) -> None:
    names = kept(tmp_path)
    asyncio.run(names.name("line1.3F", {7: "unload", 3: "置き場"}))
    asyncio.run(names.name("line1.00", {7: "park"}))
    asyncio.run(names.name("line1.3F", {3: "place", 8: ""}))
    again = kept(tmp_path)
    assert again.of("line1.3F") == {3: "place", 7: "unload"}
    assert again.of("line1.00") == {7: "park"}
    assert again.of("line1.01") == {}


def test_an_empty_name_takes_it_away(tmp_path: Path) -> None:
    names = kept(tmp_path)
    asyncio.run(names.name("line1.3F", {7: "unload"}))
    asyncio.run(names.name("line1.3F", {7: ""}))
    assert kept(tmp_path).of("line1.3F") == {}


@pytest.mark.parametrize("text", ["{", '{"line1.3F": {"7": 5}}', "[]", "\x00", '{"a": {"x": "y"}}'])
def test_a_file_that_cannot_be_read_is_put_aside(tmp_path: Path, text: str) -> None:
    (tmp_path / FILE).write_text(text, "utf-8")
    names = kept(tmp_path)
    assert names.of("line1.3F") == {}
    assert (tmp_path / "names.unreadable").read_text("utf-8") == text
    asyncio.run(names.name("line1.3F", {1: "one"}))
    assert kept(tmp_path).of("line1.3F") == {1: "one"}


def test_the_directory_is_made(tmp_path: Path) -> None:
    asyncio.run(kept(tmp_path / "new" / "data").name("line1.3F", {1: "one"}))
    assert kept(tmp_path / "new" / "data").of("line1.3F") == {1: "one"}


def test_what_cannot_be_written_is_not_taken(tmp_path: Path) -> None:
    names = kept(tmp_path)
    (tmp_path / "names.new").mkdir()
    with pytest.raises(NotKept, match="Is a directory"):
        asyncio.run(names.name("line1.3F", {1: "one"}))
    assert names.of("line1.3F") == {}
