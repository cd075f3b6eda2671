"""A plant of everything that there can be, never started: what asks a controller is answered with 503."""

from collections.abc import Mapping
from typing import Any, Final

from gateway.config import Config
from gateway.plant import Plant

UNITS: Final = [{"number": 1, "axes": ["X"]}]
LINES: Final[list[dict[str, Any]]] = [
    {
        "id": "arm",
        "bodies": [{"id": "00"}, {"id": "01"}, {"id": "3F"}],
        "groups": [{"id": "80", "members": ["01", "3F"]}],
    },
    {
        "id": "leg",
        "bodies": [{"id": "00"}, {"id": "70"}],
        "groups": [{"id": "81", "members": ["00", "70"]}],
    },
    {"id": "cell", "protocol": "fics", "robot": {"id": "r1", "units": UNITS}},
    {"id": "rail", "protocol": "fics", "robot": {"id": "r2", "units": UNITS}},
]
SCARA: Final = {
    "id": "wafer",
    "line": "leg",
    "group": "82",
    "members": ["00", "70"],
    "arm_um": 156_000,
    "finger_um": 208_000,
    "pulses_per_turn": [98_765.0, 99_000.0],
}
THERE: Final = {
    "body_id": "arm.3F",
    "group_id": "arm.80",
    "scara_id": "wafer",
    "line_id": "arm",
    "robot_id": "r1",
}
"""Names that the paths of routes may have."""


def whole_plant(**tables: Mapping[str, object]) -> Plant:
    """Make it, with further tables of its configuration."""
    lines = [{**line, "address": f"tcp://127.0.0.1:{port}"} for port, line in enumerate(LINES, start=1)]
    return Plant(Config.model_validate({**tables, "lines": lines, "scaras": [SCARA]}))
