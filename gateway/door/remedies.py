"""The calls that help after a request has failed."""

import re
from collections.abc import Sequence
from typing import Final

from gateway.core.errors import GatewayError
from gateway.core.next_calls import NextCall
from gateway.plant import Plant

_TARGET: Final = re.compile(r"/[^/]+/[^/]+(?:/units/\d+)?")


def calls_for(plant: Plant, path: str, error: GatewayError) -> Sequence[NextCall]:
    """The calls that help where a request for something at a path has failed."""
    about = _TARGET.match(path)
    if error.next or about is None:
        return error.next
    try:
        return plant.target(about[0]).calls_for(error)
    except GatewayError:
        return ()
