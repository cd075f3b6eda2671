"""The requests of the recordings, in turn, and the time that passes after each."""

from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Step:
    """A request, and the seconds until the next; the answer is not waited for beyond them."""

    method: str
    path: str
    content: Any = None
    then_s: float = 0.5


def get(path: str, then_s: float = 0.2) -> Step:
    return Step("GET", path, None, then_s)


def post(path: str, content: Any = None, then_s: float = 0.5) -> Step:
    return Step("POST", path, content, then_s)


def put(path: str, content: Any, then_s: float = 0.5) -> Step:
    return Step("PUT", path, content, then_s)


def _relative(pulses: int, direction: str = "cw") -> dict[str, Any]:
    return {"kind": "relative", "direction": direction, "distance": {"value": pulses, "unit": "pulse"}}


def _absolute(pulses: int) -> dict[str, Any]:
    return {"kind": "absolute", "position": {"value": pulses, "unit": "pulse"}}


def _speeds(body: str) -> list[Step]:
    commands = {
        "set-start-speed": {"speed": 5_000},
        "set-maximum-speed": {"speed": 50_000},
        "set-maximum-acceleration": {"acceleration": 100_000},
    }
    return [post(f"/bodies/{body}/commands/{name}", values) for name, values in commands.items()]


BODIES: list[Step] = [
    get("/bodies/00/position"),
    get("/bodies/3F/status"),
    get("/bodies"),
    *_speeds("00"),
    *_speeds("01"),
    *_speeds("3F"),
    post("/bodies/3F/moves", _relative(20_000), 0.1),
    get("/bodies/3F/position", 0.0),
    get("/bodies/3F/position", 0.0),
    get("/bodies/00/status"),
    post("/bodies/3F/moves", _relative(100), 2.0),
    post("/bodies/3F/moves", _absolute(5_000), 0.3),
    post("/bodies/3F/stop", {"mode": "immediate"}, 3.0),
    post("/bodies/00/moves", {"kind": "home"}, 8.0),
    put("/bodies/01/position", {"value": 700, "unit": "pulse"}, 1.0),
    post("/bodies/01/moves", _absolute(900), 3.0),
    *[
        post("/bodies/3F/commands/set-position-entry", {"entry": {"position": n}, "pulses": 1000 * n}, 0.0)
        for n in range(1, 5)
    ],
    *[post("/bodies/3F/commands/get-position-entry", {"entry": {"position": n}}, 0.0) for n in range(1, 5)],
    post("/bodies/3F/commands/move-to", {"position": {"position": 2}}, 4.0),
    put("/groups/80", {"members": ["00", "01"]}, 1.0),
    post("/groups/80/moves", _relative(3_000), 0.2),
    post("/groups/80/stop", None, 4.0),
    post("/bodies/00/moves", {**_relative(1_000), "validate_only": True}, 2.0),
    post("/bodies/00/moves", _relative(60_000), 0.3),
    post("/bodies/3F/moves", _relative(60_000, "ccw"), 0.3),
    post("/bodies/00/speed", {"mode": "change", "speed": 9_000}, 0.3),
    post("/stop", {"mode": "decelerate"}, 5.0),
    post("/bodies/3F/commands/set-user-comment", {"comment_number": 2, "text": "spindle"}),
    post("/bodies/3F/commands/get-information", {"comment_number": 2}),
    post("/bodies/3F/commands/save-settings", None, 4.0),
    post("/bodies/01/commands/clear-controller-status", None, 8.0),
]


def _mm(**places: float) -> dict[str, Any]:
    return {axis: {"value": value, "unit": "mm"} for axis, value in places.items()}


_UNIT = "/robots/r1/units/1"
_OTHER = "/robots/r1/units/2"

ROBOT: list[Step] = [
    get("/robots/r1"),
    get(f"{_UNIT}/position"),
    get(f"{_UNIT}/status"),
    get(f"{_OTHER}/position"),
    post(f"{_UNIT}/moves", {"kind": "absolute", "axes": _mm(X=100.0, Y=50.0)}, 1.0),
    post(f"{_UNIT}/moves", {"kind": "home"}, 12.0),
    post(f"{_OTHER}/moves", {"kind": "relative", "axes": _mm(X=20.0)}, 6.0),
    post(f"{_UNIT}/moves", {"kind": "relative", "axes": _mm(Z=10.0)}, 0.3),
    get(f"{_UNIT}/position", 0.0),
    get("/robots/r1/inputs?count=4", 0.0),
    get("/robots/r1/variables?first=1&count=3", 4.0),
    Step("PATCH", f"{_OTHER}/settings", {"speed_percent": {"X": 50.0}}, 2.0),
    get(f"{_OTHER}/settings", 2.0),
    post(f"{_OTHER}/commands/set-speed-percent", {"percents": [40.0, None, None]}, 2.0),
    put(
        f"{_OTHER}/positions",
        {"positions": [{"number": n, "axes": _mm(X=10.0 * n, Y=5.0, Z=1.0)} for n in (1, 2, 3)]},
        6.0,
    ),
    get(f"{_OTHER}/positions?first=1&last=3", 3.0),
    post(f"{_OTHER}/moves", {"kind": "position", "position": 2}, 8.0),
    put("/robots/r1/outputs/1/7", {"on": True}, 1.0),
    put("/robots/r1/variables/9", {"value": 12.5}, 1.0),
    post(f"{_OTHER}/moves", {"kind": "relative", "axes": _mm(X=200.0)}, 0.4),
    post("/robots/r1/stop", {"mode": "immediate"}, 4.0),
    post("/robots/r1/errors/reset", None, 2.0),
    post("/robots/r1/jogs", {"unit": 2, "axis": "X", "direction": "+"}, 3.0),
    post(f"{_OTHER}/moves", {"kind": "step", "axis": "Y", "steps": 20}, 4.0),
    post(f"{_UNIT}/moves", {"kind": "relative", "axes": _mm(Z=100.0)}, 0.4),
    post("/stop", None, 8.0),
]
