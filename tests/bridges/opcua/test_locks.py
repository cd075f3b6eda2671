"""Leases as DI's LockingServices: one session has an axis, and others wait."""

from pathlib import Path

from tests.bridges.opcua.stand import Bridge, Client, Plant, client_of
from tests.e2e.processes import until

LOCK = "line1.3F.Lock"


def lock(client: Client, method: str, *inputs: tuple[str, object]) -> tuple[str, int]:
    answer = client.call(LOCK, method, *inputs)
    return answer["status"], answer["outputs"][0]


def test_who_has_the_lock_moves_and_others_do_not(bridge: Bridge, plant: Plant, tmp_path: Path) -> None:
    with client_of(tmp_path, bridge.trusted) as one, client_of(tmp_path, bridge.trusted) as other:
        one.connect(bridge, "mes")
        other.connect(bridge, "setup")
        assert lock(one, "InitLock", ("String", "cell 7")) == ("Good", 0)
        assert plant.get("/leases")["leases"][0]["scope"] == "line1.3F"
        assert one.move("line1.3F", 10)["status"] == "Good"

        refused = other.move("line1.3F", 10)
        assert (refused["status"], refused["outputs"][1]) == ("BadLocked", "lease")
        assert lock(other, "InitLock", ("String", "mine")) == ("Good", -1)
        assert lock(other, "RenewLock") == ("Good", -1)
        assert lock(other, "BreakLock")[0] == "BadUserAccessDenied"

        def is_locked() -> bool:
            locked, user, left = other.read(
                f"{LOCK}.Locked", f"{LOCK}.LockingUser", f"{LOCK}.RemainingLockTime"
            )
            return bool(locked["value"] and user["value"] == "mes" and 0 < left["value"] <= 30_000)

        until(is_locked, "the lock is told")
        assert lock(one, "RenewLock") == ("Good", 0)
        assert lock(one, "ExitLock") == ("Good", 0)
        until(lambda: other.move("line1.3F", 10)["status"] == "Good", "the move of the other")
        until(lambda: other.read(f"{LOCK}.Locked")[0]["value"] is False, "it is free")


def test_an_admin_breaks_a_lock_and_who_had_it_is_refused(
    bridge: Bridge, plant: Plant, tmp_path: Path
) -> None:
    with client_of(tmp_path, bridge.trusted) as one, client_of(tmp_path, bridge.trusted) as admin:
        one.connect(bridge, "mes")
        admin.connect(bridge, "admin")
        assert lock(one, "InitLock", ("String", "")) == ("Good", 0)
        until(lambda: admin.read(f"{LOCK}.Locked")[0]["value"], "the lock is told")
        assert lock(admin, "BreakLock") == ("Good", 0)
        before = len(plant.moves())
        assert one.move("line1.3F", 10)["status"] == "BadLocked"
        assert len(plant.moves()) == before
        lock(one, "ExitLock")
        assert one.move("line1.3F", 10)["status"] == "Good"
