"""A bridge as a service: its unit, and what systemd hears of its begin, its life and its end."""

import shutil
import signal
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from tests.bridges.mqtt.stand import Broker, Plant, write_config
from tests.e2e.processes import PATIENCE_S, until

UNIT = Path(__file__).parents[3] / "packaging" / "motion-gateway-bridge@.service"
COMMAND = "/opt/motion-gateway/bin/motion-gateway "
BEAT_S = 2.0
EXPOSED = 20
"""Tenths of what systemd-analyze security gives at most."""


@pytest.fixture
def unit(tmp_path: Path) -> Path:
    """The unit of the bridge to MQTT, with its command where it is here."""
    text = UNIT.read_text("utf-8")
    assert text.count(COMMAND) == 1
    file = tmp_path / "motion-gateway-bridge@mqtt.service"
    for it in (file, tmp_path / UNIT.name):
        it.write_text(text.replace(COMMAND, f"{sys.executable} "), "utf-8")
    return file


@pytest.mark.skipif(shutil.which("systemd-analyze") is None, reason="there is no systemd here")
@pytest.mark.parametrize(
    "words", [("verify",), ("security", "--offline=true", f"--threshold={EXPOSED}", "--no-pager")]
)
def test_process_understands_the_unit_and_leaves_it_little(unit: Path, words: tuple[str, ...]) -> None:
    command = ["systemd-analyze", *words, unit.name]
    done = subprocess.run(command, cwd=unit.parent, capture_output=True, text=True, check=False)  # noqa: S603
    assert done.returncode == 0, done.stdout + done.stderr
    assert words[0] != "verify" or done.stderr == ""


def test_process_hears_of_begin_life_and_end(plant: Plant, broker: Broker, tmp_path: Path) -> None:
    more = ("root = 'service'", "client_id = 'service'")
    config = write_config(tmp_path, plant, broker, *more, commands=False)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as manager:
        manager.bind(str(tmp_path / "notify"))
        manager.settimeout(PATIENCE_S)
        bridge = subprocess.Popen(  # noqa: S603  # our own
            [
                sys.executable,
                "-m",
                "motion_gateway",
                "bridge",
                "mqtt",
                "--config",
                config,
                "--data",
                tmp_path / "data",
            ],
            env={"NOTIFY_SOCKET": str(tmp_path / "notify"), "WATCHDOG_USEC": str(int(2e6 * BEAT_S))},
            stderr=subprocess.DEVNULL,
        )
        try:
            assert manager.recv(100).startswith(b"READY=1")
            until(lambda: manager.recv(100) == b"WATCHDOG=1", "it lives")
            bridge.send_signal(signal.SIGTERM)
            until(lambda: manager.recv(100) == b"STOPPING=1", "it says that it ends")
            assert bridge.wait(PATIENCE_S) == 0
        finally:
            bridge.kill()
