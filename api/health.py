"""Whether the gateway lives, whether its lines work, what has happened on them, and which version it is."""

from collections.abc import Iterable
from typing import Final, Literal

from fastapi import Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, generate_latest
from prometheus_client.core import Metric
from pydantic import BaseModel, Field

from api.common.requests import access_of, json_response, new_router, plant_of
from gateway.core.aside import aside
from gateway.core.line_state import LineState
from gateway.core.rights import Right

router = new_router("health")

_USABLE: Final = (LineState.READY, LineState.OUT_OF_STEP)
_JOURNAL_TROUBLE: Final = (
    "The journal cannot be written: reads and stops are carried out, what else has an effect is refused and "
    "not sent. GET /alarms tells why, and what to do."
)


class Liveness(BaseModel):
    """The gateway's process answers."""

    status: Literal["alive"]


class Readiness(BaseModel):
    """Whether requests can be carried out, and by which part they cannot."""

    ready: bool = Field(description="Whether every line is open and set up, and somebody answers on it.")
    lines: dict[str, LineState] = Field(
        description="Those that the key of the request is for; without a good key none is named."
    )
    journal: Literal["ready", "unavailable"] = Field(
        description="While it is unavailable, reads and stops go on; what else has an effect is refused."
    )
    detail: str = Field(description="The same in words, and what to do.")


@router.get("/livez", Right.OPEN, responses={}, response_model=Liveness)
async def livez() -> Response:
    """Answer, as long as the process can."""
    return json_response(Liveness(status="alive"))


@router.get(
    "/readyz",
    Right.OPEN,
    response_model=Readiness,
    responses={503: {"model": Readiness, "description": "A line is down, silent or being set up."}},
)
async def readyz(request: Request) -> Response:
    """Say whether all lines are open and set up, somebody answers on each, and the journal can be written.

    A journal in trouble is no 503: nobody else could carry out the stops and reads that go on.
    """
    plant = plant_of(request)
    is_seen = access_of(request).view_of(request.scope)
    unusable = [port for port in plant.ports().values() if port.state not in _USABLE]
    named = [f"{port.id} is {port.state}" for port in unusable if is_seen(port.id)]
    journal_works = plant.journal is None or plant.journal.trouble is None
    sentences = [f"Not every line can be used{': ' if named else ''}{', '.join(named)}."] if unusable else []
    if not journal_works:
        sentences.append(_JOURNAL_TROUBLE)
    readiness = Readiness(
        ready=not unusable,
        lines={port.id: port.state for port in plant.ports().values() if is_seen(port.id)},
        journal="ready" if journal_works else "unavailable",
        detail=" ".join(sentences) or "All lines and the journal are ready.",
    )
    return json_response(readiness, 503 if unusable else 200)


@router.get("/metrics", Right.VIEW, include_in_schema=False)
async def metrics(request: Request) -> Response:
    """Give all figures to Prometheus."""
    registry: CollectorRegistry = request.app.state.metrics
    text = await aside(generate_latest, _Collected(list(registry.collect())))
    return Response(text, media_type=CONTENT_TYPE_LATEST)


class _Collected(CollectorRegistry):
    """Figures as they were at one moment: they are counted in the event loop, and written beside it."""

    def __init__(self, figures: Iterable[Metric]) -> None:
        super().__init__()
        self._figures = figures

    def collect(self) -> Iterable[Metric]:
        """Give them."""
        return self._figures
