"""Settings that a trial has to set back, written down before they are set: a trial may be killed."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from pydantic import BaseModel, TypeAdapter

from gateway.core.whole_files import write_whole


class Debt(BaseModel):
    """A command that sets something back."""

    place: int
    """The body, or the unit that a robot has to have selected; 0 where a robot needs none."""
    command: str
    """The name of its row."""
    fields: dict[str, Any]


class DebtsUnreadable(Exception):
    """The settings that an earlier commissioning has left cannot be known; nothing was sent."""


_DEBTS = TypeAdapter(list[Debt])


class Debts:
    """The debts of a line, in a file beside its configuration; without a file they are kept nowhere."""

    def __init__(self, file: Path | None = None) -> None:
        self.file = file
        self._owed: list[Debt] = []

    def left(self) -> Sequence[Debt]:
        """Debts that a trial has left that was killed, the last one first.

        :raises OSError: the file cannot be read.
        :raises ValueError: the file is none of debts.
        """
        try:
            text = "[]" if self.file is None else self.file.read_text("utf-8")
        except FileNotFoundError:
            text = "[]"
        self._owed = _DEBTS.validate_json(text)
        return self._owed[::-1]

    def note(self, debt: Debt) -> None:
        """Write a debt down.

        :raises OSError: it cannot be written.
        """
        self._keep([*self._owed, debt])

    def cross_out(self, debt: Debt) -> None:
        """Forget a debt that is paid; the file goes with the last one.

        :raises OSError: it cannot be written.
        """
        owed = [*self._owed]
        owed.remove(debt)
        self._keep(owed)

    def _keep(self, owed: list[Debt]) -> None:
        """Write debts down, and only then count with them."""
        if self.file is not None and owed:
            write_whole(self.file, _DEBTS.dump_json(owed, indent=1).decode())
        elif self.file is not None:
            self.file.unlink(missing_ok=True)
        self._owed = owed


def debts_file(config: Path, line_id: str) -> Path:
    """The file of the debts of a line."""
    return config.with_name(f"{config.name}.{line_id}.owed")
