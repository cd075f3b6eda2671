"""The tree of a line as node-opcua browses it, beside the table of the page, row by row."""

import re
from pathlib import Path
from typing import Final

from tests.bridges.opcua.stand import Bridge, Client

PAGE: Final = Path(__file__).parents[3] / "docs" / "opcua.md"
SYSTEM: Final = ("line1",)
DEVICE: Final = (*SYSTEM, "MotionDevices", "line1")
AXIS: Final = (*DEVICE, "Axes", "3F")
CONTROLLER: Final = (*SYSTEM, "Controllers", "RC-400")
SAFETY: Final = (*SYSTEM, "SafetyStates", "SafetyState")
THERE, UNKNOWN, EMPTY = "there", "Bad_NotSupported", "empty"
ROWS: Final[dict[str, dict[tuple[str, ...], str]]] = {
    "MotionDeviceSystemType": {
        (*SYSTEM, it): THERE for it in ("MotionDevices", "Controllers", "SafetyStates")
    },
    "MotionDeviceType": {(*DEVICE, it): THERE for it in ("Manufacturer", "Model", "ProductCode")},
    "SerialNumber": {(*DEVICE, "SerialNumber"): UNKNOWN},
    "MotionDeviceCategory": {(*DEVICE, "MotionDeviceCategory"): THERE},
    "ParameterSet/SpeedOverride": {(*DEVICE, "ParameterSet", "SpeedOverride"): UNKNOWN},
    "Axes": {(*DEVICE, "Axes", it): THERE for it in ("00", "3F")},
    "AxisType: `MotionProfile`": {(*AXIS, "MotionProfile"): THERE},
    "AxisType: `ParameterSet/ActualPosition`": {
        (*AXIS, "ParameterSet", "ActualPosition"): THERE,
        (*AXIS, "ParameterSet", "ActualPosition", "EngineeringUnits"): THERE,
        (*AXIS, "ParameterSet", "ActualPosition", "EURange"): THERE,
    },
    "PowerTrains": {(*DEVICE, "PowerTrains"): EMPTY},
    "ControllerType": {
        (*CONTROLLER, "Manufacturer"): THERE,
        (*CONTROLLER, "Model"): THERE,
        (*CONTROLLER, "CurrentUser", "Level"): UNKNOWN,
    },
    "Software": {(*CONTROLLER, "Software"): EMPTY, (*CONTROLLER, "TaskControls"): EMPTY},
    "SafetyStateType": {
        (*SAFETY, "ParameterSet", it): UNKNOWN
        for it in ("OperationalMode", "EmergencyStop", "ProtectiveStop")
    },
}
"""Verdicts by the first words of a row, and by paths of browse names."""
OF_THE_TYPES: Final = "ns=0;"
"""References `Controls`, `Moves`, `Requires` and `IsDrivenBy` are of the namespace of Robotics."""


class Tree:
    """The nodes below DeviceSet."""

    def __init__(self, client: Client) -> None:
        self._client = client
        self.references: set[str] = set()

    def children(self, node: str) -> dict[str, str]:
        """Give the nodes below one, by their browse names."""
        found = self._client.tell("browse", node=node)
        self.references |= {it["reference"] for it in found}
        return {it["name"]: it["node"].partition(";s=")[2] for it in found}

    def verdict(self, path: tuple[str, ...]) -> str:
        """Say how the node at a path is."""
        node, *names = path
        for name in names:
            children = self.children(node)
            if name not in children:
                return "missing"
            node = children[name]
        status = self._client.read(node)[0]["status"]
        if status == "BadAttributeIdInvalid":  # an object
            return THERE if self.children(node) else EMPTY
        return {"Good": THERE, "BadNotSupported": UNKNOWN}.get(str(status), str(status))


def test_the_browsed_tree_is_that_of_the_page_row_by_row(bridge: Bridge, client: Client) -> None:
    client.connect(bridge)
    table = PAGE.read_text("utf-8").partition("## OPC 40010-1")[2]
    rows = re.findall(r"^\| (?!Of |\|)(.+?) \| (.+?) \|", table, re.MULTILINE)
    tree, judged = Tree(client), set()
    for of, said in rows:
        plain = of.replace("`", "")
        name = next((it for it in ROWS if plain.startswith(it.replace("`", ""))), None)
        if name is None:
            assert (plain.startswith("References Controls"), "missing" in said) == (True, True), of
            continue
        judged.add(name)
        for path, verdict in ROWS[name].items():
            assert tree.verdict(path) == verdict, path
            assert verdict in said, (of, said)
    assert judged == set(ROWS)
    assert all(it.startswith((OF_THE_TYPES, "i=")) for it in tree.references), tree.references
