"""A gateway as a member of a plant: it forwards its events, says that it lives, and hears stops of the plant.

Nothing in the gateway waits for this. It sends from the journal, so an outage of the servers, or of
the network, loses nothing that the journal still has.
"""

import asyncio
import json
import logging
import re
from collections.abc import Mapping, Sequence
from contextlib import suppress
from time import monotonic
from typing import Any, Final, NoReturn
from uuid import uuid4

from nats.aio.msg import Msg
from pydantic import ValidationError
from pydantic_core import to_jsonable_python

from fleet.claims import Claims
from fleet.cursors import is_cursor
from fleet.engine import (
    CURSOR,
    LAST_SEQUENCE,
    MESSAGE_ID,
    STOP,
    STREAM,
    Connection,
    EngineTrouble,
    Unfit,
    connected,
    entry_of,
    events_of,
    reports_of,
)
from fleet.fitness import faults_of
from fleet.stop_message import StopMessage
from fleet.tasks import end
from gateway.access.principal import EVERYBODY, Principal, asking
from gateway.core.errors import GatewayError
from gateway.core.events import GAP, SNAPSHOT, Event
from gateway.core.origin import Origin, acting, current
from gateway.core.parts import GATEWAY
from gateway.door import stopping
from gateway.door.results import told
from gateway.membership import Membership, PlantOfGateways
from gateway.plant import Plant
from gateway.version import VERSION

log = logging.getLogger(__name__)

REGISTER_S: Final = 2.0
BATCH: Final = 500
"""Events that the stream takes, or refuses, together; a server takes 1,000 at most."""
AT_ONCE: Final = 32
"""Events that are written before all else in the gateway has a turn."""
AGAIN_S: Final = 1.0
TAKEN_S: Final = 30.0
"""Seconds until it is looked again if another gateway has the same name."""
UNREACHABLE_S: Final = 5.0
"""Seconds for which a trouble has to last before it becomes an alarm."""
HEADERS_BYTES: Final = 1024
TOO_LARGE: Final = "left out: larger than a message of the plant may be"

_ID: Final = re.compile(r'"id":"([^"]+)"')
_CURSOR: Final = re.compile(r'"cursor":"([^"]+)"')
"""Both stand in the head of an event, before its data."""


class Overtaken(Exception):
    """Another writer was faster at this gateway's subject: where its events end is to be read again."""


class NotAlone(Exception):
    """After events of this process there are others in the stream: another gateway has the same name."""


