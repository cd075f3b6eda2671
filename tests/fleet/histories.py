"""Judges a plant's history: every event of a journal stands in the stream once, in order."""

import threading
from collections import Counter
from collections.abc import Sequence
from typing import Any

import httpx

from tests.fleet.plants import Member


class Load(threading.Thread):
    """Events at a rate: leases are taken and given back at the gateways in turn, whoever is there."""

    def __init__(self, gateways: Sequence[Member], per_s: float) -> None:
        super().__init__(daemon=True)
        self._gateways, self._pause_s = gateways, 2 / per_s
        self._end = threading.Event()
        self.done = 0
        """Leases taken and given back: two events each."""

    def run(self) -> None:
        """Go on until it is ended."""
        with httpx.Client(timeout=1.0) as http:
            turn = 0
            while not self._end.wait(self._pause_s):
                turn += 1
                try:
                    self._take_and_give_back(http, self._gateways[turn % len(self._gateways)])
                except (httpx.HTTPError, KeyError):
                    continue  # killed just now

    def _take_and_give_back(self, http: httpx.Client, gateway: Member) -> None:
        taken = http.post(f"{gateway.url}/leases", json={"scope": "line1.00"})
        http.delete(
            f"{gateway.url}/leases/{taken.json()['lease']}",
            headers={"Lease-Token": str(taken.json()["token"])},
        )
        self.done += 1

    def end(self) -> None:
        """End it."""
        self._end.set()
        self.join()


def journal_of(gateway: Member) -> list[str]:
    """The ids of all events that a gateway has, oldest first."""
    ids: list[str] = []
    after = ""
    while True:
        page: Any = gateway.get(f"/events?limit=1000{after}")
        ids += [it["id"] for it in page["events"]]
        if not page["events"]:
            return ids
        after = f"&after={page['cursor']}"


def judge(journal: Sequence[str], stream: Sequence[str]) -> None:
    """Compare a gateway's journal with its part of the stream.

    The stream may have more: what a crash has kept from the journal, in the epoch that has ended with it.
    """
    doubled = {id_: count for id_, count in Counter(stream).items() if count > 1}
    assert not doubled, f"stored twice: {doubled}"
    known = set(journal)
    extra = [id_ for id_ in stream if id_ not in known]
    epochs = {id_.partition("-")[0] for id_ in journal}
    last = {epoch: max(id_ for id_ in journal if id_.startswith(epoch)) for epoch in epochs}
    for id_ in extra:
        epoch = id_.partition("-")[0]
        assert epoch not in last or id_ > last[epoch], f"{id_} is in no journal"
    assert [id_ for id_ in stream if id_ in known] == list(journal), "lost or reordered"
