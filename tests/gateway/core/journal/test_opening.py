"""A journal at the start: another gateway's is left alone, and one that cannot be used says so."""

from pathlib import Path

import pytest

from gateway.core.journal.disk import DiskFailed, InUse
from gateway.core.journal.journal import JournalUnavailable
from gateway.core.journal.opening import open_journal
from gateway.core.journal.writes import meta


def test_another_gateways_journal_is_left_alone(tmp_path: Path) -> None:
    first = open_journal(tmp_path)
    with pytest.raises(InUse, match="another gateway"):
        open_journal(tmp_path)
    first.journal.disk.close()


def test_one_that_cannot_be_used_takes_nothing(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    (tmp_path / "file").write_text("in the way")
    journal, past, set_aside = open_journal(tmp_path / "file")
    assert (past.last_event, past.was_clean, set_aside) == (0, True, None)
    assert "only reads and stops are sent" in caplog.text
    with pytest.raises(JournalUnavailable, match="nothing was sent"):
        journal.require()
    with pytest.raises(DiskFailed):
        journal.disk.commit([meta("a", "b")], durable=True)


def test_a_broken_one_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "journal.db").write_bytes(b"no journal" * 1000)
    journal, _, set_aside = open_journal(tmp_path)
    assert set_aside is not None
    assert set_aside.read_bytes()[:10] == b"no journal"
    assert journal.trouble is None
    journal.disk.close()
