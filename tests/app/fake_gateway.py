"""A gateway that answers as it is told, and keeps what was asked."""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import httpx
import pytest
from typer.testing import CliRunner, Result

from app import http
from app.cli import app

Answer = tuple[int, object]


@dataclass
class Asked:
    """One request."""

    method: str
    path: str
    content: object
    headers: Mapping[str, str]
    query: Mapping[str, str]


@dataclass
class FakeGateway:
    """Answers each path in turn, with the last answer again and again; any other as `otherwise` says."""

    answers: dict[str, list[Answer]] = field(default_factory=dict)
    otherwise: Answer = (404, {"detail": "There is no such thing.", "moved": "no"})
    asked: list[Asked] = field(default_factory=list)

    def request(
        self, method: str, url: str, *, json: object, headers: dict[str, str], **_: object
    ) -> httpx.Response:
        place = httpx.URL(url)
        path = place.path
        self.asked.append(Asked(method, path, json, headers, dict(place.params)))
        waiting = self.answers.get(path, [self.otherwise])
        status, answer = waiting.pop(0) if len(waiting) > 1 else waiting[0]
        if isinstance(answer, BaseException):
            raise answer
        if isinstance(answer, str):
            return httpx.Response(status, text=answer)
        return httpx.Response(status, json=answer)

    @property
    def paths(self) -> list[str]:
        return [request.path for request in self.asked]

    @property
    def posted(self) -> list[tuple[str, object]]:
        return [(request.path, request.content) for request in self.asked if request.method == "POST"]

    def run(self, monkeypatch: pytest.MonkeyPatch, *words: str, **environment: str) -> Result:
        monkeypatch.setattr(http, "request", self.request)
        return CliRunner().invoke(app, words, env=environment)


def interrupted_at(monkeypatch: pytest.MonkeyPatch, pauses: int) -> list[float]:
    """Press Ctrl-C in pause number `pauses`; give the list to which the seconds of each pause are added."""
    slept: list[float] = []

    def sleep(seconds: float) -> None:
        slept.append(seconds)
        if len(slept) == pauses:
            raise KeyboardInterrupt

    monkeypatch.setattr(time, "sleep", sleep)
    return slept


def always(answer: object, status: int = 200) -> FakeGateway:
    """One answer for all."""
    return FakeGateway(otherwise=(status, answer))


def move(status: str, moved: str | None = None, body: str = "a.3F") -> dict[str, Any]:
    return {"id": "m1", "body_id": body, "status": status, "error": moved and {"moved": moved}}


def stopped(*states: str) -> dict[str, Any]:
    confirmed = all(state == "confirmed" for state in states)
    bodies = [{"body_id": "a.3F", "state": state, "detail": None} for state in states]
    return {"confirmed": confirmed, "bodies": bodies, "robots": []}


def plant(**names: str) -> dict[str, list[Answer]]:
    """The lists of a gateway with robot r1, of units 1 and 2, SCARA wafer, bodies a.3F and a.02, by names."""
    axes = [{"name": name, "unit": "mm"} for name in "XY"] + [{"name": "@", "unit": "degree"}]
    units = [{"number": number, "axes": axes} for number in (1, 2)]
    return {
        "/robots": [(200, {"robots": [{"robot_id": "r1", "name": names.get("r1", ""), "units": units}]})],
        "/bodies": [
            (
                200,
                {
                    "bodies": [
                        {"body_id": f"a.{number}", "name": names.get(f"b{number}", "")}
                        for number in ("3F", "02")
                    ]
                },
            )
        ],
        "/groups": [(200, {"groups": [{"group_id": "a.80", "name": names.get("g80", "")}]})],
        "/scaras": [(200, {"scaras": [{"scara_id": "wafer", "name": names.get("wafer", "")}]})],
        "/robots/r1/units/1": [(200, {"axes": axes})],
    }
