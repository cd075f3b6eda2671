"""The plant as the gateway's documents tell it, kept up to date by its events and by a slow sweep."""

import asyncio
from collections import OrderedDict
from collections.abc import Callable, Iterable, Mapping
from typing import Any, Final
from urllib.parse import quote

from motion_gateway_client import AsyncGateway, GatewayError, Refused

Document = dict[str, Any]
OnChange = Callable[[str, Document | None], object]

GATHER_S: Final = 0.02
"""Events that come together cause one reading."""
AGAIN_S: Final = 0.25
"""A document is read no sooner again, however many events are about it."""
SWEEP_S: Final = 60.0
"""Everything is read once in this time: no event tells that a value has grown older, or was read anew."""
TRY_AGAIN_S: Final = 1.0
READERS: Final = 4
"""Documents that are asked for at a time: the gateway serves others meanwhile."""
MOST_ALARMS: Final = 2000
NOT_FOUND: Final = 404
_ALL: Final = frozenset({"stream.gap", "gateway.crashed", "gateway.reloaded"})
"""Event types after which every document is read again: events were lost, or the gateway began anew."""


class Mirror:
    """Documents by their paths, as GET gives them: `/bodies/line1.3F`, `/robots/r1/units/1`, `/alarms/a-1`.

    Bodies, lines, robots with their units, SCARA robots, and the alarms that stand. `on_change` is called
    with each document that was read, and with None where one has gone.
    """

    def __init__(self, gateway: AsyncGateway) -> None:
        self._gateway = gateway
        self.documents: dict[str, Document] = {}
        self.on_change: OnChange = lambda _path, _document: None
        self.on_trouble: Callable[[GatewayError], object] = lambda _error: None
        """Called with what keeps documents from being read; they are tried again."""
        self.known = asyncio.Event()
        """Set once everything was read."""
        self._due: OrderedDict[str, None] = OrderedDict()
        self._read_at: dict[str, float] = {}
        self._dependent: set[str] = set()
        """Paths of what changes with events about others: alarms, and SCARA robots with their bodies."""
        self._news = asyncio.Event()
        self._all_due = True

    def note(self, event: Mapping[str, Any]) -> None:
        """Mark what an event is about: it is read soon."""
        if event["type"] in _ALL:
            self._all_due = True
        elif event["type"].startswith("alarm."):
            self._mark([f"/alarms/{event['data']['id']}"])
        else:
            self._mark(self._about(event["subject"]))
        self._news.set()

    async def run(self) -> None:
        """Read what is marked, and everything once a sweep, for ever."""
        swept_at = _now()
        while True:
            try:
                if self._all_due:
                    await self._read_all()
                    swept_at = _now()
                elif _now() - swept_at >= SWEEP_S:
                    await self._sweep()
                    swept_at = _now()
                await self._read_due()
            except GatewayError as error:
                self.on_trouble(error)
                await asyncio.sleep(TRY_AGAIN_S)
            await self._wait_for_work(swept_at + SWEEP_S)

    async def _read_all(self) -> None:
        self._all_due = False
        try:
            found = await self._list()
        except BaseException:
            self._all_due = True
            raise
        for path in self.documents.keys() - found:
            self._forget(path)
        self.known.set()

    async def _scaras(self) -> list[Document]:
        """The SCARA robots: none of a gateway without their extension."""
        try:
            listed: list[Document] = (await self._gateway.call("GET", "/scaras"))["scaras"]
        except Refused as refusal:
            if refusal.status != NOT_FOUND:
                raise
            return []
        return listed

    async def _list(self) -> set[str]:
        """Read all collections; gives the paths of what there is."""
        lines = (await self._gateway.call("GET", "/lines"))["lines"]
        robots = (await self._gateway.call("GET", "/robots"))["robots"]
        scaras = await self._scaras()
        query = {"standing": "true", "limit": MOST_ALARMS}
        alarms = (await self._gateway.call("GET", "/alarms", query=query))["alarms"]
        found: set[str] = set()
        for kind, id_, documents in (
            ("lines", "line_id", lines),
            ("robots", "robot_id", robots),
            ("scaras", "scara_id", scaras),
            ("alarms", "id", alarms),
        ):
            for document in documents:
                found.update(self._take(f"/{kind}/{quote(document[id_])}", document))
        bodies = [f"/bodies/{quote(body)}" for line in lines for body in line.get("bodies", ())]
        await self._read(bodies)
        return found.union(bodies)

    async def _sweep(self) -> None:
        """Read everything again, a little at a time."""
        for path in [path for path in self.documents if "/units/" not in path]:
            await self._read([path])
            await asyncio.sleep(0.5 * SWEEP_S / (len(self.documents) + 1))
            await self._read_due()

    async def _read_due(self) -> None:
        now = _now()
        paths = [path for path in self._due if self._read_at.get(path, 0.0) + AGAIN_S <= now]
        for path in paths:
            del self._due[path]
        try:
            await self._read(paths)
        except BaseException:
            self._mark(paths)
            raise

    async def _wait_for_work(self, sweep_at: float) -> None:
        if self._all_due:
            return
        now = _now()
        due = (self._read_at.get(path, 0.0) + AGAIN_S for path in self._due)
        wait_s = min(due, default=sweep_at) - now
        self._news.clear()
        try:
            async with asyncio.timeout(max(wait_s, GATHER_S)):
                await self._news.wait()
        except TimeoutError:
            return
        await asyncio.sleep(GATHER_S)

    async def _read(self, paths: Iterable[str]) -> None:
        """Read some documents, a few at a time.

        :raises GatewayError: one cannot be read.
        """
        left = iter(paths)

        async def read_next() -> None:
            for path in left:
                await self._read_one(path)

        readers = (read_next() for _ in range(READERS))
        for outcome in await asyncio.gather(*readers, return_exceptions=True):
            if outcome is not None:
                raise outcome

    async def _read_one(self, path: str) -> None:
        self._read_at[path] = _now()
        try:
            document = await self._gateway.call("GET", path)
        except Refused as refusal:
            if refusal.status != NOT_FOUND:
                raise
            self._forget(path)
            return
        self._take(path, document)

    def _take(self, path: str, document: Document) -> list[str]:
        """Keep a document, and those of its units; gives their paths."""
        if path.startswith("/alarms/") and document["reset_at"] is not None:
            self._forget(path)
            return []
        self._keep(path, document)
        units = [(f"{path}/units/{unit['number']}", unit) for unit in document.get("units", ())]
        for its_path, unit in units:
            self._keep(its_path, unit)
        return [path, *(its_path for its_path, _ in units)]

    def _keep(self, path: str, document: Document) -> None:
        self.documents[path] = document
        if path.startswith(("/alarms/", "/scaras/")):
            self._dependent.add(path)
        self.on_change(path, document)

    def _forget(self, path: str) -> None:
        self._read_at.pop(path, None)
        self._dependent.discard(path)
        if self.documents.pop(path, None) is not None:
            self.on_change(path, None)

    def _mark(self, paths: Iterable[str]) -> None:
        self._due.update(dict.fromkeys(paths))

    def _about(self, subject: str) -> list[str]:
        """Give the paths of all that an event about a subject may have changed."""
        kind, _, rest = subject.removeprefix("/").partition("/")
        if kind not in ("bodies", "lines", "robots", "scaras"):
            return []
        name = rest.partition("/")[0]
        own = [f"/{kind}/{quote(name)}"]
        if kind == "lines":
            own += [path for path, document in self.documents.items() if _is_on(path, document, name)]
        return [*own, *(path for path in self._dependent if self._depends(path, subject, name))]

    def _depends(self, path: str, subject: str, name: str) -> bool:
        """Tell if an alarm, or a SCARA robot, is about a subject or on a body of this name."""
        document = self.documents[path]
        if path.startswith("/alarms/"):
            return bool(document["subject"] == subject)
        return any(axis["body_id"] == name for axis in document["axes"])


def _is_on(path: str, document: Document, line: str) -> bool:
    return document.get("line_id") == line and not path.startswith("/lines/")


def _now() -> float:
    return asyncio.get_running_loop().time()
