"""A request that is repeated with its Idempotency-Key is carried out once, over restarts, too."""

import asyncio
import json
from collections.abc import AsyncIterator, Callable
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any, NamedTuple

import httpx2
import pytest
from starlette.types import Message, Receive, Scope, Send

from api.app import create_app
from gateway.access.credentials import Credentials
from tests.api.access.guarded import Keys
from tests.open_access import OPEN
from tests.plants import configuration, in_virtual_time
from tests.tested_plant import TestedPlant
from tests.world import DISK_S, World

KEY = {"idempotency-key": "4711"}
MOVES = "/bodies/3F/moves"


def relative(pulses: int = 500) -> dict[str, Any]:
    return {"kind": "relative", "direction": "cw", "distance": {"value": pulses, "unit": "pulse"}}


@pytest.fixture
def world(tmp_path: Path) -> World:
    return World(tmp_path / "data")


@asynccontextmanager
async def client(
    plant: TestedPlant, credentials: Credentials | None = None
) -> AsyncIterator[httpx2.AsyncClient]:
    while any(port.state != "ready" for port in plant.ports().values()):  # noqa: ASYNC110
        await asyncio.sleep(0.1)
    transport = httpx2.ASGITransport(create_app(plant, credentials), raise_app_exceptions=False)
    async with httpx2.AsyncClient(transport=transport, base_url="http://127.0.0.1:8420") as http:
        yield http


def is_replayed(answer: httpx2.Response) -> bool:
    return answer.headers.get("idempotency-replayed") == "true"


@in_virtual_time
async def test_a_repeat_gets_the_same_answer(world: World) -> None:
    async with world.gateway() as plant, client(plant) as http:
        first = await http.post(MOVES, json=relative(), headers=KEY)
        again = await http.post(MOVES, json=relative(), headers=KEY)
    assert (first.status_code, is_replayed(first)) == (202, False)
    assert is_replayed(again)
    assert (again.status_code, again.content) == (first.status_code, first.content)
    assert again.headers["location"] == first.headers["location"]
    assert len(world.sent("1+M")) == 1


@in_virtual_time
async def test_a_whole_number_with_a_point_makes_no_other_request(world: World) -> None:
    async with world.gateway() as plant, client(plant) as http:
        await http.post(MOVES, json=relative(500), headers=KEY)
        again = await http.post(MOVES, content=json.dumps(relative()).replace("500", "5e2"), headers=KEY)
    assert (again.status_code, is_replayed(again)) == (202, True)


@in_virtual_time
async def test_however_the_body_is_called_and_the_end_is_waited_for_it_is_one_request(world: World) -> None:
    async with world.gateway() as plant, client(plant) as http:
        first = await http.post("/bodies/3f/moves?wait=30", json=relative(), headers=KEY)
        for path in ("/bodies/3F/moves?wait=30", "/bodies/LINE1.3f/moves", "/bodies/line1.3F/moves?wait=5"):
            again = await http.post(path, json={**relative(), "start_within_s": len(path) / 10}, headers=KEY)
            assert (is_replayed(again), again.content) == (True, first.content)
    assert len(world.sent("1+M")) == 1


HUNDRED = 100
HOME = {"kind": "home"}


class Goal(NamedTuple):
    """A target of a move, the request for it, and the frame that this request sends."""

    world: Callable[[Path], World]
    path: str
    content: dict[str, Any]
    frame: str
    moves: int

    def sent(self, world: World) -> list[str]:
        return [frame for frame in world.wire.frames() if frame.startswith(self.frame)]


def of_robot(mode: int) -> Goal:
    def world(folder: Path) -> World:
        made = World.of_robot(folder, mode)
        made.text += OPEN
        return made

    return Goal(world, "/robots/r1/units/1/moves", HOME, "ORG", 1)


def of_group(folder: Path) -> World:
    return World(folder, text=configuration(bodies=(0x00, 0x3F), groups={"80": ("00", "3F")}))


GOALS = {
    "body": Goal(World, MOVES, relative(), "&3F1+M", 1),
    "group": Goal(of_group, "/groups/80/moves", relative(), "&801+M", 2),
    "robot, mode 2": of_robot(2),
    "robot, mode 3": of_robot(3),
}


