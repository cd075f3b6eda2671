"""Rights in a plant: each gateway decides by the caller's own key, for a stop by NATS as well."""

import shutil
import subprocess
from collections.abc import Iterator
from contextlib import ExitStack
from pathlib import Path
from typing import Any, Final

import httpx
import pytest

from gateway.access.keys import FILE
from tests.e2e.processes import MOTION_GATEWAY, SimulatedLine, until
from tests.fleet.plants import BODIES, Engine, Member, PlantProcess, needs_engine

pytestmark = needs_engine

KEYS: Final = '[access]\nmode = "keys"\n'
MOVE: Final = {"kind": "relative", "direction": "cw", "distance": {"value": 40, "unit": "pulse"}}


class Guarded:
    """Two gateways that take the same keys, of which the plant reaches one by NATS alone."""

    def __init__(self, folder: Path, stack: ExitStack) -> None:
        engine = Engine(folder / "engine")
        stack.callback(engine.kill)
        self.gateways = []
        for name in ("stocker1", "stocker2"):
            (folder / name).mkdir()
            line = SimulatedLine(folder / name, BODIES)
            stack.callback(line.end)
            self.gateways.append(Member(folder / name, name, engine.url, line, more=KEYS))
            stack.callback(self.gateways[-1].end)
        self.process = PlantProcess(
            folder, engine.url, f'[plant.gateways]\nstocker9 = "http://127.0.0.1:1"\n{KEYS}'
        )
        stack.callback(self.process.end)
        known = {"online": 2, "unheard": 1}
        until(lambda: self.process.http.get("/readyz").json()["gateways"] == known, "both are heard")
        self._engine, self._folder, self._stack = engine, folder, stack

    def key(self, name: str, role: str, *more: str) -> str:
        """Make a key that both gateways take."""
        one, two = self.gateways
        words = ["keys", "create", name, "--role", role, *more, "--data", str(one.data)]
        made = subprocess.run([MOTION_GATEWAY, *words], capture_output=True, text=True, check=True)  # noqa: S603
        shutil.copy(one.data / FILE, two.data / FILE)
        return made.stdout.strip()

    def by_nats_alone(self) -> PlantProcess:
        """A plant process that finds nobody at the addresses of the gateways."""
        nowhere = "".join(f'{it.name} = "http://127.0.0.1:1"\n' for it in self.gateways)
        (self._folder / "deaf").mkdir()
        deaf = PlantProcess(self._folder / "deaf", self._engine.url, f"[plant.gateways]\n{nowhere}{KEYS}")
        self._stack.callback(deaf.end)
        until(lambda: deaf.http.get("/readyz").json()["servers"] == "followed", "it follows the servers")
        return deaf


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Guarded]:
    with ExitStack() as stack:
        yield Guarded(tmp_path_factory.mktemp("keys"), stack)


def shown(key: str) -> dict[str, str]:
    return {"Authorization": f"Bearer {key}"}


def kind_of(answer: httpx.Response) -> tuple[int, str]:
    return answer.status_code, str(answer.json()["type"]).rpartition(":")[2]


def test_without_a_key_nothing_is_told_and_nothing_is_done(guarded: Guarded) -> None:
    http = guarded.process.http
    for path in ("/gateways", "/bodies", "/events", "/metrics", "/bodies/stocker1:line1.3F"):
        assert kind_of(http.get(path)) == (401, "not-authenticated"), path
    assert kind_of(http.post("/stop")) == (401, "not-authenticated")
    assert http.get("/livez").is_success


def test_a_key_is_that_of_the_gateways_and_its_role_holds_there(guarded: Guarded) -> None:
    http = guarded.process.http
    viewer, operator = shown(guarded.key("screen", "viewer")), shown(guarded.key("cell", "operator"))
    until(lambda: http.get("/bodies", headers=viewer).is_success, "the gateways know the key")
    gateways = {it["name"]: it["state"] for it in http.get("/gateways", headers=viewer).json()["gateways"]}
    assert gateways == {"stocker1": "online", "stocker2": "online", "stocker9": "unheard"}
    path = "/bodies/stocker2:line1.3F/moves"
    assert kind_of(http.post(path, json=MOVE, headers=viewer)) == (403, "not-permitted")
    until(lambda: http.get("/bodies", headers=operator).is_success, "the gateways know the key")
    assert http.post(path, json=MOVE, headers=operator).is_success
    audit = httpx.get(f"{guarded.gateways[1].url}/bodies/3F/moves", headers=operator).json()
    assert len(audit["moves"]) == 1


def test_a_key_with_a_scope_sees_the_events_of_that_alone(guarded: Guarded) -> None:
    http = guarded.process.http
    scoped = shown(guarded.key("one-body", "viewer", "--scope", "line1.3F"))
    until(lambda: http.get("/bodies", headers=scoped).is_success, "the gateways know the key")
    subjects = {it["subject"] for it in http.get("/events?limit=1000", headers=scoped).json()["events"]}
    assert subjects
    assert subjects <= {"/bodies/stocker1:line1.3F", "/bodies/stocker2:line1.3F"}


def test_a_stop_by_the_servers_alone_takes_a_good_key(guarded: Guarded) -> None:
    deaf, operator = guarded.by_nats_alone(), shown(guarded.key("pendant", "operator"))
    until(lambda: guarded.process.http.get("/bodies", headers=operator).is_success, "the key is known")
    stopped: Any = deaf.http.post("/stop", headers=operator)
    assert {it["gateway"]: it["state"] for it in stopped.json()["gateways"]} == {
        "stocker1": "confirmed",
        "stocker2": "confirmed",
    }, stopped.text
    for it in guarded.gateways:
        it.line.begin_anew()
    refused = deaf.http.post("/stop", headers=shown("mg_nobody_knows_this"))
    assert refused.status_code == 409
    assert {it["state"] for it in refused.json()["gateways"]} == {"unreached"}
    assert not [fact for it in guarded.gateways for fact in it.line.executed("5SS")]


def test_somebody_with_a_browser_signs_in_once(guarded: Guarded) -> None:
    key = guarded.key("operator-1", "operator")
    with httpx.Client(base_url=guarded.process.url) as browser:
        page = browser.get("/", headers={"Sec-Fetch-Mode": "navigate"})
        assert page.headers["location"] == "/sign-in"
        assert browser.post("/sign-in", data={"key": "mg_wrong_key"}).status_code == 401
        until(
            lambda: browser.post("/sign-in", data={"key": key}).status_code == 303,
            "the gateways know the key",
        )
        assert browser.get("/bodies").is_success
        foreign = browser.post("/stop", headers={"Origin": "http://evil.example"})
        assert foreign.status_code == 403
        browser.post("/sign-out")
        assert browser.get("/bodies").status_code == 401
