"""The examples in the rows, taken apart and put to the test."""

from collections.abc import Iterator

from protocols.fics.commands import Row, read
from protocols.fics.link import (
    Completion,
    FicsRequest,
    FicsRequestReader,
    Ver2Reader,
    Ver3Reader,
    credit,
    encode,
)
from protocols.fics.row import NAME_LENGTH
from protocols.table import Reply

CR = b"\r"


def exchanges(row: Row) -> Iterator[tuple[str, str]]:
    """Each command and its answer, as they stand on the wire without terminator."""
    return zip(row.example[::2], row.example[1::2], strict=True)


def check_examples(row: Row) -> None:
    """Every example is read, survives JSON, and is written as the same bytes again."""
    assert row.example, f"{row.__name__} has no example"
    for sent, answered in exchanges(row):
        (request,) = FicsRequestReader().feed(sent.encode() + CR)
        assert isinstance(request, FicsRequest)
        command = read(request.name, request.arguments)
        assert isinstance(command, row)
        assert encode(command) == sent.encode() + CR
        assert row.model_validate_json(command.model_dump_json()) == command
        (found,) = Ver3Reader().feed(answered.encode() + CR)
        credited = credit(command, found)
        if row.is_query():
            check_reply(credited, answered)
            assert Ver2Reader().feed(answered.encode() + CR) == [found]
        else:
            assert credited == Completion(sent[:NAME_LENGTH])


def check_reply(reply: object, answered: str) -> None:
    assert isinstance(reply, Reply)
    assert reply.written() == answered[NAME_LENGTH + 1 :]
    assert type(reply).model_validate_json(reply.model_dump_json()) == reply
