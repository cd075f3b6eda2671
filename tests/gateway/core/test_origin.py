"""Every exchange tells who asked for it."""

import asyncio
import os
from typing import Any

import pytest

from gateway.core.exchange import Lane
from gateway.core.origin import (
    FENCE,
    GATEWAY,
    POLL,
    PROBE,
    SET_UP,
    Origin,
    acting,
    current,
    go_on_after,
    hex_digits,
    sorted_by_time,
)
from gateway.fics.session import FicsSession
from gateway.rorze.session import RorzeSession
from protocols.fics.variables import GetVariable
from protocols.rorze.position import GetPosition
from tests.fics_plants import fics_rig
from tests.gateway.rorze.exchanges import exchange
from tests.gateway.rorze.far_end import FarEnd, running_line, until, virtual
from tests.plants import in_virtual_time, rig

ANNA = Origin("anna", "r-1")


def test_nobody_but_the_gateway_asks_where_nothing_else_is_said() -> None:
    assert current() is GATEWAY
    assert exchange(GetPosition()).origin is GATEWAY


def test_what_is_asked_within_a_request_has_its_origin_and_nothing_after_it() -> None:
    with acting(ANNA):
        with acting(SET_UP):
            assert current() is SET_UP
        asked = exchange(GetPosition())
    assert asked.origin is ANNA
    assert current() is GATEWAY


@virtual
async def test_a_task_keeps_the_origin_of_its_beginning() -> None:
    async def ask() -> Origin:
        await asyncio.sleep(1)
        return exchange(GetPosition()).origin

    with acting(ANNA):
        task = asyncio.create_task(ask())
    assert await task is ANNA


def note_origins(monkeypatch: pytest.MonkeyPatch, session: type[Any]) -> list[tuple[str, Origin]]:
    """The code and the origin of all that is written from now on."""
    noted: list[tuple[str, Origin]] = []
    written = session.written

    def note(self: Any, exchange: Any, now: float, deadline: float) -> None:
        noted.append((exchange.command.code, exchange.origin))
        written(self, exchange, now, deadline)

    monkeypatch.setattr(session, "written", note)
    return noted


def test_set_up_fences_and_probes_are_the_gateways_and_a_repetition_keeps_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    noted = note_origins(monkeypatch, RorzeSession)
    set_up: list[tuple[str, Origin]] = []

    @virtual
    async def story() -> None:
        far = FarEnd()
        far.once("&026PD")
        async with running_line(far) as line:
            set_up.extend(noted)
            noted.clear()
            with acting(ANNA):
                await line.submit(2, GetPosition(), Lane.READ)
            assert noted == [("6PD", ANNA), ("3ND", FENCE), ("6PD", ANNA)]
            far.silent = {3}
            await line.submit(3, GetPosition(), Lane.READ)
            noted.clear()
            await until(lambda: ("3ND", PROBE) in noted)

    story()
    assert set_up == [("XID", SET_UP), ("XRS", SET_UP)]


def test_a_robot_is_set_up_by_the_gateway(monkeypatch: pytest.MonkeyPatch) -> None:
    noted = note_origins(monkeypatch, FicsSession)

    @in_virtual_time
    async def story() -> None:
        async with fics_rig() as rig:
            with acting(ANNA):
                await rig.robot.read(GetVariable(number=1))

    story()
    assert noted[0] == ("MOD", SET_UP)
    assert noted[-1] == ("VAR", ANNA)


def test_what_a_plant_looks_after_by_polling_is_the_gateways(monkeypatch: pytest.MonkeyPatch) -> None:
    noted = note_origins(monkeypatch, RorzeSession)

    @in_virtual_time
    async def story() -> None:
        async with rig():
            noted.clear()
            await asyncio.sleep(30)

    story()
    assert {origin for _, origin in noted} == {POLL}


def test_no_two_ids_are_alike() -> None:
    made = [hex_digits(32) for _ in range(1000)]
    assert {len(it) for it in made} == {32}
    assert all(int(it, 16) >= 0 for it in made)
    assert len(set(made)) == len(made)


def test_ids_sort_by_time() -> None:
    made = [sorted_by_time(at_ms) for at_ms in (1, 255, 256, 1_800_000_000_000)]
    assert made == sorted(made)
    assert {len(it) for it in made} == {20}


def test_ids_of_one_millisecond_sort_as_they_were_drawn() -> None:
    made = [sorted_by_time(1_800_000_000_000) for _ in range(1000)]
    assert (made, len(set(made))) == (sorted(made), 1000)


def test_a_clock_that_is_set_back_leaves_their_order() -> None:
    made = [sorted_by_time(at_ms) for at_ms in (1_900_000_000_000, 1_800_000_000_000, 1_900_000_000_001)]
    assert made == sorted(made)


def test_a_clock_that_was_ahead_in_an_earlier_life_leaves_their_order() -> None:
    go_on_after(f"{2_000_000_000_000 << 32:020x}")
    assert f"{2_000_000_000_000 << 32:020x}" < sorted_by_time(1_800_000_000_000) < sorted_by_time(1)


def test_a_fork_draws_its_own() -> None:
    read, write = os.pipe()
    if os.fork() == 0:
        os.write(write, hex_digits(32).encode())
        os._exit(0)
    os.close(write)
    assert os.read(read, 32).decode() != hex_digits(32)
    os.close(read)
    os.wait()
