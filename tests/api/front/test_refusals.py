"""Answers to requests that cannot be read."""

import pytest
from httptools import HttpParserCallbackError

from api.front.refusals import refusal_in


def test_a_fault_of_the_gateway_is_not_taken_for_the_clients(caplog: pytest.LogCaptureFixture) -> None:
    error = HttpParserCallbackError("a callback failed")
    error.__context__ = ZeroDivisionError("ours")
    assert refusal_in(error).status == 400
    (record,) = caplog.records
    assert record.exc_info
