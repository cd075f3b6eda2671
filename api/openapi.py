"""The OpenAPI documents as files, the whole and its parts: `python -m api.openapi` writes them anew."""

import json
from pathlib import Path
from typing import Any

from api.app import create_app
from api.common.schemas import core_of, resources_of
from gateway.door.opening import Config, Plant

FOLDER = Path(__file__).parent.parent / "openapi"


def documents() -> dict[str, str]:
    """The files of the app's documents, which are the same for every configuration.

    `resources.json` leaves out the routes of single commands; clients are generated from it. `core.json` has
    what is needed first.
    """
    line = {"id": "line1", "address": "tcp://127.0.0.1:1", "bodies": [{"id": "3F"}]}
    whole = create_app(Plant(Config.model_validate({"lines": [line]}))).openapi()
    parts = {"openapi.json": whole, "resources.json": resources_of(whole), "core.json": core_of(whole)}
    return {name: _written(document) for name, document in parts.items()}


def _written(document: dict[str, Any]) -> str:
    return json.dumps(document, ensure_ascii=False, indent=1) + "\n"


if __name__ == "__main__":
    for name, text in documents().items():
        (FOLDER / name).write_text(text, "utf-8")
