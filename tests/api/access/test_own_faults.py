"""A fault of the gateway itself in the check of rights: it refuses no stop, and lets no stranger in."""

import pytest

from api.common import access
from api.common.access import Access
from gateway.access.credentials import Credentials
from gateway.access.keys import KeyStore
from gateway.access.limits import Usages
from gateway.access.roles import RIGHTS_OF
from gateway.access.territory import Territory
from gateway.core.rights import Right
from gateway.door import caller
from gateway.door.admission import AccessCheck
from gateway.plant import Plant
from tests.api.access.guarded import Keys, guarded, written
from tests.api.stand import RELATIVE, Stand
from tests.own_faults import Place, fail_always, fail_once, named

STOPS = ("/stop", "/bodies/arm.3F/stop", "/groups/arm.80/stop", "/bodies/arm.3F/commands/stop-immediately")


def test_every_role_may_stop() -> None:
    assert all(Right.STOP in rights for rights in RIGHTS_OF.values())


@pytest.mark.parametrize("path", STOPS)
@pytest.mark.parametrize(
    "place",
    [
        (Access, "_grant_of"),
        (AccessCheck, "by_key"),
        (access, "_bearer"),
        (Credentials, "verify"),
        (KeyStore, "verify"),
        (KeyStore, "_look"),
        (KeyStore, "_read"),
        (Usages, "begin"),
        (Plant, "target"),
    ],
    ids=named,
)
def test_a_fault_once_refuses_no_stop(path: str, place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    @guarded()
    async def story(stand: Stand, keys: Keys) -> None:
        key = keys.header("viewer", "arm.00")
        fail_once(monkeypatch, place)
        answer = await stand.post(path, **key)
        assert answer.status_code == 200
        assert answer.json()["confirmed"] is True

    story()


@pytest.mark.parametrize("path", STOPS)
@pytest.mark.parametrize(
    "place",
    [
        (Territory, "require"),
        (Territory, "require_right"),
        (Territory, "covers"),
        (Access, "_targets"),
        (access, "_use_of"),
        (access, "_with_leases"),
        (caller, "address_of"),
    ],
    ids=named,
)
def test_a_fault_that_lasts_where_only_others_than_stops_are_checked_refuses_no_stop(
    path: str, place: Place, monkeypatch: pytest.MonkeyPatch
) -> None:
    @guarded()
    async def story(stand: Stand, keys: Keys) -> None:
        fail_always(monkeypatch, place)
        answer = await stand.post(path, **keys.header("viewer", "arm.00"))
        assert answer.status_code == 200
        assert answer.json()["confirmed"] is True

    story()


@pytest.mark.parametrize("place", [(Territory, "require"), (Access, "_targets")], ids=named)
def test_such_a_fault_lets_nothing_move(place: Place, monkeypatch: pytest.MonkeyPatch) -> None:
    @guarded()
    async def story(stand: Stand, keys: Keys) -> None:
        before = written(stand)
        fail_always(monkeypatch, place)
        answer = await stand.post("/bodies/arm.3F/moves", RELATIVE, **keys.header("operator"))
        assert answer.status_code == 500
        assert written(stand) == before

    story()


@pytest.mark.parametrize(
    "place", [(Access, "_grant_of"), (KeyStore, "verify"), (KeyStore, "_look")], ids=named
)
@pytest.mark.parametrize("lasts", [False, True])
def test_whatever_fails_no_stranger_stops_anything(
    place: Place, lasts: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    @guarded()
    async def story(stand: Stand, keys: Keys) -> None:
        good = keys.header("viewer")["authorization"]
        before = written(stand)
        for header in ({}, {"authorization": f"{good}x"}, {"authorization": "Bearer mg_0_0"}):
            if lasts:
                fail_always(monkeypatch, place)
            else:
                fail_once(monkeypatch, place)
            answer = await stand.post("/stop", **header)
            assert answer.status_code in (401, 500)
        assert written(stand) == before

    story()
