"""The Python client against the demo: it moves a motor, loses its stream, and misses nothing."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from datetime import datetime
from pathlib import Path
from typing import Final

import pytest
from motion_gateway_client import AsyncGateway, Gateway, MoveNotOver, MoveNotSucceeded, Refused
from motion_gateway_client.generated.types import Event, Move, RelativeMoveRequest, UnitStatus

from benchmarks.processes import free_port
from tests.clients.proxy import Cable
from tests.e2e import processes
from tests.e2e.processes import PATIENCE_S, simulated_line, until, write_config

NEWS = ["body.move.*", "body.stop.*"]
LAST: Final = "body.move.succeeded"


def ends(event: Event, move: Move) -> bool:
    return event["type"] == LAST and event["data"]["id"] == move["id"]


def by(pulses: int) -> RelativeMoveRequest:
    return {"kind": "relative", "direction": "cw", "distance": {"value": pulses, "unit": "pulse"}}


@pytest.fixture
def gateway(demo: str) -> Iterator[Gateway]:
    with Gateway(demo, timeout=PATIENCE_S) as gateway:
        yield gateway


def all_since(gateway: Gateway, cursor: str) -> list[str]:
    page = gateway.list_events(after=cursor, bodies="3F", types=",".join(NEWS), limit=1000)
    return [event["id"] for event in page["events"]]


def now(gateway: Gateway) -> str:
    """The cursor after everything so far, which a move tells."""
    return gateway.wait_for_move(gateway.start_move("3F", by(1)))["event_cursor"]


def test_it_moves_a_motor_and_waits_for_the_end(gateway: Gateway) -> None:
    planned = gateway.plan_move("3F", by(500))
    assert planned["frame"].startswith("&3F1+M")

    move = gateway.start_move("3F", by(500))
    ended = gateway.wait_for_move(move, timeout=PATIENCE_S)

    assert ended["position"] == (ended["start_position"] or 0) + 500
    assert gateway.get_position("3F")["pulses"] == ended["position"]
    assert gateway.command("3F", "get-position")["pulses"] == ended["position"]


def test_its_stream_loses_the_connection_resumes_and_misses_nothing(gateway: Gateway, cable: Cable) -> None:
    after = now(gateway)
    seen: list[Event] = []
    with Gateway(cable.url) as watching:
        events = watching.events(bodies=["3F"], types=NEWS, after=after)
        while not seen or seen[-1]["type"] != LAST:
            seen.append(next(events))
        for _ in range(2):
            cable.pull()
            gateway.wait_for_move(gateway.start_move("3F", by(700)))
            missed = gateway.wait_for_move(gateway.start_move("3F", by(300)))
            cable.plug()
            while not ends(seen[-1], missed):
                seen.append(next(events))
    assert [event["id"] for event in seen] == all_since(gateway, after)
    assert len([event for event in seen if event["type"] == LAST]) == 5


def test_its_stream_goes_on_over_a_restart_in_the_middle_of_a_move(tmp_path: Path) -> None:
    with simulated_line(tmp_path) as line:
        config = write_config(line, "gateway")
        config.write_text(config.read_text().replace("port = 0", f"port = {free_port()}"))
        server = processes.Gateway(config).wait_until_ready()
        with Gateway(server.url, timeout=PATIENCE_S) as gateway:
            events = gateway.events(bodies=["3F"], types=NEWS, after=now(gateway))
            move = gateway.start_move("3F", by(10_000))
            seen = [next(events)]
            server.kill()
            server.start()
            server.wait_until_ready()
            while not ends(seen[-1], move):
                seen.append(next(events))
            told = [event["id"] for event in seen]
            assert len(set(told)) == len(told)
            assert set(all_since(gateway, move["event_cursor"])) <= set(told)
        server.end()


def test_live_values_come_while_somebody_watches(gateway: Gateway) -> None:
    values = gateway.events(bodies=["3F"], types=["body.position"], sample=20)
    first, second = next(values), next(values)
    assert (first["type"], first["subject"]) == (second["type"], second["subject"])
    assert first["data"] == second["data"]
    assert first["id"] != second["id"]


def test_a_stream_that_breaks_before_its_first_event_misses_nothing(gateway: Gateway, cable: Cable) -> None:
    with Gateway(cable.url) as watching:
        events = watching.events(bodies=["00"], types=[LAST])
        with ThreadPoolExecutor(1) as pool:
            first = pool.submit(next, events)  # a generator runs only while it is asked
            until(lambda: b"events after" in cable.answers, "the stream has begun")
            cable.pull()
            move = gateway.wait_for_move(gateway.start_move("00", by(5)))
            cable.plug()
            event = first.result(PATIENCE_S)
    assert ends(event, move)


@pytest.mark.anyio
async def test_the_client_for_asyncio_does_the_same(gateway: Gateway, cable: Cable) -> None:
    after = now(gateway)
    seen: list[Event] = []
    async with AsyncGateway(cable.url) as client:
        move = await client.start_move("3F", by(400))
        cable.pull()
        cable.plug()
        await client.wait_for_move(move, timeout=PATIENCE_S)
        async for event in client.events(bodies=["3F"], types=NEWS, after=after):
            seen.append(event)
            if ends(event, move):
                break
            cable.pull()
            cable.plug()
    assert [event["id"] for event in seen] == all_since(gateway, after)


def test_a_stop_ends_a_move_and_its_waiting(gateway: Gateway) -> None:
    move = gateway.start_move("3F", by(5_000_000))
    with pytest.raises(MoveNotOver, match=r"not over in 0\.05 s"):
        gateway.wait_for_move(move, timeout=0.05)

    assert gateway.stop("3F")["confirmed"]

    with pytest.raises(MoveNotSucceeded) as caught:
        gateway.wait_for_move(move)
    assert caught.value.move["status"] == "stopped"
    assert {body["state"] for body in gateway.stop()["bodies"]} == {"confirmed"}


def test_a_refusal_says_what_the_motor_did_and_what_to_do_next(gateway: Gateway) -> None:
    with pytest.raises(Refused) as caught:
        gateway.start_move("55", by(5))
    problem = caught.value
    assert (problem.kind, problem.status, problem.moved, problem.retryable) == ("not-found", 404, "no", False)
    assert "55" in problem.detail
    assert problem.request_id

    with pytest.raises(Refused) as caught:
        gateway.start_move("3F", by(5), idempotency_key="order 7")
    assert "Idempotency-Key" in caught.value.detail


def test_a_jog_moves_for_as_long_as_the_block_runs(gateway: Gateway) -> None:
    after = now(gateway)
    with gateway.jog("r1", unit=2, axis="X", direction="+") as session:
        begun = gateway.get_unit_status("r1", 2)
        # Longer than the dead man waits.
        until(lambda: seconds_between(begun, gateway.get_unit_status("r1", 2)) > 1.2, "it jogs on")
        assert gateway.get_unit_status("r1", 2)["axes"]["X"]["motion"] == "jog"
    assert not gateway.get_unit_status("r1", 2)["moving"]
    events = gateway.list_events(after=after, bodies="r1", types="robot.jog.*", limit=1000)["events"]
    assert [event["type"] for event in events][-1] == "robot.jog.ended"
    assert "robot.jog.lost" not in [event["type"] for event in events]
    assert session["unit"] == 2


def test_a_body_jogs_for_as_long_as_the_block_runs(gateway: Gateway) -> None:
    with gateway.jog_body("3F", direction="cw") as session:
        until(lambda: gateway.get_status("3F")["moving"], "it jogs")
    assert not gateway.get_status("3F")["moving"]
    assert gateway.get_move("3F", session["id"])["kind"] == "jog"


def test_nobody_else_moves_what_is_leased(gateway: Gateway, demo: str) -> None:
    with gateway.lease("3F", ttl_s=30) as lease, Gateway(demo, timeout=PATIENCE_S) as other:
        with pytest.raises(Refused) as caught:
            other.start_move("3F", by(5))
        assert (caught.value.kind, caught.value.moved) == ("lease", "no")
        gateway.wait_for_move(gateway.start_move("3F", by(5)))
    assert lease["lease"] not in [lease["lease"] for lease in gateway.list_leases()["leases"]]


def seconds_between(first: UnitStatus, second: UnitStatus) -> float:
    times = [datetime.fromisoformat(status["read_at"]) for status in (first, second)]
    return (times[1] - times[0]).total_seconds()
