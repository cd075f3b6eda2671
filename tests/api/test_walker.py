"""One route serves all rows: it finds the row that a search would find, and leaves the rest to the others."""

import re

import pytest
from starlette.types import Scope

from api.walker import BY_HAND, ServedRow, Walker
from gateway.door import operations
from tests.api.stand import Stand, on_stand

ROWS = Walker(operations())


def asked(method: str, path: str) -> Scope:
    return {"type": "http", "method": method, "path": path, "query_string": b"", "headers": []}


def searched(method: str, path: str) -> ServedRow | None:
    """The first row, in the order of the documents, whose path fits."""
    words = path.split("/")
    return next((row for row in ROWS.routes if method in row.methods and row.params_in(words)), None)


@on_stand()
async def test_all_rows_are_served_by_one_route(stand: Stand) -> None:
    (route,) = (route for route in stand.app.routes if isinstance(route, Walker))
    assert [row.operation for row in route.routes] == list(operations())
    assert len(stand.app.routes) < 30


def test_what_is_answered_by_hand_says_why_and_is_little() -> None:
    rows = list(operations())
    assert [row.name for row in rows if row.by_hand is not None] == ["listCommands"]
    assert len([row for row in rows if row.http_only is not None]) <= 7
    assert all(row.by_hand != "" and row.http_only != "" for row in rows)
    assert BY_HAND.keys() == {row.name for row in rows if row.by_hand or row.http_only}


def test_every_row_is_found_as_a_search_finds_it() -> None:
    assert len(ROWS.routes) > 450
    for row in ROWS.routes:
        if row.operation.named:
            for word in ("1", "line1", "positions"):
                path = re.sub(r"{\w+}", word, row.path)
                scope = asked(row.operation.verb, path)
                assert ROWS.find(scope) is searched(row.operation.verb, path), path
                assert scope["path_params"] == row.params_in(path.split("/")) or ROWS.find(scope) is not row
        else:
            assert ROWS.find(asked(row.operation.verb, row.path)) is row


@pytest.mark.parametrize(
    ("method", "path"),
    [
        ("GET", "/nowhere"),
        ("GET", "/bodies/"),
        ("GET", "//"),
        ("GET", ""),
        ("DELETE", "/bodies"),
        ("GET", "/bodies/3F/{x"),
    ],
)
def test_what_is_not_there_is_left_to_the_others(method: str, path: str) -> None:
    assert ROWS.find(asked(method, path)) is None


@on_stand()
async def test_a_wrong_method_and_a_wrong_path_are_answered_as_ever(stand: Stand) -> None:
    wrong = await stand.client.request("DELETE", "/bodies/3F")
    assert (wrong.status_code, wrong.headers["allow"]) == (405, "GET")
    assert (await stand.get("/bodies/3F/nothing")).status_code == 404
