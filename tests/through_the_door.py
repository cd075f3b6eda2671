"""What tests ask a plant without HTTP: by the name of the operation, as every front end does."""

from typing import Any, Final

from gateway.core.operation import Operation
from gateway.core.origin import Origin, acting
from gateway.door import operations
from gateway.door.calls import carry_out
from gateway.plant import Plant

ME: Final = Origin("test", "r-1")
OPERATIONS: Final[dict[str, Operation]] = {operation.name: operation for operation in operations()}


async def ask(
    plant: Plant, name: str, /, *, request: object = None, caller: Origin = ME, **values: Any
) -> Any:
    """Let an operation be carried out; `values` are those of path and query."""
    operation = OPERATIONS[name]
    if operation.request_name is not None and request is not None:
        values[operation.request_name] = request
    with acting(caller):
        return await carry_out(plant, operation, values)
