"""The OpenAPI document as a file: `python -m api.openapi` writes it anew."""

import json
from pathlib import Path

from api.app import create_app
from gateway.config import Config
from gateway.plant import Plant

PATH = Path(__file__).parent.parent / "openapi" / "openapi.json"


def document() -> str:
    """The document of the app, which is the same for every configuration."""
    line = {"id": "line1", "address": "tcp://127.0.0.1:1", "bodies": [{"id": "3F"}]}
    app = create_app(Plant(Config.model_validate({"lines": [line]})))
    return json.dumps(app.openapi(), ensure_ascii=False, indent=1) + "\n"


if __name__ == "__main__":
    PATH.write_text(document(), "utf-8")
