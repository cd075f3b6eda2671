"""The figures for Prometheus, by its conventions; every series is there from the start."""

import platform
from collections import Counter as Tally
from collections.abc import Iterable, Iterator, Sequence
from typing import Final, get_args

from prometheus_client import (
    CONTENT_TYPE_LATEST,
    CollectorRegistry,
    GCCollector,
    ProcessCollector,
    generate_latest,
)
from prometheus_client.core import (
    CounterMetricFamily,
    GaugeMetricFamily,
    HistogramMetricFamily,
    InfoMetricFamily,
    Metric,
)
from prometheus_client.registry import Collector

from gateway.core.aside import aside
from gateway.core.line_state import LineState
from gateway.core.load import Histogram
from gateway.core.origin import Work
from gateway.door.traffic import CLIENTS, Traffic
from gateway.logbook import OUTCOMES
from gateway.plant import Plant
from gateway.version import VERSION

COUNTED: Final = (
    *("duplicates", "echoes", "fences", "frames_sent", "garbage", "late_replies", "messages", "openings"),
    *("overtaken", "repeats", "replies", "set_ups_again", "strangers_in_groups", "strays", "timeouts"),
)
"""Counters of a line, as they are called in the metrics."""
CONTENT_TYPE: Final = CONTENT_TYPE_LATEST
WORKS: Final[Sequence[str]] = get_args(Work)


async def text_of(plant: Plant, traffic: Traffic) -> bytes:
    """Write all figures, as they are now, beside the event loop."""
    return await aside(generate_latest, _Collected(list(_registry(plant, traffic).collect())))


def _registry(plant: Plant, traffic: Traffic) -> CollectorRegistry:
    registry = CollectorRegistry()
    registry.register(PlantCollector(plant))
    registry.register(GatewayCollector(plant, traffic))
    ProcessCollector(registry=registry)
    GCCollector(registry=registry)
    return registry


def _add(family: HistogramMetricFamily, labels: Sequence[str], took: Histogram) -> None:
    buckets = [("+Inf" if bound == float("inf") else f"{bound:g}", count) for bound, count in took.up_to()]
    family.add_metric(labels, buckets, took.total_s)


class PlantCollector(Collector):
    """Reads the plant's own counters when Prometheus asks, so that counting costs nothing in between.

    Labels are line and kind: one series for each body and command would make a scrape block the loop.
    """

    def __init__(self, plant: Plant) -> None:
        self._plant = plant

    def collect(self) -> Iterator[Metric]:
        """Give all figures as they are now."""
        yield from self._of_lines()
        yield from self._of_work()
        yield from self._of_motion()
        yield from self._of_what_moves()

    def _of_lines(self) -> Iterator[Metric]:
        happened = CounterMetricFamily(
            "motion_gateway_line", "What has happened on a line.", labels=("line", "kind")
        )
        waiting = GaugeMetricFamily(
            "motion_gateway_waiting", "Requests waiting in a lane.", labels=("line", "kind")
        )
        up = GaugeMetricFamily(
            "motion_gateway_line_ready", "Whether a line can take commands.", labels=("line",)
        )
        for port in self._plant.ports().values():
            for kind in sorted({*COUNTED, *port.counters}):
                happened.add_metric((port.id, kind), port.counters[kind])
            for lane, count in port.waiting().items():
                waiting.add_metric((port.id, lane), count)
            up.add_metric((port.id,), port.state is LineState.READY)
        yield from (happened, waiting, up)

    def _of_work(self) -> Iterator[Metric]:
        busy = CounterMetricFamily(
            "motion_gateway_line_busy_seconds", "Time a line was busy, by caller.", labels=("line", "kind")
        )
        use = GaugeMetricFamily(
            "motion_gateway_line_use_percent",
            "Percent of the last ten seconds that a line was busy, by caller.",
            labels=("line", "kind"),
        )
        took = HistogramMetricFamily(
            "motion_gateway_exchange_seconds",
            "From the first bit of a frame to its reply, or the end of its time.",
            labels=("line",),
        )
        for port in self._plant.ports().values():
            percent = port.load_percent()
            for work in sorted({*WORKS, *port.load.busy_s}):
                busy.add_metric((port.id, work), port.load.busy_s.get(work, 0.0))
                use.add_metric((port.id, work), percent.get(work, 0.0))
            _add(took, (port.id,), port.load.took)
        yield from (busy, use, took)

    def _of_motion(self) -> Iterator[Metric]:
        moves = CounterMetricFamily(
            "motion_gateway_moves", "Moves that have ended, by how.", labels=("line", "outcome")
        )
        stops = HistogramMetricFamily(
            "motion_gateway_stop_seconds",
            "From the request of a stop to the standstill that the controller reports.",
            labels=("line",),
        )
        figures = self._plant.history.figures
        for line in self._plant.ports():
            for outcome in OUTCOMES:
                moves.add_metric((line, outcome), figures.moves[line, outcome])
            _add(stops, (line,), figures.stops[line])
        yield from (moves, stops)

    def _of_what_moves(self) -> Iterator[Metric]:
        for protocol, family in self._plant.packages.families.items():
            what, seen = family.collections[0], list(family.seen())
            gauge = GaugeMetricFamily(
                f"motion_gateway_{what}",
                f"{what.capitalize()} of a line by condition.",
                labels=("line", "kind"),
            )
            for line in self._plant.config.lines:
                if line.protocol == protocol:
                    own = [one.now for one in seen if one.line_id == line.id]
                    gauge.add_metric((line.id, "configured"), len(own))
                    gauge.add_metric((line.id, "offline"), sum(not now.online for now in own))
                    gauge.add_metric((line.id, "moving"), sum(now.moving is True for now in own))
            yield gauge


