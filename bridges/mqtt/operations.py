"""The operations of the gateway's OpenAPI document: which stop, which move, which change something."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Final

from motion_gateway_client import AsyncGateway

from bridges.mqtt.topics import STOP as STOPPING

STOP: Final = "stop"
MOTION: Final = "motion"
READS: Final = frozenset({"open", "view"})
WITHIN: Final = "start_within_s"
"""The member of a request that says how long it may wait for its turn."""


@dataclass(frozen=True, slots=True)
class Operation:
    """The properties of an operation that a bridge needs; the gateway judges the rest."""

    stops: bool = False
    changes: bool = True
    """True if it has an effect, so that to do it twice matters."""
    moves: bool = False
    """True if it can move a motor, so that it must not come late."""
    takes_within: bool = False
    """True if its request can say how long it may wait for its turn."""


UNKNOWN: Final = Operation(moves=True)
"""Stands for an operation that the document lacks: the gateway refuses it, or knows more."""
RAW: Final = "/raw"
"""End of the path of a command as text, which may be one that moves."""


class Operations:
    """The operations that are POSTs, by their paths."""

    def __init__(self, document: Mapping[str, Any]) -> None:
        schemas = document.get("components", {}).get("schemas", {})
        self._by_shape: dict[tuple[str, ...], Operation] = {}
        """Operations by the fixed parts of their paths; the parts that are parameters are left out."""
        self._shapes: dict[int, set[tuple[int, ...]]] = {}
        """Places of the fixed parts of each known path, by the number of its parts."""
        for path, its in document["paths"].items():
            if "post" in its:
                parts = path.split("/")
                fixed = tuple(place for place, part in enumerate(parts) if not part.startswith("{"))
                self._by_shape[_shape(parts, fixed)] = _operation(path, its["post"], schemas)
                self._shapes.setdefault(len(parts), set()).add(fixed)

    def find(self, path: str) -> Operation:
        """Give the operation of a path."""
        parts = path.split("/")
        found = (self._by_shape.get(_shape(parts, fixed)) for fixed in self._shapes.get(len(parts), ()))
        return next((operation for operation in found if operation is not None), UNKNOWN)


def _shape(parts: list[str], fixed: tuple[int, ...]) -> tuple[str, ...]:
    return (str(len(parts)), *(f"{place} {parts[place]}" for place in fixed))


def without_document(path: str) -> Operation | None:
    """Tell a stop from the rest, of which nothing is known before the gateway has given its document."""
    return Operation(stops=True) if path.endswith(STOPPING) else None


async def read(gateway: AsyncGateway) -> Operations:
    """Ask the gateway for its document.

    :raises GatewayError: it does not give it.
    """
    return Operations(await gateway.call("GET", "/openapi.json"))


def _operation(path: str, told: Mapping[str, Any], schemas: Mapping[str, Any]) -> Operation:
    right = told.get("x-right")
    return Operation(
        stops=right == STOP,
        changes=right not in READS and right != STOP,
        moves=told.get("x-effect") == MOTION or path.endswith(RAW),
        takes_within=any(WITHIN in request.get("properties", {}) for request in _requests(told, schemas)),
    )


def _requests(told: Mapping[str, Any], schemas: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Give all shapes that a request can have."""
    content = told.get("requestBody", {}).get("content", {})
    waiting = [media.get("schema", {}) for media in content.values()]
    while waiting:
        schema = waiting.pop()
        if "$ref" in schema:
            schema = schemas.get(schema["$ref"].rpartition("/")[2], {})
        yield schema
        waiting += [*schema.get("oneOf", ()), *schema.get("anyOf", ()), *schema.get("allOf", ())]
