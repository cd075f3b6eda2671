"""Completion in the shell: the addresses and names that a running gateway has."""

from pathlib import Path
from typing import Any, Final

import typer

from app.client import LOCAL, Client
from app.exits import Failure

_IDS: Final = {"bodies": "body_id", "groups": "group_id", "scaras": "scara_id", "robots": "robot_id"}


def addresses(context: typer.Context, begun: str) -> list[str]:
    """List the addresses and names that complete a word; none where no gateway answers."""
    key_file = context.params.get("key_file")  # while a word is completed, options are text
    try:
        client = Client.at(context.params.get("url") or LOCAL, Path(key_file) if key_file else None)
        listed = {kind: client.made(kind) for kind in _IDS}
    except Failure:
        return []
    words = [word for kind, items in listed.items() for item in items for word in _words(item, _IDS[kind])]
    return [word for word in words if word.startswith(begun)]


def _words(item: dict[str, Any], id_key: str) -> list[str]:
    """The address, that of each unit, and the name; a shell would take a name with a blank for two words."""
    address: str = item[id_key]
    units = [f"{address}/units/{unit['number']}" for unit in item.get("units", ())]
    name = item["name"]
    return [address, *units, *([name] if name and not any(map(str.isspace, name)) else [])]
