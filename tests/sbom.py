"""The parts a gateway is made of, as CycloneDX 1.6: `python -m tests.sbom`.

They are the pinned Python packages that it is installed with, and the npm packages in the console's pages.
"""

import json
import re
import tomllib
from base64 import b64decode
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any, Final
from urllib.parse import quote

ROOT: Final = Path(__file__).parents[1]
REQUIREMENTS: Final = ROOT / "requirements.txt"
LOCK: Final = ROOT / "console" / "package-lock.json"
WRITTEN: Final = ROOT / "packaging" / "motion-gateway.cdx.json"
IN_PAGES: Final = (
    "@codemirror/commands",
    "@codemirror/state",
    "@codemirror/view",
    "openapi-fetch",
    "svelte",
    "uplot",
    "uqr",
)
"""Packages that the console's sources import; the rest of its packages builds and checks them."""
_PINNED: Final = re.compile(r"(?m)^([A-Za-z0-9._-]+)==([^\s;\\]+)")
_FOLDER: Final = "node_modules/"


def bill() -> dict[str, Any]:
    """Make the bill of materials; the same for the same pins."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
    return {
        "bomFormat": "CycloneDX",
        "specVersion": "1.6",
        "version": 1,
        "metadata": {"component": _component("application", "pypi", project["name"], project["version"])},
        "components": [*_of_python(), *_of_pages()],
    }


def _of_python() -> Iterator[dict[str, Any]]:
    for name, version in _PINNED.findall(REQUIREMENTS.read_text("utf-8")):
        yield _component("library", "pypi", name, version)


def _of_pages() -> Iterator[dict[str, Any]]:
    packages = json.loads(LOCK.read_text("utf-8"))["packages"]
    for name in sorted(_with_all_they_need(IN_PAGES, packages)):
        package = packages[_FOLDER + name]
        kind, _, digest = package["integrity"].partition("-")
        hashes = [{"alg": kind.upper().replace("SHA", "SHA-"), "content": b64decode(digest).hex()}]
        yield _component("library", "npm", name, package["version"]) | {"hashes": hashes}


def _with_all_they_need(names: Iterable[str], packages: dict[str, Any]) -> set[str]:
    found: set[str] = set()
    waiting = list(names)
    while waiting:
        name = waiting.pop()
        if name not in found:
            found.add(name)
            waiting += packages[_FOLDER + name].get("dependencies", {})
    return found


def _component(kind: str, registry: str, name: str, version: str) -> dict[str, Any]:
    url = f"pkg:{registry}/{quote(name)}@{quote(version)}"
    return {"type": kind, "bom-ref": url, "name": name, "version": version, "purl": url}


if __name__ == "__main__":
    WRITTEN.write_text(json.dumps(bill(), indent=1) + "\n", "utf-8")
