"""What is asked of bodies and their lines beside single commands: groups, scans, places, power."""

import asyncio
from collections.abc import Mapping
from typing import Final

from gateway.access import principal
from gateway.core.addresses import numbered_address
from gateway.core.errors import GatewayError
from gateway.core.rights import Right
from gateway.operations.caller import for_caller, needs, require
from gateway.operations.of_bodies import of_body
from gateway.plant import Plant
from gateway.rorze.bodies import Body, Group, R
from gateway.rorze.family import Rorze
from gateway.rorze.line import Line
from gateway.rorze.move_requests import Length
from gateway.rorze.scans import Scan
from gateway.rorze.sweep import SweepAnswer
from gateway.security import entries
from protocols.rorze.position import GetPosition, SetPosition
from protocols.rorze.row import RorzeCommand
from protocols.rorze.status import GetControllerStatus

know_mode: Final = of_body(Right.VIEW, Body.know_mode)


@needs(Right.OPERATE)
async def acknowledge_power_cycle(plant: Plant, body_id: str) -> None:
    """Allow motion again after a loss of power; errors as of `Body.acknowledge_power_cycle`."""
    body = plant.family(Rorze).body(body_id)
    await body.acknowledge_power_cycle()
    plant.security.note(entries.POWER_CYCLE_ACKNOWLEDGED, body.address)


@needs(Right.SETUP)
async def set_position(plant: Plant, body_id: str, position: Length) -> tuple[int, float]:
    """Call the present position by another number; gives the pulses, and when that was answered.

    :raises GatewayError: it was refused, not sent, or not answered.
    """
    body = plant.family(Rorze).body(body_id)
    pulses = position.pulses(body.scale)
    _, answered = await body.ask(SetPosition(position=pulses))
    return pulses, answered.at


@for_caller
async def define_group(plant: Plant, group_id: str, members: list[str], name: str) -> Group:
    """Define a group at the link master, whose caller needs the right on all it will reach.

    :raises GatewayError: as of `Rorze.define_group`.
    """
    address = numbered_address(group_id)
    home = address.rpartition(".")[0]
    reached = (f"{home}.{it}" if home and "." not in it else it for it in members)
    require(plant, Right.SETUP, address, *reached)
    return await plant.family(Rorze).define_group(group_id, members, name)


@needs(Right.VIEW)
async def sweep(
    plant: Plant, line_id: str, command: RorzeCommand[R]
) -> Mapping[Body, SweepAnswer | GatewayError]:
    """Ask all bodies of a line the same, in the fewest frames: what each told, or why it did not."""
    rorze = plant.family(Rorze)
    line = _line(plant, line_id)
    return await rorze.sweeps[line.id].ask(rorze.bodies_of(line), command)


@for_caller
async def poll_all(plant: Plant) -> None:
    """Ask every body for status and position, those out of scope too; the silent keep what was known."""
    plant.territory.require_right(principal.current(), Right.VIEW)
    rorze = plant.family(Rorze)
    await asyncio.gather(*(_poll_line(rorze, line) for line in rorze.lines.values()))


async def _poll_line(rorze: Rorze, line: Line) -> None:
    for command in (GetControllerStatus(), GetPosition()):
        await rorze.sweeps[line.id].ask(rorze.bodies_of(line), command)


@needs(Right.SETUP, leased=False)
async def start_scan(plant: Plant, line_id: str) -> Scan:
    """Begin to ask who is on a line; errors as of `Scans.start`."""
    return plant.family(Rorze).scans.start(_line(plant, line_id))


async def get_scan(plant: Plant, line_id: str, scan_id: str, wait_s: float) -> Scan:
    """Give a scan when it is over, or as it is when the time is up; errors as of `Works.get`."""
    require(plant, Right.VIEW, line_id)
    return await plant.family(Rorze).scans.get(_line(plant, line_id).id, scan_id, wait_s)


def _line(plant: Plant, line_id: str) -> Line:
    plant.target(f"/lines/{line_id}")  # a line that leads to a robot says so
    return plant.family(Rorze).lines[line_id]
