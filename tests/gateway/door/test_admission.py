"""Callers come in by what their credentials are good for, whichever front end they come through."""

import asyncio
from contextlib import suppress
from pathlib import Path

import pytest

from gateway.access.credentials import Credentials
from gateway.access.errors import LimitReached, NotAuthenticated, NotPermitted
from gateway.access.keys import KeyStore
from gateway.access.limits import Rates
from gateway.access.principal import PRINCIPAL, current
from gateway.access.roles import Role
from gateway.config import Config
from gateway.core.origin import ORIGIN, Origin
from gateway.core.rights import Right
from gateway.door.admission import (
    SIGN_INS_AT_ONCE,
    TICKETS_AT_ONCE,
    TICKETS_PER_S,
    WRONG_SIGN_INS_AT_ONCE,
    AccessCheck,
    Grant,
    Use,
)
from gateway.plant import Plant

LINES = [
    {"id": "arm", "address": "tcp://127.0.0.1:1", "bodies": [{"id": "00"}]},
    {"id": "leg", "address": "tcp://127.0.0.1:2", "bodies": [{"id": "00"}]},
]
PAT = Origin("a test", "request-1")


class Gate:
    """The way in to a plant of two lines, and its keys."""

    def __init__(self, data: Path) -> None:
        self.keys = KeyStore(data)
        plant = Plant(Config.model_validate({"lines": LINES}))
        plant.access.credentials = Credentials(self.keys)
        self.admission = AccessCheck(plant)

    def key(self, role: Role, *scope: str) -> str:
        return self.keys.create(f"{role}", role, list(scope) or None, None)

    def grant(self, key: str) -> Grant:
        return self.admission.by_key(key.encode(), bytes.decode)


@pytest.fixture
def gate(tmp_path: Path) -> Gate:
    return Gate(tmp_path)


def test_a_caller_with_the_right_acts_in_its_own_name(gate: Gate) -> None:
    before, grant = PRINCIPAL.get(), gate.grant(gate.key(Role.OPERATOR, "arm"))
    with gate.admission.let_in(grant, PAT, Right.OPERATE, Use.MOVE, ["arm.00"]):
        assert current().name == "operator"
        assert ORIGIN.get() == PAT
        assert gate.admission.sees("arm.00")
        assert not gate.admission.sees("leg.00")
    assert PRINCIPAL.get() is before


def test_a_caller_without_the_right_or_beside_its_scope_is_refused(gate: Gate) -> None:
    grant = gate.grant(gate.key(Role.OPERATOR, "arm"))
    with pytest.raises(NotPermitted):
        gate.admission.let_in(grant, PAT, Right.ADMIN, Use.REQUEST, None)
    with pytest.raises(NotPermitted):
        gate.admission.let_in(grant, PAT, Right.OPERATE, Use.MOVE, ["leg.00"])


def test_a_key_that_is_none_or_was_revoked_lets_nobody_in(gate: Gate) -> None:
    with pytest.raises(NotAuthenticated):
        gate.grant("mg_nobody")
    grant = gate.grant(gate.key(Role.VIEWER))
    assert gate.admission.holds(grant)
    gate.keys.revoke("viewer")
    assert not gate.admission.holds(grant)
    with pytest.raises(NotAuthenticated):
        gate.admission.good(grant)


def test_an_event_stream_is_told_when_its_credential_has_ended(gate: Gate) -> None:
    grant = gate.grant(gate.key(Role.VIEWER))
    passage = gate.admission.let_in(grant, PAT, Right.VIEW, Use.SUBSCRIBER, None)
    assert passage.holds is not None
    assert passage.holds()
    gate.keys.revoke("viewer")
    assert not passage.holds()


def test_a_session_and_a_ticket_end_with_the_key(gate: Gate) -> None:
    key = gate.key(Role.VIEWER)
    grant = gate.admission.shown_at_sign_in(key)
    assert grant is not None
    session = gate.admission.sign_in(grant, "10.0.0.1", "")
    assert gate.admission.sessions.grant_of(session) == grant
    ticket = gate.admission.tickets.issue(grant)
    gate.keys.revoke("viewer")
    with pytest.raises(NotAuthenticated):
        gate.admission.redeemed(ticket)


def test_who_signs_in_too_often_is_refused_and_so_is_an_address_of_wrong_keys(gate: Gate) -> None:
    key = gate.key(Role.VIEWER)
    for _ in range(SIGN_INS_AT_ONCE):
        gate.admission.shown_at_sign_in(key)
    with pytest.raises(LimitReached, match="signed in too often"):
        gate.admission.shown_at_sign_in(key)
    assert gate.admission.shown_at_sign_in("mg_nobody") is None

    async def story() -> None:
        for _ in range(WRONG_SIGN_INS_AT_ONCE):
            gate.admission.refuse_sign_in("/sign-in", "10.0.0.1")
        with pytest.raises(LimitReached, match="not good"):
            gate.admission.refuse_sign_in("/sign-in", "10.0.0.1")

    asyncio.run(story())


def test_who_asks_for_too_many_tickets_is_refused_by_key_and_by_address_and_nobody_else(gate: Gate) -> None:
    crowd, other, third = (gate.grant(gate.key(role)) for role in (Role.VIEWER, Role.OPERATOR, Role.SETUP))
    for number in range(TICKETS_AT_ONCE):
        gate.admission.ticket_of(crowd, f"10.0.{number}.1")
    with pytest.raises(LimitReached, match="Too many tickets"):
        gate.admission.ticket_of(crowd, "10.1.0.1")
    for _ in range(TICKETS_AT_ONCE):
        gate.admission.ticket_of(other, "10.2.0.1")
    with pytest.raises(LimitReached, match="Too many tickets"):
        gate.admission.ticket_of(third, "10.2.0.1")
    assert gate.admission.redeemed(gate.admission.ticket_of(third, "10.3.0.1")) == third


def test_tickets_may_be_asked_for_again_after_a_while(gate: Gate, monkeypatch: pytest.MonkeyPatch) -> None:
    now = [0.0]
    tickets = Rates(TICKETS_AT_ONCE, TICKETS_PER_S, clock=lambda: now[0])
    monkeypatch.setattr(gate.admission, "_tickets_given", tickets)
    grant = gate.grant(gate.key(Role.VIEWER))

    def given() -> int:
        count = 0
        with suppress(LimitReached):
            while count <= TICKETS_AT_ONCE:
                gate.admission.ticket_of(grant, "10.0.0.1")
                count += 1
        return count

    assert given() == pytest.approx(TICKETS_AT_ONCE, abs=1)
    now[0] += 2.5 / TICKETS_PER_S
    assert given() in (2, 3)
