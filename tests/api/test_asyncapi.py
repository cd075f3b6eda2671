"""The documents of events: the files are what the table says, and every event in them can be told apart."""

import re
from typing import Any

import pytest
import yaml

from api import asyncapi
from gateway.event_types import EVENT_TYPES

TEXT = asyncapi.PATH.read_text("utf-8")


@pytest.fixture(scope="module")
def document() -> Any:
    return yaml.load(TEXT, yaml.CSafeLoader)


def test_the_files_are_what_the_table_says() -> None:
    assert asyncapi.document() == TEXT, "write it anew: python -m api.asyncapi"
    assert asyncapi.PAGE.read_text("utf-8") == asyncapi.page(), "write it anew: python -m api.asyncapi"


def test_every_type_is_a_message_of_the_one_channel(document: dict[str, Any]) -> None:
    messages = document["components"]["messages"]
    assert {message["name"] for message in messages.values()} == set(EVENT_TYPES)
    assert set(document["channels"]["events"]["messages"]) == set(messages)
    assert all(message["summary"].endswith(".") for message in messages.values())


def test_every_reference_leads_somewhere(document: dict[str, Any]) -> None:
    named = set(re.findall(r"#/components/schemas/(\w+)", TEXT))
    assert named <= set(document["components"]["schemas"])


def test_no_two_models_share_a_name(document: dict[str, Any]) -> None:
    assert not [name for name in document["components"]["schemas"] if "__" in name]


def test_the_page_names_every_type() -> None:
    page = asyncapi.PAGE.read_text("utf-8")
    assert all(f"| `{name}` |" in page for name in EVENT_TYPES)
