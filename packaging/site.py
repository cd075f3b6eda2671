"""The documents as a site: `make site` builds them with Zensical, offline, for the gateway to serve."""

import re
import shutil
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Final

ROOT: Final = Path(__file__).parents[1]
DOCS: Final = ROOT / "docs"
BUILT: Final = ROOT / "api" / "manual" / "built"
CONFIG: Final = ROOT / "packaging" / "zensical.toml"
DEVELOPERS: Final = ("decisions", "architecture.md", "testing.md")
"""Pages that are not part of the site: they are about the source."""
UNUSED: Final = ("sitemap.xml", "objects.inv", "404.html")
_BROKEN_LINE: Final = re.compile(r"^((?!#)(?:.*[^\x00-\x7f]\n *(?=[^\x00-\x7f]))+)", re.MULTILINE)
"""Paragraphs in Japanese with line ends, which would be shown as blanks."""
_LINK: Final = re.compile(r"(?<!!)\[([^\]]+)\]\(([^)\s]+)\)")


def build(target: Path) -> None:
    """Build the site into a folder, which it replaces.

    :raises subprocess.CalledProcessError: a page or a link is not right; Zensical has said which.
    """
    with TemporaryDirectory() as folder:
        place = Path(folder)
        shutil.copytree(DOCS, place / "docs", ignore=shutil.ignore_patterns(*DEVELOPERS, "*.json"))
        for page in (place / "docs").rglob("*.md"):
            text = without_dead_links(page, place / "docs")
            page.write_text(joined(text), "utf-8")
        texts = "".join(page.read_text("utf-8") for page in (place / "docs").rglob("*.md"))
        for picture in (place / "docs" / "screenshots").iterdir():
            if picture.name not in texts:
                picture.unlink()
        shutil.copy(CONFIG, place)
        zensical = [sys.executable, "-m", "zensical", "build", "--strict"]
        subprocess.run(zensical, cwd=place, check=True)  # noqa: S603  # our own build tool
        for name in UNUSED:
            (place / "site" / name).unlink(missing_ok=True)
        shutil.rmtree(target, ignore_errors=True)
        shutil.copytree(place / "site", target)


def joined(text: str) -> str:
    """A text whose lines of Japanese go on without a blank."""
    return _BROKEN_LINE.sub(lambda match: re.sub(r"\n *", "", match[1]), text)


def without_dead_links(page: Path, docs: Path) -> str:
    """The text of a page, with links to what the site does not have as their words alone."""

    def kept(link: re.Match[str]) -> str:
        file = link[2].partition("#")[0]
        there = not file or "://" in file or (page.parent / file).resolve().is_relative_to(docs.resolve())
        return link[0] if there and (not file or "://" in file or (page.parent / file).exists()) else link[1]

    return _LINK.sub(kept, page.read_text("utf-8"))


if __name__ == "__main__":
    build(BUILT)
