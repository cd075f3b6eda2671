from typing import Any

import pytest

from gateway.core.errors import (
    Cancelled,
    Expired,
    GatewayEnding,
    GatewayError,
    HeldUp,
    NotAllowed,
    StoppedFirst,
)
from gateway.core.exchange import Lane
from gateway.core.gate import Gate
from gateway.rorze.session import RorzeExchange
from protocols.rorze.link_master import SetReplyFormat
from protocols.rorze.moves import MoveClockwise
from protocols.rorze.position import GetPosition
from protocols.rorze.row import LINK_MASTER, RorzeCommand
from protocols.rorze.stops import StopImmediately
from protocols.table import Effect
from tests.gateway.rorze.exchanges import exchange

MOVE = MoveClockwise(distance=500)


def test_a_fresh_command_passes() -> None:
    assert Gate[RorzeExchange](LINK_MASTER).refuses(exchange(MOVE), now=0.0) is None


def test_a_command_admitted_before_a_stop_never_passes_again() -> None:
    gate = Gate[RorzeExchange](LINK_MASTER)
    admitted = exchange(MOVE, epoch=gate.epoch(2))
    gate.stop(2)
    refusal = gate.refuses(admitted, now=0.0)
    assert isinstance(refusal, Cancelled)
    assert refusal.moved == "no"
    assert "nothing was sent" in refusal.detail
    gate.stop(2)
    assert isinstance(gate.refuses(admitted, now=0.0), Cancelled)


def test_a_stop_concerns_its_own_body_and_what_was_admitted_before_it() -> None:
    gate = Gate[RorzeExchange](LINK_MASTER)
    other = exchange(MOVE, body=3, epoch=gate.epoch(3))
    gate.stop(2)
    later = exchange(MOVE, epoch=gate.epoch(2))
    assert gate.refuses(other, now=0.0) is None
    assert gate.refuses(later, now=0.0) is None


@pytest.mark.parametrize("command", [GetPosition(), StopImmediately()], ids=lambda it: it.code)
def test_reads_and_stops_pass_after_a_stop(command: GetPosition | StopImmediately) -> None:
    gate = Gate[RorzeExchange](LINK_MASTER)
    admitted = exchange(command, epoch=gate.epoch(2))
    gate.stop(2)
    assert gate.refuses(admitted, now=0.0) is None


def test_whatever_goes_in_the_command_lane_obeys_the_stop() -> None:
    gate = Gate[RorzeExchange](LINK_MASTER)
    admitted = exchange(GetPosition(), lane=Lane.COMMAND, epoch=gate.epoch(2))
    gate.stop(2)
    assert isinstance(gate.refuses(admitted, now=0.0), Cancelled)


def test_what_proves_a_stop_passes_however_often_the_stop_is_asked_for_again() -> None:
    gate = Gate[RorzeExchange](LINK_MASTER)
    admitted = exchange(GetPosition(), lane=Lane.VERIFY, epoch=gate.epoch(2))
    gate.stop(2)
    assert gate.refuses(admitted, now=0.0) is None


@pytest.mark.parametrize(("now", "passes"), [(4.999, True), (5.0, False), (1e9, False)])
def test_no_command_starts_later_than_its_sender_allowed(now: float, passes: bool) -> None:
    refusal = Gate[RorzeExchange](LINK_MASTER).refuses(exchange(MOVE, expires_at=5.0), now)
    assert (refusal is None) is passes
    assert passes or isinstance(refusal, Expired)


def test_added_guards_are_asked_after_the_built_in_ones_and_the_first_refusal_counts() -> None:
    gate = Gate[RorzeExchange](LINK_MASTER)
    asked: list[str] = []

    def lease(_exchange: RorzeExchange, _now: float) -> GatewayError | None:
        asked.append("lease")
        return NotAllowed("No lease; nothing was sent.")

    def journal(_exchange: RorzeExchange, _now: float) -> GatewayError | None:
        asked.append("journal")
        return None

    gate.add(lease)
    gate.add(journal)
    refusal = gate.refuses(exchange(MOVE), now=0.0)
    assert isinstance(refusal, NotAllowed)
    assert asked == ["lease"]
    gate.stop(2)
    assert isinstance(gate.refuses(exchange(MOVE), now=0.0), Cancelled)
    assert asked == ["lease"]


@pytest.mark.parametrize("command", [GetPosition(), StopImmediately(), MOVE], ids=lambda it: it.code)
def test_added_guards_are_asked_about_all_but_questions(command: RorzeCommand[Any]) -> None:
    gate = Gate[RorzeExchange](LINK_MASTER)
    gate.add(lambda _exchange, _now: NotAllowed("No lease; nothing was sent."))
    is_question = command.effect is Effect.READ
    assert (gate.refuses(exchange(command), now=0.0) is None) is is_question


# what is revoked


def test_what_was_admitted_before_everything_was_revoked_never_passes_and_says_why() -> None:
    gate = Gate[RorzeExchange](LINK_MASTER)
    admitted = [exchange(MOVE, body=body, epoch=gate.epoch(body)) for body in (2, 0x80)]
    gate.revoke(HeldUp)
    assert all(isinstance(gate.refuses(it, now=0.0), HeldUp) for it in admitted)
    assert gate.refuses(exchange(MOVE, epoch=gate.epoch(2)), now=0.0) is None


def test_the_reason_is_what_came_last_to_the_body() -> None:
    gate = Gate[RorzeExchange](LINK_MASTER)
    one, other = (exchange(MOVE, body=body, epoch=gate.epoch(body)) for body in (2, 3))
    gate.revoke(HeldUp)
    gate.stop(2)
    assert isinstance(gate.refuses(one, now=0.0), StoppedFirst)
    assert isinstance(gate.refuses(other, now=0.0), HeldUp)
    gate.revoke(GatewayEnding)
    assert isinstance(gate.refuses(one, now=0.0), GatewayEnding)


def test_the_set_up_of_the_link_master_goes_on() -> None:
    gate = Gate[RorzeExchange](LINK_MASTER)
    admitted = exchange(SetReplyFormat(end_of_move=1), body=LINK_MASTER, epoch=gate.epoch(LINK_MASTER))
    gate.revoke(HeldUp)
    assert gate.refuses(admitted, now=0.0) is None


@pytest.mark.parametrize("command", [GetPosition(), StopImmediately()], ids=lambda it: it.code)
def test_reads_and_stops_pass_whatever_is_revoked(command: GetPosition | StopImmediately) -> None:
    gate = Gate[RorzeExchange](LINK_MASTER)
    admitted = exchange(command, epoch=gate.epoch(2))
    gate.revoke(GatewayEnding)
    assert gate.refuses(admitted, now=0.0) is None
