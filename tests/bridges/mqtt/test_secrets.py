"""Keys and passwords: in no message, no log, no metric and no list of arguments."""

import shutil
import subprocess
from pathlib import Path

import httpx
import pytest

from tests.bridges.mqtt.stand import MES, Broker, Plant, at, bridging, free_port, relative
from tests.e2e.processes import until

PASSWORD = "s3cret-of-the-broker"  # noqa: S105  # looked for everywhere


@pytest.mark.skipif(shutil.which("mosquitto_passwd") is None, reason="there is no mosquitto_passwd here")
def test_no_secret_is_told_by_any_way(plant: Plant, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    passwords, file, port = tmp_path / "passwords", tmp_path / "password", free_port()
    subprocess.run(["mosquitto_passwd", "-c", "-b", passwords, "bridge", PASSWORD], check=True)  # noqa: S603, S607
    file.write_text(f"{PASSWORD}\n")
    file.chmod(0o600)
    broker = Broker(
        tmp_path, f"listener {port} 127.0.0.1", f"password_file {passwords}", "allow_anonymous false"
    )
    request.addfinalizer(broker.kill)
    way = f"url = 'mqtt://127.0.0.1:{port}'", "user = 'bridge'", f"password_file = '{file}'"
    with at(broker, "#") as client, bridging(tmp_path, plant, broker, *way, "positions = ['3F']") as bridge:
        bridge.wait_until_online()
        client.command("/bodies/3F/moves?wait=30", relative())
        client.command("/bodies/3F/moves", relative(), who="watcher")
        client.command("/access/keys", {"name": "new", "role": "admin"}, who="admin")
        client.command("/%61ccess/keys", {"name": "new", "role": "admin"}, who="admin")
        client.command("/tickets", who="admin")
        plant.key_files[MES].rename(aside := plant.key_files[MES].with_suffix(".aside"))
        client.command("/stop")
        aside.rename(plant.key_files[MES])
        until(lambda: client.of("bodies/line1.3F/position"), "a position")
        told = {
            "messages": b"\n".join(it.topic.encode() + it.payload for it in client.heard).decode(),
            "properties": str([vars(it.properties) for it in client.heard]),
            "log": bridge.program.words(),
            "metrics": httpx.get(f"{bridge.listens_at}/metrics").text,
            "status": httpx.get(f"{bridge.listens_at}/status").text,
            "arguments": bridge.program.arguments,
            "kept": "".join(it.read_text() for it in (tmp_path / "bridge-data").iterdir()),
        }
    assert len(client.heard) > 20
    for secret in (PASSWORD, *(it.read_text().strip() for it in plant.key_files.values())):
        assert [where for where, text in told.items() if secret in text] == []
    assert "mg_" not in told["messages"], "nor a new one"
