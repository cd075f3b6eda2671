"""Whether the gateway lives, whether its lines work, what has happened on them, and which version it is."""

from fastapi import Request, Response

from api.common.requests import access_of, json_response, new_router, plant_of
from gateway.door.metrics import CONTENT_TYPE, text_of
from gateway.door.of_http import Liveness, Readiness, readiness_of
from gateway.door.table import Right

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
    return Response(await text_of(request.app.state.metrics), media_type=CONTENT_TYPE)
