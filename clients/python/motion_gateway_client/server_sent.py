"""Server-sent events as the gateway writes them."""

import json
import re
from collections.abc import Iterator
from typing import Final, cast

from motion_gateway_client.generated.types import Event

_BEGINS: Final = re.compile(r": events after (\S+)")


class EventReader:
    """Puts pieces of text together to events, and knows after which cursor reading goes on."""

    def __init__(self, cursor: str | None) -> None:
        self.cursor = cursor
        self._rest = ""
        self._id: str | None = None
        self._data: list[str] = []

    def take(self, text: str) -> Iterator[Event]:
        """Take a piece; the events that it ends are given once."""
        # Not `splitlines`, which takes more than the end of a line for one.
        *lines, self._rest = (self._rest + text).split("\n")
        for line in lines:
            if event := self._take_line(line):
                yield event

    def _take_line(self, line: str) -> Event | None:
        if begins := _BEGINS.fullmatch(line):
            self.cursor = self.cursor or begins[1]
        field, _, value = line.partition(": ")
        if field == "id":
            self._id = value
        elif field == "data":
            self._data.append(value)
        if line or not self._data:
            return None
        event = cast("Event", json.loads("\n".join(self._data)))
        self._data = []
        self.cursor = self._id or self.cursor
        return event
