"""Sessions end when they should, and tickets are taken once."""

import pytest

from gateway.access import grants
from gateway.access.grants import (
    IDLE_S,
    LONGEST_S,
    PENDANT_S,
    SESSIONS_PER_KEY,
    TICKET_S,
    TICKETS_PER_KEY,
    Grant,
    SessionInfo,
    Sessions,
    Tickets,
    handle_of,
)
from gateway.access.principal import EVERYBODY, Principal
from gateway.access.roles import Role

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


@pytest.mark.parametrize("lasts_s", [TICKET_S, PENDANT_S])
def test_a_ticket_is_taken_once_and_in_time(lasts_s: float) -> None:
    clock = Clock()
    tickets = Tickets(clock, lasts_s)
    ticket, late = tickets.issue(GRANT), tickets.issue(GRANT)
    clock.now = lasts_s
    assert tickets.redeem(ticket) is GRANT
    assert tickets.redeem(ticket) is None
    clock.now = lasts_s + 0.1
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


def grant(name: str) -> Grant:
    return Grant(Principal(name, Role.VIEWER, id=f"{name}'s"))


def test_sessions_of_the_same_key_make_room_first() -> None:
    sessions = Sessions()
    operator = sessions.begin(grant("operator"))
    viewers = [sessions.begin(grant("viewer")) for _ in range(1000)]
    assert sessions.grant_of(operator) is not None
    lasting = [it for it in viewers if sessions.grant_of(it)]
    assert lasting == viewers[-SESSIONS_PER_KEY:]


def test_the_one_that_was_not_used_for_the_longest_time_makes_room() -> None:
    sessions = Sessions()
    first, second, *_ = (sessions.begin(grant("viewer")) for _ in range(SESSIONS_PER_KEY))
    sessions.grant_of(first)
    sessions.begin(grant("viewer"))
    assert sessions.grant_of(first) is not None
    assert sessions.grant_of(second) is None


def test_of_many_keys_the_one_with_the_most_sessions_makes_room(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(grants, "MOST_SESSIONS", 5)
    sessions = Sessions()
    lone = sessions.begin(grant("operator"))
    crowd = [sessions.begin(grant("viewer")) for _ in range(4)]
    newest = sessions.begin(grant("mes"))
    assert sessions.grant_of(crowd[0]) is None
    assert all(sessions.grant_of(it) for it in (lone, newest, *crowd[1:]))


def test_a_session_that_has_made_room_stops_until_it_would_have_ended() -> None:
    clock = Clock()
    sessions = Sessions(clock)
    crowd = [sessions.begin(grant("viewer")) for _ in range(SESSIONS_PER_KEY + 2)]
    assert sessions.grant_of(crowd[0]) is None
    assert sessions.grant_to_stop(crowd[0]) is not None
    assert sessions.grant_to_stop(crowd[-1]) is not None
    sessions.end(crowd[1])  # its user signs out
    assert sessions.grant_to_stop(crowd[1]) is None
    clock.now = IDLE_S + 1
    assert sessions.grant_to_stop(crowd[0]) is None
    assert sessions.grant_to_stop("") is None


def test_a_session_is_ended_by_what_names_it_or_with_all_of_its_key() -> None:
    sessions = Sessions()
    told: list[tuple[str, str]] = []

    def tell(session: SessionInfo, why: str) -> None:
        told.append((session.name, why))

    sessions.on_end = tell
    one, two, other = (sessions.begin(grant(it), "10.0.0.9") for it in ("mes", "mes", "boss"))
    assert [it.name for it in sessions.all()] == ["boss", "mes", "mes"]
    assert one not in str(sessions.all())
    [ended] = sessions.end_by(id=handle_of(one))
    assert (ended.id, ended.address) == (handle_of(one), "10.0.0.9")
    assert sessions.end_by(id=handle_of(one)) == []
    assert [it.name for it in sessions.end_by(name="mes")] == ["mes"]
    assert [sessions.grant_of(it) is None for it in (one, two, other)] == [True, True, False]
    crowd = [sessions.begin(grant("mes")) for _ in range(SESSIONS_PER_KEY + 1)]
    sessions.end_by(name="mes")
    assert sessions.grant_to_stop(crowd[0]) is None  # one that has made room is ended, too
    assert set(told) == {("mes", "ended"), ("mes", "made_room")}


def test_tickets_of_the_same_key_make_room_first() -> None:
    tickets = Tickets()
    other = tickets.issue(grant("operator"))
    crowd = [tickets.issue(grant("viewer")) for _ in range(1000)]
    assert tickets.redeem(other) is not None
    assert sum(tickets.redeem(it) is not None for it in crowd) == TICKETS_PER_KEY
