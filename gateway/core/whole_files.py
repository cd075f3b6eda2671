"""Small files of the data directory, each as a whole: a loss of power leaves the old one or the new one."""

import os
from pathlib import Path


def write_whole(file: Path, text: str) -> None:
    """Write a text beside the file, and put it in its place; its folder is made if there is none.

    :raises OSError: it was not written; the file is as it was.
    """
    file.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    new = file.with_suffix(".new")
    with new.open("w", encoding="utf-8") as stream:
        stream.write(text)
        stream.flush()
        os.fsync(stream.fileno())
    new.replace(file)
    directory = os.open(file.parent, os.O_RDONLY)
    try:
        os.fsync(directory)
    finally:
        os.close(directory)
