"""Answers to all sorts of wrong requests: sentences that end once and have one mark at a place."""

import re
from collections.abc import Iterator
from itertools import product
from typing import Any, Final

import httpx2
import pytest
from httpx2 import AsyncClient

from api.app import Application
from tests.api.robots.cell import Cell, in_cell
from tests.api.stand import Stand, on_stand

pytestmark = pytest.mark.prove

MARKS: Final = re.compile(r"[.,;:?!]\s*[.,;:]|\s{2,}|\s[.,;:?]|。[.;。、]|[(（]\s|\s[)）]|\(\)|（）|^\s|\s$")
"""Two marks at one place, a mark after a blank, two blanks, and brackets around nothing."""
NAMES: Final = {"body_id": "3F", "group_id": "80", "robot_id": "r1", "unit": "1", "line_id": "arm"}
WRONG_NAMES: Final = ("zz", "%20", "%09.")
WRONG_BODIES: Final = ("", "{", "[]", "null", '"x"', "{}", '{"nix":1}', '{"a":1,"a":2}', '{"a":1e999}')
WRONG_VALUES: Final[tuple[Any, ...]] = (None, "zz", -1, 1e12, [], {}, True, 3.5)
LONG: Final = ("/backup", "/stream", "/positions.csv", "/position-uploads")
"""Good requests of these take long, or never end."""


def requests_of(app: Application) -> Iterator[tuple[str, str, str]]:
    """Requests that are wrong in one place, mostly: each method, path with its query, and body."""
    document = app.openapi()
    for path, operations in document["paths"].items():
        # One command says what all of them say.
        if path.endswith(LONG) or (
            "/commands/" in path and not path.endswith(("move-clockwise", "home-robot"))
        ):
            continue
        names = re.findall(r"\{(\w+)\}", path)
        good = path.format_map({name: NAMES.get(name, "1") for name in names})
        for method, operation in operations.items():
            for name, wrong in product(names, WRONG_NAMES):
                yield method, path.format_map({it: NAMES.get(it, "1") for it in names} | {name: wrong}), "{}"
            yield method, f"{good}?nix=1", ""
            for parameter in operation.get("parameters", ()):
                if parameter["in"] == "query":
                    yield method, f"{good}?{parameter['name']}=nan", ""
            for body in WRONG_BODIES if method != "get" else ():
                yield method, good, body
            for body in wrong_values(document, operation):
                yield method, good, body


def wrong_values(document: dict[str, Any], operation: dict[str, Any]) -> Iterator[str]:
    """The examples of a request's body, each with one value that is wrong, or may be."""
    schema = operation.get("requestBody", {}).get("content", {}).get("application/json", {}).get("schema", {})
    for shape in [schema, *schema.get("oneOf", ()), *schema.get("anyOf", ())]:
        named = document["components"]["schemas"].get(shape.get("$ref", "").rpartition("/")[2], shape)
        for example in named.get("examples", ()):
            for name in example:
                for value in WRONG_VALUES:
                    yield httpx2.Request("POST", "http://x", json={**example, name: value}).content.decode()


async def walk(app: Application, client: AsyncClient) -> int:
    """Send all of them in both languages; gives how many sentences were read."""
    said: dict[str, str] = {}
    for method, path, body in requests_of(app):
        for language in ("en", "ja"):
            headers = {"content-type": "application/json", "accept-language": language}
            answer = await client.request(method.upper(), path, content=body, headers=headers)
            assert answer.status_code != 500, (method, path, body, answer.text)
            if answer.headers.get("content-type", "").startswith("application/problem"):
                problem = answer.json()
                told = [
                    problem["detail"],
                    problem["remedy"],
                    *(it["message"] for it in problem.get("errors", ())),
                ]
                said.update(dict.fromkeys(told, f"{method} {path} {body}"))
    assert {text: where for text, where in said.items() if MARKS.search(text)} == {}
    return len(said)


@on_stand({"arm": [{"id": "00"}, {"id": "3F"}]})
async def test_what_is_said_about_bodies_and_lines_is_punctuated_once(stand: Stand) -> None:
    assert await walk(stand.app, stand.client) > 300


@in_cell()
async def test_what_is_said_about_robots_is_punctuated_once(cell: Cell) -> None:
    assert await walk(cell.app, cell.client) > 300
