"""For whom an operation is carried out."""

from collections.abc import Callable, Coroutine
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar

from gateway.core.origin import Origin, acting
from gateway.plant import Plant

P = ParamSpec("P")
R = TypeVar("R")


def for_caller(
    operation: Callable[Concatenate[Plant, P], Coroutine[Any, Any, R]],
) -> Callable[Concatenate[Plant, Origin, P], Coroutine[Any, Any, R]]:
    """Let an operation take its caller behind the plant, and act for it."""

    @wraps(operation)
    async def carried_out(plant: Plant, caller: Origin, /, *args: P.args, **kwargs: P.kwargs) -> R:
        with acting(caller):
            return await operation(plant, *args, **kwargs)

    return carried_out
