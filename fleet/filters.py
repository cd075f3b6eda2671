"""Filters for the events of the plant: by address, type and gateway."""

import re
from collections.abc import Callable

from fleet.feed import PlantEvent, Wanted
from gateway.core.errors import InvalidRequest
from gateway.core.events import GAP
from gateway.core.parts import spelled

_TYPE = re.compile(r"[a-z0-9_]+(?:\.[a-z0-9_]+)*(?:\.\*)?")
_GATEWAY = re.compile(r"[a-z][a-z0-9-]{0,31}")


def filter_of(bodies: str | None, types: str | None, gateways: str | None) -> Wanted:
    """Read what is wanted: addresses, types such as `body.move.*`, gateways; a gap concerns everybody.

    :raises InvalidRequest: one of them is none.
    """
    tests = [
        *([_by_type(_split(types))] if types else ()),
        *([_by_address(_split(bodies))] if bodies else ()),
        *([_by_gateway(_split(gateways))] if gateways else ()),
    ]
    return lambda event: event.type == GAP or all(test(event) for test in tests)


def _split(text: str) -> list[str]:
    return [part.strip() for part in text.split(",")]


def _by_type(types: list[str]) -> Callable[[PlantEvent], bool]:
    for type_ in types:
        if not _TYPE.fullmatch(type_):
            raise InvalidRequest(f"types: {type_!r} is no type of events.", "Give types such as body.move.*")
    exact = {type_ for type_ in types if not type_.endswith("*")}
    prefixes = tuple(type_.removesuffix("*") for type_ in types if type_.endswith("*"))
    return lambda event: event.type in exact or event.type.startswith(prefixes)


def _by_address(addresses: list[str]) -> Callable[[PlantEvent], bool]:
    wanted = set()
    for text in addresses:
        gateway, colon, address = text.rpartition(":")
        if (canonical := spelled(address)) is None or (colon and not _GATEWAY.fullmatch(gateway)):
            raise InvalidRequest(
                f"bodies: {text!r} is no address.", "Give addresses such as stocker1:line1.3F or 3F."
            )
        wanted.add((gateway, canonical))

    def passes(event: PlantEvent) -> bool:
        address = event.subject.rpartition(":")[2]
        names = (address, address.rpartition(".")[2], address.partition("/")[0])
        return any((gateway, name) in wanted for name in names for gateway in (event.gateway, ""))

    return passes


def _by_gateway(gateways: list[str]) -> Callable[[PlantEvent], bool]:
    for name in gateways:
        if not _GATEWAY.fullmatch(name):
            raise InvalidRequest(f"gateways: {name!r} is no name of a gateway.", "GET /gateways lists them.")
    wanted = set(gateways)
    return lambda event: event.gateway in wanted
