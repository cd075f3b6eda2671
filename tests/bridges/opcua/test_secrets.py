"""Keys: in no node, no event, no answer, no log, no metric and no list of arguments."""

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import httpx

from tests.bridges.opcua.stand import Bridge, Client, ClientError, Plant, client_of


def nodes_below(client: Client, node: str) -> Iterator[str]:
    """All nodes of the bridge below one of them."""
    seen, left = {node}, [node]
    while left:
        yield (node := left.pop())
        below = (
            {found["node"].partition(";s=")[2] for found in client.tell("browse", node=node)} - seen - {""}
        )
        seen |= below
        left += below


def test_no_secret_is_told_by_any_way(bridge: Bridge, client: Client, plant: Plant, tmp_path: Path) -> None:
    secrets = plant.secrets
    client.connect(bridge)
    client.tell("subscribe")
    client.tell("watch", fields=["EventType", "SourceName", "Message"])
    answers: list[Any] = [client.move("line1.3F", 10.0), client.move("line1.3F", 10.0, kind="sideways")]
    answers.append(client.call("line1.3F", "Stop"))
    with client_of(tmp_path, bridge.trusted) as other, suppress(ClientError):
        other.tell("connect", url=bridge.url, user="viewer", password=secrets["mes"])
    nodes = list(nodes_below(client, "line1"))
    told = {
        "nodes": str([(node, client.read(node)) for node in nodes]),
        "answers": str(answers),
        "events": str(client.tell("events")),
        "log": bridge.program.words(),
        "metrics": httpx.get(f"{bridge.metrics}/metrics").text,
        "status": httpx.get(f"{bridge.metrics}/status").text,
        "arguments": bridge.program.arguments,
        "kept": str([file.read_bytes() for file in (bridge.folder / "data").rglob("*") if file.is_file()]),
    }
    assert len(nodes) > 30
    assert "is not let in" in told["log"], "a wrong key was tried"
    for secret in secrets.values():
        assert [where for where, text in told.items() if secret in text] == []
