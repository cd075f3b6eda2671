"""The plant of `serve --demo`: a line with a lift, two axes that go together, a SCARA robot, and a Fics."""

from pathlib import Path
from typing import Any, Final

from app.client import LOCAL
from gateway.config import Config

LINE: Final = "line1"
ROBOT: Final = "r1"
_TURN: Final = 360.0
_BODIES: Final[tuple[dict[str, Any], ...]] = (
    {"id": "00", "name": "left rail"},
    {"id": "01", "name": "right rail"},
    {"id": "10", "name": "base", "units": {"unit": "deg", "pulses_per_unit": 121_791.045 / _TURN}},
    {"id": "11", "name": "arm", "units": {"unit": "deg", "pulses_per_unit": 60_000 / _TURN}},
    {"id": "12", "name": "finger", "units": {"unit": "deg", "pulses_per_unit": 100_000 / _TURN}},
    {
        "id": "3F",
        "name": "lift",
        "units": {"unit": "mm", "pulses_per_unit": 100.0},
        "inputs": {"0": "door closed", "8": "index mark"},
        "outputs": {"0": "program runs", "1": "lamp"},
    },
)
_GROUPS: Final[tuple[dict[str, Any], ...]] = (
    {"id": "80", "members": ["00", "01"]},
    {"id": "81", "members": ["10", "11", "12"]},
)
_SCARA: Final[dict[str, Any]] = {
    "id": "wafer",
    "line": LINE,
    "group": "8A",
    "members": ["10", "11", "12"],
    "arm_um": 215_000,
    "finger_um": 330_000,
    "pulses_per_turn": [121_791.045, 60_000.0, 100_000.0],
}
"""The robot of RC-420 manual 13.10.7."""
BODIES: Final = tuple(int(body["id"], 16) for body in _BODIES)


def demo_config(
    line_path: Path, robot_path: Path, port: int | None = None, plant: str | None = None
) -> Config:
    """The configuration for a simulated line and robot at these places; `plant` is NAME=SERVER."""
    server: dict[str, Any] = {"raw_commands": True, "allow_endless_moves": True}
    if port is not None:
        server["port"] = port
    line = {
        "id": LINE,
        "address": f"serial://{line_path}?baud=9600",
        "bodies": _BODIES,
        "groups": _GROUPS,
    }
    units = [
        {"number": 1, "axes": ["X", "Y", "Z"], "motor_axes": ["A", "B", "Z"]},
        {"number": 2, "axes": ["X", "Y", "Z"]},
    ]
    robot = {"id": ROBOT, "units": units, "macros": {"PCK": "pick"}}
    cell = {"id": "cell1", "protocol": "fics", "address": f"dpram://{robot_path}", "robot": robot}
    return Config.model_validate(
        {
            "server": server,
            "access": {"mode": "open"},
            "lines": [line, cell],
            **({"scaras": [_SCARA]} if "scaras" in Config.model_fields else {}),
            **({} if plant is None else {"plant": _member(plant)}),
        }
    )


def _member(plant: str) -> dict[str, Any]:
    name, _, server = plant.partition("=")
    return {"name": name, "servers": [server]}


def welcome(url: str, command: str) -> str:
    """Say in five lines what to do next; `command` is what the demo was started as."""
    where = "" if url == LOCAL else f" --url {url}"
    return f"""
  1  See the plant, move its motors by hand, STOP ALL:  {url}/
  2  Move a motor from another shell:  {command} move 3F relative 500 --wait 10{where}
  3  Break something, and find the way back to work:  {url}/#/system
  4  Try the API:  {url}/docs  or MQTT and OPC UA:  {url}/manual/mqtt.html  {url}/manual/opcua.html
  5  Serve a line of your own:  {command} init --port /dev/ttyUSB0 --out gateway.toml
"""
