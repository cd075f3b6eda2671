"""A person has a spare gateway take a line over, in the middle of a move, through a real terminal server."""

from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from app.cli import app
from tests.e2e.processes import SimulatedLine, until
from tests.fleet.plants import BODIES, Engine, Member, PlantProcess, needs_engine
from tests.fleet.terminal_server import TerminalServer, needs_ser2net

pytestmark = [needs_engine, needs_ser2net]

OWNERS = 'owners = ["stocker1", "spare1"]\n'
LONG = {"kind": "relative", "direction": "cw", "distance": {"value": 400_000, "unit": "pulse"}}


class Pair:
    """Two gateways that may have one line."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        self.engine = Engine(folder / "engine")
        stack.callback(self.engine.kill)
        self.process = PlantProcess(folder, self.engine.url)
        stack.callback(self.process.end)
        self.line = SimulatedLine(folder, BODIES)
        stack.callback(self.line.end)
        self.server = TerminalServer(folder, self.line)
        stack.callback(self.server.end)
        self.old, self.spare = (self._gateway(folder, name, stack) for name in ("stocker1", "spare1"))

    def _gateway(self, folder: Path, name: str, stack: ExitStack) -> Member:
        own = folder / name
        own.mkdir()
        gateway = Member(own, name, self.engine.url, self.line, OWNERS, address=self.server.address)
        stack.callback(gateway.end)
        return gateway

    def states(self) -> tuple[Any, Any]:
        """State of the line at both gateways."""
        return tuple(it.get("/lines/line1")["state"] for it in (self.old, self.spare))


@pytest.fixture(scope="module")
def pair(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Pair]:
    with ExitStack() as stack:
        yield Pair(tmp_path_factory.mktemp("pair"), stack)


def take_over(gateway: Member, old: str) -> str:
    words = ["take-over", "line1", "--from", old, "--i-have-cut-the-old-one", "--url", gateway.url]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    return done.output


def at_the_spare(pair: Pair) -> int:
    """Have the spare own the line, whichever tests came before; gives the epoch."""
    until(lambda: "ready" in pair.states(), "somebody has the line")
    if pair.states()[0] == "ready":
        take_over(pair.spare, "stocker1")
    until(lambda: pair.states() == ("standby", "ready"), "spare1 has the line")
    return int(pair.spare.get("/lines/line1")["owner"]["epoch"])


def test_the_first_owner_opens_the_line_and_the_spare_stands_by(pair: Pair) -> None:
    until(lambda: pair.states() == ("ready", "standby"), "stocker1 has the line")
    assert pair.old.get("/lines/line1")["owner"] == {"gateway": "stocker1", "epoch": 1}
    assert pair.spare.get("/lines/line1")["owner"] == {"gateway": "stocker1", "epoch": 1}
    assert pair.spare.http.get("/readyz").is_success
    refused = pair.spare.http.post("/bodies/3F/moves", json=LONG)
    assert (refused.status_code, refused.json()["type"].rpartition(":")[2]) == (409, "owner-changed")
    assert pair.process.http.post("/stop").status_code == 200


@pytest.mark.prove
def test_a_take_over_in_the_middle_of_a_move_throws_the_old_owner_out_for_good(pair: Pair) -> None:
    until(lambda: pair.states() == ("ready", "standby"), "stocker1 has the line")
    begun = pair.old.http.post("/bodies/3F/moves", json=LONG, headers={"Owner-Epoch": "1"})
    assert begun.is_success, begun.text
    assert "epoch 2" in take_over(pair.spare, "stocker1")
    assert pair.states() == ("standby", "ready")
    assert pair.spare.get("/lines/line1")["owner"] == {"gateway": "spare1", "epoch": 2}
    until(
        lambda: pair.old.get("/lines/line1")["owner"] == {"gateway": "spare1", "epoch": 2},
        "stocker1 knows who has the line",
    )
    [alarm] = pair.old.get("/alarms")["alarms"]
    assert (alarm["cause"], alarm["ended_at"]) == ("line.taken_over", None)
    assert "is not this gateway's any more" in alarm["en"]["happened"]
    refused = pair.old.http.post("/bodies/3F/moves", json=LONG)
    assert refused.json()["type"].rpartition(":")[2] == "owner-changed"
    assert pair.old.http.post("/stop").json()["confirmed"]
    own = f"/bodies/3F/moves/{begun.json()['id']}"
    followed = pair.spare.get(own)
    assert "Gateway spare1 took the line over from stocker1 in the middle" in " ".join(followed["evidence"])
    assert followed["status"] in ("sent", "moving"), followed
    until(lambda: pair.old.get(own)["status"] == "lost", "stocker1 says that it does not know how it ends")
    assert pair.spare.http.post("/stop").json()["confirmed"]
    ends = ("succeeded", "stopped")  # of nine seconds some have passed
    until(lambda: pair.spare.get(own)["status"] in ends, "spare1 has followed it to its end")


def test_a_command_with_another_epoch_is_refused_and_nothing_is_sent(pair: Pair) -> None:
    at_the_spare(pair)
    until(lambda: not pair.spare.get("/bodies/3F")["moving"], "the motor stands still")
    pair.line.begin_anew()
    for epoch, status in (("1", 409), ("x", 422)):
        refused = pair.spare.http.post("/bodies/3F/moves", json=LONG, headers={"Owner-Epoch": epoch})
        assert refused.status_code == status, refused.text
        address = "/bodies/spare1:line1.3F/moves"
        refused = pair.process.http.post(address, json=LONG, headers={"Owner-Epoch": epoch})
        assert refused.status_code == status, "the plant process hands it on"
    stopped = pair.process.http.post("/bodies/spare1:line1.3F/stop", headers={"Owner-Epoch": "1"})
    assert stopped.is_success, "a stop is never refused for it"
    assert not pair.line.executed("1+M")


def test_the_old_owner_does_not_come_back_by_itself_not_even_after_a_restart(pair: Pair) -> None:
    epoch = at_the_spare(pair)
    pair.old.end()
    pair.old.start()
    until(lambda: pair.states() == ("standby", "ready"), "stocker1 stands by")
    assert f"epoch {epoch + 1}" in take_over(pair.old, "spare1")
    until(lambda: pair.states() == ("ready", "standby"), "stocker1 has the line again")
    pair.engine.kill()
    assert f"epoch {epoch + 2}" in take_over(pair.spare, "stocker1")
    until(lambda: pair.states() == ("standby", "ready"), "a person needs no engine")
