"""A hand in the plant, over HTTP."""

from collections.abc import AsyncIterator, Callable
from typing import Any, TypeVar

import httpx
import pytest

from simulator.rorze.control import create_control
from simulator.rorze.line import Rc400Line, build_line

T = TypeVar("T")


class Bench:
    """A line on a bench, with a clock that is set by hand."""

    def __init__(self) -> None:
        self.now = 0.0
        self.line: Rc400Line = build_line([0x00, 0x3F], 0.0)
        transport = httpx.ASGITransport(create_control(self.line, self))
        self.http = httpx.AsyncClient(transport=transport, base_url="http://control")

    def touch(self, deed: Callable[[float], T]) -> T:
        return deed(self.now)

    def ask(self, command: str) -> str:
        self.line.receive(command.encode() + b"\r", self.now)
        return self.line.take_output(self.now).decode()

    async def change(self, method: str, path: str, **body: object) -> Any:
        response = await self.http.request(method, path, json=body)
        assert response.is_success, response.text
        return response.json() if response.content else None


@pytest.fixture
async def bench(anyio_backend: str) -> AsyncIterator[Bench]:
    bench = Bench()
    async with bench.http:
        yield bench


@pytest.mark.anyio
async def test_the_state_of_a_body_is_what_it_tells_itself(bench: Bench) -> None:
    bench.ask("&3F6PS-500")
    state = (await bench.http.get("/bodies/3f")).json()
    assert (state["body"], state["powered"], state["moving"], state["position"]) == ("3F", True, False, -500)
    assert state["mechanics"]["origin"] == {"first": -1000, "last": -800}
    assert [body["body"] for body in (await bench.http.get("/bodies")).json()] == ["00", "3F"]


@pytest.mark.anyio
async def test_an_ems_switch_pressed_by_hand_stops_the_motor(bench: Bench) -> None:
    bench.ask("&7FXRSM1")
    bench.ask("&3F1+M100000")
    bench.now = 0.5
    state = await bench.change("PUT", "/bodies/3F/sensors/ems", on=True)
    assert not state["moving"]
    assert state["sensors"]["ems"]
    assert bench.line.take_output(0.5) == b">&7D1+M[3F:08]\r"
    assert bench.ask("&3F1+M5") == ">&3F1+M@51\r"
    await bench.change("PUT", "/bodies/3F/sensors/ems", on=None)
    assert bench.ask("&3F1+M5") == ">&3F1+M\r"


@pytest.mark.anyio
async def test_an_input_is_set_and_reported(bench: Bench) -> None:
    for command in ("&7FXID", "&3FEMSI:H0008", "&3FESSI"):
        bench.ask(command)
    state = await bench.change("PUT", "/bodies/3F/inputs/3", on=True)
    assert state["inputs"] == 8
    bench.now = 1.0  # the input's noise filter has made up its mind
    assert bench.line.take_output(1.0) == b">&7EXED[3F:I:H0008]\r"
    assert bench.ask("&3FCID") == ">&3FCIDH0008\r"


@pytest.mark.anyio
async def test_a_limit_sensor_moved_into_the_way_ends_the_move_there(bench: Bench) -> None:
    mechanics = {"cw_limit": {"first": 700, "last": 900}, "slits": {"phase": 5, "period": 400}, "slipped": 0}
    mechanics["encoder"] = 2.5
    state = await bench.change("PATCH", "/bodies/3F/mechanics", **mechanics)
    assert state["mechanics"] == mechanics | {
        "origin": {"first": -1000, "last": -800},
        "ccw_limit": {"first": -1001000, "last": -1000000},
    }
    bench.ask("&7FXRSM1")
    bench.ask("&3F1+M2000")
    bench.now = 10.0
    assert bench.line.take_output(10.0) == b">&7D1+M[3F:02]\r"
    assert bench.ask("&3F6PD") == ">&3F6PD+000000700\r"


@pytest.mark.anyio
async def test_power_is_cut_and_restored(bench: Bench) -> None:
    bench.ask("&3F6PS77")
    assert not (await bench.change("PUT", "/bodies/3F/power", on=False))["powered"]
    assert bench.ask("&3F6PD") == ""
    assert (await bench.change("PUT", "/bodies/3F/power", on=True))["powered"]
    assert bench.ask("&3F6PD") == ">&3F6PD+000000000\r"

    assert not (await bench.change("PUT", "/link/power", on=False))["powered"]
    assert bench.ask("&3F6PD") == ""
    assert (await bench.change("PUT", "/link/power", on=True))["powered"]
    assert bench.ask("&3F6PD") == ">&3F6PD+000000000\r"


@pytest.mark.anyio
async def test_a_brown_out_ends_unasked(bench: Bench) -> None:
    bench.ask("&3F6PS77")
    assert not (await bench.change("POST", "/bodies/3F/brown-outs", for_s=0.05))["powered"]
    bench.now = 0.04
    assert bench.ask("&3F6PD") == ""
    bench.now = 0.05
    assert bench.ask("&3F6PD") == ">&3F6PD+000000000\r"


@pytest.mark.anyio
async def test_what_is_not_known_of_a_controller_can_be_changed(bench: Bench) -> None:
    bench.ask("&3F6PS77")
    bench.ask("&3F9VS1,ABC")
    await bench.change("PATCH", "/bodies/3F/settings", keeps_position=True, keeps_comments=True)
    await bench.change("PUT", "/bodies/3F/power", on=False)
    await bench.change("PUT", "/bodies/3F/power", on=True)
    assert bench.ask("&3F6PD") == ">&3F6PD+000000077\r"
    assert bench.ask("&3F9VD1") == ">&3F9VDABC\r"


