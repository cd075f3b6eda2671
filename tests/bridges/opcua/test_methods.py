"""Methods: stops, homing, jogs, and refusals in the caller's language."""

from pathlib import Path

import pytest

from tests.bridges.opcua.stand import Bridge, Client, Plant, client_of
from tests.e2e.processes import until

LONG = 500_000


def test_a_stop_goes_by_while_a_move_runs_and_is_confirmed(
    bridge: Bridge, client: Client, plant: Plant
) -> None:
    client.connect(bridge)
    for object_, method in (("line1.3F", "Stop"), ("line1", "Stop")):
        assert client.move("line1.3F", LONG)["status"] == "Good"
        until(lambda: plant.get("/bodies/line1.3F")["moving"], "it moves")
        answer = client.call(object_, method)
        assert (answer["status"], answer["outputs"][0]) == ("Good", True)
        until(lambda: plant.get("/bodies/line1.3F")["moving"] is False, "it stands")


def test_the_plant_is_stopped_beside_the_devices(bridge: Bridge, client: Client, plant: Plant) -> None:
    client.connect(bridge, "viewer")
    namespaces = client.tell("read", nodes=["i=2255"])[0]["value"]
    devices = f"ns={namespaces.index('http://opcfoundation.org/UA/DI/')};i=5001"
    answer = client.tell("call", object=devices, method="s=Stop")
    assert (answer["status"], answer["outputs"][0]) == ("Good", True)
    assert plant.get("/bodies/line1.00")["moving"] is False


def test_an_axis_is_homed(bridge: Bridge, client: Client) -> None:
    client.connect(bridge)
    answer = client.call("line1.00", "Home", ("String", "home-1"), ("Double", 0.0))
    assert answer["status"] == "Good"
    client.call("line1.00", "Stop")


def test_a_jog_lives_on_heartbeats(bridge: Bridge, client: Client, plant: Plant) -> None:
    client.connect(bridge)
    jog = client.call(
        "line1.3F", "Jog", ("String", "jog-1"), ("String", "cw"), ("Double", 0.0), ("Double", 0.0)
    )
    assert jog["status"] == "Good", jog
    jog_id, within_ms, *_ = jog["outputs"]
    assert within_ms > 0
    assert client.call("line1.3F", "Heartbeat", ("String", jog_id))["outputs"][0] in ("jogging", "lost")
    stopped = client.call("line1.3F", "StopJog", ("String", jog_id))
    assert stopped["status"] == "Good", stopped
    until(lambda: plant.get("/bodies/line1.3F")["moving"] is False, "it stands")


@pytest.mark.parametrize(
    ("told", "status"),
    [
        ({"kind": "sideways"}, "BadInvalidArgument"),
        ({"unit": "mm"}, "BadInvalidArgument"),
        ({"key": " "}, "BadInvalidArgument"),
        ({"kind": "position", "pulses": 1.5}, "BadInvalidArgument"),
    ],
)
def test_a_refusal_has_a_sentence_and_a_remedy(
    bridge: Bridge, client: Client, plant: Plant, told: dict[str, object], status: str
) -> None:
    client.connect(bridge)
    before, refused = len(plant.moves()), bridge.counted("refused")
    answer = client.move("line1.3F", **{"pulses": 10.0, **told})  # type: ignore[arg-type]
    move_id, _, replayed, detail, remedy = answer["outputs"]
    assert (answer["status"], move_id, replayed) == (status, "", False)
    assert detail
    assert remedy
    assert len(plant.moves()) == before
    assert bridge.counted("refused") == refused + 1


def test_a_refusal_is_told_in_the_language_of_the_session(bridge: Bridge, tmp_path: Path) -> None:
    told = []
    for locales in (["ja-JP", "en"], ["de", "en-US"]):
        with client_of(tmp_path, bridge.trusted) as client:
            client.connect(bridge, "viewer", locales=locales)
            told.append(client.move("line1.3F", 10)["outputs"][3])
    japanese, english = told
    assert any("\u3040" <= it <= "\u30ff" for it in japanese), japanese
    assert english.isascii(), english


def test_arguments_of_a_wrong_number_or_kind_are_refused(bridge: Bridge, client: Client) -> None:
    client.connect(bridge)
    assert client.call("line1.3F", "StartMove")["status"] == "BadArgumentsMissing"
    few = [("String", "x"), ("Double", 1.0)]
    assert client.call("line1.3F", "Home", *few, ("Double", 1.0))["status"] == "BadTooManyArguments"
    wrong = client.call("line1.3F", "Home", ("String", "x"), ("String", "soon"))
    assert (wrong["status"], wrong["inputs"]) == ("BadInvalidArgument", ["Good", "BadTypeMismatch"])
