"""A robot: its units are motion devices, their axes move in their own units."""

from collections.abc import Iterator
from pathlib import Path
from uuid import uuid4

import pytest

from tests.bridges.opcua.stand import BODIES, Bridge, Client, Plant, client_of, node
from tests.e2e.processes import simulated_line, simulated_robot, until

ROBOT = """
[[lines]]
id = 'cell1'
protocol = "fics"
address = '{address}'

[lines.robot]
id = "r1"

[[lines.robot.units]]
number = 1
axes = ["X", "Y", "Z"]
system = "mm"
"""


@pytest.fixture
def client(tmp_path: Path) -> Iterator[Client]:
    """A client of a plant with a robot."""
    node()
    with simulated_line(tmp_path, BODIES) as line, simulated_robot(tmp_path) as robot:
        plant = Plant(tmp_path, line, ROBOT.format(address=robot.address))
        bridge = Bridge(tmp_path, plant)
        with client_of(tmp_path, bridge.trusted) as client:
            yield client.connect(bridge)
        bridge.program.end()
        plant.end()


def test_a_robot_is_homed_moved_by_an_axis_and_stopped(client: Client) -> None:
    assert [it["name"] for it in client.tell("browse", node="r1.1.Axes")] == ["X", "Y", "Z"]
    emergency = client.read("r1.SafetyStates.SafetyState.EmergencyStop")[0]
    assert (emergency["status"], emergency["value"]) == ("BadNotSupported", None)
    home = client.call("r1.1", "Home", ("String", uuid4().hex), ("Double", 0.0))
    assert home["status"] == "Good", home
    until(lambda: client.read("r1.1.X.Homed")[0]["value"] == "yes", "it is homed")

    before = client.read("r1.1.X.ActualPosition")[0]
    assert before["status"] == "Good", before
    moved = client.move("r1.1.X", 5.0, unit="mm")
    assert moved["status"] == "Good", moved
    seen: list[float] = []

    def has_moved() -> bool:
        seen.append(client.read("r1.1.X.ActualPosition")[0]["value"])
        return bool(seen[-1] == pytest.approx(before["value"] + 5.0, abs=0.1))

    until(has_moved, f"it has moved from {before}: {seen}", 10)
    assert client.move("r1.1.X", 5.0, unit="deg")["status"] == "BadInvalidArgument"
    assert client.call("r1", "Stop")["status"] == "Good"
