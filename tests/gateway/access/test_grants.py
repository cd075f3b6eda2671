"""Sessions end when they should, and tickets are taken once."""

import pytest

from gateway.access import grants
from gateway.access.grants import IDLE_S, LONGEST_S, TICKET_S, Grant, Sessions, Tickets
from gateway.access.principal import EVERYBODY

GRANT = Grant(EVERYBODY)


class Clock:
    now = 0.0

    def __call__(self) -> float:
        return self.now


def test_a_session_that_is_used_lasts_as_long_as_any_and_no_longer() -> None:
    clock = Clock()
    sessions = Sessions(clock)
    session = sessions.begin(GRANT)
    assert len(session) == 43
    while clock.now < LONGEST_S:
        assert sessions.grant_of(session) is GRANT
        assert sessions.lasts(session)
        clock.now += IDLE_S
    clock.now = LONGEST_S + 1
    assert not sessions.lasts(session)
    assert sessions.grant_of(session) is None


def test_a_session_that_is_idle_or_ended_is_none() -> None:
    clock = Clock()
    sessions = Sessions(clock)
    idle, ended = sessions.begin(GRANT), sessions.begin(GRANT)
    sessions.end(ended)
    assert sessions.grant_of(ended) is None
    assert not sessions.lasts(ended)
    clock.now = IDLE_S + 1
    assert sessions.grant_of(idle) is None
    assert sessions.grant_of("") is None


def test_a_ticket_is_taken_once_and_in_time() -> None:
    clock = Clock()
    tickets = Tickets(clock)
    ticket, late = tickets.issue(GRANT), tickets.issue(GRANT)
    clock.now = TICKET_S
    assert tickets.redeem(ticket) is GRANT
    assert tickets.redeem(ticket) is None
    clock.now = TICKET_S + 0.1
    assert tickets.redeem(late) is None


def test_the_oldest_make_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grants, "MOST_SESSIONS", 2)
    monkeypatch.setattr(grants, "MOST_TICKETS", 2)
    sessions, tickets = Sessions(), Tickets()
    first, *others = (sessions.begin(GRANT) for _ in range(3))
    assert sessions.grant_of(first) is None
    assert all(sessions.grant_of(it) for it in others)
    oldest, *rest = (tickets.issue(GRANT) for _ in range(3))
    assert tickets.redeem(oldest) is None
    assert all(tickets.redeem(it) for it in rest)
