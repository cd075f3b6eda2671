"""Backups that are read from controllers, and comparisons of controllers with backups."""

import asyncio
import re
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from functools import partial
from typing import NamedTuple, Protocol, TypeVar

from gateway.core.backup_record import Backup, BackupComparison, Difference, differing
from gateway.core.errors import InvalidText, Misplaced
from gateway.core.origin import new_id
from gateway.core.readings import ProgressListener, Readings
from gateway.core.restores import RestoredController, Restores, answers_of, baud_of, scales_of
from gateway.core.works import left_s

COMMENT_COLUMN = 30
MOST_TOLD = 100
"""Faults of a text that are told at once, at most."""

_HEADING = re.compile(r"\[\s*(?P<words>[^\[\]]*?)\s*\]\s*(;.*)?")


class BackupLine(NamedTuple):
    """A line of a section."""

    number: int
    """Number of the line, from 1."""
    text: str


class BackupPart(NamedTuple):
    """The part of a backup that is about one controller."""

    name: str
    """Name in the heading: a body's number, a robot's id."""
    line: int
    sections: dict[str, list[BackupLine]]
    headings: dict[str, int]
    """The lines of the sections' headings."""


def refuse(faults: Sequence[Misplaced]) -> None:
    """Refuse a text that has faults.

    :raises InvalidText: it has, each with its line and column.
    """
    if faults:
        first = faults[0]
        more = f" There are {len(faults)} faults in all." if len(faults) > 1 else ""
        raise InvalidText(
            "backup",
            f"Line {first.line}, column {first.column}: {first.reason}{more} Nothing was sent.",
            "Correct the backup.",
            faults[:MOST_TOLD],
        )


def parts_of(text: str, kind: str) -> list[BackupPart]:
    """Cut a backup into its parts and their sections; `kind` begins the heading of a part, such as `body`.

    :raises InvalidText: a line has no place, a heading comes twice, or there is no part.
    """
    parts: list[BackupPart] = []
    faults: list[Misplaced] = []
    lines: list[BackupLine] | None = None
    for number, raw in enumerate(text.splitlines(), 1):
        line = raw.strip()
        heading = _HEADING.fullmatch(line)
        if heading is None:
            if lines is not None:
                lines.append(BackupLine(number, raw))
            elif line and not line.startswith(";"):
                faults.append(Misplaced(number, 1, "A heading such as [settings] has to come first."))
            continue
        words = " ".join(heading["words"].split())
        begins, _, name = words.partition(" ")
        if begins == kind:
            lines = None
            if any(part.name == name for part in parts):
                faults.append(Misplaced(number, 1, f"[{words}] comes twice."))
            parts.append(BackupPart(name, number, {}, {}))
        elif not parts or words in parts[-1].sections:
            twice = f"[{words}] comes twice."
            missing = f"A heading such as [{kind} ...] has to come first."
            faults.append(Misplaced(number, 1, twice if parts else missing))
        else:
            lines = parts[-1].sections[words] = []
            parts[-1].headings[words] = number
    if not parts and not faults:
        faults.append(Misplaced(1, 1, f"There is no heading [{kind} ...]."))
    empty = [part for part in parts if not part.sections]
    faults += [Misplaced(part.line, 1, f"[{kind} {part.name}] has no sections.") for part in empty]
    refuse(sorted(faults))
    return parts


def commented(text: str, comment: str) -> str:
    """A line with its comment."""
    return f"{text:<{COMMENT_COLUMN - 1}} ; {comment}\n"


def section(name: str, lines: Iterable[str]) -> str:
    """A section with its heading."""
    return f"\n[{name}]\n{''.join(lines)}"


C = TypeVar("C", bound=RestoredController)


class BackupSource(Protocol):
    """A controller that is read."""

    @property
    def address(self) -> str:
        """Unique address of the controller."""

    @property
    def baud(self) -> int | None:
        """The speed of its line; None where its port does not tell."""

    async def require_ready(self) -> None:
        """Make sure that it answers, and is not being changed as a whole.

        :raises GatewayError: it does not, or it is.
        """

    async def read(self, progress: ProgressListener, /) -> str:
        """Read all that it keeps, as text.

        :raises GatewayError: it was not read.
        """


class Backups(Readings[Backup]):
    """The backups of a plant, one at a time of each target."""

    noun = "backup"

    async def start(self, target: str, preamble: str, sources: Sequence[BackupSource]) -> Backup:
        """Begin to read controllers, one after the other.

        :raises BodyBusy: a backup of the same is being read.
        :raises GatewayError: one of them does not answer, or is being changed.
        """
        self.require_none(target)
        for source in sources:
            await source.require_ready()
        self.require_none(target)
        now = datetime.now(UTC)
        addresses = [source.address for source in sources]
        baud = next((source.baud for source in sources), None)
        record = Backup(id=new_id(now), target=target, controllers=addresses, baud=baud, started_at=now)
        return self.follow(record, partial(_read, record, preamble, sources))


async def _read(
    record: Backup, preamble: str, sources: Sequence[BackupSource], progress: ProgressListener
) -> None:
    text = preamble
    for source in sources:
        record.controller = source.address
        text += await source.read(progress)
    record.text = text


class Comparisons(Readings[BackupComparison]):
    """The comparisons of controllers with backups, one at a time of each target."""

    noun = "comparison"

    def start(self, target: str, restores: Restores[C], controllers: Sequence[C]) -> BackupComparison:
        """Begin to tell what a restore would do, controller by controller.

        :raises BodyBusy: a comparison of the same is under way, or a controller is being restored.
        """
        self.require_none(target)
        for controller in controllers:
            restores.require_none(controller.address)
        now = datetime.now(UTC)
        addresses = [controller.address for controller in controllers]
        record = BackupComparison(
            id=new_id(now),
            target=target,
            controllers=addresses,
            scales=scales_of(controllers),
            baud=baud_of(controllers),
            started_at=now,
        )
        return self.follow(record, partial(_compare, record, restores, controllers))


async def _compare(
    record: BackupComparison, restores: Restores[C], controllers: Sequence[C], progress: ProgressListener
) -> None:
    began_at = asyncio.get_running_loop().time()
    commands: list[str] = []
    differences: list[Difference] = []
    progress.expect(answers_of(controllers))
    for controller in controllers:
        record.controller = controller.address
        found = await restores.plan(record.target, [controller], progress)
        commands += found.commands
        differences += found.differences
    record.commands, record.differences, record.differing = commands, differences, differing(differences)
    took_s = asyncio.get_running_loop().time() - began_at
    record.restore_s = left_s(3 * record.read + len(commands), record.read, took_s, record.baud)
