"""Take-overs again and again in the middle of moves: no frame of the old owner after the new one's first.

`TAKE_OVERS=1000` asks for as many; each takes three seconds.
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import ExitStack
from typing import Any, Final

import pytest

from tests.e2e.processes import until
from tests.fleet.plants import Member, needs_engine
from tests.fleet.terminal_server import needs_ser2net
from tests.fleet.test_take_over import LONG, Pair, take_over

pytestmark = [needs_engine, needs_ser2net, pytest.mark.prove, pytest.mark.long]

TAKE_OVERS: Final = int(os.environ.get("TAKE_OVERS", "20"))
CLEARING: Final = "!"
"""First bytes of an opening, which end a frame that was half sent; they are no frame."""


@pytest.fixture
def pair(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Pair]:
    with ExitStack() as stack:
        yield Pair(tmp_path_factory.mktemp("pair"), stack)


def sent_by(gateway: Member) -> list[str]:
    """The frames that a gateway has written to the line since it opened it, without CR."""
    entries: Any = gateway.get("/lines/line1/trace?limit=1000")["entries"]
    opened = max(number for number, it in enumerate(entries) if it["kind"] == "opened")
    frames = (it["data"].removesuffix("\\r") for it in entries[opened:] if it["kind"] == "tx")
    return [it for it in frames if not it.startswith(CLEARING)]


def after_the_first_of(new: Sequence[str], arrived: Sequence[str]) -> list[str]:
    """The frames that have arrived at the controllers from the new owner's first one on."""
    for begin in range(len(arrived)):
        if list(arrived[begin:]) == list(new)[: len(arrived) - begin]:
            return list(arrived[begin:])
    raise AssertionError(
        f"frames of another owner among those of the new one: {arrived[-40:]}, not {new[:40]}"
    )


@pytest.mark.timeout(300 + 10 * TAKE_OVERS)
def test_no_frame_of_the_old_owner_arrives_after_the_new_ones_first(pair: Pair) -> None:
    until(lambda: pair.states() == ("ready", "standby"), "stocker1 has the line")
    old, new = pair.old, pair.spare
    seen = 0
    for _ in range(TAKE_OVERS):
        pair.line.begin_anew()
        begun = old.http.post("/bodies/3F/moves", json=LONG)
        if begun.status_code == 409:  # the last move still runs
            old.http.post("/stop")
            begun = old.http.post("/bodies/3F/moves", json=LONG)
        take_over(new, old.name)
        arrived = [it for it in pair.line.requests() if not it.startswith(CLEARING)]
        frames = sent_by(new)  # read later, so that it has all that has arrived
        seen += len(after_the_first_of(frames, arrived))
        new.http.post("/stop")
        until(lambda it=new: it.get("/bodies/3F")["moving"] is False, "the motor stands still")  # type: ignore[misc]
        old, new = new, old
    print(f"{TAKE_OVERS} take-overs, {seen} frames of new owners, none of an old one behind them")
