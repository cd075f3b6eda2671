"""Faults of the gateway itself, which tests let happen once."""

from collections.abc import Callable
from typing import Any

import pytest

Place = tuple[Any, str]
"""A class or a module, and the name of a function of it."""


def fail_once(monkeypatch: pytest.MonkeyPatch, place: Place, calls: int = 1) -> list[str]:
    """Let a call of a function, by default the next, raise an exception that the code does not foresee."""
    owner, name = place
    good: Callable[..., Any] = getattr(owner, name)
    failed: list[str] = []
    left = [calls]

    def bad(*args: Any, **kwargs: Any) -> Any:
        left[0] -= 1
        if left[0] != 0:
            return good(*args, **kwargs)
        failed.append(name)
        raise ZeroDivisionError

    monkeypatch.setattr(owner, name, bad)
    return failed


def fail_always(monkeypatch: pytest.MonkeyPatch, place: Place) -> None:
    """Let every call of a function raise an exception that the code does not foresee."""

    def bad(*_: Any, **__: Any) -> Any:
        raise ZeroDivisionError

    monkeypatch.setattr(*place, bad)


def named(place: Place) -> str:
    """A place in the name of a test."""
    return f"{place[0].__name__.rpartition('.')[2]}.{place[1]}"
