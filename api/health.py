"""Whether the gateway lives, whether its lines work, what has happened on them, and which version it is."""

from collections.abc import Iterable

from fastapi import Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, generate_latest
from prometheus_client.core import Metric

from api.common.requests import access_of, json_response, new_router, plant_of
from gateway.core.aside import aside
from gateway.core.rights import Right
from gateway.door.of_http import Liveness, Readiness, readiness_of

router = new_router("health")


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
    readiness = readiness_of(plant_of(request), access_of(request).view_of(request.scope))
    return json_response(readiness, 200 if readiness.ready else 503)


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
