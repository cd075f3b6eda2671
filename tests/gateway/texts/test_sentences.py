"""Sentences that are said in English only have Japanese beside them, for who asks for it."""

import asyncio
import re

import pytest

from gateway.core.verdicts import TABLES, RowProblem
from gateway.door.catalogue import list_translations
from gateway.rorze.move_proof import CAUSES
from gateway.rorze.settings import unavailable_in
from gateway.rorze.settings_table import SETTINGS
from gateway.texts import catalogue, entry, japanese
from protocols.fics.commands import ROWS
from protocols.rorze.commands import COMMANDS
from protocols.rorze.row import MODE_NAMES
from transports import TransportLost, TransportUnavailable, create

HINTS = {
    it["description"]
    for row in (*COMMANDS.values(), *ROWS)
    for it in row.model_json_schema().get("properties", {}).values()
    if "description" in it
}
"""Descriptions of parameters in the tables of commands."""
REASONS = {why for mode in MODE_NAMES.values() for why in unavailable_in(mode, SETTINGS).values()}
"""Why a body has not got a setting."""
DOWN = set(entry("en", "phrases.line-down").values())
"""Why a line is down."""


ENDS = {
    re.sub(r":g\}", "}", sentence)
    for rows in TABLES.values()
    for row in rows
    if isinstance(row.error, RowProblem)
    for sentence in (row.error.detail, row.error.remedy)
    if not sentence.endswith("{acknowledge}")
} | set(CAUSES.values())
"""Sentences about the ends of moves, but for that of a power cycle."""


@pytest.mark.parametrize("sentences", [HINTS, REASONS, DOWN, ENDS])
def test_each_has_one_in_japanese(sentences: set[str]) -> None:
    assert sentences
    assert sentences - catalogue("sentences.ja").keys() == set()


def test_all_of_them_are_given_to_clients() -> None:
    assert asyncio.run(list_translations()).ja == catalogue("sentences.ja")


class Nobody:
    """A receiver that nothing comes to."""

    def data_received(self, data: bytes) -> None:
        raise AssertionError(data)

    def connection_lost(self, error: TransportLost) -> None:
        raise AssertionError(error)


@pytest.mark.parametrize(
    "address",
    ["serial:///dev/nobody?baud=9600", "tcp://127.0.0.1:1", "tcp://nobody.invalid:1", "dpram:///dev/nobody"],
)
def test_why_a_port_is_not_open_is_said_in_japanese(address: str) -> None:
    with pytest.raises(TransportUnavailable) as refusal:
        asyncio.run(create(address).open(Nobody()))
    why = str(refusal.value).removesuffix("Nothing was sent.").rstrip(" .")
    assert japanese(why).startswith(f"{address} を開けません。")
    assert not re.search("[a-z]{3,} [a-z]{3,}", japanese(why)), japanese(why)
    assert japanese(f"Line a is down: {why}. Nothing was sent.").endswith("何も送信していません。")


def test_another_sentence_stays_as_it_is() -> None:
    assert japanese("Somebody wrote this.") == "Somebody wrote this."
