"""The manual's examples in the rows, taken apart and put to the test."""

from collections.abc import Iterator
from typing import Any

from protocols.rorze.row import RorzeCommand

Row = type[RorzeCommand[Any]]


def exchanges(row: Row) -> Iterator[tuple[str, str]]:
    """Parameters and reply payload of each example, without frame, body and code."""
    for command, reply in zip(row.example[::2], row.example[1::2], strict=True):
        head = command[:3] + row.code
        assert command.startswith(head)
        assert reply.startswith(">" + head)
        yield command.removeprefix(head), reply.removeprefix(">" + head)


def check_examples(row: Row) -> None:
    """Every example reads, survives JSON, and writes the same bytes again."""
    assert row.example, f"{row.code} has no example"
    for parameters, payload in exchanges(row):
        command = row.read(parameters)
        assert command.written() == parameters
        assert row.model_validate_json(command.model_dump_json()) == command
        reply = command.read_reply(payload)
        assert reply.written() == payload
        assert type(reply).model_validate_json(reply.model_dump_json()) == reply
