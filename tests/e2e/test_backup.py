"""A body is backed up into a file, changed, compared and brought back, by the programs as installed."""

from pathlib import Path

import pytest

from tests.e2e.processes import gateway_at, simulated_line
from tests.e2e.test_cli import run

pytestmark = pytest.mark.prove


def test_a_line_is_backed_up_and_a_changed_body_brought_back(tmp_path: Path) -> None:
    file = tmp_path / "line.txt"
    with (
        simulated_line(tmp_path, "3F", "--listen", "tcp://127.0.0.1:0") as line,
        gateway_at(line, bodies="3F") as gateway,
    ):
        url = gateway.wait_until_ready().url
        said = run("backup", "line1", file, url=url)
        assert (said.returncode, said.stdout) == (0, ""), said.stderr
        settings = file.read_text().partition("\n[speed-sets]")[0]
        assert "\n[body 3F]\n\n[settings]\nEAS0 " in settings
        file.write_text(settings)
        run("send", "3F", "0SS77", url=url)
        differs = run("diff", "line1", file, url=url)
        assert differs.returncode == 1
        assert differs.stdout == "line1.3F settings: origin offset, pulses: backup 0SS10, holds 0SS77\n"
        assert run("restore", "3F", file, "--dry-run", url=url).stdout == "&3F0SS10\n"
        said = run("restore", "3F", file, "--flash", url=url)
        assert (said.returncode, "flash memory and RAM hold the backup" in said.stdout) == (0, True)
        assert run("diff", "3F", file, url=url).returncode == 0
        assert [fact.facts["text"] for fact in line.executed("F")] == ["FIS"]
