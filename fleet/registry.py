"""The gateways of the plant, and when each was heard last; a silent one is unheard, never dead."""

import logging
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from math import inf
from time import monotonic
from typing import Any, Final

from pydantic import BaseModel, ConfigDict, ValidationError

from fleet.cursors import epoch_of
from gateway.core.tables import Slug
from gateway.membership import check_gateway_url

log = logging.getLogger(__name__)

UNHEARD_S: Final = 10.0
"""A gateway that was not heard for longer is `unheard`."""


class Entry(BaseModel):
    """A gateway's entry: it writes that of itself."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    name: Slug
    url: str
    fingerprint: str | None = None
    lines: list[str] = []
    owners: dict[str, str] = {}
    """Lines that another gateway has, with its name."""
    version: str = ""
    cursor: str = ""


@dataclass
class Gateway:
    """A gateway of the plant, as far as it is known."""

    name: str
    url: str
    lines: list[str] = field(default_factory=list)
    owners: dict[str, str] = field(default_factory=dict)
    version: str | None = None
    cursor: str | None = None
    fingerprint: str | None = None
    heard_at: float | None = None


class Registry:
    """All gateways that were ever heard, and those that the configuration names with their addresses.

    A caller's key is sent to that address: the address of the configuration counts, never a different one
    that an intruder with stolen credentials has put into the registry.
    """

    def __init__(
        self, named: Mapping[str, str] | None = None, clock: Callable[[], float] = monotonic
    ) -> None:
        self._named = dict(named or {})
        self._clock = clock
        self._gateways = {name: Gateway(name, url) for name, url in self._named.items()}
        self._writers: dict[str, dict[tuple[str, str], float]] = {}
        """Writers of each entry, by address and epoch: when each was heard last."""
        self._twins: dict[str, tuple[float, str]] = {}
        """Names that two gateways have: when both were heard last, and their addresses."""

    def note(self, subject: str, content: bytes) -> None:
        """Take an entry of the registry; one in the place of another gateway, or without sense, is none."""
        try:
            entry = Entry.model_validate_json(content)
            url = self._named.get(entry.name) or check_gateway_url(entry.url)
        except (ValidationError, ValueError) as error:
            log.warning("an entry of the registry is left unheeded (%s): %s", subject, error)
            return
        if subject.rpartition(".")[2] != entry.name:
            log.warning("an entry of the registry is left unheeded (%s): it names %s", subject, entry.name)
            return
        known = self._gateways.setdefault(entry.name, Gateway(entry.name, url))
        known.url, known.lines, known.version = url, entry.lines, entry.version
        known.cursor, known.fingerprint, known.owners = entry.cursor, entry.fingerprint, entry.owners
        known.heard_at = self._clock()
        self._note_writer(entry)

    def _note_writer(self, entry: Entry) -> None:
        """Notice a writer that comes back after another one: one that was started anew never does."""
        now, writer = self._clock(), (entry.url, epoch_of(entry.cursor))
        heard = {
            writer: at for writer, at in self._writers.get(entry.name, {}).items() if now - at <= UNHEARD_S
        }
        if writer in heard and writer != next(reversed(heard)):
            self._twins[entry.name] = now, " and ".join(sorted({url for url, _ in heard}))
        heard.pop(writer, None)
        self._writers[entry.name] = {**heard, writer: now}

    def conflict_of(self, name: str) -> str | None:
        """Say that two gateways have a name, in a sentence; None: it is one's alone."""
        seen_at, urls = self._twins.get(name, (-inf, ""))
        if self._clock() - seen_at > UNHEARD_S:
            return None
        return f"Two gateways call themselves {name} ({urls}): give each a plant.name of its own."

    def heard(self, name: str) -> None:
        """Take note that a gateway has answered."""
        if name in self._gateways:
            self._gateways[name].heard_at = self._clock()

    def get(self, name: str) -> Gateway | None:
        """Find one; None where there is none of this name."""
        return self._gateways.get(name)

    def all(self) -> list[Gateway]:
        """All of them, by their names."""
        return [self._gateways[name] for name in sorted(self._gateways)]

    def age_s(self, gateway: Gateway) -> float | None:
        """For how long it was not heard; None where it never was."""
        return None if gateway.heard_at is None else max(0.0, self._clock() - gateway.heard_at)

    def is_online(self, gateway: Gateway) -> bool:
        """Tell if a gateway was heard within the last `UNHEARD_S` seconds."""
        age_s = self.age_s(gateway)
        return age_s is not None and age_s <= UNHEARD_S

    def is_named(self, name: str) -> bool:
        """Tell if the configuration has the address of a gateway."""
        return name in self._named

    def told(self, gateway: Gateway) -> dict[str, Any]:
        """Tell of one, as `GET /gateways` does."""
        age_s = self.age_s(gateway)
        return {
            "name": gateway.name,
            "url": gateway.url,
            "state": "online" if self.is_online(gateway) else "unheard",
            "heard_age_s": None if age_s is None else round(age_s, 3),
            "lines": gateway.lines,
            "version": gateway.version,
            "cursor": gateway.cursor,
            "fingerprint": gateway.fingerprint,
            "conflict": self.conflict_of(gateway.name),
        }
