"""The words of the pages: every event has some, in both languages."""

import re
from typing import Final

import pytest

from commissioning.assumptions import ASSUMPTIONS
from gateway.access.posture import weakened
from gateway.config import parse
from gateway.event_types import EVENT_TYPES
from gateway.rorze.program_runs import END_CAUSES
from gateway.texts import catalogue
from tests.console.console import CONSOLE

PARTS: Final = re.compile(r"^    parts: \{\n(.*?)^    \}", re.MULTILINE | re.DOTALL)
WORD: Final = re.compile(r'^      (\w+): "(?=[^"])', re.MULTILINE)

PLUMBING: Final = re.compile(r"^(id|.*_id|.*_at)$")
"""Members that no page shows: ids and times, as in `told.ts`."""
IN_SENTENCES: Final = {"event_cursor", "remedy_en", "raised_at", "en"}

PAGES: Final = sorted((CONSOLE / "src").rglob("*.svelte"))
EXTENSIONS: Final = {folder.name for folder in (CONSOLE / "src" / "extensions").iterdir()}
"""Each says itself what it is called, in both languages."""
FULL_STOP: Final = re.compile(r".*\}\.(?:\s|<|\{|$)", re.MULTILINE)

WEAKENINGS: Final = re.compile(r"^    weakenings: \{\n(.*?)^    \}", re.MULTILINE | re.DOTALL)
ASSUMED: Final = re.compile(r"^    assumed: \{\n(.*?)^    \}", re.MULTILINE | re.DOTALL)
ENDS: Final = re.compile(r"^    ends: \{\n(.*?)^    \}", re.MULTILINE | re.DOTALL)
WEAK: Final = """
[server]
raw_commands = true
allow_endless_moves = true
max_connections = 50_000
[access]
lease_mode = "off"
subscribers_per_key = 1000
requests_per_key = 1000
moves_per_key_and_s = 1000
"""
LINE: Final = """
[[lines]]
id = "line1"
address = "tcp://127.0.0.1:1"
bodies = [{ id = "3F", power_comment = 0, needs_origin = false }]
"""
OPEN: Final = '[access]\nmode = "open"\n'
NETWORK: Final = """
[server]
host = "0.0.0.0"
trusted_proxies = ["10.0.0.1"]
allowed_origins = ["https://mes.example"]
"""


@pytest.mark.parametrize("language", ["en", "ja"])
def test_every_assumption_has_its_words(language: str) -> None:
    found = ASSUMED.search((CONSOLE / "src" / "words" / f"{language}.ts").read_text("utf-8"))
    assert found
    assert sorted(re.findall(r'"([a-z-]+)": "(?=[^"])', found[1])) == sorted(
        assumption.slug for assumption in ASSUMPTIONS
    )


@pytest.mark.parametrize("language", ["en", "ja"])
def test_every_part_of_an_events_type_has_a_word(language: str) -> None:
    found = PARTS.search((CONSOLE / "src" / "words" / f"{language}.ts").read_text("utf-8"))
    assert found
    needed = {part for name in EVENT_TYPES for part in name.split(".")}
    assert needed <= {*WORD.findall(found[1]), *EXTENSIONS}


def test_every_member_of_an_event_that_a_page_shows_has_a_word_in_japanese() -> None:
    """Moves and alarms are told in sentences."""
    datas = [set(event.data.model_fields) for event in EVENT_TYPES.values()]
    told = {name for names in datas if not names & IN_SENTENCES for name in names if not PLUMBING.match(name)}
    assert len(told) > 80
    assert {name for name in told if len(name) > 1} - catalogue("sentences.ja").keys() == set()


def test_a_page_leaves_the_end_of_a_sentence_to_its_language() -> None:
    """After what is put in no full stop follows: Japanese has another."""
    texts = {page.name: page.read_text("utf-8").rpartition("</script>")[2] for page in PAGES}
    assert {name: found[0] for name, text in texts.items() if (found := FULL_STOP.findall(text))} == {}


def test_every_weakened_default_has_a_sentence_in_japanese() -> None:
    found = WEAKENINGS.search((CONSOLE / "src" / "words" / "ja.ts").read_text("utf-8"))
    assert found
    configs = [parse(text + LINE, "test.toml") for text in (WEAK, OPEN, NETWORK)]
    settings = {weak.setting for config in configs for weak in weakened(config)}
    assert {name.rpartition(".")[2] for name in settings} == set(WORD.findall(found[1]))


def test_every_end_of_a_program_has_a_word_in_both_languages() -> None:
    for language in ("en", "ja"):
        found = ENDS.search((CONSOLE / "src" / "words" / f"{language}.ts").read_text("utf-8"))
        assert found
        assert {*END_CAUSES.values(), "normal"} == set(WORD.findall(found[1]))
