"""The gateway runs with the oldest and with the newest dependencies that pyproject.toml allows.

Both are fetched from PyPI, with uv: pip does not know how to take the oldest.
"""

import os
import subprocess
import sys
from pathlib import Path

import httpx
import pytest

from tests.e2e.processes import PATIENCE_S, START_PATIENCE_S, until
from tests.e2e.test_installation import PROJECT, ROOT, Installed, build, install, served

pytestmark = pytest.mark.prove

NEEDED = PROJECT["project"]["dependencies"] + [
    requirement for extra in PROJECT["project"]["optional-dependencies"].values() for requirement in extra
]
TRIES = 3


def fetch(*words: str | Path) -> None:
    """Run a program that asks PyPI, which may be there at the second or the third try."""
    for _ in range(TRIES):
        done = subprocess.run(  # noqa: S603
            [str(word) for word in words],
            capture_output=True,
            text=True,
            check=False,
            timeout=START_PATIENCE_S,
        )
        if done.returncode == 0:
            return
    raise AssertionError(
        "The bounds of the dependencies are not tested: PyPI cannot be reached, or it has no versions within "
        f"them that run on this Python without a compiler.\n{done.stdout}{done.stderr}"
    )


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    into = tmp_path_factory.mktemp("dist")
    build(ROOT, into, "-t", "wheel")
    (wheel,) = into.glob("*.whl")
    return wheel


@pytest.fixture(scope="module")
def uv(tmp_path_factory: pytest.TempPathFactory) -> Path:
    into = tmp_path_factory.mktemp("uv")
    fetch(sys.executable, "-m", "pip", "install", "--quiet", "--target", into, "uv")
    return into / "bin" / "uv"


@pytest.mark.parametrize("versions", ["lowest-direct", "highest"])
def test_a_motor_moves_with_the_dependencies_that_are_allowed(
    versions: str, uv: Path, wheel: Path, tmp_path: Path
) -> None:
    environment = Installed(tmp_path / "venv")
    cache = ("--cache-dir", uv.parent / "cache", "--no-config")
    fetch(uv, "venv", *cache, "--python", sys.executable, environment.folder)
    bounds = ("--resolution", versions, "--only-binary", ":all:")
    fetch(uv, "pip", "install", *cache, "--python", environment.python, *bounds, *NEEDED)
    install(environment, wheel)
    process = environment.start("demo", "--port", "0", **os.environ)
    try:
        url = served(process)
        until(lambda: httpx.get(f"{url}/readyz").is_success, "the demo is ready")
        said = environment.run("move", "3F", "relative", "5", "--wait", "20", "--url", url)
        assert '"status": "succeeded"' in said
        assert httpx.get(f"{url}/docs").is_success
    finally:
        process.terminate()
        process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