class Member:
    """Forwards the events of a plant of lines, from `start` to `stop`."""

    def __init__(
        self,
        settings: PlantOfGateways,
        plant: Plant,
        membership: Membership,
        url: str,
        fingerprint: str | None,
    ) -> None:
        self._settings, self._plant, self._membership = settings, plant, membership
        self._url, self._fingerprint = settings.url or url, fingerprint
        self._claims = Claims(plant)
        self._connection: Connection | None = None
        self._news = asyncio.Event()
        self._task: asyncio.Task[None] | None = None
        self._stops: set[asyncio.Task[None]] = set()
        self._troubled_since: float | None = None
        self._sent = False
        """True once the stream has taken events of this process."""

    def start(self) -> None:
        """Begin, in a task of its own."""
        self._plant.events.listeners.append(self._note_event)
        self._task = asyncio.create_task(self._run(), name="member of the plant")

    async def stop(self) -> None:
        """End the membership; events that the stream does not have yet are sent after the next start."""
        if self._task is not None:
            await end([self._task])

    def _note_event(self, event: Event) -> None:
        self._news.set()
        self._claims.note_event(event)

    async def _run(self) -> None:
        self._troubled_since = monotonic()
        while True:
            why = "the connection has ended"
            try:
                await self._belong()
            except EngineTrouble as trouble:
                why = str(trouble)
            except Exception as fault:  # the gateway goes on, and so does the next attempt
                log.exception("the forwarding of events has met a fault of the gateway itself")
                why = f"a fault of the gateway itself, {type(fault).__name__}"
            self._note_trouble(why)
            await asyncio.sleep(AGAIN_S)

    def _note_trouble(self, why: str, lasts_s: float = UNREACHABLE_S) -> None:
        """Tell of a trouble once, when it has lasted."""
        now = monotonic()
        if self._troubled_since is None:
            self._troubled_since = now
        if now - self._troubled_since >= lasts_s and self._membership.trouble is None:
            self._membership.trouble = why
            log.warning("the servers of the plant do not take events: %s", why)
            self._plant.events.publish("plant.unreachable", GATEWAY, {"reason": why})

    def _note_success(self) -> None:
        self._troubled_since = None
        if self._membership.trouble is not None:
            self._membership.trouble = None
            log.info("the servers of the plant take events again")
            self._plant.events.publish("plant.reached", GATEWAY, {})

    async def _belong(self) -> None:
        """Be a member for as long as one connection lasts.

        :raises EngineTrouble: it has ended, or the servers do not take the events.
        """
        name = self._membership.name
        faults = await asyncio.to_thread(lambda: list(faults_of(self._settings)))
        if faults:
            raise Unfit(faults[0])
        async with connected(self._settings, name, f"_INBOX_{name}") as connection:
            self._connection = connection
            await connection.nats.subscribe(STOP, cb=self._hear_stop)
            await self._claims.agree(connection)
            work = [
                asyncio.create_task(part, name="member of the plant")
                for part in (self._register(connection), self._forward(connection))
            ]
            try:
                await asyncio.wait({*work, connection.ended}, return_when=asyncio.FIRST_COMPLETED)
                for task in work:
                    if task.done():
                        task.result()
            finally:
                self._claims.note_end()
                self._connection = None
                await end(work)
        raise EngineTrouble("the connection has ended")

    # the registry

    async def _register(self, connection: Connection) -> NoReturn:
        """Say every two seconds that this gateway lives, and what it serves."""
        while True:
            entry = json.dumps(self._entry()).encode()
            await connection.nats.publish(entry_of(self._membership.name), entry)
            await asyncio.sleep(REGISTER_S)

    def _entry(self) -> Mapping[str, Any]:
        return {
            "name": self._membership.name,
            "url": self._url,
            "fingerprint": self._fingerprint,
            "lines": list(self._plant.ports()),
            "owners": {line: name for line in self._plant.ports() if (name := self._elsewhere(line))},
            "version": VERSION,
            "cursor": self._plant.events.cursor,
        }

    def _elsewhere(self, line_id: str) -> str | None:
        return self._plant.peers.ownership.elsewhere(line_id)

    # events

    async def _forward(self, connection: Connection) -> None:
        """Send what the stream does not have, and then what happens, in the order of the journal."""
        while True:
            try:
                cursor, sequence = await self._last_taken(connection)
                await self._require_own(cursor, sequence)
                self._note_success()
                await self._send_on(connection, cursor, sequence)
            except Overtaken:
                await asyncio.sleep(AGAIN_S)
            except NotAlone:
                name = self._membership.name
                self._note_trouble(f"another gateway calls itself {name}, too: give it another plant.name", 0)
                await asyncio.sleep(TAKEN_S)

    async def _require_own(self, cursor: str | None, sequence: int) -> None:
        """See that the last event in the stream is this gateway's own, if it has sent any.

        :raises NotAlone: it is not. All of the journal would be sent again after it, and again.
        """
        if not self._sent or not sequence:
            return
        page = await self._plant.events.since(cursor, limit=1)
        if cursor is None or any(event.type == GAP for event in page.events):
            raise NotAlone

    async def _send_on(self, connection: Connection, cursor: str | None, sequence: int) -> NoReturn:
        hub = self._plant.events
        while True:
            self._news.clear()
            page = await hub.since(cursor, limit=BATCH)
            cursor = page.cursor
            self._membership.behind = hub.last - int(cursor.rpartition("-")[2])
            if events := [event for event in page.events if event.type != SNAPSHOT]:
                sequence = await self._send(connection, events, sequence)
                self._sent = True
                self._membership.forwarded += len(events)
            else:
                await self._news.wait()

    async def _last_taken(self, connection: Connection) -> tuple[str | None, int]:
        """Find the place behind the last event that the stream has of this gateway.

        A server that lags behind may tell an older one: then what is sent next is refused, and asked again.

        :raises EngineTrouble: there is no stream, or it tells nothing.
        """
        told = await connection.request(f"$JS.API.DIRECT.GET.{STREAM}.{events_of(self._membership.name)}")
        headers = told.headers or {}
        if headers.get("Status") == "404":
            return None, 0
        if "Nats-Sequence" not in headers:
            raise EngineTrouble(
                f"the stream {STREAM} tells nothing: {headers.get('Description', 'no sequence')}"
            )
        cursor = headers.get(CURSOR, "")
        # No gateway has written one that is none: who has stolen the password has.
        return cursor if is_cursor(cursor) else None, int(headers["Nats-Sequence"])

    async def _send(self, connection: Connection, events: Sequence[Event], sequence: int) -> int:
        """Publish all of these events or none, directly behind this gateway's last message in the stream.

        :raises Overtaken: another message came between; nothing was taken.
        :raises EngineTrouble: the events may or may not have been taken.
        """
        *first, last = [self._message(connection, event) for event in events]
        subject = events_of(self._membership.name)
        batch = {"Nats-Batch-Id": uuid4().hex} if first else {}
        expected = {LAST_SEQUENCE: str(sequence)}
        for number, (payload, headers) in enumerate(first, 1):
            numbered = {**batch, "Nats-Batch-Sequence": str(number), **(expected if number == 1 else {})}
            await connection.nats.publish(subject, payload, headers={**headers, **numbered})
            if number % AT_ONCE == 0:
                await asyncio.sleep(0)
        payload, headers = last
        if first:
            ending = {**batch, "Nats-Batch-Sequence": str(len(events)), "Nats-Batch-Commit": "1"}
        else:
            ending = expected
        answer = json.loads((await connection.request(subject, payload, {**headers, **ending})).data)
        if "error" in answer or answer.get("duplicate"):
            if answer.get("error", {}).get("err_code") in _OVERTAKEN or answer.get("duplicate"):
                raise Overtaken
            raise EngineTrouble(f"the stream {STREAM} takes no events: {answer['error'].get('description')}")
        return int(answer["seq"])

    def _message(self, connection: Connection, event: Event) -> tuple[bytes, dict[str, str]]:
        """Give an event as it was written: one of an earlier life keeps the epoch of that."""
        content = event.json.encode()
        id_, cursor = (
            match[1] if (match := pattern.search(event.json)) else event.cursor for pattern in (_ID, _CURSOR)
        )
        if len(content) > connection.nats.max_payload - HEADERS_BYTES:
            content = json.dumps({**json.loads(content), "data": {"detail": TOO_LARGE}}).encode()
        return content, {MESSAGE_ID: id_, CURSOR: cursor}

    # stops

    async def _hear_stop(self, message: Msg) -> None:
        """Stop everything because of a message; one whose key is not good here is refused and counted."""
        try:
            asked = StopMessage.model_validate_json(message.data)
        except ValidationError:
            log.warning("a stop of the plant that cannot be read is left unheeded")
            return
        who = self._caller(asked)
        if who is None:
            await self._report(asked, {"refused": "The key is not good here; nothing was stopped."})
            return
        stopping_all = asyncio.create_task(self._stop_all(asked, who), name="stop of the plant")
        self._stops.add(stopping_all)
        stopping_all.add_done_callback(self._stops.discard)

    def _caller(self, asked: StopMessage) -> Principal | None:
        if self._plant.config.access.mode == "open":
            return EVERYBODY
        grant = self._plant.access.credentials.to_stop(asked.key_prefix, asked.key_sha256)
        return None if grant is None else grant.principal

    async def _stop_all(self, asked: StopMessage, who: Principal) -> None:
        with asking(who), acting(Origin(f"{who.name} (plant)", asked.request_id)):
            stop = stopping.stop_all(self._plant, current(), asked.mode)
            try:
                stopped, _ = await asyncio.gather(stop, self._report(asked, {"received": True}))
                report = to_jsonable_python(told(stopped, "/stop"))
            except GatewayError as error:
                await self._report(asked, {"failed": error.detail})
            else:
                await self._report(asked, {"report": report})

    async def _report(self, asked: StopMessage, content: Mapping[str, Any]) -> None:
        connection = self._connection
        with suppress(Exception):  # the stop counts, not who hears of it
            if connection is not None:
                subject = reports_of(self._membership.name, asked.request_id)
                await connection.nats.publish(subject, json.dumps(content).encode())


_OVERTAKEN: Final = frozenset({10071, 10164, 10201})
"""Error codes of JetStream: wrong last sequence, of a batch too; a message id that is there already."""
