"""The ports of a replay: where a difference begins."""

import pytest

from recordings.dialects import DIALECTS
from recordings.line_script import Numbered, script_of
from recordings.ports import Line, MatchingPort
from transports.base import Receiver, TransportLost
from transports.trace import TraceEntry

POLL, CLIENT = ("gateway: poll", None), ("http 127.0.0.1", "job-17")
MOVE = b"&3F1+M500\r"


class Deaf(Receiver):
    """Hears nothing."""

    def data_received(self, data: bytes) -> None: ...

    def connection_lost(self, error: TransportLost) -> None: ...


def records(*frames: tuple[bytes, tuple[str, str | None]]) -> list[Numbered]:
    """The records of frames that were written, a millisecond apart."""
    return [
        (
            number,
            TraceEntry(
                at="2026-11-24T14:03:00Z",
                monotonic_ns=number * 10**6,
                kind="tx",
                data=frame,
                caller=caller,
                request_id=request_id,
            ),
        )
        for number, (frame, (caller, request_id)) in enumerate(frames, 1)
    ]


@pytest.mark.anyio
async def test_a_deed_differs_at_its_record_though_a_body_was_asked_sooner_then() -> None:
    """The gateway's own questions have no order: that to another body may be yet to come."""
    dialect = DIALECTS["rorze"]()
    then = records((b"&009CD\r", POLL), (b"&129CD\r", POLL), (b"&3F1+M501\r", CLIENT))
    line = Line("line1", "serial:///dev/null", 0.001, False, DIALECTS["rorze"]())
    port = MatchingPort(line, script_of(then, dialect, 0), script_of([], dialect, 0))
    await port.open(Deaf())
    port.begin()
    port.sender = lambda: POLL
    port.write(b"&009CD\r")
    port.sender = lambda: CLIENT
    port.write(MOVE)
    assert port.difference is not None
    assert port.difference.place == "lines/line1.jsonl:3"


@pytest.mark.anyio
async def test_a_question_to_nobody_that_is_there_is_told_at_the_end() -> None:
    dialect = DIALECTS["rorze"]()
    then = records((b"&009CD\r", POLL), (b"&529CD\r", POLL))
    line = Line("line1", "serial:///dev/null", 0.001, False, DIALECTS["rorze"]())
    port = MatchingPort(line, script_of(then, dialect, 0), script_of([], dialect, 0))
    await port.open(Deaf())
    port.begin()
    port.sender = lambda: POLL
    port.write(b"&009CD\r")
    assert port.difference is None
    port.end()
    assert port.difference is not None
    assert port.difference.place == "lines/line1.jsonl:2"
