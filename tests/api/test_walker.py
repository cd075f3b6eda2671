"""Each route of an operation has its row, with the same right; what is written by hand has a reason."""

from api.app import create_app
from api.common.routes import HttpRoute
from gateway.config import Config
from gateway.door import operations
from gateway.plant import Plant

LINE = {"id": "line1", "address": "tcp://127.0.0.1:1", "bodies": [{"id": "3F"}]}


def routes() -> dict[tuple[str, str], HttpRoute]:
    app = create_app(Plant(Config.model_validate({"lines": [LINE]})))
    found = [route for route in app.routes if isinstance(route, HttpRoute)]
    return {(method, route.path): route for route in found for method in route.methods or ()}


def test_every_route_has_a_row_and_every_row_a_route() -> None:
    there, rows = routes(), {(row.verb, row.path): row for row in operations()}
    assert there.keys() == rows.keys()
    for place, row in rows.items():
        assert there[place].right == row.right, place


def test_what_is_written_by_hand_says_why_and_is_little() -> None:
    rows = list(operations())
    assert [row.name for row in rows if row.by_hand is not None] == ["listCommands"]
    assert len([row for row in rows if row.http_only is not None]) <= 7
    assert all(row.by_hand != "" and row.http_only != "" for row in rows)
    by_hand = {(row.verb, row.path) for row in rows if row.by_hand or row.http_only}
    made = {place for place, route in routes().items() if route.endpoint.__module__ == "api.walker"}
    assert made == {(row.verb, row.path) for row in rows} - by_hand
