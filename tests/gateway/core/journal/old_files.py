"""Journals of earlier versions."""

import sqlite3
from contextlib import closing
from pathlib import Path

from gateway.core.journal.schema import MIGRATIONS


def file_of(version: int, directory: Path) -> None:
    """A journal as a gateway of that time has left it."""
    with closing(sqlite3.connect(directory / "journal.db", isolation_level=None)) as old:
        for script in MIGRATIONS[:version]:
            old.executescript(script)
        old.execute(f"PRAGMA user_version = {version}")
        old.executescript(
            """
            INSERT INTO meta VALUES ('epoch', 'e1'), ('clean', '1');
            INSERT INTO events VALUES (7, 1.0, 'line.up', '/lines/a', '{7}');
            INSERT INTO intents (id, at, target, command, effect, frame, caller, move_id)
            VALUES ('i1', 1.0, 'a.3F', 'home', 'motion', '&3FHMF', 'mes', 'm1');
            INSERT INTO moves (id, target, final, at, record) VALUES ('m1', 'a.3F', 0, 1.0, '{1}');
            INSERT INTO keys (scope, key, digest, at) VALUES ('s', 'k', 'd', 1.0);
            INSERT INTO alarms (id, at, target, cause, record)
            VALUES ('a1', 1.0, '/lines/a', 'line.down', '{2}');
            """
        )
