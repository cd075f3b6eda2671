"""The memory of a plant over restarts: events, moves, long work, and what was under way when it ended."""

import logging
import time
from collections.abc import Collection, Mapping, Sequence
from datetime import UTC, datetime
from functools import partial
from typing import Any, Union

from pydantic import TypeAdapter
from pydantic_core import from_json

from gateway.core.alarms import Alarm, Alarms
from gateway.core.events import Event, EventHub
from gateway.core.family import AnyLine, Registered
from gateway.core.journal import writes
from gateway.core.journal.intents import Intents
from gateway.core.journal.opening import Beginning, OpenedJournal
from gateway.core.journal.writes import Write
from gateway.core.known import FactStore
from gateway.core.move_record import MoveRecord, MoveStatus
from gateway.core.origin import go_on_after
from gateway.core.parts import GATEWAY
from gateway.core.works import Dated, DurableJobs
from gateway.families import registered

log = logging.getLogger(__name__)


def make_sense(past: Beginning) -> None:
    """Make sure that the records of an earlier life can be read.

    :raises ValueError: one cannot.
    """
    kinds: Any = Union[tuple(record for kind in registered() for record in kind.move_records)]  # noqa: UP007
    moves = TypeAdapter[MoveRecord](kinds)
    for record in past.moves:
        moves.validate_json(record)
    for alarm in past.alarms:
        Alarm.model_validate_json(alarm)


class Persistence:
    """The journal of a plant, and what writes into it."""

    def __init__(
        self,
        opened: OpenedJournal,
        events: EventHub,
        alarms: Alarms,
        registered: Collection[Registered],
        known: FactStore,
    ) -> None:
        self.journal, self._past, self._set_aside = opened
        self._events, self._alarms, self._registered = events, alarms, registered
        self.journal.on_trouble = self._tell_of_trouble
        past = self._past
        go_on_after(past.last_id)
        events.resume(past.epoch, past.earlier, past.last_event, past.events)
        events.listeners.append(self._keep_event)
        known.resume(past.known)
        known.on_change = self._keep_known

    def keep(self, line: AnyLine) -> None:
        """Write down what a line does with an effect."""
        line.intents = Intents(self.journal, line.address_of)

    def start(self, works: Mapping[str, DurableJobs[Any]]) -> None:
        """Begin to write, tell how the last life ended, and take over its moves and `works`, by their kinds.

        The lines are built.
        """
        self.journal.start()
        self._alarms.resume(map(Alarm.model_validate_json, self._past.alarms))
        self._alarms.on_change = self._keep_alarm
        records = [from_json(record) for record in self._past.moves]
        self._tell_of_the_past(records)
        for record in records:
            if record["status"] == MoveStatus.QUEUED:
                _note_preparation(record, self._past.prepared.get(record["id"], ()))
        for intent in self._past.open_intents:
            detail = "The gateway has ended before this was known."
            self.journal.note(writes.ended(intent.id, time.time(), "unknown", detail))
        for package in self._registered:
            for moves in package.move_logs():
                moves.on_change = self._keep_move
            package.resume(records, self._past.begun)
        for kind, those in works.items():
            those.on_change = partial(self._keep_work, kind, those)
            those.resume(record for its_kind, record in self._past.works if its_kind == kind)

    async def close(self) -> None:
        """Write what waits; this life has ended well."""
        await self.journal.close()

    def _keep_event(self, event: Event) -> None:
        self.journal.note(writes.event(event.number, time.time(), event.type, event.subject, event.json))

    def _keep_known(self, address: str, fact: str) -> None:
        self.journal.note_newest((writes.KNOWN, address), partial(writes.known, address, fact))

    def _keep_move(self, move: MoveRecord) -> None:
        self.journal.note_newest(move.id, partial(_written, move))

    def _keep_work(self, kind: str, works: DurableJobs[Any], record: Dated) -> None:
        self.journal.note_newest(record.id, partial(_written_work, kind, works, record))

    def _keep_alarm(self, alarm: Alarm) -> None:
        self.journal.note(
            writes.alarm(
                alarm.id,
                alarm.raised_at.timestamp(),
                alarm.subject,
                alarm.cause,
                alarm.model_dump_json(),
                reset_at=None if alarm.reset_at is None else alarm.reset_at.timestamp(),
                reset_by=alarm.reset_by,
            )
        )

    # what is told

    def _tell_of_trouble(self, why: str | None) -> None:
        if why is None:
            for alarm in self._alarms.standing():  # what was raised meanwhile was not written
                self._keep_alarm(alarm)
            self._events.publish("gateway.journal.recovered", GATEWAY, {})
        else:
            self._events.publish("gateway.journal.trouble", GATEWAY, {"reason": why})

    def _tell_of_the_past(self, records: list[dict[str, Any]]) -> None:
        if self._set_aside is not None:
            self._events.publish("gateway.journal.set_aside", GATEWAY, {"file": str(self._set_aside)})
        if self.journal.trouble is not None:
            self._tell_of_trouble(self.journal.trouble)
        if self._past.was_clean:
            return
        moves = {record["id"]: record["body_id"] for record in records if record["ended_at"] is None}
        seen_at = self._past.seen_at and datetime.fromtimestamp(self._past.seen_at, UTC).isoformat()
        told = {
            "last_seen_at": seen_at,
            "moves": list(moves),
            "targets": list(moves.values()),
            "commands": list(
                dict.fromkeys(f"{intent.command} to {intent.target}" for intent in self._past.open_intents)
            ),
        }
        log.error("the last life of the gateway did not end as it should; its alarm tells what was under way")
        self._events.publish("gateway.crashed", GATEWAY, told)


def _written(move: MoveRecord) -> Write:
    at, final = move.created_at.timestamp(), move.status.final
    return writes.move(move.id, at, move.body_id, move.model_dump_json(), final=final)


def _written_work(kind: str, works: DurableJobs[Any], record: Dated) -> Write:
    text = works.as_kept(record).model_dump_json()
    return writes.work(record.id, kind, record.started_at.timestamp(), text, over=record.ended_at is not None)


def _note_preparation(record: dict[str, Any], frames: Sequence[str]) -> None:
    sentence = f"To prepare it, {', '.join(frames)} may have been sent."
    if frames and sentence not in record["evidence"]:
        record["evidence"].append(sentence)
