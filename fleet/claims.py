"""Claims of gateways: each says which lines with a spare it owns, and which moves are under way there."""

import asyncio
import json
import logging
from collections.abc import Coroutine

from nats.aio.msg import Msg

from fleet.engine import OWNERS, Connection, EngineTrouble, claim_of
from gateway.core.events import Event
from gateway.plant import Plant

log = logging.getLogger(__name__)


class Claims:
    """Hears the claims of others, and makes those of this gateway, over one connection at a time."""

    def __init__(self, plant: Plant) -> None:
        self._plant, self._ownership = plant, plant.peers.ownership
        self._connection: Connection | None = None
        self._news: set[str] = set()
        """Lines with moves that others have not heard of."""
        self._sending: set[asyncio.Task[None]] = set()

    async def agree(self, connection: Connection) -> None:
        """Read the claims of the other gateways before this one claims any line.

        :raises EngineTrouble: the servers do not answer.
        """
        lines = self._ownership.owners
        if not lines:
            return
        await connection.nats.subscribe(f"$KV.{OWNERS}.*.*", cb=self._hear)
        for line, owners in lines.items():
            for gateway in owners:
                self._note(gateway, line, await self._asked(connection, gateway, line))
        for line, epoch in self._ownership.held().items():
            await self._claim(connection, line, epoch)
        self._connection = connection
        self._ownership.on_claim = lambda line, epoch: self._soon(self._claim(connection, line, epoch))
        self._ownership.is_current = True

    def note_end(self) -> None:
        """The connection has ended: what others say is not heard any more."""
        self._connection = None
        self._ownership.is_current = False
        self._ownership.on_claim = lambda _line, _epoch: None

    def note_event(self, event: Event) -> None:
        """Publish which moves are under way on a line, for the gateway that may take the line over."""
        if self._connection is None or not self._ownership.owners or ".move." not in event.type:
            return
        line = self._plant.line_of(event.subject)
        if line in self._ownership.held() and line not in self._news:
            self._news.add(line)
            self._soon(self._tell_news(self._connection, line))

    async def _tell_news(self, connection: Connection, line: str) -> None:
        self._news.discard(line)
        if (epoch := self._ownership.held().get(line)) is not None:
            await self._claim(connection, line, epoch)

    async def _asked(self, connection: Connection, gateway: str, line: str) -> bytes:
        told = await connection.request(f"$JS.API.DIRECT.GET.KV_{OWNERS}.{claim_of(gateway, line)}")
        status = (told.headers or {}).get("Status")
        if status not in (None, "404"):
            raise EngineTrouble(
                f"nobody tells who has line {line}: {(told.headers or {}).get('Description')}"
            )
        return b"" if status else told.data

    async def _hear(self, message: Msg) -> None:
        _, _, gateway, line = message.subject.split(".")
        self._note(gateway, line, message.data)

    def _note(self, gateway: str, line: str, content: bytes) -> None:
        if not content:
            return
        try:
            told = json.loads(content)
            epoch, moves = int(told["epoch"]), [dict(move) for move in told.get("moves", ())]
        except (ValueError, KeyError, TypeError) as error:
            log.warning("a claim of %s for line %s cannot be read: %s", gateway, line, error)
            return
        self._ownership.note_left(line, gateway, moves)
        self._ownership.note_claim(line, gateway, epoch)

    def _soon(self, saying: Coroutine[None, None, None]) -> None:
        task = asyncio.get_running_loop().create_task(self._said(saying), name="claim")
        self._sending.add(task)
        task.add_done_callback(self._sending.discard)

    async def _said(self, saying: Coroutine[None, None, None]) -> None:
        try:
            await saying
        except EngineTrouble as trouble:  # all is said again over the next connection
            log.info("nobody hears what this gateway says of its lines: %s", trouble)

    async def _claim(self, connection: Connection, line: str, epoch: int) -> None:
        subject = claim_of(self._ownership.name, line)
        moves = [move.model_dump(mode="json") for move in self._plant.moves_under_way(line)]
        await connection.request(subject, {"epoch": epoch, "moves": moves})
