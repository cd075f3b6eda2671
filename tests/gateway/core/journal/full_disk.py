"""A disk that has no room left."""

import resource
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def no_room_beyond(size: int) -> Iterator[tuple[int, int]]:
    """No file can grow longer than this; gives the limits of before."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield before
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
