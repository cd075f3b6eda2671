"""The paths of requests that are stops."""

import pytest

from api.front.stop_paths import is_stop


@pytest.mark.parametrize(
    "path",
    [
        "/stop",
        "/bodies/3F/stop",
        "/groups/80/stop",
        "/robots/r1/stop",
        "/robots/r1/units/1/stop",
        "/robots/r1/jogs/x/stop",
        "/bodies/arm.3F/commands/stop-immediately",
        "/groups/80/commands/stop-decelerating",
        "/bodies/3F/commands/end-program",
        "/robots/r1/commands/stop-all-immediately",
        "/robots/r1/units/1/commands/stop-jog",
    ],
)
def test_a_stop_is_a_stop(path: str) -> None:
    assert is_stop("POST", path)
    assert not is_stop("GET", path)


@pytest.mark.parametrize(
    "path",
    [
        "/stops",
        "/bodies/3F/moves",
        "/bodies/3F/commands/set-stop-speed-set",
        "/bodies/3F/commands/home-fast-then-stop",
    ],
)
def test_what_only_sounds_like_one_is_none(path: str) -> None:
    assert not is_stop("POST", path)
