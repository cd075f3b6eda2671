"""The catalogue of sentences: complete in both languages, with the same facts, and all of it is used."""

import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest

from gateway.texts import LANGUAGES, Text, catalogue, entry, has, text

ROOT = Path(__file__).parents[3]
SOURCES = [it for folder in ("api", "app", "gateway") for it in (ROOT / folder).rglob("*.py")]
JAPANESE = re.compile("[\u3040-\u30ff\u4e00-\u9fff]")
FACTS = re.compile(r"\{(\w+)\}")
IN_ENGLISH_ONLY = frozenset({"detail", "remedy", "scope", "stored", "unit", "what", "why"})
"""Facts that are told in English, or are clear without words."""
IN_JAPANESE_ONLY = frozenset({"address", "comment"})
"""Facts in the place of such."""
LONGER_NAMES = {"phrases.axis-beyond-": "upper", "phrases.beyond-": "upper", "stops.": "one"}
"""Keys whose last part is known at run time only."""


def sentences(told: Mapping[str, Any], path: str = "") -> Iterator[tuple[str, str]]:
    for name, it in told.items():
        if isinstance(it, str):
            yield path + name, it
        else:
            yield from sentences(it, f"{path}{name}.")


ENGLISH, OTHER = (dict(sentences(catalogue(language))) for language in LANGUAGES)


def test_each_sentence_is_there_in_both_languages_with_the_same_facts() -> None:
    assert ENGLISH.keys() == OTHER.keys()
    for key, told in ENGLISH.items():
        here, there = set(FACTS.findall(told)), set(FACTS.findall(OTHER[key]))
        assert there - here <= IN_JAPANESE_ONLY, key
        assert here - there <= IN_ENGLISH_ONLY, key


def test_what_is_told_in_japanese_is_japanese() -> None:
    languageless = {key for key, told in OTHER.items() if not JAPANESE.search(FACTS.sub("", told))}
    assert {key for key in languageless if OTHER[key].strip() not in ("", "{remedy}")} == set()
    assert not any(JAPANESE.search(told) for told in ENGLISH.values())


def test_no_sentence_in_japanese_stands_in_the_code() -> None:
    assert [it.name for it in SOURCES if JAPANESE.search(it.read_text("utf-8"))] == []


def test_each_sentence_that_the_code_names_is_there() -> None:
    named = {
        "errors.": re.compile(r'\.(?:worded|reword)\(\s*"([^"]+)"'),
        "": re.compile(r'\btext\(\s*f?"([a-z][^"{]*)[{"]'),
    }
    found = {
        prefix + key
        for it in SOURCES
        for prefix, call in named.items()
        for key in call.findall(it.read_text("utf-8"))
    }
    assert len(found) > 40
    unknown = {key for key in found if not has(key) and not has(key.rstrip(".")) and key not in LONGER_NAMES}
    assert {it for it in unknown if not any(key.startswith(it) for key in ENGLISH)} == set()


def test_a_fact_that_is_a_text_is_filled_in_language_by_language() -> None:
    holder = text("phrases.caller-without-key")
    told = text("errors.lease.held.detail", scope="line1", holder=holder, rest_s="2.0")
    assert holder.en in told.en
    assert holder.ja in told.ja
    assert Text("{a}", "<{a}>").of(a="{b}") == ("{b}", "<{b}>")


def test_a_key_that_is_not_there_is_a_key_error() -> None:
    assert not has("alarms.nothing")
    assert not has("problems.not-found.title.more")
    with pytest.raises(KeyError):
        entry("en", "alarms.nothing")
