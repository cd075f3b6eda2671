"""Node from PyPI, in the folder of the console."""

from pathlib import Path

import pytest

from tests.clients.node import node

ROOT = Path(__file__).parents[2]
CONSOLE = ROOT / "console"


def require_packages() -> str:
    """Give Node; `make test` installs it, and what the console is built with."""
    if not (CONSOLE / "node_modules").exists():
        pytest.skip("make test installs the packages of console")
    return node()
