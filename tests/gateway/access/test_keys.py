"""The store of keys: what is kept, what is told once, and how soon a change counts."""

import json
import logging
import os
import stat
from math import nan
from pathlib import Path

import pytest

from gateway.access.keys import DAY_S, FILE, RECHECK_S, Key, KeyFault, KeyPolicy, KeyStore
from gateway.access.roles import Role
from tests.own_faults import fail_once


class Clock:
    now = 1_000_000.0

    def __call__(self) -> float:
        return self.now


@pytest.fixture
def clock() -> Clock:
    return Clock()


@pytest.fixture
def store(tmp_path: Path, clock: Clock) -> KeyStore:
    return KeyStore(tmp_path / "data", clock)


def verified(store: KeyStore, token: str) -> Key:
    key = store.verify(token)
    assert key is not None
    return key


def test_after_a_fault_of_the_gateway_itself_the_file_is_read_again(
    store: KeyStore, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    old = store.create("mes", Role.OPERATOR)
    new = KeyStore(tmp_path / "data").create("scada", Role.OPERATOR)
    failed = [fail_once(monkeypatch, (KeyStore, "_read")) for _ in range(2)]
    assert store.verify(new) is None, "the second attempt has met a fault, too"
    assert all(failed)
    verified(store, old)
    verified(store, new)


def test_a_key_is_known_again(store: KeyStore) -> None:
    token = store.create("mes", Role.OPERATOR, ["line1", "r1"])
    key = verified(store, token)
    assert (key.name, key.role, key.scope) == ("mes", Role.OPERATOR, ("line1", "r1"))
    assert key.principal().scope == frozenset({"line1", "r1"})
    assert store.verify(token + "x") is None


def test_the_file_has_no_secret_and_nobody_else_reads_it(store: KeyStore, tmp_path: Path) -> None:
    token = store.create("mes", Role.VIEWER)
    prefix, secret = token.split("_", 2)[1:]
    assert len(secret) == 43  # 256 bits
    for file in (tmp_path / "data").iterdir():
        assert secret not in file.read_text()
        assert stat.S_IMODE(file.stat().st_mode) == 0o600
    assert prefix in (tmp_path / "data" / FILE).read_text()
    assert stat.S_IMODE((tmp_path / "data").stat().st_mode) == 0o700


@pytest.fixture
def looking(monkeypatch: pytest.MonkeyPatch) -> None:
    """Each request comes when it is time to look at the file."""
    monkeypatch.setattr("gateway.access.keys.RECHECK_S", 0.0)


@pytest.mark.usefixtures("looking")
def test_another_process_makes_and_revokes_keys_and_the_next_request_knows_it(
    store: KeyStore, tmp_path: Path
) -> None:
    assert store.is_empty
    another = KeyStore(tmp_path / "data")
    token = another.create("mes", Role.VIEWER)
    key = verified(store, token)
    assert store.has(key)
    assert not store.is_empty
    another.revoke("mes")
    assert store.verify(token) is None
    assert not store.has(key)
    assert store.is_empty


def test_a_key_that_is_new_is_known_at_once(store: KeyStore, tmp_path: Path) -> None:
    another = KeyStore(tmp_path / "data")
    first = another.create("mes", Role.VIEWER)
    verified(store, first)
    verified(store, another.create("panel", Role.VIEWER))
    assert RECHECK_S <= 0.1, "one that is revoked is refused as soon as this is over"


def test_a_key_ends_when_it_expires(store: KeyStore, clock: Clock) -> None:
    token = store.create("mes", Role.VIEWER, expires_s=10)
    key = verified(store, token)
    clock.now += 10
    assert store.verify(token) is None
    assert not store.has(key)
    assert [it.state_at(clock.now) for it in store.all()] == ["expired"]
    store.create("mes", Role.VIEWER)


def test_a_name_stands_for_one_good_key(store: KeyStore) -> None:
    old = store.create("mes", Role.VIEWER)
    with pytest.raises(KeyFault, match="revoke it first"):
        store.create("mes", Role.ADMIN)
    store.revoke("mes")
    with pytest.raises(KeyFault, match="no good key"):
        store.revoke("mes")
    assert verified(store, store.create("mes", Role.ADMIN)).role is Role.ADMIN
    assert store.verify(old) is None
    assert [key.state_at(0) for key in store.all()] == ["revoked", "good"]


@pytest.mark.parametrize("name", ["", "a b", "a\nb", "gateway", "Everybody", "x" * 65, "名"])
def test_a_name_that_records_could_not_show_is_refused(store: KeyStore, name: str) -> None:
    with pytest.raises(KeyFault, match="no name"):
        store.create(name, Role.VIEWER)


@pytest.mark.parametrize("scope", [[""], ["line 1"], ["3G"], ["line1.3"], ["../r1"], ["line1", ""]])
def test_a_scope_that_can_be_no_address_is_refused(store: KeyStore, scope: list[str]) -> None:
    with pytest.raises(KeyFault, match="no address"):
        store.create("mes", Role.VIEWER, scope)


@pytest.mark.usefixtures("looking")
def test_a_file_that_was_spoilt_leaves_the_keys_as_they_were(
    store: KeyStore, tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    token = store.create("mes", Role.VIEWER)
    verified(store, token)
    file = tmp_path / "data" / FILE
    file.write_text('{"keys": [')
    with caplog.at_level(logging.WARNING):
        assert store.verify(token) is not None
    assert "is no file of keys" in caplog.text
    with pytest.raises(KeyFault, match="no file of keys"):
        store.create("other", Role.VIEWER)
    file.unlink()
    assert store.verify(token) is None


def test_a_file_that_others_may_write_is_not_believed(store: KeyStore, tmp_path: Path) -> None:
    store.create("mes", Role.VIEWER)
    (tmp_path / "data" / FILE).chmod(0o666)
    with pytest.raises(KeyFault, match="chmod 600"):
        store.all()
    assert KeyStore(tmp_path / "data").is_empty


def test_a_directory_that_everybody_may_write_is_not_believed(store: KeyStore, tmp_path: Path) -> None:
    store.create("mes", Role.ADMIN)
    data = tmp_path / "data"
    data.chmod(0o777)
    with pytest.raises(KeyFault, match="chmod 700"):
        store.all()
    assert KeyStore(data).is_empty
    data.chmod(0o1777)
    assert len(store.all()) == 1, "nobody replaces the file of somebody else there"


@pytest.mark.parametrize("expires_s", [0.0, -1.0, nan, 1e11])
def test_a_time_that_no_key_has_is_refused(store: KeyStore, expires_s: float) -> None:
    with pytest.raises(KeyFault, match="within 10 years"):
        store.create("mes", Role.VIEWER, expires_s=expires_s)


def test_a_change_that_cannot_be_written_is_told(tmp_path: Path) -> None:
    (tmp_path / "data").write_text("a file")
    with pytest.raises(KeyFault, match="cannot be changed"):
        KeyStore(tmp_path / "data").create("mes", Role.VIEWER)


def test_uses_are_written_down_now_and_then(store: KeyStore, clock: Clock, tmp_path: Path) -> None:
    key = verified(store, store.create("mes", Role.VIEWER))
    assert store.uses() == {}
    store.keep_uses()
    assert store.uses() == {key.prefix: clock.now}
    (tmp_path / "data" / "keys-used.json").write_text("[1]")
    assert store.uses() == {}


@pytest.mark.skipif(os.geteuid() != 0, reason="only root can give a file away")
def test_what_root_makes_belongs_to_the_gateway(tmp_path: Path) -> None:
    data = tmp_path / "data"
    data.mkdir()
    os.chown(data, 4711, 4712)
    KeyStore(data).create("mes", Role.VIEWER)
    owner = (data / FILE).stat()
    assert (owner.st_uid, owner.st_gid) == (4711, 4712)


def test_the_format_of_the_file_is_stable(store: KeyStore, tmp_path: Path) -> None:
    store.create("mes", Role.SETUP, ["3F"], expires_s=60)
    (key,) = json.loads((tmp_path / "data" / FILE).read_text())["keys"]
    assert list(key) == ["name", "role", "scope", "prefix", "sha256", "created", "expires", "revoked"]
    assert (key["role"], key["scope"], key["expires"] - key["created"]) == ("setup", ["3F"], 60)


# their end, their rotation, and the second admin


def store_at(folder: Path, **policy: object) -> tuple[KeyStore, list[float]]:
    now = [1_000_000.0]
    store = KeyStore(folder, lambda: now[0])
    store.adopt(KeyPolicy.model_validate(policy))
    return store, now


def test_a_rotated_key_goes_on_beside_the_new_one_for_the_overlap(tmp_path: Path) -> None:
    store, now = store_at(tmp_path)
    old = store.create("mes", Role.OPERATOR, ["line1"], 100 * DAY_S)
    now[0] += 90 * DAY_S
    new = store.rotate("mes", DAY_S)
    both = [store.verify(old), store.verify(new)]
    assert [(it.name, it.role, it.scope) for it in both if it] == [("mes", Role.OPERATOR, ("line1",))] * 2
    now[0] += DAY_S
    assert store.verify(old) is None
    found = store.verify(new)
    assert found is not None
    assert found.expires == 1_000_000 + 190 * DAY_S
    newest = store.rotate("mes", 0)
    assert (store.verify(new), store.verify(newest) is None) == (None, False)
    store.revoke("mes")
    assert store.verify(newest) is None
    with pytest.raises(KeyFault, match="no good key mes"):
        store.rotate("mes")


def test_a_rotation_never_lets_a_key_live_longer(tmp_path: Path) -> None:
    store, now = store_at(tmp_path)
    old = store.create("mes", Role.VIEWER, None, 10.0)
    store.rotate("mes", DAY_S)
    now[0] += 10
    assert store.verify(old) is None


def test_a_key_that_never_ended_ends_with_its_rotation(tmp_path: Path) -> None:
    store, _ = store_at(tmp_path, lifetime_s=50.0)
    store.create("mes", Role.VIEWER)
    found = store.verify(store.rotate("mes"))
    assert found is not None
    assert found.expires == 1_000_050


def test_a_key_is_warned_of_before_its_end_unless_another_follows(tmp_path: Path) -> None:
    store, now = store_at(tmp_path, warning_s=30.0)
    store.create("mes", Role.VIEWER, None, 100)
    store.create("for-ever", Role.VIEWER)

    def soon() -> list[bool]:
        return [it.ends_soon for it in store.infos()]

    assert soon() == [False, False]
    now[0] += 70
    assert soon() == [True, False]
    store.rotate("mes", 5)
    assert soon() == [False, False, False]
    now[0] += 200
    assert soon() == [False, False, False]


def test_the_key_of_an_admin_takes_a_second_admin_where_four_eyes_are_wanted(tmp_path: Path) -> None:
    store, _ = store_at(tmp_path, four_eyes=True)
    first = [store.create(name, Role.ADMIN) for name in ("ann", "bob")]
    assert all(store.verify(it) for it in first)
    assert store.verify(store.create("mes", Role.SETUP))
    with pytest.raises(KeyFault, match="takes two admins"):
        store.create("eve", Role.ADMIN)
    third = store.create("eve", Role.ADMIN, by="ann")
    assert (store.verify(third), store.infos()[-1].state) == (None, "waiting")
    with pytest.raises(KeyFault, match="ann has made the key eve"):
        store.approve("eve", "ann")
    assert store.verify(third) is None
    store.approve("eve", "bob")
    assert store.verify(third) is not None
    with pytest.raises(KeyFault, match="whose new key another would have alone"):
        store.rotate("bob", by="ann")
    assert store.verify(store.rotate("bob", by="bob"))


def test_an_admin_who_ends_the_keys_of_all_others_makes_no_admin_alone(tmp_path: Path) -> None:
    store, _ = store_at(tmp_path, four_eyes=True)
    for name in ("ann", "bob"):
        store.create(name, Role.ADMIN)
    store.revoke("bob")
    third = store.create("eve", Role.ADMIN, by="ann")
    assert store.verify(third) is None
    with pytest.raises(KeyFault, match="at the gateway's machine"):
        store.approve("eve", "ann")
    assert store.verify(store.create("bob", Role.ADMIN)), "who is at the machine has all of its files"
    store.approve("eve", "bob")
    assert store.verify(third)


def test_files_of_keys_without_the_new_words_are_read_by_earlier_versions(tmp_path: Path) -> None:
    store, _ = store_at(tmp_path)
    store.create("mes", Role.VIEWER)
    (kept,) = json.loads((tmp_path / FILE).read_text())["keys"]
    assert not kept.keys() & {"made_by", "needs_approval", "approved_by"}
