"""A plant is opened and asked by names, without HTTP; a second front end gives the verdicts of the first."""

import asyncio
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from gateway.access.keys import KeyStore
from gateway.access.roles import RIGHTS_OF, Role
from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.operation import Operation
from gateway.core.rights import Right
from gateway.door import opened, operations
from tests.gateway.door.json_lines import connected, serving

CONFIG = """
[access]
mode = "{mode}"

[[lines]]
id = "arm"
address = "tcp://127.0.0.1:1"
bodies = [{{ id = "00" }}, {{ id = "3F" }}]
groups = [{{ id = "80", members = ["00", "3F"] }}]

[[lines]]
id = "cell"
protocol = "fics"
address = "tcp://127.0.0.1:2"
robot = {{ id = "r1", units = [{{ number = 1, axes = ["X", "Y"] }}] }}
"""
IN_SCOPE = frozenset({"arm"})
NAMED = {
    "line_id": "arm",
    "body_id": "arm.3F",
    "group_id": "arm.80",
    "robot_id": "r1",
    "scara_id": "wafer",
}
OUTSIDE = {"robot_id", "scara_id"}
"""Parts outside the scope."""


def written(tmp_path: Path, mode: str = "open") -> tuple[Path, Path]:
    file, data = tmp_path / "gateway.toml", tmp_path / "data"
    file.write_text(CONFIG.format(mode=mode))
    data.mkdir(mode=0o700)
    return file, data


def arguments_of(operation: Operation) -> dict[str, Any]:
    return {name: NAMED.get(name, 1) for name in operation.named}


def is_allowed(operation: Operation, role: Role, scope: frozenset[str] | None) -> bool:
    """Say whether the row allows a caller, in the words of docs/access.md."""
    if operation.right in (Right.OPEN, Right.STOP):
        return True
    if operation.right not in RIGHTS_OF[role]:
        return False
    if scope is None or operation.any_scope:
        return True
    return operation.target in operation.named and operation.target not in OUTSIDE


def test_each_operation_stands_in_the_table_once() -> None:
    rows = list(operations())
    assert len({row.name for row in rows}) == len({(row.verb, row.path) for row in rows}) == len(rows) > 550
    assert len([row for row in rows if row.http_only]) <= 20
    for row in rows:
        assert row.description, row.name
        assert row.title, row.name


def test_a_plant_is_asked_by_names_and_data(tmp_path: Path) -> None:
    async def story() -> None:
        async with opened(*written(tmp_path)) as door:
            body = await door.call("getBody", {"body_id": "3f"})
            assert (body["body_id"], body["online"]) == ("arm.3F", False)
            assert [it["body_id"] for it in (await door.call("listBodies"))["bodies"]] == ["arm.00", "arm.3F"]
            named = await door.call("nameBodyPosition", {"body_id": "3F", "number": 7}, {"name": "unload"})
            assert named == {"body_id": "arm.3F", "number": 7, "name": "unload"}
            moves = await door.call("listMoves", {"body_id": "3F", "limit": 5})
            assert moves == {"moves": []}

    asyncio.run(story())


def test_what_is_wrong_is_said_by_its_name_and_nothing_is_sent(tmp_path: Path) -> None:
    async def story() -> None:
        async with opened(*written(tmp_path)) as door:
            with pytest.raises(NotFound, match="did you mean getBody"):
                await door.call("getBodi", {"body_id": "3F"})
            with pytest.raises(InvalidRequest, match="body_id: it is missing"):
                await door.call("getBody")
            with pytest.raises(InvalidRequest, match="limits: there is none"):
                await door.call("listMoves", {"body_id": "3F", "limits": 5})
            with pytest.raises(InvalidRequest, match="limit"):
                await door.call("listMoves", {"body_id": "3F", "limit": 0})
            with pytest.raises(InvalidRequest, match="It takes no request"):
                await door.call("getBody", {"body_id": "3F"}, {"fresh": True})
            with pytest.raises(InvalidRequest, match="name"):
                await door.call("nameBodyPosition", {"body_id": "3F", "number": 7}, {"nam": "unload"})
            with pytest.raises(NotFound):
                await door.call("getBody", {"body_id": "55"})

    asyncio.run(story())


@pytest.mark.parametrize("scope", [None, IN_SCOPE])
@pytest.mark.parametrize("role", Role)
def test_every_operation_gives_the_verdict_of_its_row_over_a_second_front_end(
    tmp_path: Path, role: Role, scope: frozenset[str] | None
) -> None:
    file, data = written(tmp_path, "keys")
    key = KeyStore(data).create("somebody", role, None if scope is None else sorted(scope), None)
    refused = [row for row in operations() if not row.http_only and not is_allowed(row, role, scope)]
    asked = [row for row in operations() if not row.http_only and is_allowed(row, role, scope)]

    async def story() -> None:
        async with (
            opened(file, data) as door,
            serving(door, tmp_path / "door"),
            connected(tmp_path / "door") as client,
        ):
            for row in refused:
                answer = await client.ask(row.name, arguments=arguments_of(row), key=key)
                assert answer.get("error") == "not-permitted", (row.name, answer)
            for row in asked:
                if row.right is Right.STOP:
                    continue  # would be waited for
                answer = await client.ask(row.name, arguments={**arguments_of(row), "nonsense": 1}, key=key)
                assert answer.get("error") == "invalid-request", (row.name, answer)
            assert (await client.ask("listBodies"))["error"] == "not-authenticated"
            assert (await client.ask("listBodies", key="mg_nobody"))["error"] == "not-authenticated"

    asyncio.run(story())
    assert asked
    assert refused or role is Role.ADMIN


def test_it_needs_no_web_framework() -> None:
    imports = (
        "import sys, gateway.door; print([it for it in ('api', 'fastapi', 'starlette', 'uvicorn') "
        "if it in sys.modules])"
    )
    command = [sys.executable, "-c", imports]
    told = subprocess.run(command, check=True, capture_output=True, text=True)  # noqa: S603  # our own words
    assert told.stdout.strip() == "[]"
