"""The truth of the simulated plant, whatever the line made of it: the judge of every test."""

import json
from collections import deque
from collections.abc import Iterator
from typing import NamedTuple, TextIO


class Fact(NamedTuple):
    """One thing that happened."""

    kind: str
    at: float
    """Virtual time in seconds."""
    body: int
    request: int | None
    """The running number of the host's frame that brought it about; None where no frame did."""
    facts: dict[str, object]

    def as_json(self) -> str:
        """One line of JSON, the body in its two hexadecimal digits."""
        named = {"kind": self.kind, "time_s": self.at, "body": f"{self.body:02X}", "request": self.request}
        return json.dumps(named | self.facts)


class TruthLog:
    """The facts in the order they became known; the newest `capacity` of them are kept, or all.

    A sink gets every fact as a line of JSON.
    """

    def __init__(self, capacity: int | None = None, sink: TextIO | None = None) -> None:
        self.count = 0
        """Facts logged so far, kept or not."""
        self.request: int | None = None
        """The request that is being carried out, while it is; the link master sets it."""
        self._facts: deque[Fact] = deque(maxlen=capacity)
        self._sink = sink

    def log(self, kind: str, now: float, body: int, **facts: object) -> None:
        """Add a fact, in the name of the request that is being carried out."""
        self.add(Fact(kind, now, body, self.request, facts))

    def add(self, fact: Fact) -> None:
        """Add a fact."""
        self._facts.append(fact)
        self.count += 1
        if self._sink is not None:
            self._sink.write(fact.as_json() + "\n")

    def __iter__(self) -> Iterator[Fact]:
        return iter(self._facts)

    def of(self, kind: str, body: int | None = None) -> list[Fact]:
        """The kept facts of one kind, of one body or of all."""
        return [fact for fact in self._facts if fact.kind == kind and body in (None, fact.body)]

    def since(self, count: int) -> list[Fact]:
        """The kept facts after the first `count`."""
        missed = count - (self.count - len(self._facts))
        return list(self._facts)[max(missed, 0) :]
