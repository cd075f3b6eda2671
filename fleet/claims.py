"""What gateways say of the lines that several of them may have: each says it of itself."""

import asyncio
import json
import logging

from nats.aio.msg import Msg

from fleet.engine import OWNERS, Connection, EngineTrouble, claim_of
from gateway.ownership import Ownership

log = logging.getLogger(__name__)


class Claims:
    """Hears the claims of others, and makes those of this gateway, over one connection at a time."""

    def __init__(self, ownership: Ownership) -> None:
        self._ownership = ownership
        self._sending: set[asyncio.Task[None]] = set()

    async def agree(self, connection: Connection) -> None:
        """Hear what others say before anything is claimed.

        :raises EngineTrouble: nobody tells.
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
        self._ownership.on_claim = lambda line, epoch: self._claim_soon(connection, line, epoch)
        self._ownership.is_current = True

    def note_end(self) -> None:
        """The connection has ended: what others say is not heard any more."""
        self._ownership.is_current = False
        self._ownership.on_claim = lambda _line, _epoch: None

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
            epoch = int(json.loads(content)["epoch"])
        except (ValueError, KeyError, TypeError) as error:
            log.warning("a claim of %s for line %s cannot be read: %s", gateway, line, error)
            return
        self._ownership.note_claim(line, gateway, epoch)

    def _claim_soon(self, connection: Connection, line: str, epoch: int) -> None:
        task = asyncio.get_running_loop().create_task(self._claim(connection, line, epoch), name="claim")
        self._sending.add(task)
        task.add_done_callback(self._sending.discard)

    async def _claim(self, connection: Connection, line: str, epoch: int) -> None:
        subject = claim_of(self._ownership.name, line)
        await connection.request(subject, {"epoch": epoch})
