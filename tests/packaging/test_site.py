"""The documents as a site: whole, offline, and without what is for developers of the gateway alone."""

import re
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from typing import Any
from urllib.parse import unquote

import pytest

ROOT = Path(__file__).parents[2]
LOADED = re.compile(r"<(?:script|img|link|iframe|source)\b[^>]*\b(?:src|href)=\"?(https?:)?//")
REFERENCE = re.compile(r"<(?:a|img|script|link)\b[^>]*?\b(?:href|src)=\"?([^\"#\s>]+)")
MOST_MIB = 6.0


def _site() -> Any:
    spec = spec_from_file_location("site_of_documents", ROOT / "packaging" / "site.py")
    assert spec is not None
    assert spec.loader is not None
    module = module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def built(tmp_path_factory: pytest.TempPathFactory) -> Path:
    pytest.importorskip("zensical")
    target = tmp_path_factory.mktemp("site") / "built"
    _site().build(target)
    return target


def test_every_link_of_the_site_leads_to_a_page_of_it_and_nothing_is_loaded_from_elsewhere(
    built: Path,
) -> None:
    pages = sorted(built.rglob("*.html"))
    assert len(pages) > 30
    for page in pages:
        text = page.read_text("utf-8")
        assert not LOADED.search(text), page
        for reference in REFERENCE.findall(text):
            if not re.match(r"https?:|mailto:|data:", reference):
                assert (page.parent / unquote(reference)).exists(), f"{page.name}: {reference}"


def test_it_has_no_pages_of_developers_and_operators_find_theirs_in_both_languages(built: Path) -> None:
    names = {str(page.relative_to(built)) for page in built.rglob("*.html")}
    assert not {name for name in names if "decision" in name or name in ("architecture.html", "testing.html")}
    assert names >= {
        f"{place}{name}.html" for place in ("", "ja/") for name in ("console", "recovery", "tour")
    }
    navigation = (built / "index.html").read_text("utf-8")
    assert "decisions" not in navigation


def test_it_stays_small(built: Path) -> None:
    size = sum(file.stat().st_size for file in built.rglob("*") if file.is_file())
    assert size < MOST_MIB * 1024 * 1024


def test_links_to_what_the_site_has_not_become_words(tmp_path: Path) -> None:
    (tmp_path / "there.md").write_text("# There")
    page = tmp_path / "page.md"
    page.write_text("[a](there.md) [b](decisions/0001.md) [c](../README.md#x) [d](https://e.f) [g](#h)")
    assert _site().without_dead_links(page, tmp_path) == "[a](there.md) b c [d](https://e.f) [g](#h)"


def test_a_line_of_japanese_goes_on_without_a_blank() -> None:
    broken = "## 見出し\n本文は、\n続く。\n\n- 項目は、\n  続く。\n- 次\nEnglish\nlines\n"
    joined = "## 見出し\n本文は、続く。\n\n- 項目は、続く。\n- 次\nEnglish\nlines\n"
    assert _site().joined(broken) == joined
