"""Whether the gateway lives, whether its lines work, what has happened on them, and which version it is."""

from collections.abc import Iterator
from typing import Literal

from fastapi import Request, Response
from prometheus_client import CONTENT_TYPE_LATEST, CollectorRegistry, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric
from prometheus_client.registry import Collector
from pydantic import BaseModel, Field

from api.common.requests import json_response, new_router, plant_of
from api.common.version import VERSION
from gateway.core.line_state import LineState
from gateway.core.rights import Right
from gateway.fics.family import Fics
from gateway.plant import Plant
from gateway.rorze.family import Rorze

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
    """Give the figures of all lines to Prometheus."""
    registry: CollectorRegistry = request.app.state.metrics
    return Response(generate_latest(registry), media_type=CONTENT_TYPE_LATEST)


def metrics_of(plant: Plant) -> CollectorRegistry:
    """Make the registry that `/metrics` shows."""
    registry = CollectorRegistry()
    registry.register(PlantCollector(plant))
    return registry


class PlantCollector(Collector):
    """Reads the plant's own counters when Prometheus asks, so that counting costs nothing in between.

    Labels are line and kind only: one series for each body and command would make a scrape block the loop.
    """

    def __init__(self, plant: Plant) -> None:
        self._plant = plant

    def collect(self) -> Iterator[Metric]:
        """Give all figures as they are now."""
        happened = CounterMetricFamily(
            "motion_gateway_line", "What has happened on a line.", labels=("line", "kind")
        )
        waiting = GaugeMetricFamily(
            "motion_gateway_waiting", "Requests waiting in a lane.", labels=("line", "kind")
        )
        bodies = GaugeMetricFamily(
            "motion_gateway_bodies", "Bodies of a line by condition.", labels=("line", "kind")
        )
        robots = GaugeMetricFamily(
            "motion_gateway_robots", "Robots of a line by condition.", labels=("line", "kind")
        )
        up = GaugeMetricFamily(
            "motion_gateway_line_ready", "Whether a line can take commands.", labels=("line",)
        )
        busy = CounterMetricFamily(
            "motion_gateway_line_busy_seconds", "Time a line was taken up, by whom.", labels=("line", "kind")
        )
        for port in self._plant.ports().values():
            for kind, count in port.counters.items():
                happened.add_metric((port.id, kind), count)
            for work, seconds in port.load.busy_s.items():
                busy.add_metric((port.id, work), seconds)
            for lane, count in port.waiting().items():
                waiting.add_metric((port.id, lane), count)
            up.add_metric((port.id,), port.state is LineState.READY)
        rorze = self._plant.family(Rorze)
        for line in rorze.lines.values():
            own = rorze.bodies_of(line)
            bodies.add_metric((line.id, "configured"), len(own))
            bodies.add_metric((line.id, "offline"), sum(not body.online for body in own))
            bodies.add_metric((line.id, "moving"), sum(body.moving is True for body in own))
        for robot in self._plant.family(Fics).robots():
            robots.add_metric((robot.line.id, "configured"), 1)
            robots.add_metric((robot.line.id, "offline"), not robot.online)
            robots.add_metric((robot.line.id, "moving"), robot.moving is True)
        yield from (happened, busy, waiting, bodies, robots, up)
        yield CounterMetricFamily("motion_gateway_events", "Events published.", value=self._plant.events.last)