async def a_hundred(http: httpx2.AsyncClient, goal: Goal) -> list[httpx2.Response]:
    return await asyncio.gather(
        *(http.post(goal.path, json=goal.content, headers=KEY) for _ in range(HUNDRED))
    )


@pytest.mark.parametrize("name", GOALS)
def test_a_hundred_at_once_make_one_move(name: str, tmp_path: Path) -> None:
    @in_virtual_time
    async def story() -> None:
        goal = GOALS[name]
        world = goal.world(tmp_path / "data")
        async with world.gateway() as plant, client(plant) as http:
            answers = await a_hundred(http, goal)
        assert {(it.status_code, it.content) for it in answers} == {(202, answers[0].content)}
        assert sum(map(is_replayed, answers)) == HUNDRED - 1
        assert len(goal.sent(world)) == 1
        assert len(world.rows("moves")) == goal.moves

    story()


@pytest.mark.parametrize("written", [False, True])
@pytest.mark.parametrize("name", GOALS)
def test_a_hundred_after_a_kill_behind_the_intent_get_the_one_move(
    name: str, written: bool, tmp_path: Path
) -> None:
    """The process ends right before its frame is handed to the port, or right after."""

    @in_virtual_time
    async def story() -> None:
        goal = GOALS[name]
        world = goal.world(tmp_path / "data")
        write, killed = world.wire.write, asyncio.Event()

        def die(data: bytes) -> None:
            if killed.is_set():
                return
            if data.decode().startswith(goal.frame):
                killed.set()
                world.crash()
                if not written:
                    return
            write(data)

        world.wire.write = die  # type: ignore[method-assign]
        async with world.gateway() as plant, client(plant) as http:
            first = asyncio.create_task(http.post(goal.path, json=goal.content, headers=KEY))
            await killed.wait()
            first.cancel()
            await asyncio.gather(first, return_exceptions=True)
        world.wire.write = write  # type: ignore[method-assign]
        async with world.gateway() as plant, client(plant) as http:
            answers = await a_hundred(http, goal)
            assert {(it.status_code, it.content) for it in answers} == {
                (answers[0].status_code, answers[0].content)
            }
            assert all(it.is_success and is_replayed(it) for it in answers), answers[0].text
            await asyncio.sleep(60.0)
            answer = answers[0].json()
            for move in answer.get("moves", [answer]):
                end = (await http.get(f"/{_place_of(move)}/moves/{move['id']}")).json()
                assert end["ended_at"], end
                assert end["status"] == "succeeded" or (end["evidence"] and end["error"]), end
                assert not (end["status"] == "succeeded" and not written), end
        assert len(goal.sent(world)) == (1 if written else 0)

    story()


def _place_of(move: dict[str, Any]) -> str:
    return "robots/r1/units/1" if "unit" in move else f"bodies/{move['body_id']}"


@in_virtual_time
async def test_the_same_key_with_another_request_is_refused(world: World) -> None:
    async with world.gateway() as plant, client(plant) as http:
        await http.post(MOVES, json=relative(), headers=KEY)
        other = await http.post(MOVES, json=relative(501), headers=KEY)
        assert other.status_code == 422
        assert "another request" in other.json()["detail"]
        elsewhere = await http.post("/bodies/00/moves", json=relative(501), headers=KEY)
        assert elsewhere.status_code == 202
    assert len(world.sent("1+M")) == 2


@in_virtual_time
async def test_a_refusal_of_which_nothing_was_sent_does_not_use_the_key_up(world: World) -> None:
    async with world.gateway() as plant, client(plant) as http:
        busy = await plant.moves.start(plant.body("3F"), _long())
        refused = await http.post(MOVES, json=relative(), headers=KEY)
        assert refused.status_code == 409
        invalid = await http.post(MOVES, json={"kind": "nothing"}, headers=KEY)
        assert invalid.status_code == 422
        await plant.moves.wait(busy[0].id, 60.0)
        taken = await http.post(MOVES, json=relative(), headers=KEY)
        assert (taken.status_code, is_replayed(taken)) == (202, False)


