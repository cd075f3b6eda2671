"""The examples of the page for PLC people, run as they stand there."""

import os
import re
import subprocess
from pathlib import Path

from tests.bridges.opcua.stand import PEERS, Bridge, node
from tests.e2e.processes import PATIENCE_S

PAGE = Path(__file__).parents[3] / "docs" / "opcua.md"
SAID = [
    r"-?\d+ Good \d{4}-",
    r"\[ '00', '3F' \]",
    r"Good true true \[ '\w+', 'succeeded', -?\d+ \]",
    r"BadInvalidArgument \S+ There is no kind of move 'sideways'; nothing was sent\. Kind is",
    r"Good true",
    r"Good (ended|stopping|stopped)",
    r"0 0 0",
]


def test_the_examples_run_in_one_go_once_the_client_is_trusted(bridge: Bridge, tmp_path: Path) -> None:
    blocks = re.findall(r"```js\n(.*?)```", PAGE.read_text("utf-8"), re.DOTALL)
    assert len(blocks) == 11
    script = tmp_path / "examples.cjs"
    script.write_text(
        "(async () => {\n"
        + "\n".join(blocks)
        + "\n})().catch((e) => { console.log(e.message); process.exit(1); });\n"
    )

    first = run(script, bridge, tmp_path)
    assert first.returncode == 1
    rejected = Path(bridge.program.said(r"NodeOPCUA-Client\S* is not in .*: cp (\S+\.der) ")[1])
    (bridge.trusted / rejected.name).write_bytes(rejected.read_bytes())
    second = run(script, bridge, tmp_path)

    assert second.returncode == 0, second.stdout + second.stderr
    for line, pattern in zip(second.stdout.splitlines(), SAID, strict=False):
        assert re.match(pattern, line), (pattern, second.stdout)


def run(script: Path, bridge: Bridge, home: Path) -> "subprocess.CompletedProcess[str]":
    environment = {
        "PATH": os.environ["PATH"],
        "HOME": str(home),
        "XDG_CONFIG_HOME": str(home),
        "NODE_PATH": str(PEERS / "node_modules"),
        "OPCUA_URL": bridge.url,
        "OPCUA_USER": "mes",
        "OPCUA_KEY": bridge.plant.secrets["mes"],
    }
    return subprocess.run(  # noqa: S603  # our own
        [node(), str(script)],
        env=environment,
        capture_output=True,
        text=True,
        timeout=2 * PATIENCE_S,
        check=False,
    )
