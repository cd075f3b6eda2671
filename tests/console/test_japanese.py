"""The console in Japanese: no page says a sentence, or a word of ours, in English."""

import re
from collections.abc import Callable, Iterator

import httpx
import pytest

from tests.console.browser import Console, demo_in
from tests.console.screenshots import LIFT, break_something, work

pytestmark = pytest.mark.prove
SETTLED_MS = 2_500
NOTICED_MS = 8_000
"""Milliseconds after which the gateway has seen the fault."""
PAGES = (
    *("#/plant", f"#/axis/{LIFT}", "#/robot/r1", "#/scara/wafer", f"#/positions/{LIFT}", "#/positions/r1"),
    *(f"#/motion/{LIFT}", f"#/program/{LIFT}", f"#/settings/{LIFT}", "#/settings/r1/units/1", "#/wire/line1"),
    *("#/wire/cell1", "#/events", "#/shift", "#/system", "#/commission/line1", "#/commission/cell1"),
    *(f"#/pendant/{LIFT}", "#/pendant/r1/units/1", "#/pendant/wafer"),
)
FAULTS = ({"kind": "ems", "target": "r1"}, {"kind": "dead", "target": "line1.01"}, {"kind": "disk"})
SHOWN = r"""() => {
  const own = "code, pre, textarea, select, .mono, script, style, [lang=en]";
  const found = [];
  const walk = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let it = walk.nextNode(); it; it = walk.nextNode()) {
    if (it.parentElement && !it.parentElement.closest(own)) found.push(it.textContent.trim());
  }
  for (const name of ["title", "aria-label", "placeholder"]) {
    for (const it of document.querySelectorAll(`[${name}]`)) {
      if (!it.closest("code, pre")) found.push(it.getAttribute(name));
    }
  }
  return found;
}"""
OF_THE_SYSTEM = re.compile("No space left on device")
"""Words of an operating system about a disk."""
ENGLISH = (
    re.compile(r"[A-Za-z]{2,}(?: [A-Za-z']{2,}){2,}"),  # three words one after the other
    re.compile(r"(?<![\w.])[a-z]+(?:_[a-z]+)+(?![\w.])"),  # the name of a member
    re.compile(
        r"(?<![\w.])(?:stepping|quadruple|normal|running|ended|queued|everybody|percent|true|false)(?![\w.])"
    ),
)


def english(texts: list[str]) -> list[str]:
    """The texts that are not in Japanese; names that people have given are of one or two words."""
    told = (OF_THE_SYSTEM.sub("", text) for text in dict.fromkeys(texts))
    return [text for text in told if any(form.search(text) for form in ENGLISH)]


@pytest.fixture(scope="module")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """A demo of its own, which is broken in the end."""
    with demo_in(tmp_path_factory.mktemp("japanese")) as url:
        work(url)
        yield url


def shown(console: Console, path: str) -> list[str]:
    console.go(path)
    console.page.wait_for_timeout(SETTLED_MS)
    return list(console.page.evaluate(SHOWN))


def test_no_page_says_anything_in_english(demo: str, open_console: Callable[..., Console]) -> None:
    console = open_console(demo, "#/plant", "ja")
    found = {path: english(shown(console, path)) for path in PAGES}
    failed = break_something(demo)
    for fault in FAULTS:
        httpx.post(f"{demo}/demo/faults", json=fault).raise_for_status()
    console.page.wait_for_timeout(NOTICED_MS)
    for path in (*PAGES, "#/axis/line1.01", f"#/why/{LIFT}/{failed}"):
        found[f"{path}, broken"] = english(shown(console, path))
    assert {path: texts for path, texts in found.items() if texts} == {}


def test_what_is_english_is_found() -> None:
    texts = [
        "lift (line1.3F)",
        "left rail",
        "The motor stands still.",
        "frames_sent: 3",
        "body.move.failed",
        "stepping",
    ]
    assert english(texts) == ["The motor stands still.", "frames_sent: 3", "stepping"]