@in_virtual_time
async def test_who_has_been_refused_may_use_the_key_for_something_else_at_once(world: World) -> None:
    tasks: list[asyncio.Task[httpx2.Response]] = []
    async with world.gateway() as plant:
        app = create_app(plant)

        async def seen_by_the_client(scope: Scope, receive: Receive, send: Send) -> None:
            async def pass_on(message: Message) -> None:
                await send(message)
                if message.get("status") == 422:
                    tasks.append(asyncio.create_task(http.post(MOVES, json=relative(), headers=KEY)))
                    await asyncio.sleep(1.0)

            await app(scope, receive, pass_on)

        transport = httpx2.ASGITransport(seen_by_the_client)
        async with httpx2.AsyncClient(transport=transport, base_url="http://127.0.0.1:8420") as http:
            await http.post(MOVES, json={"kind": "nothing"}, headers=KEY)
            [corrected] = await asyncio.gather(*tasks)
    assert (corrected.status_code, is_replayed(corrected)) == (202, False)


@in_virtual_time
async def test_over_a_restart_the_answer_is_the_same(world: World) -> None:
    async with world.gateway() as plant, client(plant) as http:
        first = await http.post(MOVES, json=relative(), headers=KEY)
        await plant.moves.wait(first.json()["id"], 60.0)
    async with world.gateway() as plant, client(plant) as http:
        again = await http.post(MOVES, json=relative(), headers=KEY)
    assert is_replayed(again)
    assert again.content == first.content
    assert len(world.sent("1+M")) == 1


async def crash_behind(world: World, table: str, look_s: float = DISK_S / 5) -> None:
    """Kill the gateway when its journal is seen to have a row of this table."""
    while not world.rows(table):  # noqa: ASYNC110
        await asyncio.sleep(look_s)
    world.crash()


@in_virtual_time
async def test_a_crash_between_the_intent_and_the_answer_makes_no_second_move(world: World) -> None:
    async with world.gateway() as plant, client(plant) as http:
        first = asyncio.create_task(http.post(MOVES, json=relative(), headers=KEY))
        await crash_behind(world, "intents")
        move = (await first).json()
    async with world.gateway() as plant, client(plant) as http:
        answers = await asyncio.gather(*(http.post(MOVES, json=relative(), headers=KEY) for _ in range(100)))
        assert {it.json()["id"] for it in answers} == {move["id"]}
        assert all(map(is_replayed, answers))
        await asyncio.sleep(5.0)
    assert len(world.sent("1+M")) == 1


@in_virtual_time
async def test_a_crash_before_the_intent_leaves_the_key_free(world: World) -> None:
    async with world.gateway() as plant, client(plant) as http:
        first = asyncio.create_task(http.post(MOVES, json=relative(), headers=KEY))
        await crash_behind(world, "keys", look_s=0)
        plant.line("line1").gate.stop(0x3F)
        await first
    async with world.gateway() as plant, client(plant) as http:
        again = await http.post(MOVES, json=relative(), headers=KEY)
        assert (again.status_code, is_replayed(again)) == (202, False)


@in_virtual_time
async def test_a_setting_under_way_at_a_crash_is_not_sent_again(world: World) -> None:
    path, content = "/bodies/3F/commands/set-maximum-speed", {"speed": 1000}
    async with world.gateway() as plant, client(plant) as http:
        first = asyncio.create_task(http.post(path, json=content, headers=KEY))
        await crash_behind(world, "intents")
        await first
    async with world.gateway() as plant, client(plant) as http:
        again = await http.post(path, json=content, headers=KEY)
        assert (again.status_code, is_replayed(again)) == (409, True)
        assert "nothing is sent again" in again.json()["detail"]
    assert len(world.sent("OHS")) == 1


@pytest.mark.parametrize("key", ["", "a b", "x" * 256])
def test_a_key_that_is_none_is_refused(key: str, world: World) -> None:
    @in_virtual_time
    async def story() -> None:
        async with world.gateway() as plant, client(plant) as http:
            answer = await http.post(MOVES, json=relative(), headers={"idempotency-key": key})
            assert answer.status_code == 422
        assert world.sent("1+M") == []

    story()


