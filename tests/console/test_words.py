"""The words of the pages: every event has some, in both languages."""

import re
from typing import Final

import pytest

from gateway.event_types import EVENT_TYPES
from tests.console.console import CONSOLE

PARTS: Final = re.compile(r"^    parts: \{\n(.*?)^    \}", re.MULTILINE | re.DOTALL)
WORD: Final = re.compile(r'^      (\w+): "(?=[^"])', re.MULTILINE)


@pytest.mark.parametrize("language", ["en", "ja"])
def test_every_part_of_an_events_type_has_a_word(language: str) -> None:
    found = PARTS.search((CONSOLE / "src" / "words" / f"{language}.ts").read_text("utf-8"))
    assert found
    needed = {part for name in EVENT_TYPES for part in name.split(".")}
    assert needed <= set(WORD.findall(found[1]))
