"""Counters of requests: the time of their answers, and the clients that are connected."""

from typing import Final, Literal

from gateway.core.load import Histogram

METHODS: Final = ("GET", "POST", "PUT", "PATCH", "DELETE")
CLASSES: Final = ("2xx", "3xx", "4xx", "5xx")
BOUNDS_S: Final = (0.001, 0.0025, 0.005, 0.01, 0.02, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 10.0, 60.0)
CLIENTS: Final = ("request", "websocket", "sse")
Client = Literal["request", "websocket", "sse"]


class Traffic:
    """The requests of one application."""

    def __init__(self) -> None:
        self.took = {(method, its): Histogram(BOUNDS_S) for method in METHODS for its in CLASSES}
        """Times from the request to the head of its answer, by method and class of status."""
        self._took = {(method, int(its[0])): took for (method, its), took in self.took.items()}
        self.clients = dict.fromkeys(CLIENTS, 0)
        """Clients connected now, by what they are connected for."""

    def note(self, method: str, status: int, took_s: float) -> None:
        """Count an answer; methods that no route serves are left out."""
        if (took := self._took.get((method, status // 100))) is not None:
            took.observe(took_s)
