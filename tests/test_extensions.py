"""An extension is a folder: without it a gateway is there that has its families, and knows nothing more."""

import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Final

import pytest

ROOT: Final = Path(__file__).parents[1]
FOLDERS: Final = (
    "api",
    "app",
    "docs",
    "gateway",
    "protocols",
    "recordings",
    "simulator",
    "tests",
    "transports",
)
TESTS: Final = (
    "tests/api/bodies/test_info.py",
    "tests/api/test_stops.py",
    "tests/app/test_targets.py",
    "tests/app/test_targets.py",
    "tests/gateway/door/test_stops.py",
    "tests/gateway/rorze/test_moves.py",
    "tests/gateway/test_config.py",
    "tests/gateway/test_memory.py",
    "tests/gateway/test_reload.py",
    "tests/gateway/test_snapshot.py",
    "tests/gateway/texts",
    "tests/third_family/test_third_family.py",
)
"""A test of each place that extensions add something to."""
HERE_ALONE: Final = f"import sys; sys.path[:] = [it for it in sys.path if it != {str(ROOT)!r}]; "
"""The packages are found in the working directory, and not where they are installed from."""
DEMO: Final = """
import asyncio
from pathlib import Path
from api.app import create_app
from app.demo import demo_config
from gateway.config import parse
from gateway.core.toml_files import ConfigError
from gateway.door.opening import Plant

async def main():
    plant = Plant(demo_config(Path("/line1"), Path("/cell1")))
    assert {"line1.3F", "line1.80", "r1"} <= plant.addresses() and "wafer" not in plant.addresses()
    document = create_app(plant).openapi()
    assert "/bodies" in document["paths"] and not [it for it in document["paths"] if "scara" in it]
    assert not [it for it in document["components"]["schemas"] if "Scara" in it]
    assert not [it for it in document["tags"] if "scara" in it["name"]]
    try:
        parse('[[scaras]]\\nid = "wafer"\\n', "gateway.toml")
    except ConfigError as error:
        assert "unknown key" in str(error), error
    else:
        raise AssertionError("scaras were taken")

asyncio.run(main())
"""


@pytest.fixture(scope="module")
def without(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the tree without the folder of SCARA robots."""
    copy = tmp_path_factory.mktemp("without")
    for name in FOLDERS:
        unwanted = shutil.ignore_patterns("__pycache__", "rorze_scara", "peers", "screenshots")
        shutil.copytree(ROOT / name, copy / name, ignore=unwanted)
    shutil.copy(ROOT / "pyproject.toml", copy)
    return copy


def run(where: Path, program: str) -> None:
    ended = subprocess.run(  # noqa: S603  # our own words
        [sys.executable, "-c", HERE_ALONE + program],
        cwd=where,
        env={**os.environ, "PYTHONDONTWRITEBYTECODE": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert ended.returncode == 0, ended.stdout[-4000:] + ended.stderr[-4000:]


def test_the_demo_is_served_without_it(without: Path) -> None:
    run(without, DEMO)


@pytest.mark.long
def test_the_tests_of_the_families_pass_without_it(without: Path) -> None:
    run(without, f"import pytest; sys.exit(pytest.main(['-n', '0', '-q', '-m', 'not prove', *{TESTS!r}]))")
