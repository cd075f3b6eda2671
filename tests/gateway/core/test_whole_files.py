"""A small file is written as a whole, or stays as it was."""

import os
from pathlib import Path

import pytest

from gateway.core.whole_files import write_whole


def test_a_text_takes_the_place_of_the_last_one_and_nothing_else_is_left(tmp_path: Path) -> None:
    file = tmp_path / "data" / "names.json"
    for text in ("one", "二"):
        write_whole(file, text)
        assert file.read_text("utf-8") == text
    assert list(file.parent.iterdir()) == [file]


def test_where_the_disk_takes_nothing_the_last_one_stays(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(_: int) -> None:
        raise OSError("no space")

    file = tmp_path / "names.json"
    write_whole(file, "one")
    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="no space"):
        write_whole(file, "two")
    assert file.read_text("utf-8") == "one"
