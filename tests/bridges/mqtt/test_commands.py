"""The bridge's own verdict on a command, before the gateway is asked."""

from types import SimpleNamespace

import pytest
from aiomqtt import Message

from bridges.common.callers import Callers, Doors
from bridges.common.settings import CallerTable, GatewayTable
from bridges.common.state import Figures
from bridges.mqtt import requests
from bridges.mqtt.commands import Commands
from bridges.mqtt.operations import Operation

MOVE, STOP = Operation(moves=True), Operation(stops=True)


@pytest.mark.parametrize(
    ("operation", "retain", "stored", "is_refused"),
    [
        (MOVE, False, False, False),
        (MOVE, False, True, False),
        (MOVE, True, False, True),
        (MOVE, True, True, True),
        (STOP, False, False, False),
        (STOP, False, True, False),
        (STOP, True, False, False),
        (STOP, True, True, True),
    ],
)
def test_what_comes_while_the_bridge_subscribes_is_stored_only_if_it_is_retained(
    operation: Operation, retain: bool, stored: bool, is_refused: bool
) -> None:
    callers = Callers(Doors(GatewayTable(url="http://127.0.0.1:1")), {"mes": CallerTable()})
    commands = Commands("root", callers, Figures(), lambda _: operation)
    told = SimpleNamespace(CorrelationData=b"c", MessageExpiryInterval=9)
    message = Message("root/cmd/mes/bodies/3F/stop", b"", 1, retain, 1, told)  # type: ignore[arg-type]
    refusal = commands._judge(requests.read(message, "root"), operation, stored=stored)
    assert (refusal is not None and refusal.kind == "retained") == is_refused
