"""Ways to a broker: user names, certificates, WebSockets, MQTT 3.1.1; and what `check` says of them."""

import shutil
import subprocess
import time
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest
from typer.testing import CliRunner

from app.cli import app
from tests.bridges.mqtt.stand import (
    MES,
    ROOT,
    Broker,
    Client,
    Plant,
    at,
    bridging,
    free_port,
    relative,
    write_config,
)
from tests.certificates import write_certificate
from tests.e2e.processes import until


@pytest.fixture
def brokers(tmp_path: Path) -> Iterator[list[Broker]]:
    begun: list[Broker] = []
    yield begun
    for broker in begun:
        broker.kill()


def served_at(brokers: list[Broker], folder: Path, *settings: str) -> Broker:
    brokers.append(Broker(folder, *settings))
    return brokers[-1]


def checked(config: Path) -> tuple[int, str]:
    result = CliRunner().invoke(app, ["bridge", "check", "--config", str(config)])
    return result.exit_code, result.output


@pytest.mark.prove
def test_a_user_name_and_a_password_from_a_file(plant: Plant, brokers: list[Broker], tmp_path: Path) -> None:
    passwords, secret = tmp_path / "passwords", tmp_path / "password"
    mosquitto_passwd = shutil.which("mosquitto_passwd")
    assert mosquitto_passwd
    subprocess.run([mosquitto_passwd, "-c", "-b", passwords, "bridge", "s3cret"], check=True)  # noqa: S603
    secret.write_text("s3cret\n")
    secret.chmod(0o600)
    port = free_port()
    guarded = f"listener {port} 127.0.0.1", f"password_file {passwords}", "allow_anonymous false"
    broker = served_at(brokers, tmp_path, *guarded)
    way = f"url = 'mqtt://127.0.0.1:{port}'", "user = 'bridge'", f"password_file = '{secret}'"
    with bridging(tmp_path, plant, broker, *way) as bridge, at(broker) as client:
        bridge.wait_until_online()
        assert client.last("bodies/line1.3F/state")
    secret.write_text("wrong\n")
    code, said = checked(bridge.config)
    assert code == 1
    assert "cannot be used" in said
    assert "wrong" not in said


def test_what_a_broker_does_not_take_is_told_and_sent_again_when_it_does(
    plant: Plant, brokers: list[Broker], tmp_path: Path
) -> None:
    rights, port = tmp_path / "rights", free_port()
    taken = (
        f"topic readwrite {ROOT}/cmd/#",
        f"topic readwrite {ROOT}/status",
        f"topic readwrite {ROOT}/bodies/#",
    )
    rights.write_text("\n".join([*taken, "topic readwrite answers/#", f"topic read {ROOT}/#", ""]))
    listener = f"listener {port} 127.0.0.1", "allow_anonymous true", f"acl_file {rights}"
    broker = served_at(brokers, tmp_path, *listener)
    with bridging(tmp_path, plant, broker, f"url = 'mqtt://127.0.0.1:{port}'") as bridge:
        refused = f"it does not take what is published at {ROOT}/lines/line1/state: Not authorized"
        until(lambda: refused in httpx.get(f"{bridge.listens_at}/status").json()["reason"], "it is told")
        rights.write_text("topic readwrite #\n")
        broker.kill()
        broker.start()
        bridge.wait_until_online()


def test_an_answer_that_a_broker_does_not_take_ends_no_connection(
    plant: Plant, brokers: list[Broker], tmp_path: Path
) -> None:
    rights, port = tmp_path / "rights", free_port()
    rights.write_text(f"topic readwrite {ROOT}/#\ntopic readwrite answers/#\n")
    listener = f"listener {port} 127.0.0.1", "allow_anonymous true", f"acl_file {rights}"
    broker = served_at(brokers, tmp_path, *listener)
    with bridging(tmp_path, plant, broker, f"url = 'mqtt://127.0.0.1:{port}'") as bridge:
        bridge.wait_until_online()
        client = Client(port)
        try:
            client.publish(f"cmd/{MES}/stop", ResponseTopic="not/allowed")
            bridge.program.said("an answer has gone nowhere")
            assert client.command("/stop")["status"] == 200
        finally:
            client.close()
        assert "not connected to the broker:" not in bridge.program.words()


@pytest.mark.prove
@pytest.mark.parametrize("scheme", ["mqtts", "wss"])
def test_certificates_of_both_sides(scheme: str, plant: Plant, brokers: list[Broker], tmp_path: Path) -> None:
    authority = write_certificate(tmp_path, "authority", file="authority")
    server = write_certificate(tmp_path, "127.0.0.1", authority, "server")
    own = write_certificate(tmp_path, "bridge", authority, "bridge")
    port = free_port()
    listener = [f"listener {port} 127.0.0.1", f"cafile {authority[0]}", f"certfile {server[0]}"]
    listener += [f"keyfile {server[1]}", "require_certificate true", "use_identity_as_username true"]
    listener += ["protocol websockets"] if scheme == "wss" else []
    broker = served_at(brokers, tmp_path, *listener)
    way = [f"url = '{scheme}://127.0.0.1:{port}'", f"ca_file = '{authority[0]}'"]
    shown = [f"cert_file = '{own[0]}'", f"key_file = '{own[1]}'"]
    with bridging(tmp_path, plant, broker, *way, *shown) as bridge, at(broker) as client:
        bridge.wait_until_online()
        assert client.last("bodies/line1.3F/state")
        assert client.command("/bodies/3F/moves?wait=30", relative())["status"] == 200
    if scheme == "mqtts":  # of a WebSocket that was not let in the library leaves its socket open
        code, said = checked(write_config(tmp_path, plant, broker, *way))
        assert (code, "cannot be used" in said) == (1, True), "without its own it is not let in"


