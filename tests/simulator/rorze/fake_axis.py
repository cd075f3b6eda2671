"""The least an RC-420 can be: it repeats what it is told, and ends moves when it was told to."""

import re

from protocols.rorze.link import MoveEnded, StatusChanged
from simulator.rorze.controller import Message, Response

FLASH_TIME_S = 1.5


class FakeAxis:
    """`1+M<seconds>` moves for that time, `FIS` answers late, `XXX` is unknown; the rest is echoed."""

    def __init__(self, body: int) -> None:
        self.body = body
        self.powered = True
        self.refusal = ""
        self.text: tuple[float, str] | None = None
        self.done: list[tuple[float, str]] = []
        self._code = ""
        self._ends_at: float | None = None
        self._messages: list[Message] = []

    def execute(self, text: str, now: float) -> Response:
        self.advance(now)
        self.done.append((now, text))
        if self.refusal:
            return Response(self.refusal)
        if text == "XXX":
            return Response("@49")
        if not re.fullmatch(r"..M\d+(\.\d+)?|..[^M][A-Z0-9,+-]*", text):
            return Response("@4A")
        if text == "FIS":
            return Response("", FLASH_TIME_S)
        if text[2] == "M":
            self._code, self._ends_at = text[:3], now + float(text[3:])
            return Response("")
        return Response(text[3:])

    def advance(self, now: float) -> None:
        if self._ends_at is not None and self._ends_at <= now:
            self.say(MoveEnded(self.body, self._code, 0), self._ends_at)
            self._ends_at = None

    def wake_at(self) -> float | None:
        return self._ends_at

    def say(self, frame: MoveEnded | StatusChanged, at: float) -> None:
        self._messages.append(Message(at, frame))

    def take_messages(self) -> list[Message]:
        messages, self._messages = self._messages, []
        return messages

    def text_since(self) -> float | None:
        return None if self.text is None else self.text[0]

    def take_text(self, now: float) -> str | None:
        self.advance(now)
        text, self.text = self.text, None
        return None if text is None else text[1]

    def power_off(self, now: float) -> None:
        self.advance(now)
        self.powered, self._ends_at = False, None
        self._messages.clear()

    def power_on(self, now: float) -> None:
        self.powered = True
        self.done.append((now, "power on"))