class GatewayCollector(Collector):
    """Reads what is counted of the gateway itself."""

    def __init__(self, plant: Plant, traffic: Traffic) -> None:
        self._plant, self._traffic = plant, traffic

    def collect(self) -> Iterator[Metric]:
        """Give all figures as they are now."""
        yield from self._of_requests()
        yield from self._of_events()
        yield from self._of_the_journal()
        yield from self._of_the_membership()
        alarms = GaugeMetricFamily("motion_gateway_alarms", "Alarms that stand.", labels=("cause",))
        standing = Tally(alarm.cause for alarm in self._plant.alarms.standing())
        for cause in sorted({*self._plant.alarms.causes, *standing}):
            alarms.add_metric((cause,), standing[cause])
        yield alarms
        build = {"version": VERSION, "python": platform.python_version()}
        yield InfoMetricFamily("motion_gateway_build", "What runs here.", build)

    def _of_requests(self) -> Iterator[Metric]:
        took = HistogramMetricFamily(
            "motion_gateway_request_seconds",
            "From a request to the head of its answer; a wait that the client wanted is in it.",
            labels=("method", "code"),
        )
        for labels, histogram in self._traffic.took.items():
            _add(took, labels, histogram)
        clients = GaugeMetricFamily("motion_gateway_clients", "Who is connected.", labels=("kind",))
        for kind in CLIENTS:
            clients.add_metric((kind,), self._traffic.clients[kind])
        yield from (took, clients)

    def _of_events(self) -> Iterator[Metric]:
        hub = self._plant.events
        yield CounterMetricFamily("motion_gateway_events", "Events published.", value=hub.last)
        dropped = CounterMetricFamily(
            "motion_gateway_events_dropped",
            "How often a client was cut off for reading too slowly, or lost events.",
            labels=("kind",),
        )
        dropped.add_metric(("slow_consumer",), hub.slow_consumers)
        dropped.add_metric(("gap",), hub.gaps)
        yield dropped

    def _of_the_membership(self) -> Iterator[Metric]:
        membership = self._plant.peers.membership
        if membership is None:
            return
        yield GaugeMetricFamily(
            "motion_gateway_plant_reached",
            "Whether the servers of the plant take events.",
            value=membership.trouble is None,
        )
        yield CounterMetricFamily(
            "motion_gateway_plant_events", "Events that the plant has taken.", value=membership.forwarded
        )
        yield GaugeMetricFamily(
            "motion_gateway_plant_behind", "Events that the plant has not taken yet.", value=membership.behind
        )

    def _of_the_journal(self) -> Iterator[Metric]:
        journal = self._plant.journal
        ready = journal is not None and journal.trouble is None
        yield GaugeMetricFamily(
            "motion_gateway_journal_ready", "Whether the journal can be written.", value=ready
        )
        yield GaugeMetricFamily(
            "motion_gateway_journal_lag_seconds",
            "How long the last commit took that somebody waited for.",
            value=0.0 if journal is None else journal.lag_s,
        )
        yield GaugeMetricFamily(
            "motion_gateway_journal_waiting",
            "Entries that wait to be written.",
            value=0 if journal is None else journal.waiting(),
        )


class _Collected(CollectorRegistry):
    """Figures as they were at one moment: they are counted in the event loop, and written beside it."""

    def __init__(self, figures: Iterable[Metric]) -> None:
        super().__init__()
        self._figures = figures

    def collect(self) -> Iterable[Metric]:
        """Give them."""
        return self._figures
