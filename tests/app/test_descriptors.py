"""The number of connections that the operating system lets a gateway have."""

import resource

import pytest

from app.descriptors import KEPT_BACK, connections_possible


class Allowed:
    """The operating system's limits, soft and hard."""

    def __init__(self, soft: int, hard: int, monkeypatch: pytest.MonkeyPatch) -> None:
        self.limits = (soft, hard)
        monkeypatch.setattr(resource, "getrlimit", lambda _: self.limits)
        monkeypatch.setattr(resource, "setrlimit", self._set)

    def _set(self, _: int, limits: tuple[int, int]) -> None:
        self.limits = limits


def test_a_limit_that_can_be_raised_is_raised(monkeypatch: pytest.MonkeyPatch) -> None:
    allowed = Allowed(256, 4096, monkeypatch)
    assert connections_possible(1000) == 1000
    assert allowed.limits == (1000 + KEPT_BACK, 4096)


def test_a_limit_that_is_high_enough_is_left_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    allowed = Allowed(65_536, 65_536, monkeypatch)
    assert connections_possible(1000) == 1000
    assert allowed.limits == (65_536, 65_536)


@pytest.mark.parametrize("soft", [resource.RLIM_INFINITY, 256])
def test_without_a_hard_limit_everything_is_possible(soft: int, monkeypatch: pytest.MonkeyPatch) -> None:
    Allowed(soft, resource.RLIM_INFINITY, monkeypatch)
    assert connections_possible(50_000) == 50_000


def test_a_hard_limit_that_is_too_low_limits_connections_and_is_told(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    allowed = Allowed(256, 512, monkeypatch)
    assert connections_possible(1000) == 512 - KEPT_BACK
    assert allowed.limits == (512, 512)
    assert "ulimit -n" in caplog.text
