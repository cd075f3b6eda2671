"""Parameters of endpoints that are made, not written."""

from collections.abc import Callable, Coroutine, Mapping
from inspect import Parameter, Signature
from typing import Any

from fastapi import Request, Response

from gateway.door.table import names_in

Endpoint = Callable[..., Coroutine[Any, Any, Response]]


def names_of(path: str, known: Mapping[str, Any]) -> dict[str, Any]:
    """Give the parameters in a path their types; those that are not `known` are text."""
    return {name: known.get(name, str) for name in names_in(path)}


def taking(endpoint: Endpoint, parameters: Mapping[str, Any]) -> Endpoint:
    """Let FastAPI see which parameters an endpoint takes besides the request; `wait` may be left out."""
    endpoint.__signature__ = Signature(  # type: ignore[attr-defined]  # it is looked for there
        [
            it.replace(name=name, kind=Parameter.KEYWORD_ONLY) if isinstance(it, Parameter) else _of(name, it)
            for name, it in {"request": Request, **parameters}.items()
        ]
    )
    return endpoint


def _of(name: str, annotation: Any) -> Parameter:
    default = None if name == "wait" else Parameter.empty
    return Parameter(name, Parameter.KEYWORD_ONLY, annotation=annotation, default=default)
