"""The target of a command: an address, or a name that the configuration gives; the shell completes both."""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Literal

import typer

from app.client import LOCAL, Client
from app.exits import Failure, Misuse
from gateway.core.parts import is_numbered, numbered_address

Kind = Literal["bodies", "groups", "scaras", "robots"]

FIRST_GROUP = 0x80
"""Least number of a virtual body, as in `protocols.rorze.row`, which takes long to load."""
_UNIT = re.compile("(.+?)(?:/units)?/([1-9])", re.IGNORECASE)


@dataclass(frozen=True, slots=True)
class NamedTarget:
    """The target of a command; `unit` is the number of a robot's unit, where one was named."""

    kind: Kind
    address: str
    unit: int | None = None
    units: tuple[int, ...] = ()
    """All units of the robot."""

    @property
    def path(self) -> str:
        """Where the gateway serves it."""
        return f"/{self.kind}/{self.address}" + (f"/units/{self.unit}" if self.unit else "")

    @property
    def filter(self) -> str:
        """The target's part of a filter of events."""
        return self.address + (f"/units/{self.unit}" if self.unit else "")

    def unit_path(self) -> str:
        """Where its unit is served; the only one if none was named.

        :raises Failure: it has several.
        """
        if self.unit is None and len(self.units) != 1:
            named = ", ".join(f"{self.address}/units/{number}" for number in self.units)
            raise Misuse(f"Robot {self.address} has several units: say {named}")
        return f"/{self.kind}/{self.address}/units/{self.unit or self.units[0]}"


def numbered(word: str) -> NamedTarget | None:
    """Read the address of a body or a group, `3F` or `arm.80`; None if it is none."""
    if not is_numbered(word):
        return None
    group = int(word[-2:], 16) >= FIRST_GROUP
    return NamedTarget("groups" if group else "bodies", numbered_address(word))


def find(client: Client, word: str) -> NamedTarget:
    """Find the target of a word: an address means itself, whatever names there are.

    :raises Failure: no target has this name, or several have; or the gateway did not tell.
    """
    if target := numbered(word):
        return target
    unit = _UNIT.fullmatch(word)
    name, number = (unit[1], int(unit[2])) if unit else (word, None)
    robots = client.request("GET", "/robots")["robots"]
    for robot in robots:
        if robot["robot_id"] == name.lower():
            return _robot(robot, number)
    scaras = client.made("scaras")
    if any(scara["scara_id"] == word.lower() for scara in scaras):
        return NamedTarget("scaras", word.lower())
    found = [_robot(robot, number) for robot in robots if robot["name"] == name]
    if number is None:
        found += [NamedTarget("scaras", scara["scara_id"]) for scara in scaras if scara["name"] == name]
        found += _named(client, "bodies", "body_id", name) + _named(client, "groups", "group_id", name)
    if len(found) == 1:
        return found[0]
    if found:
        raise Misuse(
            f"{word!r} is the name of {' and '.join(target.address for target in found)}: say the address"
        )
    raise Misuse(f"There is nothing called {word!r}; `motion-gateway status` lists what there is")


def _robot(robot: dict[str, Any], unit: int | None) -> NamedTarget:
    return NamedTarget("robots", robot["robot_id"], unit, tuple(unit["number"] for unit in robot["units"]))


def _named(client: Client, kind: Kind, id_key: str, name: str) -> list[NamedTarget]:
    listed = client.request("GET", f"/{kind}")[kind]
    return [NamedTarget(kind, item[id_key]) for item in listed if item["name"] == name]


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
