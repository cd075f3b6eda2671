"""Every example of a request body is posted to the demo: none is refused for its form."""

import json
from pathlib import Path
from typing import Any

import httpx
import pytest

from tests.clients.conftest import running_demo
from tests.e2e.processes import PATIENCE_S

OPENAPI = Path(__file__).parents[2] / "openapi" / "openapi.json"


def path_with_examples(path: str, operation: dict[str, Any]) -> str:
    values = {
        it["name"]: it["schema"].get("examples", [None])[0]
        for it in operation["parameters"]
        if it["in"] == "path"
    }
    return path.format_map({**values, "unit": 2})


def requests() -> list[tuple[str, str, Any]]:
    """Give method, path and body of every example; of groups' commands none, which are those of bodies."""
    return [
        (
            method,
            path_with_examples(path, operation) if operation.get("parameters") else path,
            example["value"],
        )
        for path, item in json.loads(OPENAPI.read_text("utf-8"))["paths"].items()
        if not path.startswith("/groups/{group_id}/commands/")
        for method, operation in item.items()
        for content in operation.get("requestBody", {}).get("content", {}).values()
        for example in content.get("examples", {}).values()
    ]


@pytest.mark.timeout(300)
def test_no_example_is_refused_for_its_form(tmp_path: Path) -> None:
    with running_demo(tmp_path) as url, httpx.Client(base_url=url, timeout=PATIENCE_S) as http:
        http.put("/groups/80", json={"members": ["00", "3F"]}).raise_for_status()
        refused = []
        for method, path, body in requests():
            answer = http.request(method, path, json=body)
            kind = "" if answer.is_success else answer.json()["type"].rpartition(":")[2]
            if answer.status_code in (400, 405, 415, 500) or kind == "invalid-request":
                refused.append(f"{method} {path} {body}: {answer.json()['detail']}")
    alone = [it for it in refused if "is not sent alone" in it]
    assert refused == alone, "\n".join(refused)
    # What belongs between other commands has a route only to say so.
    assert len(alone) == 3
    assert len(requests()) > 100