@in_virtual_time
async def test_a_stop_with_a_key_goes_out_without_a_disk(world: World) -> None:
    world.folder.write_text("in the way")
    async with world.gateway() as plant, client(plant) as http:
        assert (await http.post("/bodies/3F/stop", headers=KEY)).json()["confirmed"]
        move = await http.post(MOVES, json=relative(), headers=KEY)
        assert (move.status_code, move.json()["type"][-19:]) == (503, "journal-unavailable")


def _long() -> Any:
    from protocols.rorze.moves import MoveClockwise

    return MoveClockwise(distance=20_000)


@in_virtual_time
async def test_a_key_for_a_request_is_worth_nothing_to_others(world: World, tmp_path: Path) -> None:
    keys = Keys(tmp_path / "keys")
    world.text = world.text.replace(OPEN, "")
    mes, guest = keys.header("operator"), keys.header("operator", "line1")
    async with world.gateway() as plant, client(plant, keys.credentials) as http:
        assert (await http.post(MOVES, json=relative(), headers={**KEY, **mes})).status_code == 202
        assert (await http.post(MOVES, json=relative(), headers=KEY)).status_code == 401
        theirs = await http.post(MOVES, json=relative(), headers={**KEY, **guest})
        again = await http.post(MOVES, json=relative(), headers={**KEY, **mes})
    assert (theirs.status_code, is_replayed(theirs)) == (409, False)
    assert (again.status_code, is_replayed(again)) == (202, True)
    assert [row["caller"] for row in world.rows("intents") if row["key"]] == ["operator (http 127.0.0.1)"]


@in_virtual_time
async def test_a_body_that_no_route_takes_is_refused_before_it_is_kept(world: World) -> None:
    async with world.gateway() as plant, client(plant) as http:
        answer = await http.post(MOVES, content=b" " * 300_000, headers=KEY)
    assert answer.status_code == 413
    assert answer.json()["moved"] == "no"


@in_virtual_time
async def test_a_key_without_the_right_is_refused_before_the_body_is_read(
    world: World, tmp_path: Path
) -> None:
    keys = Keys(tmp_path / "keys")
    world.text = world.text.replace(OPEN, "")

    async def body() -> AsyncIterator[bytes]:
        raise AssertionError("the body was read")
        yield b""

    headers = {**KEY, **keys.header("viewer"), "content-type": "application/json", "content-length": "250000"}
    async with world.gateway() as plant, client(plant, keys.credentials) as http:
        answer = await http.post(MOVES, content=body(), headers=headers)
    assert (answer.status_code, answer.json()["moved"]) == (403, "no")


@in_virtual_time
@pytest.mark.parametrize(("depth", "status"), [(100, 400), (30_000, 422), (100_000, 413)])
async def test_nested_json_with_a_key_is_the_clients_mistake(world: World, depth: int, status: int) -> None:
    async with world.gateway() as plant, client(plant) as http:
        answer = await http.post(
            MOVES, content=b"[" * depth, headers={**KEY, "content-type": "application/json"}
        )
    assert (answer.status_code, answer.json()["moved"]) == (status, "no")


@in_virtual_time
async def test_a_read_is_never_answered_with_an_old_value(world: World) -> None:
    path = "/bodies/3F/commands/get-position"
    async with world.gateway() as plant, client(plant) as http:
        before = await http.post(path, json={}, headers=KEY)
        await http.post(f"{MOVES}?wait=30", json=relative(777))
        after = await http.post(path, json={}, headers=KEY)
        assert not is_replayed(after)
        assert after.json() != before.json()
        assert str(777) in after.text
        await http.post("/tickets", headers=KEY)
    assert world.rows("keys") == []  # and none is written down for it


@in_virtual_time
async def test_the_answers_of_one_caller_are_bounded(world: World, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("gateway.door.keys.MOST_OF_ONE", 3)
    monkeypatch.setattr("gateway.door.keys.COUNTED_EVERY", 4)
    async with world.gateway() as plant, client(plant) as http:
        for number in range(12):
            await http.put(
                f"/bodies/3F/positions/{number}/name",
                json={"name": "a"},
                headers={"idempotency-key": f"k{number}"},
            )
    assert 3 <= len(world.rows("keys")) <= 3 + 4
