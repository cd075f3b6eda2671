"""Edges of sensors and inputs, reported by bodies as the configuration has it."""

import asyncio

import pytest

from gateway.config import parse
from gateway.core.toml_files import ConfigError
from gateway.rorze.knowledge import SensorEdges
from protocols.rorze.inputs_outputs import GetInputs, Inputs, Sensors
from protocols.rorze.link import UnknownMessage, program_text
from protocols.rorze.modes import EventMask, SetEventMask
from protocols.rorze.moves import MoveClockwise
from protocols.table import Ack
from simulator.rorze.controller import Rc420
from simulator.rorze.world import EMS
from tests.gateway.rorze.test_body_power import brown_out
from tests.plants import Rig, configuration, ended, in_virtual_time, rig, start

EVENTS = (
    'events = {sensors = ["ems"], inputs = [0, 9], status = ["ems_error"], position = true}, '
    'inputs = {0 = "door closed"}'
)
EMS_ON = {"sensor": "ems", "on": True}
DOOR_OPEN = {"number": 0, "name": "door closed", "on": True}


async def settled() -> None:
    await asyncio.sleep(5)


def switch_input(rig: Rig, number: int, *, on: bool) -> None:
    def switch(axis: Rc420) -> None:
        axis.world.inputs = axis.world.inputs & ~(1 << number) | on << number

    rig.touch(0x3F, switch)


def switch_ems(rig: Rig, *, on: bool) -> None:
    rig.touch(0x3F, lambda axis: axis.world.forced.__setitem__(EMS, on))


def edges(rig: Rig, kind: str) -> list[dict[str, object]]:
    return [event.data for event in rig.events(f"body.{kind}.changed") if event.subject.endswith(".3F")]


@in_virtual_time
async def test_the_body_is_told_what_to_report_and_edges_have_names() -> None:
    async with rig(body_options=EVENTS) as it:
        await settled()
        [*_, setting] = it.executed("EMS", 0x3F)
        assert setting.facts["text"] == "EMSC:H04,M:H00,S:H20,I:H0201"
        assert it.executed("ESS", 0x3F)[-1].facts["text"] == "ESSC,S,I,P"
        assert not edges(it, "input")
        asked = len(it.wire.sent)
        for number, on in (0, True), (9, True), (0, False):
            switch_input(it, number, on=on)
            await asyncio.sleep(0.1)
        switch_ems(it, on=True)
        await asyncio.sleep(0.1)
        assert not [frame for frame in it.wire.frames(asked) if "CID" in frame]
        assert edges(it, "input") == [
            DOOR_OPEN,
            {"number": 9, "name": None, "on": True},
            DOOR_OPEN | {"on": False},
        ]
        assert edges(it, "sensor") == [EMS_ON]
        assert it.events("body.controller_event")[-1].data["P"] == 0


@in_virtual_time
async def test_an_error_that_is_reported_is_looked_at_at_once() -> None:
    async with rig(body_options=EVENTS) as it:
        await settled()
        move = await start(it, MoveClockwise(distance=400_000))
        await asyncio.sleep(1)
        switch_ems(it, on=True)
        await asyncio.sleep(0.25)
        told = it.events("body.status.changed")[-1].data["status"]
        assert "ems_error" in told
        await ended(it, move)


@in_virtual_time
async def test_what_is_not_to_be_reported_is_not() -> None:
    async with rig(body_options=EVENTS) as it:
        await settled()
        switch_input(it, 5, on=True)
        await settled()
        assert not it.events("body.controller_event")
        assert not edges(it, "input")


@in_virtual_time
async def test_a_body_without_events_keeps_its_own_settings() -> None:
    async with rig() as it:
        await it.body().ask(SetEventMask(mask=EventMask(inputs=1)))
        await asyncio.sleep(90)
        assert [fact.facts["text"] for fact in it.executed("EMS")] == ["EMSI:H0001"]


@in_virtual_time
async def test_the_settings_are_made_again_after_a_loss_of_power() -> None:
    async with rig(body_options=EVENTS) as it:
        await settled()
        switch_ems(it, on=True)
        brown_out(it)
        await asyncio.sleep(45)  # its mark is looked at every 30 s where it stands at 0
        before = len(edges(it, "sensor"))
        switch_ems(it, on=False)
        await asyncio.sleep(1)
        assert edges(it, "sensor")[before:] == [EMS_ON | {"on": False}]


@in_virtual_time
async def test_what_somebody_else_has_set_is_set_back() -> None:
    async with rig(body_options=EVENTS) as it:
        await settled()
        await it.body().ask(SetEventMask(mask=EventMask()))
        await asyncio.sleep(70)
        switch_input(it, 0, on=True)
        await asyncio.sleep(1)
        assert edges(it, "input") == [DOOR_OPEN]


@in_virtual_time
async def test_a_moving_body_is_told_when_it_stands() -> None:
    async with rig(body_options=EVENTS) as it:
        await settled()
        await it.body().ask(SetEventMask(mask=EventMask()))
        await asyncio.sleep(50)
        await start(it, MoveClockwise(distance=400_000))
        told = len(it.executed("EMS", 0x3F))
        await asyncio.sleep(30)
        assert len(it.executed("EMS", 0x3F)) == told + 1
        assert not [fact for fact in it.truth.of("command", 0x3F) if fact.facts["reply"] == "@50"]


@in_virtual_time
async def test_an_input_that_is_found_changed_is_an_edge_too() -> None:
    async with rig() as it:
        await it.body().ask(GetInputs())
        switch_input(it, 3, on=True)
        await it.body().ask(GetInputs())
        await it.body().ask(GetInputs(bit=3))
        assert edges(it, "input") == [{"number": 3, "name": None, "on": True}]


def test_what_is_told_first_is_no_edge() -> None:
    told: list[tuple[str, dict[str, object]]] = []
    edges = SensorEdges({}, lambda kind, facts: told.append((kind, facts)))
    edges.replied(GetInputs(), Inputs(bits=0x3FF), 0.0)
    edges.reported({"S": 0x21, "I": 0x3FF})
    assert not told
    edges.replied(GetInputs(), Sensors(bits=0x20), 0.0)
    edges.replied(GetInputs(), Sensors(on=1), 0.0)
    edges.replied(GetInputs(), Ack(), 0.0)
    assert told == [("body.sensor.changed", {"sensor": "stall", "on": False})]


@in_virtual_time
async def test_the_text_of_a_user_program_is_an_event() -> None:
    async with rig() as it:
        it.wire._deliver(b">&7CUSD[3F:PART 12 OK]\r")
        await asyncio.sleep(1)
        [event] = it.events("body.program.message")
        assert (event.subject, event.data) == ("/bodies/line1.3F", {"text": "PART 12 OK"})


@pytest.mark.parametrize("text", [">&7CUSD[7F:text]", ">&7CUSD[3F]", ">&7AUSD[3F:text]", ">&7CUSE[3F:text]"])
def test_another_message_is_no_text(text: str) -> None:
    assert program_text(UnknownMessage(0x7C, text)) is None


@pytest.mark.parametrize(
    "events",
    ['{sensors = ["door"]}', "{inputs = [10]}", '{status = ["pulses_running"]}', "{inputs = [true]}"],
)
def test_there_are_only_the_events_of_the_manual(events: str) -> None:
    with pytest.raises(ConfigError, match="events"):
        parse(configuration(body_options=f"events = {events}"), "test.toml")
