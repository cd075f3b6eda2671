"""Every operation that only reads answers what its row says, as data."""

import json
from typing import Any

import pytest
from pydantic import TypeAdapter

from gateway.core.errors import InvalidRequest, NotAllowed, NotFound, NotSent
from gateway.core.operation import Operation
from gateway.core.rights import Right
from gateway.door import Door, operations
from tests.fics_plants import fics_rig
from tests.plants import in_virtual_time, rig

NAMED = {"line_id": "line1", "body_id": "3F", "group_id": "80", "port": 8, "n": 30, "number": 1}
OF_ROBOTS = {"line_id": "cell", "robot_id": "r1", "unit": 1}
ASKED = {"getCurve": {"distance": 1000}}
NOT_HERE = (NotFound, NotSent, NotAllowed)
"""Records of what was not done, and SCARA robots; this plant has none, no journal, no log and no keys."""
READS = [
    row for row in operations() if row.verb == "GET" and row.http_only is None and row.right is not Right.STOP
]


def arguments_of(row: Operation, named: dict[str, Any]) -> dict[str, Any]:
    return {name: named.get(name, "none") for name in row.named} | ASKED.get(row.name, {})


def is_of(row: Operation, kinds: set[str]) -> bool:
    return not row.named or row.named[0] in kinds


async def read(door: Door, row: Operation, named: dict[str, Any]) -> bool:
    """Say whether the operation was answered, as its row says; if not, there is no such thing here."""
    try:
        told = await door.call(row.name, arguments_of(row, named))
    except NOT_HERE:
        return False
    assert json.loads(json.dumps(told)) == told, row.name
    TypeAdapter(row.result).validate_python(told)
    return True


@in_virtual_time
async def test_reads_of_bodies_and_of_the_plant() -> None:
    async with rig() as it:
        door = Door(it.plant)
        asked = [row for row in READS if is_of(row, {"line_id", "body_id", "group_id"})]
        answered = [row.name for row in asked if await read(door, row, NAMED)]
        assert {"getBody", "getPosition", "listBodyPositions", "getBodySettings", "getTrace"} <= {*answered}
        assert {"listEvents", "listCommands", "version", "getBodyBackup", "getCapture"} <= {*answered}
        assert len(answered) > 40


@in_virtual_time
async def test_reads_of_robots() -> None:
    async with fics_rig() as it:
        door = Door(it.plant)
        asked = [row for row in READS if row.named and row.named[0] == "robot_id"]
        answered = [row.name for row in asked if await read(door, row, OF_ROBOTS)]
        assert {"getRobot", "getUnitPosition", "getInputs", "getSettings", "listPositions"} <= {*answered}


@in_virtual_time
async def test_what_only_http_serves_says_why() -> None:
    async with rig() as it:
        with pytest.raises(InvalidRequest, match="streamEvents is served by HTTP alone: it is a stream"):
            await Door(it.plant).call("streamEvents")
