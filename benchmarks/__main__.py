"""Run the benchmarks and print what they found: `python -m benchmarks --only line-use --seconds 10`."""

from collections.abc import Awaitable, Callable
from enum import StrEnum
from typing import Annotated

import typer
import uvloop

from benchmarks import (
    bulk,
    busy_line,
    console,
    crowd,
    dpram_round_trip,
    echoing_line,
    fan_out,
    first_byte,
    full_line,
    garbage,
    http_cost,
    http_read,
    key_cost,
    line_use,
    live_values,
    move_cost,
    mqtt_bridge,
    opcua,
    pages,
    plant,
    recording,
    start,
    stop_latency,
    tls_crowd,
    under_flood,
)
from benchmarks.figures import Figure, table


class Benchmark(StrEnum):
    """A measurement that can be chosen with `--only`."""

    START = "start"
    LINE_USE = "line-use"
    BULK = "bulk"
    HTTP_READ = "http-read"
    HTTP_COST = "http-cost"
    FIRST_BYTE = "first-byte"
    STOP_LATENCY = "stop-latency"
    DPRAM = "dpram"
    CROWD = "crowd"
    FAN_OUT = "fan-out"
    MOVE_COST = "move-cost"
    LIVE_VALUES = "live-values"
    CONSOLE = "console"
    KEY_COST = "key-cost"
    FULL_LINE = "full-line"
    BUSY_LINE = "busy-line"
    TLS_CROWD = "tls-crowd"
    PAGES = "pages"
    GARBAGE = "garbage"
    FLOODS = "floods"
    ECHOING_LINE = "echoing-line"
    OPCUA = "opcua"
    PLANT = "plant"
    RECORDING = "recording"
    MQTT_BRIDGE = "mqtt-bridge"


RUNS: dict[Benchmark, Callable[[float], Awaitable[list[Figure]]]] = {
    Benchmark.START: start.run,
    Benchmark.LINE_USE: line_use.run,
    Benchmark.BULK: bulk.run,
    Benchmark.HTTP_READ: http_read.run,
    Benchmark.HTTP_COST: http_cost.run,
    Benchmark.FIRST_BYTE: first_byte.run,
    Benchmark.STOP_LATENCY: stop_latency.run,
    Benchmark.DPRAM: dpram_round_trip.run,
    Benchmark.CROWD: crowd.run,
    Benchmark.FAN_OUT: fan_out.run,
    Benchmark.MOVE_COST: move_cost.run,
    Benchmark.LIVE_VALUES: live_values.run,
    Benchmark.CONSOLE: console.run,
    Benchmark.KEY_COST: key_cost.run,
    Benchmark.FULL_LINE: full_line.run,
    Benchmark.BUSY_LINE: busy_line.run,
    Benchmark.TLS_CROWD: tls_crowd.run,
    Benchmark.PAGES: pages.run,
    Benchmark.GARBAGE: garbage.run,
    Benchmark.FLOODS: under_flood.run,
    Benchmark.ECHOING_LINE: echoing_line.run,
    Benchmark.OPCUA: opcua.run,
    Benchmark.PLANT: plant.run,
    Benchmark.RECORDING: recording.run,
    Benchmark.MQTT_BRIDGE: mqtt_bridge.run,
}


def main(
    only: Annotated[list[Benchmark] | None, typer.Option(help="Leave the others out.")] = None,
    seconds: Annotated[float, typer.Option(min=0.1, help="How long each of them measures.")] = 10.0,
) -> None:
    """Measure, and print medians, lowest and highest of several rounds beside yardstick and target.

    A missed target is printed, not an error: it may be the machine, which should have nothing else to do.
    """
    figures = uvloop.run(_run(only or list(Benchmark), seconds))
    typer.echo(table(figures))


async def _run(chosen: list[Benchmark], seconds: float) -> list[Figure]:
    return [figure for benchmark in chosen for figure in await RUNS[benchmark](seconds)]


if __name__ == "__main__":
    typer.run(main)
