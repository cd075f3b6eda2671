"""Parameters of endpoints that are made, not written."""

from collections.abc import Callable, Coroutine, Mapping
from inspect import Parameter, Signature
from typing import Any

from fastapi import Request, Response

Endpoint = Callable[..., Coroutine[Any, Any, Response]]


def names_in(path: str, known: Mapping[str, Any]) -> dict[str, Any]:
    """Give the parameters in a path their types; those that are not `known` are text."""
    names = [part[1:-1] for part in path.split("/") if part.startswith("{")]
    return {name: known.get(name, str) for name in names}


def taking(endpoint: Endpoint, parameters: Mapping[str, Any]) -> Endpoint:
    """Let FastAPI see which parameters an endpoint takes besides the request; `wait` may be left out."""
    endpoint.__signature__ = Signature(  # type: ignore[attr-defined]  # it is looked for there
        [
            Parameter(
                name,
                Parameter.KEYWORD_ONLY,
                annotation=annotation,
                default=None if name == "wait" else Parameter.empty,
            )
            for name, annotation in {"request": Request, **parameters}.items()
        ]
    )
    return endpoint
