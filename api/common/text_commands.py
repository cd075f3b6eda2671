"""Commands as plain text, where the configuration allows it: the same scheduler, the same rules."""

from collections.abc import Callable
from typing import Any

from fastapi import Request, Response
from pydantic import BaseModel

from api.common.idempotency import require_no_key
from api.common.requests import json_response, origin, plant_of, wait_s
from api.common.results import render
from api.common.strict_json import StrictRoute
from gateway.core.targets import Answer
from gateway.door.doing import do, read_text
from protocols.table import Effect


class TextRoute(StrictRoute):
    """A route that knows only when it has read its body whether that is a stop."""

    refuses_keys = False


async def send_text(
    request: Request, target: str, text: str, wait: float | None, told: Callable[[Any, Answer], BaseModel]
) -> Response:
    """Send a command to what stands at a path; give what is `told` of its answer, or its move or stop.

    :raises NotAllowed: the configuration has no plain text; nothing was sent.
    :raises GatewayError: as of `do`, or as an Idempotency-Key is refused.
    """
    plant = plant_of(request)
    command = read_text(plant, target, text)
    if command.effect is not Effect.STOP:
        require_no_key(request)
    waited_s = wait_s(request, wait)
    result = await do(plant, origin(), target, command, waited_s)
    if isinstance(result, Answer):
        return json_response(told(command, result))
    return render(request, result, waited_s)
