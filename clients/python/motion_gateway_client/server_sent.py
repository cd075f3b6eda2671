"""Server-sent events, line by line, as the gateway writes them."""

import json
import re
from typing import Final, cast

from motion_gateway_client.generated.types import Event

_BEGINS: Final = re.compile(r": events after (\S+)")


class EventReader:
    """Puts lines together to events, and knows after which cursor reading goes on."""

    def __init__(self, cursor: str | None) -> None:
        self.cursor = cursor
        self._id: str | None = None
        self._data: list[str] = []

    def take(self, line: str) -> Event | None:
        """Take a line; an empty one ends an event, which is given once."""
        if begins := _BEGINS.fullmatch(line):
            self.cursor = self.cursor or begins[1]
        field, _, value = line.partition(": ")
        if field == "id":
            self._id = value
        elif field == "data":
            self._data.append(value)
        return self._ended() if not line else None

    def _ended(self) -> Event | None:
        data, self._data = self._data, []
        if not data:
            return None
        self.cursor = self._id or self.cursor
        return cast("Event", json.loads("\n".join(data)))
