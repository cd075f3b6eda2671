"""Sentences that people read, in English and Japanese, by key: `en.toml` and `ja.toml` beside this file.

A translator edits these alone, and those of extensions, in their packages. A key is a path in them, such as
`alarms.body.offline.remedy`; braces name the facts that are filled in.
"""

import re
import tomllib
from collections.abc import Mapping
from functools import cache, reduce
from pathlib import Path
from typing import Any, Final, NamedTuple

LANGUAGES: Final = ("en", "ja")


class Text(NamedTuple):
    """A sentence in both languages."""

    en: str
    ja: str

    def of(self, **facts: object) -> "Text":
        """Fill in the facts; one that is a text itself is filled in language by language."""
        return Text(*(_filled(told, language, facts) for language, told in zip(LANGUAGES, self, strict=True)))


def _filled(told: str, language: str, facts: Mapping[str, object]) -> str:
    return told.format_map({name: spoken(fact, language) for name, fact in facts.items()})


def spoken(fact: object, language: str) -> object:
    """Say a fact in one language, if it is a text."""
    return getattr(fact, language) if isinstance(fact, Text) else fact


def text(key: str, /, **facts: object) -> Text:
    """Find a sentence, and fill in the facts.

    :raises KeyError: the catalogue has no such key, or a fact is missing.
    """
    return Text(*(entry(language, key) for language in LANGUAGES)).of(**facts)


def entry(language: str, key: str) -> Any:
    """Find what the catalogue of one language has at a key: a sentence, or a table of them.

    :raises KeyError: it has nothing there.
    """
    found: Any = catalogue(language)
    for part in key.split("."):
        found = found[part]
    return found


def has(key: str) -> bool:
    """Say whether the catalogue has a text for the key."""
    try:
        entry(LANGUAGES[0], key)
    except (KeyError, TypeError):
        return False
    return True


def japanese(sentence: str) -> str:
    """Say in Japanese a sentence of `sentences.ja.toml`, with what its braces name; another as it is."""
    for form, names, told in _forms():
        if found := form.fullmatch(sentence):
            return told.format_map(dict(zip(names, map(japanese, found.groups()), strict=True)))
    return sentence


@cache
def _forms() -> list[tuple[re.Pattern[str], list[str], str]]:
    """Each sentence with anything where its braces are, the names in them, and the Japanese."""
    split = ((re.split(r"\{(\w+)\}", english), told) for english, told in catalogue("sentences.ja").items())
    return [
        (re.compile("(.*?)".join(map(re.escape, parts[::2]))), parts[1::2], told) for parts, told in split
    ]


@cache
def catalogue(language: str) -> Mapping[str, Any]:
    """Read the whole catalogue of one language."""
    files = sorted(Path(__file__).parents[1].glob(f"*/{language}.toml"))
    return reduce(_joined, (tomllib.loads(file.read_text("utf-8")) for file in files))


def _joined(one: Mapping[str, Any], other: Mapping[str, Any]) -> Mapping[str, Any]:
    """Join tables at every depth."""
    return {**one, **other, **{key: _joined(one[key], other[key]) for key in one.keys() & other.keys()}}
