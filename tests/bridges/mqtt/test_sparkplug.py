"""The plant as an edge node of Sparkplug B, as npm sparkplug-payload reads it: births, data and deaths."""

import asyncio
import json
import re
import subprocess
import time
from collections import Counter
from collections.abc import Iterable, Iterator
from fnmatch import fnmatchcase
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridges.common.mirror import Mirror
from bridges.common.state import Figures, State
from bridges.mqtt.settings import Sparkplug
from bridges.mqtt.sparkplug import Node, _KeptNumber
from bridges.mqtt.sparkplug_payload import DataType, Metric, commanded, encode
from tests.bridges.fake_gateway import FakeGateway, alarm
from tests.bridges.mqtt.stand import MES, Broker, Client, Plant, at, bridging, relative
from tests.clients.node import node
from tests.e2e.processes import until

HERE = Path(__file__).parent
PAGE = HERE.parents[2] / "docs" / "mqtt.md"
NODE_ID = "spBv1.0/fab2/{}/test"
TABLE = "sparkplug = {{ group = 'fab2'{} }}"


def decoded(payloads: Iterable[bytes]) -> list[Any]:
    """Payloads as an independent library reads them."""
    if not (HERE.parents[1] / "peers" / "node_modules" / "sparkplug-payload").exists():
        pytest.skip("make test installs the peers")
    text = "\n".join(it.hex() for it in payloads)
    done = subprocess.run(  # noqa: S603  # our own
        [node(), str(HERE / "decode.cjs")], input=text, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return [json.loads(line) for line in done.stdout.split("\n") if line]


def metrics_of(payload: Any) -> dict[str, Any]:
    return {it["name"]: it.get("value") for it in payload["metrics"]}


@pytest.fixture
def broker(tmp_path: Path) -> Iterator[Broker]:
    broker = Broker(tmp_path)
    yield broker
    broker.kill()


def of(client: Client, type_: str, device: str = "") -> list[bytes]:
    topic = NODE_ID.format(type_) + (f"/{device}" if device else "")
    return [it.payload for it in list(client.heard) if it.topic == topic]


def born(client: Client, device: str, least: int = 1) -> list[bytes]:
    return until(
        lambda: of(client, "DBIRTH", device)[least - 1 :] and of(client, "DBIRTH", device), "a birth"
    )


def rebirth(client: Client, *more: Metric, topic: str = "NCMD") -> None:
    asked = [Metric(True, DataType.BOOLEAN, "Node Control/Rebirth"), *more]
    client._client.publish(NODE_ID.format(topic), encode(asked, 1, None), 0)


@pytest.mark.prove
def test_births_data_and_deaths_are_as_the_library_of_others_reads_them(
    plant: Plant, broker: Broker, tmp_path: Path
) -> None:
    with at(broker, "spBv1.0/#", "motion/#") as client:
        with bridging(tmp_path, plant, broker, TABLE.format("")) as bridge:
            bridge.wait_until_online()
            born(client, "line1.3F")
            client.command("/bodies/3F/moves?wait=30", relative())
            position = plant.get("/bodies/3F")["position"]
            until(lambda: of(client, "DDATA", "line1.3F"), "data")
            plant.line.tell("PUT", "/bodies/00/power", on=False)
            until(lambda: of(client, "DDEATH", "line1.00"), "a death", 120)
            plant.line.tell("PUT", "/bodies/00/power", on=True)
            born(client, "line1.00", 2)
            bridge.program.kill()
            until(lambda: of(client, "NDEATH"), "the broker tells it")
        heard = [it for it in client.heard if it.topic.startswith("spBv1.0/")]
    payloads = dict(zip([id(it) for it in heard], decoded(it.payload for it in heard), strict=True))
    by_topic = [(it.topic.split("/")[2], it.topic.split("/")[4:], payloads[id(it)], it) for it in heard]
    assert not any(it.retain for *_, it in by_topic)
    types = [type_ for type_, *_ in by_topic]
    assert types[0] == "NBIRTH"
    assert types[-1] == "NDEATH"
    sequence = [payload["seq"] for type_, _, payload, _ in by_topic if type_ != "NDEATH"]
    assert sequence == [number % 256 for number in range(len(sequence))], "none is left out"
    birth, death = by_topic[0][2], by_topic[-1][2]
    assert metrics_of(birth)["Lines/line1"] == "ready"
    assert metrics_of(birth)["Node Control/Rebirth"] is False
    assert metrics_of(birth)["bdSeq"] == metrics_of(death)["bdSeq"]
    assert "seq" not in death
    _judge_devices(by_topic, position)


def _judge_devices(by_topic: list[Any], position: int) -> None:
    """Data has aliases alone, of the birth before it; its newest values are the plant's."""
    names: dict[str, dict[int, str]] = {}
    last: dict[str, dict[str, Any]] = {}
    for type_, device, payload, _ in by_topic:
        if not device:
            continue
        if type_ == "DBIRTH":
            names[device[0]] = {it["alias"]: it["name"] for it in payload["metrics"]}
            last[device[0]] = metrics_of(payload)
            assert last[device[0]]["Online"] is True
        elif type_ == "DDATA":
            assert not any(it.get("name") for it in payload["metrics"])
            last[device[0]] |= {names[device[0]][it["alias"]]: it.get("value") for it in payload["metrics"]}
        else:
            assert (type_, payload["metrics"]) == ("DDEATH", [])
    aliases = [alias for its in names.values() for alias in its]
    assert len(aliases) == len(set(aliases)), "an alias is one metric of the node"
    assert last["line1.3F"]["Position"] == position
    assert last["line1.3F"]["Moving"] is False


def test_a_rebirth_is_done_and_no_other_command_is(plant: Plant, broker: Broker, tmp_path: Path) -> None:
    with (
        at(broker, "spBv1.0/#") as client,
        bridging(tmp_path, plant, broker, TABLE.format("")) as bridge,
    ):
        born(client, "line1.3F")
        moved = len(plant.moves())
        rebirth(client, Metric(5, DataType.INT64, "Position"))
        born(client, "line1.3F", 2)
        client._client.publish(NODE_ID.format("DCMD") + "/line1.3F", encode([], 1, None), 0)
        client._client.publish(NODE_ID.format("NCMD"), b"\xff\xff", 0)
        until(lambda: bridge.figure("sparkplug_commands_total") == 3, "each is counted")
        assert "Position" in bridge.program.words()
        assert len(plant.moves()) == moved
        first, second = decoded(of(client, "NBIRTH")[:2])
        assert metrics_of(first)["bdSeq"] == metrics_of(second)["bdSeq"]
        assert (first["seq"], second["seq"]) == (0, 0)


def test_nothing_is_told_while_the_primary_host_is_offline(
    plant: Plant, broker: Broker, tmp_path: Path
) -> None:
    def state(client: Client, online: bool) -> None:
        told = json.dumps({"online": online, "timestamp": int(time.time() * 1000)})
        client._client.publish("spBv1.0/STATE/scada", told, 1, retain=True)

    with at(broker, "spBv1.0/#", "motion/#") as client:
        with bridging(tmp_path, plant, broker, TABLE.format(", host = 'scada'")):
            client.last("status", lambda it: it["state"] == "online")
            client.command("/bodies/3F/moves?wait=30", relative())
            assert not of(client, "NBIRTH")
            state(client, True)
            born(client, "line1.3F")
            state(client, False)
            until(lambda: of(client, "NDEATH"), "the node is gone")
            born_before = len(of(client, "NBIRTH"))
            client.publish(f"cmd/{MES}/stop")
            state(client, True)
            until(lambda: len(of(client, "NBIRTH")) == born_before + 1, "it is born again")
        first, second = (metrics_of(it)["bdSeq"] for it in decoded(of(client, "NBIRTH")))
        assert second == first + 1
        deaths = [metrics_of(it)["bdSeq"] for it in decoded(of(client, "NDEATH"))]
        assert deaths == [first, second], "one that ends as it should says so, too"


class Busy:
    """A connection; while a birth is on its way the plant changes."""

    def __init__(self, mirror: Mirror) -> None:
        self.topics: list[str] = []
        self._mirror = mirror

    async def publish(self, topic: str, *_: Any, **__: Any) -> None:
        self.topics.append(topic.split("/", 2)[2])
        self._mirror.documents["/alarms/a-1"] = alarm("a-1", "/bodies/line1.3F")
        self._mirror.documents["/bodies/line1.00"]["moving"] ^= True


def node_of(mirror: Mirror, folder: Path, scada: str | None = None) -> Node:
    figures = Figures()
    state = State(("gateway",), figures)
    state.up("gateway")
    file = SimpleNamespace(gateway=SimpleNamespace(name="n"))
    host = SimpleNamespace(mirror=mirror, data=folder, figures=figures, state=state)
    return Node(file, Sparkplug(group="g", host=scada), host)  # type: ignore[arg-type]  # as much as it needs


@pytest.mark.parametrize(
    "payload",
    [
        b"[" * 100_000,
        b'{"online": true, "timestamp": 1e999}',
        b'{"online": true, "timestamp": "soon"}',
        b"[1]",
        b"7",
        b"\xff",
        b"",
    ],
)
def test_a_state_of_the_host_that_is_none_changes_nothing(payload: bytes, tmp_path: Path) -> None:
    node = node_of(Mirror(FakeGateway().client()), tmp_path, "scada")
    node._hear_host(b'{"online": true, "timestamp": 5}')
    node._hear_host(payload)
    assert node._host_online is True


def test_all_are_born_before_anything_is_told_of_one(tmp_path: Path) -> None:
    mirror = Mirror(FakeGateway().client())
    documents = FakeGateway().documents
    mirror.documents |= {it: documents[it] for it in ("/lines/line1", "/bodies/line1.00", "/bodies/line1.3F")}
    node, busy = node_of(mirror, tmp_path), Busy(mirror)

    async def run() -> None:
        await node._tell_births(busy)  # type: ignore[arg-type]
        for _ in range(2):
            await node._tell_changes(busy)  # type: ignore[arg-type]

    asyncio.run(run())
    assert busy.topics == [
        "NBIRTH/n", "DBIRTH/n/line1.00", "DBIRTH/n/line1.3F", "NDATA/n", "DDATA/n/line1.00"
    ]  # fmt: skip


def test_a_number_is_taken_by_a_connection_alone_and_kept(tmp_path: Path) -> None:
    numbers = _KeptNumber(tmp_path / "bdseq")
    assert [numbers.coming, numbers.coming] == [0, 0], "no try that failed counts"
    for _ in range(256):
        numbers.take()
    assert (numbers.number, numbers.coming) == (255, 0)
    assert _KeptNumber(tmp_path / "bdseq").number == 255


def test_the_page_judges_each_assertion_of_the_specification() -> None:
    ids = (HERE / "sparkplug_assertions.txt").read_text("ascii").split()
    table = PAGE.read_text("utf-8").partition("## Sparkplug B")[2]
    rows = re.findall(r"^\| (`.*?) \| (\d+) \| (held|not applicable|missing|yours) \|", table, re.MULTILINE)
    counted: Counter[str] = Counter()
    for patterns, number, verdict in rows:
        names = re.findall(r"`([^`]+)`", patterns)
        judged = [it for it in ids if any(fnmatchcase(it, name) for name in names)]
        assert len(judged) == int(number) > 0, (patterns, len(judged))
        ids = [it for it in ids if it not in judged]
        counted[verdict] += len(judged)
    assert ids == [], "a row for each"
    told = {it: int(number) for number, it in re.findall(r"(\d+) (held|not applicable|missing|yours)", table)}
    assert counted == told


VALUES = {
    DataType.INT32: st.integers(-(2**31), 2**31 - 1),
    DataType.INT64: st.integers(-(2**53), 2**53),
    DataType.DOUBLE: st.floats(allow_nan=False, allow_infinity=False),
    DataType.BOOLEAN: st.booleans(),
    DataType.STRING: st.text(),
}


def test_values_of_every_type_are_read_as_they_were() -> None:
    values = [(type_, it) for type_, its in VALUES.items() for it in _some(its)]
    metrics = [Metric(it, type_, f"m{place}", place) for place, (type_, it) in enumerate(values)]
    metrics += [Metric(None, type_, f"null {type_}") for type_ in DataType]
    (payload,) = decoded([encode(metrics, 1_700_000_000_000, 200)])
    assert (payload["timestamp"], payload["seq"]) == (1_700_000_000_000, 200)
    read = metrics_of(payload)
    for place, (type_, it) in enumerate(values):
        told = read[f"m{place}"]
        told = told - (1 << 32) if type_ is DataType.INT32 and told >= 1 << 31 else told
        told = told - (1 << 64) if type_ is DataType.INT64 and told >= 1 << 63 else told
        assert (float(told) if type_ is DataType.DOUBLE else told) == it, (type_, it)
    assert all(read[f"null {type_}"] is None for type_ in DataType)


def _some(values: "st.SearchStrategy[Any]") -> list[Any]:
    found: list[Any] = []

    @given(values)
    def take(value: Any) -> None:
        found.append(value)

    take()
    return found[:50]


@given(st.binary(max_size=200))
def test_no_bytes_break_the_reader(data: bytes) -> None:
    try:
        read = commanded(data)
    except ValueError:
        return
    assert isinstance(read, dict)
