"""Files of a release: `make release` puts them into dist/, built without network, with their checksums."""

import re
import shutil
import subprocess
import sys
import tomllib
from hashlib import sha256
from pathlib import Path

ROOT = Path(__file__).parents[1]
DIST = ROOT / "dist"
BILL = ROOT / "packaging" / "motion-gateway.cdx.json"
RECIPES = ("Dockerfile", "packaging/compose.yaml", "requirements.txt")
"""Recipes for an image, and for an installation with the tested versions."""
OF_SOURCES = {"Dockerfile": "ARG SOURCE=.\n", "compose.yaml": "build: ..\n"}
"""Lines of recipes that name the sources."""


def version() -> str:
    """The version of the gateway."""
    return str(tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]["version"])


def notes(changelog: str, of: str) -> str:
    """The section of a version in the changelog; of one that has none yet, what is not released.

    :raises ValueError: there is neither.
    """
    for name in (re.escape(of), "Unreleased"):
        if found := re.search(rf"(?ms)^## \[{name}\][^\n]*\n(.*?)(?=^## \[|\Z)", changelog):
            return found[1].strip() + "\n"
    raise ValueError(f"CHANGELOG.md has neither {of} nor Unreleased")


def recipe(name: str, text: str) -> str:
    """A recipe as it lies in a release: of the image, made of the wheel beside it."""
    wheel = f"motion_gateway-{version()}-py3-none-any.whl"
    instead = {"Dockerfile": f"ARG SOURCE={wheel}\n", "compose.yaml": "build: .\n"}
    return text.replace(OF_SOURCES[name], instead[name]) if name in instead else text


def sums(folder: Path) -> str:
    """The SHA-256 of each file, as `sha256sum --check` reads them."""
    files = sorted(file for file in folder.iterdir() if file.is_file())
    return "".join(f"{sha256(file.read_bytes()).hexdigest()}  {file.name}\n" for file in files)


def main(node: str, npm: str) -> None:
    """Build everything anew; Node and its npm pack the client for TypeScript."""
    shutil.rmtree(DIST, ignore_errors=True)
    DIST.mkdir()
    for source in (ROOT, ROOT / "clients" / "python"):
        _run(sys.executable, "-m", "hatchling", "build", "-d", str(DIST), cwd=source)
    typescript = ROOT / "clients" / "typescript"
    _run(node, "node_modules/typescript/bin/tsc", "--project", "tsconfig.build.json", cwd=typescript)
    _run(node, npm, "pack", "--pack-destination", str(DIST), cwd=typescript)
    for file in (BILL, *(ROOT / name for name in RECIPES)):
        (DIST / file.name).write_text(recipe(file.name, file.read_text("utf-8")), "utf-8")
    told = notes((ROOT / "CHANGELOG.md").read_text("utf-8"), version())
    (DIST / f"CHANGES-{version()}.md").write_text(told, "utf-8")
    (DIST / "SHA256SUMS").write_text(sums(DIST), "utf-8")


def _run(*words: str, cwd: Path) -> None:
    subprocess.run(words, cwd=cwd, check=True)  # noqa: S603  # our own build tools


if __name__ == "__main__":
    main(*sys.argv[1:])
