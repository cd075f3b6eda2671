"""Journals on the disk of a busy machine."""

import pytest

from gateway.core.journal import journal


@pytest.fixture(autouse=True)
def patience(monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk may take its time where a test does not want to see what happens then."""
    monkeypatch.setattr(journal, "WRITTEN_WITHIN_S", 60.0)
