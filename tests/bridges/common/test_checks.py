"""`bridge check` tells the faults of a file before it asks the gateway."""

from pathlib import Path

import pytest
from typer.testing import CliRunner

from app import exits
from app.cli import app

GATEWAY = "[gateway]\nurl = 'http://127.0.0.1:1'\n"


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            f"{GATEWAY}nam = 'x'\n[mqtt]\nurl = 'http://x'\nposition_rate = 100\n",
            {"3: gateway.nam", "5: mqtt.url", "6: mqtt.position_rate"},
        ),
        (f"{GATEWAY}[opcua]\nlisten = 'here'\n", {"4: opcua.listen"}),
        (GATEWAY, {"1: has no table"}),
        ("[gateway\n", {"1: not valid TOML"}),
        (f"{GATEWAY}[mqqt]\n", {"3: mqqt"}),
    ],
)
def test_every_fault_is_told_with_its_line(text: str, told: set[str], tmp_path: Path) -> None:
    file = tmp_path / "bridge.toml"
    file.write_text(text)
    result = CliRunner().invoke(app, ["bridge", "check", "--config", str(file)])
    assert result.exit_code == exits.CONFIG
    said = result.output.splitlines()
    assert len(said) == len(told), said
    for it in told:
        assert any(f"{file}:{it}" in line for line in said), said