def test_websockets_without_tls(plant: Plant, brokers: list[Broker], tmp_path: Path) -> None:
    port = free_port()
    websockets = f"listener {port} 127.0.0.1", "protocol websockets", "allow_anonymous true"
    broker = served_at(brokers, tmp_path, *websockets)
    way = f"url = 'ws://127.0.0.1:{port}/mqtt'"
    with bridging(tmp_path, plant, broker, way) as bridge, at(broker) as client:
        bridge.wait_until_online()
        assert client.last("bodies/line1.3F/state")


def test_an_old_broker_gets_the_same_and_commands_come_in_envelopes(
    plant: Plant, brokers: list[Broker], tmp_path: Path
) -> None:
    broker = served_at(brokers, tmp_path)
    with bridging(tmp_path, plant, broker, "version = '3.1.1'") as bridge, at(broker, v5=False) as client:
        client.last("status", lambda it: it["state"] == "online")
        assert client.last("bodies/line1.3F/state")["online"]
        envelope = {"correlation": "e-1", "response_topic": client.answers, "body": relative()}
        client.publish(f"cmd/{MES}/bodies/3F/moves?wait=30", envelope)
        answers = until(lambda: [it.json for it in client.heard if it.topic == client.answers], "an answer")
        assert (answers[0]["status"], answers[0]["correlation"]) == (400, "e-1"), "it could come late"
        client.publish(
            f"cmd/{MES}/bodies/3F/moves?wait=30", {**envelope, "expires_at": "2099-01-01T00:00:00Z"}
        )
        until(lambda: bridge.counted("done") == 1, "the move is made")
        bridge.program.kill()
        assert client.last("status", lambda it: it["state"] == "offline")["reason"] == "the bridge is gone"


@pytest.mark.prove
def test_a_short_absence_is_not_told_where_the_will_is_delayed(
    plant: Plant, brokers: list[Broker], tmp_path: Path
) -> None:
    broker = served_at(brokers, tmp_path)
    with bridging(tmp_path, plant, broker, "will_delay_s = 12") as bridge, at(broker) as client:
        client.last("status", lambda it: it["state"] == "online")
        before = len(client.of("status"))
        bridge.program.kill()
        client.publish(f"cmd/{MES}/stop", ResponseTopic=client.answers)
        bridge.start().wait_until_online()
        client.last("status", lambda it: it["state"] == "online")
        reasons = [it.json["reason"] for it in client.of("status")[before:]]
        assert "the bridge is gone" not in reasons
        assert bridge.counted("done") == 0, "nothing is kept for the next life"
        bridge.program.kill()
        killed_at = time.monotonic()
        client.last("status", lambda it: it["reason"] == "the bridge is gone")
        assert time.monotonic() - killed_at > 11


def test_check_measures_the_broker_and_names_its_setting(
    plant: Plant, brokers: list[Broker], tmp_path: Path
) -> None:
    broker = served_at(brokers, tmp_path)
    code, said = checked(write_config(tmp_path, plant, broker))
    assert code == 0, said
    assert "callers.mes.key_file: mes, role operator, for everything" in said
    assert "lets the bridge in; half of the messages arrive within" in said
    slow = served_at(brokers, tmp_path, "set_tcp_nodelay false")
    code, said = checked(write_config(tmp_path, plant, slow))
    assert code == 1
    assert "set `set_tcp_nodelay true` in mosquitto.conf" in said
    slow.kill()
    code, said = checked(write_config(tmp_path, plant, slow))
    assert (code, "cannot be used" in said) == (1, True)


def test_check_names_every_fault_with_its_line(plant: Plant, brokers: list[Broker], tmp_path: Path) -> None:
    broker = served_at(brokers, tmp_path)
    config = write_config(tmp_path, plant, broker, "root = 'a//b'", "will_delay_s = -1", "versoin = '5'")
    code, said = checked(config)
    lines = config.read_text().splitlines()
    assert code == 78
    for key in ("root", "will_delay_s", "versoin"):
        number = next(place for place, line in enumerate(lines, 1) if line.startswith(key))
        assert f"{config}:{number}: mqtt.{key}: " in said


def test_check_warns_of_keys_that_others_may_read(
    plant: Plant, brokers: list[Broker], tmp_path: Path
) -> None:
    broker = served_at(brokers, tmp_path)
    config = write_config(tmp_path, plant, broker)
    plant.key_files[MES].chmod(0o644)
    code, said = checked(config)
    plant.key_files[MES].chmod(0o600)
    assert (code, f"chmod 600 {plant.key_files[MES]}" in said) == (1, True)


def test_a_second_bridge_with_the_same_directory_does_not_start(
    plant: Plant, brokers: list[Broker], tmp_path: Path
) -> None:
    broker = served_at(brokers, tmp_path)
    with bridging(tmp_path, plant, broker) as bridge:
        command = ["bridge", "mqtt", "--config", str(bridge.config), "--data", str(tmp_path / "bridge-data")]
        result = CliRunner().invoke(app, command)
    assert (result.exit_code, "is in use by another bridge" in result.output) == (3, True)


def test_topics_begin_with_the_root_of_the_file(plant: Plant, brokers: list[Broker], tmp_path: Path) -> None:
    broker = served_at(brokers, tmp_path)
    with (
        bridging(tmp_path, plant, broker, "root = 'acme/fab2/stocker1'"),
        at(broker, "#") as client,
    ):
        client.root = "acme/fab2/stocker1"
        client.last("status", lambda it: it["state"] == "online")
        assert not [it for it in client.heard if it.topic.startswith(ROOT)]
