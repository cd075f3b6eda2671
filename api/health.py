"""Whether the gateway lives, whether its lines work, what has happened on them, and which version it is."""

from typing import Literal

from fastapi import Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, generate_latest
from pydantic import BaseModel, Field

from api.common.requests import json_response, new_router, plant_of
from api.common.version import VERSION
from gateway.core.line_state import LineState
from gateway.core.rights import Right

router = new_router("health")


class Liveness(BaseModel):
    """The gateway's process answers."""

    status: Literal["alive"]


class Readiness(BaseModel):
    """Whether all lines can take commands."""

    ready: bool
    lines: dict[str, LineState]


class Version(BaseModel):
    """What is running here."""

    name: str
    version: str = Field(description="Semantic version of the gateway.")


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
    """Say whether all lines are open and set up, and somebody answers on each."""
    states = {port.id: port.state for port in plant_of(request).ports().values()}
    ready = all(state in (LineState.READY, LineState.OUT_OF_STEP) for state in states.values())
    return json_response(Readiness(ready=ready, lines=states), 200 if ready else 503)


@router.get("/version", Right.OPEN, response_model=Version)
async def version() -> Response:
    """Tell the version."""
    return json_response(Version(name="motion-gateway", version=VERSION))


@router.get("/metrics", Right.VIEW, include_in_schema=False)
async def metrics(request: Request) -> Response:
    """Give all figures to Prometheus."""
    registry: CollectorRegistry = request.app.state.metrics
    return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)
