"""ser2net as a terminal server that closes the former connection when a new one comes."""

import subprocess
from pathlib import Path
from shutil import which
from typing import Final

import pytest

from benchmarks.processes import free_port
from tests.e2e.processes import SimulatedLine, until

SER2NET: Final = which("ser2net", path="/usr/sbin:/usr/bin:/usr/local/sbin")
needs_ser2net = pytest.mark.skipif(SER2NET is None, reason="there is no ser2net here")


class TerminalServer:
    """ser2net in front of a simulated line."""

    def __init__(self, folder: Path, line: SimulatedLine) -> None:
        assert SER2NET is not None
        self.port = free_port()
        config = folder / "ser2net.yaml"
        config.write_text(
            f"connection: &line1\n  accepter: tcp,127.0.0.1,{self.port}\n"
            f"  connector: serialdev,{line.place},115200n81,local\n"
            "  options:\n    kickolduser: true\n    max-connections: 1\n"
        )
        self._log = (folder / "ser2net.log").open("wb")
        self._process = subprocess.Popen(  # noqa: S603
            [SER2NET, "-n", "-u", "-c", str(config)], stdout=self._log, stderr=self._log
        )
        until(self._runs, "ser2net runs")

    def _runs(self) -> bool:
        table = Path("/proc/net/tcp").read_text("ascii")
        return f":{self.port:04X} 00000000:0000 0A" in table

    @property
    def address(self) -> str:
        """Where gateways find the line."""
        return f"tcp://127.0.0.1:{self.port}"

    def end(self) -> None:
        """End it."""
        self._process.terminate()
        self._process.wait()
        self._log.close()
