"""The dashboards of `examples/` show a move that somebody else makes."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest
from motion_gateway_client import Gateway
from motion_gateway_client.generated.types import RelativeMoveRequest

from tests.clients.node import node
from tests.e2e.processes import until

EXAMPLES = Path(__file__).parents[2] / "examples"
ENVIRONMENT = {**os.environ, "PYTHONPATH": str(EXAMPLES.parent / "clients" / "python")}
STEP: RelativeMoveRequest = {
    "kind": "relative",
    "direction": "cw",
    "distance": {"value": 5, "unit": "pulse"},
}


@pytest.mark.parametrize("name", ["mes_dashboard.py", "mes_dashboard.mts"])
def test_a_dashboard_shows_how_moves_have_ended(demo: str, tmp_path: Path, name: str) -> None:
    program = sys.executable if name.endswith(".py") else node()
    shown = tmp_path / "shown"

    def moved_and_seen() -> bool:
        # The first ones may be over before the dashboard follows.
        gateway.wait_for_move(gateway.start_move("01", STEP))
        return re.search(r"^line1\.01 +succeeded +\d+ +[1-9]", shown.read_text(), re.MULTILINE) is not None

    with shown.open("w") as output, Gateway(demo) as gateway:
        command = [str(program), str(EXAMPLES / name), demo]
        dashboard = subprocess.Popen(command, stdout=output, stderr=output, env=ENVIRONMENT)  # noqa: S603
        try:
            until(lambda: "axis" in shown.read_text(), "the dashboard begins")
            until(moved_and_seen, "it shows the end of a move")
            assert dashboard.poll() is None
        finally:
            dashboard.kill()
            dashboard.wait()
