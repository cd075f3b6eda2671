"""A line that outlives the gateways before it, on virtual time, with a journal in real files."""

import asyncio
from collections.abc import AsyncIterator, Callable, Hashable
from contextlib import asynccontextmanager, suppress
from dataclasses import dataclass, field
from pathlib import Path
from random import Random
from typing import Any

from gateway.config import parse
from gateway.core.journal import files
from gateway.core.journal.disk import DiskFailed
from gateway.core.journal.journal import Journal
from gateway.core.journal.opening import OpenedJournal, open_journal
from gateway.core.journal.writes import Value, Write
from gateway.memory import make_sense
from gateway.security.log import SecurityLog
from simulator.fics.layout import Layout
from simulator.fics.line import build_line as build_robot
from simulator.rorze.line import build_line
from tests.fics_plants import CARTESIAN, SCARA, Cable
from tests.plants import Wire, configuration
from tests.tested_plant import TestedPlant

DISK_S = 0.005
"""Seconds that a commit takes."""


class Immediate(Journal):
    """A journal without a thread: virtual time waits for none."""

    def start(self) -> None:
        return

    def note(self, *entries: Write) -> None:
        with suppress(DiskFailed):
            self.disk.commit(entries, durable=False)

    def note_newest(self, row: Hashable, write: Callable[[], Write]) -> None:
        del row
        self.note(write())

    def write(self, *entries: Write) -> asyncio.Future[None]:
        self.require()
        loop = asyncio.get_running_loop()
        done: asyncio.Future[None] = loop.create_future()
        with suppress(DiskFailed):
            self.disk.commit(entries, durable=True)
            loop.call_later(DISK_S, done.set_result, None)
        return done

    async def close(self) -> None:
        self.writer.write([None])
        self.disk.close()

    async def rows(self, sql: str, *values: Value) -> list[tuple[Any, ...]]:
        return self.disk.rows(sql, values)


@dataclass
class World:
    """A line that stays as it is while gateways come and go."""

    folder: Path
    wire: Wire | Cable = field(default_factory=lambda: Wire(build_line([0x00, 0x3F], 0.0, seed=1)))
    text: str = configuration(bodies=(0x00, 0x3F), groups={})
    """The configuration."""
    lives: int = 0

    @asynccontextmanager
    async def gateway(self) -> AsyncIterator[TestedPlant]:
        """One life, with what the last one has left."""
        self.lives += 1
        opened = open_journal(self.folder, make_sense)
        journal = Immediate(opened.journal.disk, trouble=opened.journal.trouble)
        plant = TestedPlant(
            parse(self.text, "test.toml"),
            open_transport=lambda _: self.wire,
            rng=Random(self.lives),
            journal=OpenedJournal(journal, *opened[1:]),
            security=SecurityLog(self.folder),
        )
        await plant.start()
        try:
            yield plant
        finally:
            await plant.close()

    @classmethod
    def of_robot(cls, folder: Path, mode: int, units: int = 1) -> "World":
        """A robot with one unit, or two."""
        tables = ", ".join([SCARA, CARTESIAN][:units])
        text = (
            f'[[lines]]\nid = "cell"\naddress = "tcp://127.0.0.1:1"\nprotocol = "fics"\nmode = {mode}\n'
            f'robot = {{id = "r1", units = [{tables}]}}\n'
        )
        return cls(folder, Cable(build_robot(Layout(units=units))), text)

    def crash(self) -> None:
        """From here on the present life writes nothing that the next one can find."""
        copy = self.folder.with_name(f"{self.folder.name}+")
        copy.mkdir()
        files.backup(self.folder, copy / "journal.db")
        self.folder = copy

    def sent(self, code: str) -> list[str]:
        return [frame for frame in self.wire.frames() if frame[3:6] == code]

    def rows(self, table: str) -> list[dict[str, Any]]:
        return [row for row in files.export(self.folder) if row["table"] == table]
