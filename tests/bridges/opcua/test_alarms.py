"""Alarms as conditions: raised, told again after a reconnect, over, and reset by a client."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from gateway.core.numbers import ALARMS as ALARM_NUMBERS
from tests.bridges.opcua.stand import BODIES, Bridge, Client, Plant, client_of, node
from tests.e2e.processes import simulated_line, until

FIELDS = [
    *("EventType", "SourceName", "ConditionName", "Message", "Severity", "Retain", "ActiveState.Id"),
    "+CauseNumber",
]
REFRESH_START, REFRESH_END, OFF_NORMAL = "ns=0;i=2787", "ns=0;i=2788", "ns=0;i=10637"
ALARMS, RESET = "i=2915", "i=18199"


@pytest.fixture
def cell(tmp_path: Path) -> Iterator[tuple[Plant, Bridge]]:
    """A plant of the test's own: it loses a body."""
    node()
    with simulated_line(tmp_path, BODIES) as line:
        plant = Plant(tmp_path, line)
        bridge = Bridge(tmp_path, plant)
        yield plant, bridge
        bridge.program.end()
        plant.end()


def watch(client: Client, bridge: Bridge, user: str = "mes", **more: Any) -> Client:
    client.connect(bridge, user, **more)
    client.tell("subscribe")
    assert client.tell("watch", fields=FIELDS) == "Good"
    return client


def test_raised_refreshed_over_and_reset(cell: tuple[Plant, Bridge], tmp_path: Path) -> None:
    plant, bridge = cell
    with client_of(tmp_path, bridge.trusted) as client:
        watch(client, bridge)
        plant.line.tell("PUT", "/bodies/3F/power", on=False)
        raised = client.event(lambda it: it["ConditionName"] == "body.offline")
        assert (raised["SourceName"], raised["Retain"], raised["EventType"]) == ("line1.3F", True, OFF_NORMAL)
        assert raised["CauseNumber"] == ALARM_NUMBERS["body.offline"]
        assert raised["Message"]["locale"] == "en"
        value = client.read("line1.3F.ActualPosition")[0]
        assert (value["status"], value["value"]) == ("BadNoCommunication", None)

    with client_of(tmp_path, bridge.trusted) as client:
        watch(client, bridge, locales=["ja"])
        assert client.tell("refresh") == "Good"
        seen: list[Any] = []

        def look() -> bool:
            seen.extend(client.tell("events"))
            return _refreshed(seen)

        until(look, "the refresh")
        again = next(it for it in seen if it["ConditionName"] == "body.offline")
        assert again["ConditionId"] == raised["ConditionId"]
        assert again["Message"]["locale"] == "ja"

        plant.line.tell("PUT", "/bodies/3F/power", on=True)
        # Away for a moment it was disproved, for longer it waits for its reset: over it is in any case.
        over = client.event(
            lambda it: it["ConditionId"] == raised["ConditionId"] and not it["ActiveState.Id"]
        )
        assert over["Message"]["locale"] == "ja"


def test_the_reset_of_a_client_is_the_gateways(cell: tuple[Plant, Bridge], tmp_path: Path) -> None:
    plant, bridge = cell
    with client_of(tmp_path, bridge.trusted) as client:
        watch(client, bridge)
        assert client.tell("watch", fields=FIELDS, type=ALARMS) == "Good"
        limit = {"first": 50, "last": 1_000_000}
        plant.line.tell("PATCH", "/bodies/3F/mechanics", cw_limit=limit)
        client.move("line1.3F", 500)
        both: dict[str, Any] = {}

        def has_both() -> bool:
            both.update((it["ConditionName"], it) for it in client.tell("events"))
            return both.keys() >= {"body.limit_error", "body.move.failed"}

        until(has_both, "both alarms")
        lasting, raised = both["body.limit_error"], both["body.move.failed"]
        assert client.tell("call", object=lasting["ConditionId"], method=RESET)["status"] == "BadInvalidState"
        assert (raised["SourceName"], raised["Retain"]) == ("line1.3F", True)
        id_ = raised["ConditionId"].rpartition("alarm.")[2]
        assert plant.get(f"/alarms/{id_}")["cause"] == raised["ConditionName"]

        assert client.tell("call", object=raised["ConditionId"], method=RESET)["status"] == "Good"

        gone = client.event(lambda it: it["ConditionId"] == raised["ConditionId"])
        assert gone["Retain"] is False
        assert gone["ActiveState.Id"] is False
        assert plant.get(f"/alarms/{id_}")["reset_by"].startswith("mes ")


def _refreshed(events: list[Any]) -> bool:
    types = [it["EventType"] for it in events]
    return REFRESH_START in types and REFRESH_END in types[types.index(REFRESH_START) :]


@pytest.mark.prove
def test_only_the_subscriber_may_refresh_and_only_an_operator_reset(
    cell: tuple[Plant, Bridge], tmp_path: Path
) -> None:
    plant, bridge = cell
    with client_of(tmp_path, bridge.trusted) as client, client_of(tmp_path, bridge.trusted) as other:
        watch(client, bridge, "viewer")
        number = client.tell("subscribe")
        watch(other, bridge, "setup")
        assert other.tell("refresh", subscription=number) == "BadSubscriptionIdInvalid"
        plant.line.tell("PUT", "/bodies/3F/power", on=False)
        raised = client.event(lambda it: it["ConditionName"] == "body.offline")
        refused = client.tell("call", object=raised["ConditionId"], method=RESET)
        assert refused["status"] == "BadUserAccessDenied"
