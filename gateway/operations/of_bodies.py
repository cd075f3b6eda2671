"""Operations that are asked of one body and do no more than it does."""

from collections.abc import Callable, Coroutine
from typing import Any, Concatenate, ParamSpec, TypeVar

from gateway.core.rights import Right
from gateway.operations.caller import OfCaller, needs
from gateway.plant import Plant
from gateway.rorze.bodies import Body
from gateway.rorze.family import Rorze

P = ParamSpec("P")
R = TypeVar("R")


def of_body(
    right: Right, work: Callable[Concatenate[Body, P], Coroutine[Any, Any, R]]
) -> OfCaller[Concatenate[str, P], R]:
    """Let callers with a right on a body have this done by its address; errors as of `work`.

    :raises NotFound: there is no such body.
    """

    @needs(right)
    async def operation(plant: Plant, body_id: str, /, *args: P.args, **kwargs: P.kwargs) -> R:
        return await work(plant.family(Rorze).body(body_id), *args, **kwargs)

    return operation