@pytest.mark.anyio
async def test_link_settings_are_changed_one_by_one(bench: Bench) -> None:
    await bench.change("PATCH", "/link/settings", absent_bodies="error")
    state = await bench.change("PATCH", "/link/settings", error_codes=False)
    assert state["settings"] == {
        "reply_delay_s": 0.0,
        "error_codes": False,
        "absent_bodies": "error",
        "interjection": "accept",
        "partners": "go_on",
        "line_end": "\r",
        "excess_line_ends": "invalid",
        "reply_order": "in_turn",
        "introducers": "&$#",
        "set_up": "forgotten",
        "overlong": "refused",
        "echoes": False,
    }
    assert bench.ask("&056PD") == ">&056PD@\r"
    assert (await bench.http.get("/link")).json()["requests"] == 1


@pytest.mark.anyio
async def test_faults_are_switched(bench: Bench) -> None:
    (fault,) = await bench.change("PUT", "/faults", fault="lost", direction="requests", next_frames=1)
    assert fault["probability"] == 0
    assert bench.ask("&3F6PD") == ""
    assert (await bench.http.get("/faults")).json() == []
    await bench.change("PUT", "/faults", fault="lost", direction="replies", probability=1)
    assert bench.ask("&3F6PD") == ""
    await bench.change("DELETE", "/faults")
    assert bench.ask("&3F6PD") == ">&3F6PD+000000000\r"


@pytest.mark.anyio
async def test_the_truth_is_read_page_by_page(bench: Bench) -> None:
    bench.ask("&3F6PD")
    first = (await bench.http.get("/truth", params={"limit": 1})).json()
    assert first["facts"][0]["kind"] == "request"
    rest = (await bench.http.get("/truth", params={"after": first["next"]})).json()
    assert [(fact["kind"], fact["request"]) for fact in rest["facts"]] == [("command", 1), ("reply", 1)]
    assert (await bench.http.get("/truth", params={"after": rest["next"]})).json()["facts"] == []


@pytest.mark.anyio
async def test_a_controller_breaks_down(bench: Bench) -> None:
    await bench.change("PUT", "/bodies/3F/errors", code="4E", next_commands=2)
    assert (bench.ask("&3F6PS7"), bench.ask("&3F6PD")) == (">&3F6PS@4E\r", ">&3F6PD@4E\r")
    assert bench.ask("&3F6PD") == ">&3F6PD+000000000\r"
    assert (await bench.change("PUT", "/bodies/3F/errors", code="4B"))["status"] == 0
    assert (bench.ask("&3F9CD"), bench.ask("&3F9CD")) == (">&3F9CD@4B\r", ">&3F9CDH80\r")


@pytest.mark.anyio
async def test_flash_memory_is_damaged(bench: Bench) -> None:
    await bench.change("PUT", "/bodies/3F/flash", damaged=True)
    await bench.change("PUT", "/bodies/3F/power", on=False)
    assert (await bench.change("PUT", "/bodies/3F/power", on=True))["status"] == 0x10
    assert bench.ask("&3F9CD4") == ">&3F9CD1\r"


@pytest.mark.anyio
async def test_a_user_programs_text_is_sent(bench: Bench) -> None:
    bench.ask("&7FXID")
    await bench.change("POST", "/bodies/3F/messages", text="DONE")
    assert bench.line.take_output(0.0) == b">&7CUSD[3F:DONE]\r"


@pytest.mark.anyio
@pytest.mark.parametrize(
    ("method", "path", "body", "status"),
    [
        ("GET", "/bodies/05", None, 404),
        ("GET", "/bodies/80", None, 422),
        ("PUT", "/bodies/3F/power", {"on": 1}, 422),
        ("PUT", "/bodies/3F/inputs/10", {"on": True}, 422),
        ("PUT", "/bodies/3F/sensors/door", {"on": True}, 422),
        ("PATCH", "/bodies/3F/mechanics", {"origin": {"first": "1", "last": 2}}, 422),
        ("PATCH", "/bodies/3F/mechanics", {"dog": 1}, 422),
        ("PATCH", "/bodies/3F/mechanics", {"encoder": 1e-320}, 422),
        ("PATCH", "/bodies/3F/mechanics", {"encoder": 1e308}, 422),
        ("PATCH", "/bodies/3F/mechanics", {"slipped": 10**400}, 422),
        ("PUT", "/faults", {"fault": "lost", "direction": "requests", "probability": 1.5}, 422),
        ("PUT", "/faults", {"fault": "cursed", "direction": "requests"}, 422),
        ("POST", "/bodies/3F/messages", {"text": "A]B\r>"}, 422),
        ("GET", "/truth?limit=0", None, 422),
        ("PUT", "/bodies/3F/errors", {"code": "50"}, 422),
        ("PUT", "/bodies/3F/errors", {"code": "4e"}, 422),
        ("PUT", "/bodies/3F/errors", {"code": "4E", "next_commands": -1}, 422),
        ("PUT", "/bodies/3F/flash", {"damaged": 1}, 422),
    ],
)
async def test_nonsense_is_refused(
    bench: Bench, method: str, path: str, body: dict[str, object] | None, status: int
) -> None:
    response = await bench.http.request(method, path, json=body)
    assert response.status_code == status
    assert response.json()["detail"]
