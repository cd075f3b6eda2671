"""The tables of the journal, and the way from each version of them to the next."""

import sqlite3
from typing import Final

MIGRATIONS: Final = (
    """
    CREATE TABLE meta (name TEXT PRIMARY KEY, value TEXT NOT NULL) WITHOUT ROWID;

    -- What has an effect. A row without written_at was not written to its line, as far as the journal knows.
    CREATE TABLE intents (
        id TEXT PRIMARY KEY,
        at REAL NOT NULL,
        target TEXT NOT NULL,
        command TEXT NOT NULL,
        effect TEXT NOT NULL,
        frame TEXT NOT NULL,
        caller TEXT NOT NULL,
        request_id TEXT,
        move_id TEXT,
        written_at REAL,
        ended_at REAL,
        outcome TEXT,
        detail TEXT
    ) WITHOUT ROWID;
    CREATE INDEX intents_by_time ON intents (at);
    CREATE INDEX intents_open ON intents (ended_at) WHERE ended_at IS NULL;

    CREATE TABLE moves (
        id TEXT PRIMARY KEY,
        target TEXT NOT NULL,
        final INTEGER NOT NULL,
        at REAL NOT NULL,
        record TEXT NOT NULL
    ) WITHOUT ROWID;
    CREATE INDEX moves_by_target ON moves (target, id);
    CREATE INDEX moves_open ON moves (final) WHERE final = 0;

    CREATE TABLE events (
        number INTEGER PRIMARY KEY,
        at REAL NOT NULL,
        type TEXT NOT NULL,
        subject TEXT NOT NULL,
        text TEXT NOT NULL
    );
    CREATE INDEX events_by_time ON events (at);

    -- Idempotency keys: the answer is null while the first request is under way.
    CREATE TABLE keys (
        scope TEXT NOT NULL,
        key TEXT NOT NULL,
        digest TEXT NOT NULL,
        at REAL NOT NULL,
        status INTEGER,
        location TEXT,
        answer TEXT,
        PRIMARY KEY (scope, key)
    ) WITHOUT ROWID;
    CREATE INDEX keys_by_time ON keys (at);

    CREATE TABLE alarms (
        id TEXT PRIMARY KEY,
        at REAL NOT NULL,
        target TEXT NOT NULL,
        cause TEXT NOT NULL,
        reset_at REAL,
        reset_by TEXT,
        record TEXT NOT NULL
    ) WITHOUT ROWID;
    CREATE INDEX alarms_standing ON alarms (target) WHERE reset_at IS NULL;
    """,
    """
    -- The idempotency key, within its scope, of the request that wanted it.
    ALTER TABLE intents ADD COLUMN key TEXT;
    CREATE INDEX intents_by_key ON intents (key) WHERE key IS NOT NULL;
    """,
    """
    CREATE INDEX intents_by_move ON intents (move_id) WHERE move_id IS NOT NULL;
    """,
    """
    -- For how long gateways had run on this journal: the wall clock may jump.
    ALTER TABLE intents ADD COLUMN ran_s REAL NOT NULL DEFAULT 0;
    ALTER TABLE moves ADD COLUMN ran_s REAL NOT NULL DEFAULT 0;
    ALTER TABLE keys ADD COLUMN ran_s REAL NOT NULL DEFAULT 0;
    ALTER TABLE alarms ADD COLUMN ran_s REAL NOT NULL DEFAULT 0;
    CREATE INDEX intents_by_age ON intents (ran_s);
    CREATE INDEX keys_by_age ON keys (ran_s);
    DROP INDEX intents_by_time;
    DROP INDEX keys_by_time;
    """,
    """
    -- Moves are found by their ids and events by their numbers: these were written and never read.
    DROP INDEX moves_by_target;
    DROP INDEX events_by_time;
    """,
    """
    -- Long work that changes controllers: uploads of programs and positions, runs of programs, restores.
    CREATE TABLE works (
        id TEXT PRIMARY KEY,
        kind TEXT NOT NULL,
        over INTEGER NOT NULL,
        at REAL NOT NULL,
        record TEXT NOT NULL,
        ran_s REAL NOT NULL
    ) WITHOUT ROWID;
    CREATE INDEX works_open ON works (over) WHERE over = 0;
    """,
    """
    -- Stops, which every role can cause, are forgotten before all else that somebody did.
    CREATE INDEX stops_by_age ON intents (ran_s) WHERE effect = 'stop' AND ended_at IS NOT NULL;
    """,
    """
    -- Restores tell the time they take still; no table has changed.
    """,
)
"""One script for each version, applied in order; a script that was published never changes."""

VERSION: Final = len(MIGRATIONS)


class TooNew(Exception):
    """The file was written by a later version of the gateway."""


def written_version(connection: sqlite3.Connection) -> int:
    """Version of the tables of an open file, whichever gateway has written them."""
    (found,) = connection.execute("PRAGMA user_version").fetchone()
    return int(found)


def version_of(connection: sqlite3.Connection) -> int:
    """Version of the tables of an open file.

    :raises TooNew: it is later than this gateway's.
    """
    found = written_version(connection)
    if found > VERSION:
        raise TooNew(f"it has version {found} of the tables, and this gateway knows {VERSION}")
    return found


def migrate(connection: sqlite3.Connection) -> None:
    """Bring the tables of an open file to this version, each step in a transaction of its own.

    :raises TooNew: the file's version is later than this one's.
    """
    found = version_of(connection)
    for number, script in enumerate(MIGRATIONS[found:], found + 1):
        connection.executescript(f"BEGIN IMMEDIATE; {script}; PRAGMA user_version = {number}; COMMIT;")
