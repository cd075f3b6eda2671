"""The cost of a line that echoes, beside the same line without echo: frames written, and of a core."""

import asyncio
from pathlib import Path
from tempfile import TemporaryDirectory
from time import perf_counter

from benchmarks.figures import Figure, Target
from benchmarks.processes import MOTION_GATEWAY, announced, cpu_s, free_port, gateway, set_apart

ROUNDS = 3
SETTLING_S = 5.0
"""Seconds from the first byte to a line that is set up, and from the first echo to the state that says so."""
_BODIES = '[[lines.bodies]]\nid = "00"\n[[lines.bodies]]\nid = "3F"\n'
_ROBOT = 'protocol = "fics"\nrobot = {id = "r1", units = [{number = 1, axes = ["X", "Y", "Z"]}]}\n'
_RC_400, _FICS = ("rc400", "--bodies", "00,3F"), ("fics", "--axes", "XYZ")
LINES = {
    "RC-400": (_RC_400, _BODIES),
    "Fics in mode 2": (_FICS, f"mode = 2\n{_ROBOT}"),
    "Fics in mode 3": (_FICS, f"mode = 3\n{_ROBOT}"),
}


class Wire:
    """A TCP far end that passes all on, counts frames, and says them back where it echoes."""

    def __init__(self, machine_port: int) -> None:
        self.echoes = False
        self.frames = 0
        self._machine_port = machine_port

    async def serve(self, host: asyncio.StreamReader, to_host: asyncio.StreamWriter) -> None:
        """Carry one connection until its end."""
        machine, to_machine = await asyncio.open_connection("127.0.0.1", self._machine_port)
        back = asyncio.create_task(self._back(machine, to_host))
        try:
            while data := await host.read(4096):
                self.frames += data.count(b"\r")
                if self.echoes:
                    to_host.write(data)
                to_machine.write(data)
        finally:
            back.cancel()
            to_machine.close()
            to_host.close()

    async def _back(self, machine: asyncio.StreamReader, to_host: asyncio.StreamWriter) -> None:
        while data := await machine.read(4096):
            to_host.write(data)


async def run(seconds: float) -> list[Figure]:
    """Measure each kind of line without and with echo, each for a part of the seconds."""
    figures: list[Figure] = []
    for name, (machine, keys) in LINES.items():
        rounds = [await _round(machine, keys, seconds / ROUNDS / 2 / len(LINES)) for _ in range(ROUNDS)]
        quiet, echoing = zip(*rounds, strict=True)
        for at, unit, bound in ((0, "frames/s", 2.0), (1, "% of a core", 5.0)):
            measured, yardstick = ([each[at] for each in kind] for kind in (echoing, quiet))
            target = Target("figure", "<=", bound)
            figures.append(Figure(f"{name} that echoes", unit, measured, yardstick, target))
    return figures


async def _round(
    machine: tuple[str, ...], keys: str, seconds: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    wire = Wire(machine_port := free_port())
    place = ("--listen", f"tcp://127.0.0.1:{machine_port}")
    server = await asyncio.start_server(wire.serve, "127.0.0.1", line_port := free_port())
    with TemporaryDirectory() as folder, set_apart() as apart:
        config = Path(folder) / "gateway.toml"
        head = f'[access]\nmode = "open"\n[server]\nport = {(web := free_port())}\n[[lines]]\nid = "line"\n'
        config.write_text(f'{head}address = "tcp://127.0.0.1:{line_port}"\n{keys}')
        async with (
            server,
            announced(*MOTION_GATEWAY, "simulate", *machine, *place),
            gateway(config, web, apart) as process,
        ):

            async def measured() -> tuple[float, float]:
                await asyncio.sleep(SETTLING_S)
                frames, used, begun_at = wire.frames, cpu_s(process), perf_counter()
                await asyncio.sleep(seconds)
                took_s = perf_counter() - begun_at
                return (wire.frames - frames) / took_s, 100 * (cpu_s(process) - used) / took_s

            quiet = await measured()
            wire.echoes = True
            return quiet, await measured()
