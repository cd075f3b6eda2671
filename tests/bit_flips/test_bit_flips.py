"""Every single-bit flip of every command and its reply: nothing is credited that was not answered to it."""

from pathlib import Path

import pytest

from gateway.core.exchange import Lane
from gateway.rorze.session import ReplyFrame, RorzeSession
from protocols.fics.commands import ROWS
from protocols.fics.link import Ver2Reader
from protocols.rorze.commands import COMMANDS
from protocols.rorze.link import LinkReader
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position_table import GetNumberedPositionEntry
from tests.bit_flips import outcomes
from tests.bit_flips.outcomes import CR, FicsRow, Heard, RorzeRow, Row, Sent, rows
from tests.bit_flips.page import page
from tests.fault_simulator.switches import any_body_answers

PAGE = Path(__file__).parents[2] / "docs" / "bit-flips.md"


def test_the_page_in_the_docs_is_up_to_date() -> None:
    """To write it, each flip was judged: what is credited wrongly fails here."""
    assert PAGE.read_text("utf-8") == page(), (
        "write it anew: python -m tests.bit_flips.page > docs/bit-flips.md"
    )


def test_every_command_is_there_and_its_reply_is_credited() -> None:
    rorze, fics = rows()
    assert {row.code for row in rorze} == set(COMMANDS)
    assert {row.name for row in fics} == {row.name() for row in ROWS}
    for row in (*rorze, *fics):
        assert row.comes_back(row.reply + CR) is Heard.OTHER_VALUE
        assert row.arrives(row.command + CR).kind is Sent.SAME


def test_robots_in_ver_2_mode_are_credited_no_better() -> None:
    for row in ROWS:
        if row.is_query():
            silent = FicsRow(row, Ver2Reader)
            assert {outcome.kind for outcome in silent.heard()} <= {Heard.NOTHING, Heard.OTHER_VALUE}


def test_each_bit_is_flipped_once() -> None:
    frames = list(outcomes.flips(b"&3F6PD\r"))
    assert len(set(frames)) == len(frames) == 7 * 8
    assert all((int.from_bytes(frame) ^ int.from_bytes(b"&3F6PD\r")).bit_count() == 1 for frame in frames)


@pytest.mark.parametrize(
    ("flipped", "kind"),
    [
        (b"&3F1+MA[3],500\r", Sent.SAME),
        (b"&3F1+MA[3],502\r", Sent.OTHER_VALUE),
        (b"&3F1-MA[3],500\r", Sent.OTHER_COMMAND),
        (b"&3G1+MA[3],500\r", Sent.NOTHING),
        (b"&371+MA[3],500\r", Sent.OTHER_TARGET),
        (b"&3F1+MA[3],5\r0\r", Sent.OTHER_VALUE),
        (b"&3F1+MA[3],500M", Sent.NOTHING),
    ],
)
def test_what_the_far_end_makes_of_it(flipped: bytes, kind: Sent) -> None:
    outcome = _row("1+M").arrives(flipped)
    assert outcome.kind is kind
    assert outcome.moves == (kind not in (Sent.SAME, Sent.NOTHING))


def test_a_number_that_is_repeated_shows_that_another_was_asked_for() -> None:
    fence = RorzeRow(GetNumberedPositionEntry)
    kinds = {outcome.kind for outcome in fence.sent()}
    assert Sent.SEEN in kinds
    assert Sent.OTHER_VALUE not in kinds


def test_after_an_acknowledgement_that_is_not_credited_nothing_goes_before_a_fence() -> None:
    for flipped in outcomes.flips(b">&3F1+M\r"):
        session = RorzeSession([0x3F])
        move = session.submit(session.exchange(0x3F, MoveClockwise(distance=500), Lane.COMMAND))
        assert session.next(0.0, ready=True) is move
        session.written(move, 0.0, deadline=0.5)
        for frame in LinkReader().feed(flipped):
            if isinstance(frame, ReplyFrame):
                assert session.receive(frame, 0.1) is None
            else:
                session.noise("noise", 0.1)
        session.pass_deadlines(1.0, None)
        session.submit(session.exchange(0x3F, MoveClockwise(distance=700), Lane.COMMAND))
        following = session.next(1.0, ready=True)
        assert following
        assert following.frame.startswith(b"&3F3NDP["), flipped


@pytest.mark.parametrize(
    ("heard", "payload"),
    [
        (b">&3E6PD+000000001\r", "+000000001"),
        (b">&3F6PD+000000001\r", "+000000003"),
        (b">&3F6ED@4A\r", None),
    ],
)
def test_a_wrong_credit_is_found(heard: bytes, payload: str | None) -> None:
    with pytest.raises(AssertionError, match="was credited as"):
        outcomes.judged(b">&3F6PD", heard, payload)


def test_an_answer_of_another_body_that_is_credited_is_found(monkeypatch: pytest.MonkeyPatch) -> None:
    any_body_answers(monkeypatch)
    with pytest.raises(AssertionError, match="was credited"):
        list(_row("1+M").sent())
    with pytest.raises(AssertionError, match="was credited"):
        list(_row("6PD").heard())


def _row(code: str) -> Row:
    return RorzeRow(COMMANDS[code])
