"""The bill of materials that goes with the wheel: all that is installed, and all that is in the pages."""

import json
import re

from tests.sbom import IN_PAGES, ROOT, WRITTEN, bill

_IMPORTED = re.compile(r"""(?:from|import) ["']((?:@[\w-]+/)?[\w-]+)(?:/[\w/-]+)?["']""")


def test_it_is_written_anew_with_the_pins() -> None:
    assert json.loads(WRITTEN.read_text("utf-8")) == bill(), "make documents"


def test_it_names_each_pinned_package_and_its_version() -> None:
    told = {component["purl"] for component in bill()["components"]}
    pins = re.findall(r"(?m)^(\S+)==(\S+)", (ROOT / "requirements.txt").read_text("utf-8"))
    assert len(pins) > 20
    assert {f"pkg:pypi/{name}@{version}" for name, version in pins} <= told


def test_it_names_what_the_pages_import() -> None:
    folders = (ROOT / "console" / "src", ROOT / "clients" / "typescript" / "src")
    sources = [file for folder in folders for file in folder.rglob("*") if file.suffix in (".ts", ".svelte")]
    imported = {name for file in sources for name in _IMPORTED.findall(file.read_text("utf-8"))}
    assert imported == set(IN_PAGES)
