"""Long work that changes controllers: its records outlive the gateway, and what was cut off is told."""

import logging
from abc import abstractmethod
from collections.abc import Callable, Iterable
from datetime import datetime
from typing import Any, ClassVar, Protocol, TypeVar

from pydantic import BaseModel

from gateway.core.works import GATEWAY_ENDED, CutOff, Jobs, WorkRecord

log = logging.getLogger(__name__)


class Dated(WorkRecord, Protocol):
    """A record that says when its work was over."""

    started_at: datetime
    ended_at: datetime | None


K = TypeVar("K", bound=Dated)


class DurableJobs(Jobs[K]):
    """The work of one kind; each change of a record that is worth an event is worth to be kept."""

    record_type: ClassVar[type[BaseModel]]

    def __init__(
        self,
        history: int,
        what: str,
        subject_of: Callable[[K], str],
        publish: Callable[[str, K], None],
    ) -> None:
        super().__init__(history, what, subject_of)
        self._publish = publish
        self.on_change: Callable[[K], None] = lambda _record: None
        """Called with each record that has changed."""

    def tell(self, what: str, record: K) -> None:
        """Tell how far work has come, or how it has ended."""
        self.on_change(record)
        self._publish(what, record)

    def as_kept(self, record: K) -> Any:
        """Give the form in which a record is kept."""
        return record

    def resume(self, records: Iterable[str]) -> None:
        """Remember the work of an earlier life, oldest first; what was not over then was cut off."""
        for text in records:
            try:
                record: Any = self.record_type.model_validate_json(text)
            except ValueError:
                log.warning(
                    "a %s of an earlier life cannot be read, and is forgotten: %.200r", self._what, text
                )
                continue
            self._keep(record)
            self.cut_off(record, GATEWAY_ENDED)

    def cut_off(self, record: K, why: CutOff, /) -> None:
        """Say so in a record that has not told its end yet."""
        if record.ended_at is None:
            self.note_cut_off(record, why)

    @abstractmethod
    def note_cut_off(self, record: K, why: CutOff, /) -> None:
        """Say in a record why its work has not come to its end, and what that has left."""
