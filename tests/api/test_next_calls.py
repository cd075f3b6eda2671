"""The calls that help name the right that their routes take."""

import asyncio
from collections.abc import Iterator
from functools import cache
from itertools import product

import pytest

from api.app import create_app
from gateway.access.roles import RIGHTS_OF, Role
from gateway.causes import causes_of
from gateway.config import Config
from gateway.core.alarms import Alarm, reset_of
from gateway.core.next_calls import NextCall, filled_in
from gateway.core.rights import Right
from gateway.fics import calls as calls_of_robots
from gateway.plant import Plant
from gateway.rorze import alarms as calls_of_bodies
from simulator.rorze.world import EMS
from tests.api.access.guarded import Keys, guarded
from tests.api.stand import Stand, on_stand
from tests.api.test_alarms import RELATIVE, SEEN_S, power_is_cut

SUBJECTS = ("/bodies/3F", "/groups/80", "/robots/r1", "/lines/arm", "/gateway")


@cache
def plant() -> Plant:
    return Plant(Config.model_validate({"lines": [{"id": "arm", "address": "tcp://127.0.0.1:1"}]}))


def templates() -> Iterator[NextCall]:
    """All calls that an error or an alarm can name."""
    for table in (
        calls_of_bodies.CALLS,
        calls_of_bodies.OWN_CALLS,
        calls_of_bodies.CALLS_OF_GROUPS,
        calls_of_bodies.CALLS_OF_LINES,
        calls_of_robots.CALLS,
    ):
        for calls in table.values():
            yield from calls
    for cause in causes_of(plant().packages.families.values(), {}, {}, latch=True):
        yield from cause.next


def rights_of_routes(template: NextCall) -> set[Right]:
    """The rights of the routes that take a call, whatever it is about."""
    rows = create_app(plant()).rows
    known = dict.fromkeys(("line", "unit", "move_id", "upload_id", "restore_id", "group_id"), "1")
    found = set()
    for subject in SUBJECTS:
        for call in filled_in([template], {**known, "subject": subject}):
            route = rows.find({"type": "http", "method": call.method, "path": call.path})
            if route is not None:
                found.add(route.right)
    return found


CALLS = {f"{call.method} {call.path}": call for call in templates()}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_a_call_that_helps_names_the_right_that_its_route_takes(call: NextCall) -> None:
    assert rights_of_routes(call) == {call.right}


def test_every_right_is_among_them() -> None:
    assert {call.right for call in CALLS.values()} == set(Right)


@on_stand()
async def test_the_reset_of_an_alarm_names_the_right_that_its_route_takes(stand: Stand) -> None:
    call = reset_of(Alarm.model_validate(await power_is_cut(stand)))
    assert rights_of_routes(call) == {call.right}


@guarded()
async def test_roles_are_let_in_as_the_rights_of_the_calls_say(stand: Stand, keys: Keys) -> None:
    stand.port.machine.brown_out(0x01, 0.05, asyncio.get_running_loop().time())
    await asyncio.sleep(SEEN_S)
    [alarm] = (await stand.get("/alarms?standing=true", **keys.header("viewer"))).json()["alarms"]
    axis = stand.port.machine.axes[0x3F]
    axis.world.forced.update({EMS: True})
    axis.sense(asyncio.get_running_loop().time())
    refused = await stand.post("/bodies/arm.3F/moves", RELATIVE, **keys.header("operator"))
    calls = [*alarm["next"], *refused.json()["next"]]
    assert {call["right"] for call in calls} == {"view", "operate"}
    for role, call in product((Role.VIEWER, Role.OPERATOR, Role.ADMIN), calls):
        content, header = call.get("body"), keys.header(role)
        answer = await stand.client.request(call["method"], call["path"], json=content, headers=header)
        assert (answer.status_code == 403) == (call["right"] not in RIGHTS_OF[role]), answer.text


def test_a_call_that_an_earlier_version_has_kept_without_a_right_can_be_read() -> None:
    kept = '{"method": "POST", "path": "/bodies/arm.3F/moves", "en": "Home it.", "ja": "原点"}'
    assert NextCall.model_validate_json(kept).right is Right.OPERATE
