"""A hand in the robot, over HTTP."""

from collections.abc import AsyncIterator, Callable
from pathlib import Path
from typing import Any, TypeVar

import httpx
import pytest

from simulator.fics.control import create_control
from simulator.fics.dpram_port import serve_dpram
from simulator.fics.layout import Layout
from tests.simulator.fics.bench import Bench as Line
from tests.simulator.fics.test_dpram_port import Host

T = TypeVar("T")

pytestmark = pytest.mark.anyio


class Bench(Line):
    """A robot of two units on a bench, with a clock that is set by hand."""

    def __init__(self) -> None:
        super().__init__(Layout(units=2))
        transport = httpx.ASGITransport(create_control(self.line, self))
        self.http = httpx.AsyncClient(transport=transport, base_url="http://control")

    def touch(self, deed: Callable[[float], T]) -> T:
        return deed(self.now)

    async def change(self, method: str, path: str, **body: object) -> Any:
        response = await self.http.request(method, path, json=body)
        assert response.is_success, response.text
        return response.json() if response.content else None

    async def look(self, path: str) -> Any:
        return (await self.http.get(path)).json()


@pytest.fixture
async def bench(anyio_backend: str) -> AsyncIterator[Bench]:
    bench = Bench()
    async with bench.http:
        yield bench


# The system


async def test_the_state_of_the_system_is_told(bench: Bench) -> None:
    bench.asked("UNT 2", "IOT 1-3:+", "POF 1,7")
    bench.now = 12.5
    assert await bench.look("/system") == {
        "time_s": 12.5,
        "powered": True,
        "mode": 3,
        "host_unit": 2,
        "fics_unit": 2,
        "states": [],
        "uploading": 7,
        "moving": None,
        "error": None,
        "inputs": [0, 0, 0, 0],
        "outputs": [8, 0, 0, 0],
        "requests": 4,
    }


async def test_what_moves_is_told_at_any_moment(bench: Bench) -> None:
    bench.ask("MMI 45,,-30")
    bench.now = 0.2
    system, unit = await bench.look("/system"), await bench.look("/units/1")
    assert (system["moving"], system["states"]) == ("MMI", ["c", "d"])
    assert unit["moving"]
    a, _, z = (motor["place"] for motor in unit["motors"])
    assert 0 < a < 45
    assert z == pytest.approx(-30 * a / 45)
    bench.finish()
    unit = await bench.look("/units/1")
    assert (unit["moving"], unit["motors"][0]["place"], unit["user_places"]["Z"]) == (False, 45.0, -30.0)


async def test_power_is_cut_and_restored(bench: Bench) -> None:
    bench.home()
    bench.ask("LMI ,,50")
    bench.now += 0.1
    assert not (await bench.change("PUT", "/system/power", on=False))["powered"]
    assert bench.ask("MOD") == []
    state = await bench.change("PUT", "/system/power", on=True)
    assert (state["powered"], state["mode"], state["moving"]) == (True, 2, None)
    assert bench.ask("MOD") == ["MOD 2"]
    assert bench.ask("APS") == ["APS #####,#####,#####"]


async def test_a_brown_out_ends_unasked(bench: Bench) -> None:
    assert not (await bench.change("POST", "/system/brown-outs", for_s=0.05))["powered"]
    bench.now += 0.1
    state = await bench.look("/system")
    assert (state["powered"], state["mode"]) == (True, 2)


async def test_the_stop_input_stops_and_lasts(bench: Bench) -> None:
    bench.ask("LMI ,,50")
    bench.now = 0.1
    assert (await bench.change("PUT", "/system/stop-input", on=True))["error"] == 1
    assert bench.heard() == ["LMI 001"]
    assert bench.ask("ACD") == ["ACD 5000,5000,5000"]
    bench.asked("DRT")
    assert bench.ask("ERR") == ["ERR 001"]
    await bench.change("PUT", "/system/stop-input", on=False)
    bench.asked("DRT")
    assert bench.ask("ERR") == ["ERR E00"]


@pytest.mark.parametrize(
    ("error", "answer"),
    [
        ({"code": 205, "program": 12, "step": 34}, "ERR 205"),
        ({"code": 311}, "ERR 311"),
        ({"program": 999, "step": 1}, "ERR 004"),
    ],
)
async def test_errors_of_the_system_happen(bench: Bench, error: dict[str, object], answer: str) -> None:
    bench.ask("LMI ,,50")
    await bench.change("POST", "/system/errors", **error)
    assert bench.heard() == [answer.replace("ERR", "LMI")]
    assert bench.ask("ERR") == [answer]
    bench.asked("DRT")
    assert bench.ask("ERR") == ["ERR E00"]


async def test_inputs_are_set(bench: Bench) -> None:
    assert (await bench.change("PUT", "/inputs/2", bits=0xA5))["inputs"] == [0, 0xA5, 0, 0]
    assert bench.ask("IDI 2") == ["IDI A5"]


# The teaching terminal


@pytest.mark.parametrize(
    ("activity", "state", "error", "positions", "status"),
    [
        ("automatic", "a", "E01", "#####", "4"),
        ("homing", "a", "E01", "#####", "3"),
        ("jog", "a", "E01", "0.00", "1"),
        ("editing", "b", "E03", "0.00", "0"),
    ],
)
async def test_the_teaching_terminal_keeps_the_host_out(
    bench: Bench, activity: str, state: str, error: str, positions: str, status: str
) -> None:
    bench.home()
    assert (await bench.change("PUT", "/terminal/activity", activity=activity))["states"] == [state]
    assert bench.ask("LMI ,,1") == [f"LMI {error}"]
    assert bench.ask("MPS") == [f"MPS {positions},{positions},{positions}"]
    assert bench.ask("ACD")[0].startswith(f"ACD {status}")
    assert (await bench.change("PUT", "/terminal/activity", activity=None))["states"] == []
    assert bench.do("LMI ,,1") == ["LMI"]


async def test_one_activity_ends_the_other(bench: Bench) -> None:
    await bench.change("PUT", "/terminal/activity", activity="editing")
    assert bench.ask("AES") == ["AES E03"]
    assert (await bench.change("PUT", "/terminal/activity", activity="jog"))["states"] == ["a"]
    assert bench.ask("AES") == ["AES"]


async def test_the_terminal_selects_a_unit_of_its_own(bench: Bench) -> None:
    await bench.change("PUT", "/terminal/unit", unit=2)
    assert bench.ask("UNT") == ["UNT 1,2"]


# Drivers and sensors


async def test_a_driver_reports_an_error(bench: Bench) -> None:
    bench.ask("MMI 45")
    bench.now = 0.1
    state = await bench.change("PATCH", "/units/1/motors/B/driver", error=0x31)
    assert (state["motors"][1]["driver_error"], state["moving"]) == (0x31, False)
    assert bench.heard() == ["MMI 002"]
    assert bench.ask("ACD") == ["ACD 0200,0831,0200"]
    bench.asked("DRT")
    assert bench.do("MMI 1") == ["MMI"]


async def test_a_driver_that_falls_silent_is_not_known_any_more(bench: Bench) -> None:
    bench.home()
    await bench.change("PATCH", "/units/1/motors/Z/driver", answers=False)
    assert bench.ask("ERR") == ["ERR 003"]
    assert bench.ask("MPS") == ["MPS 0.00,0.00,#####"]
    await bench.change("PATCH", "/units/1/motors/Z/driver", answers=True)
    bench.asked("DRT")
    assert bench.ask("MPS") == ["MPS 0.00,0.00,0.00"]


async def test_a_sensor_is_held_and_let_go(bench: Bench) -> None:
    path = "/units/1/motors/Z/sensors"
    state = await bench.change("PUT", f"{path}/origin", on=True)
    assert state["motors"][2]["sensors"] == {"origin": True, "plus_limit": False, "minus_limit": False}
    assert bench.ask("ASD") == ["ASD 0,0,1"]
    await bench.change("PUT", f"{path}/origin", on=None)
    assert bench.ask("ASD") == ["ASD 0,0,0"]
    bench.ask("LMI ,,50")
    bench.now = 0.1
    assert not (await bench.change("PUT", f"{path}/plus_limit", on=True))["moving"]
    assert bench.heard() == ["LMI 002"]


# The line


async def test_line_settings_are_changed_one_by_one(bench: Bench) -> None:
    await bench.change("PATCH", "/line/settings", reply_delay_s=0.5)
    settings = await bench.change("PATCH", "/line/settings", terminator="crlf")
    expected = {"reply_delay_s": 0.5, "terminator": "crlf", "boot_s": 0.0}
    expected |= {"hears": "either", "half_commands": "refused", "echoes": False}
    assert settings == await bench.look("/line/settings") == expected
    assert bench.ask("MOD") == []
    bench.now = 0.5
    assert bench.line.take_output(0.5) == b"MOD 3\r\n"


async def test_faults_are_switched(bench: Bench) -> None:
    (fault,) = await bench.change("PUT", "/faults", fault="lost", direction="requests", next_frames=1)
    assert fault["probability"] == 0
    assert bench.ask("MOD") == []
    assert await bench.look("/faults") == []
    await bench.change("PUT", "/faults", fault="lost", direction="replies", probability=1)
    assert bench.ask("MOD") == []
    await bench.change("DELETE", "/faults")
    assert bench.ask("MOD") == ["MOD 3"]


FAULTS = {
    "silence": [b"", b"", b"MOD 3\r"],
    "lost": [b"", b"MOD 3\r", b"MOD 3\r"],
    "merged": [b"MOD 3", b"MOD 3\r", b"MOD 3\r"],
    "late": [b"", b"MOD 3\r", b"MOD 3\rMOD 3\r"],
    "doubled": [b"MOD 3\r", b"MOD 3\r", b"MOD 3\rMOD 3\r"],
}
"""Answers that the host gets at once, for a second question at once, and for a third a second later."""


@pytest.mark.parametrize("fault", FAULTS)
async def test_each_fault_hits_answers(bench: Bench, fault: str) -> None:
    await bench.change("PUT", "/faults", fault=fault, direction="replies", next_frames=1, delay_s=0.5)
    seen = []
    for moment in (0.0, 0.0, 1.0):
        bench.now = moment
        bench.line.receive(b"MOD\r", moment)
        seen.append(bench.line.take_output(moment))
    assert seen == FAULTS[fault]


async def test_the_other_faults_bend_answers(bench: Bench) -> None:
    seen = {}
    for fault in ("garbled", "noise", "split"):
        await bench.change("PUT", "/faults", fault=fault, direction="replies", next_frames=1, delay_s=0.5)
        bench.line.receive(b"MOD\r", bench.now)
        seen[fault] = bench.line.take_output(bench.now), bench.line.take_output(bench.now + 1)
        bench.now += 1
    garbled, noisy, split = seen.values()
    assert len(garbled[0]) == 6
    assert sum((was ^ now).bit_count() for was, now in zip(b"MOD 3\r", garbled[0], strict=True)) == 1
    assert noisy[0].endswith(b"MOD 3\r")
    assert len(noisy[0]) > 6
    assert b"" not in split
    assert b"".join(split) == b"MOD 3\r"


async def test_a_merged_answer_loses_both_ends_of_its_line(bench: Bench) -> None:
    await bench.change("PATCH", "/line/settings", terminator="crlf")
    await bench.change("PUT", "/faults", fault="merged", direction="replies", next_frames=1)
    bench.line.receive(b"MOD\rMOD\r", 0.0)
    assert bench.line.take_output(0.0) == b"MOD 3MOD 3\r\n"


async def test_the_truth_is_read_page_by_page(bench: Bench) -> None:
    start = (await bench.look("/truth"))["next"]
    bench.do("LMI ,,5")
    first = await bench.look(f"/truth?after={start}&limit=2")
    rest = await bench.look(f"/truth?after={first['next']}")
    kinds = [fact["kind"] for fact in first["facts"] + rest["facts"]]
    assert kinds == ["request", "axis_start", "motion_start", "command", "axis_stop", "motion_stop", "reply"]
    stop = rest["facts"][2]
    assert (stop["body"], stop["time_s"], stop["facts"]) == ("01", bench.now, {"axis": "Z", "place": 5.0})


@pytest.mark.parametrize(
    ("method", "path", "body", "status"),
    [
        ("GET", "/units/3", None, 404),
        ("GET", "/units/0", None, 422),
        ("PUT", "/units/1/motors/X/sensors/origin", {"on": True}, 404),
        ("PUT", "/units/1/motors/A/sensors/door", {"on": True}, 422),
        ("PATCH", "/units/1/motors/A/driver", {"error": 256}, 422),
        ("PATCH", "/units/1/motors/A/driver", {"alarm": 1}, 422),
        ("PUT", "/inputs/5", {"bits": 1}, 404),
        ("PUT", "/inputs/1", {"bits": 256}, 422),
        ("PUT", "/system/power", {"on": 1}, 422),
        ("POST", "/system/brown-outs", {"for_s": -1.0}, 422),
        ("POST", "/system/errors", {"code": 1000}, 422),
        ("PUT", "/terminal/activity", {"activity": "asleep"}, 422),
        ("PUT", "/terminal/activity", {}, 422),
        ("PUT", "/terminal/unit", {"unit": 3}, 404),
        ("PATCH", "/line/settings", {"terminator": "lf"}, 422),
        ("PATCH", "/system/settings", {"status_bits": ["alarm"]}, 422),
        ("PATCH", "/system/settings", {"origin_bit": "lost"}, 422),
        ("PUT", "/faults", {"fault": "cursed", "direction": "requests"}, 422),
        ("PUT", "/dpram/stalled", {"on": True}, 404),
    ],
)
async def test_nonsense_is_refused(
    bench: Bench, method: str, path: str, body: dict[str, object] | None, status: int
) -> None:
    response = await bench.http.request(method, path, json=body)
    assert response.status_code == status
    assert response.json()["detail"]


async def test_the_switches_of_the_robot_are_turned_while_it_runs(bench: Bench) -> None:
    bits = ["alarm", "moving", "servo_ready", "origin_done"]
    told = await bench.change("PATCH", "/system/settings", status_bits=bits)
    assert told["status_bits"] == bits
    assert told["stop_while_braking"] == "overtakes"
    assert bench.ask("ACD") == ["ACD 0400,0400,0400"]
    bench.home()
    assert bench.ask("ACD") == ["ACD 0C00,0C00,0C00"]


# The dual-port RAM


async def test_the_dual_port_ram_is_stalled_torn_and_littered(tmp_path: Path) -> None:
    line = Line().line
    port = serve_dpram(line, tmp_path / "ram")
    host = Host(tmp_path / "ram")
    transport = httpx.ASGITransport(create_control(line, port))
    async with httpx.AsyncClient(transport=transport, base_url="http://control") as http:
        await http.post("/dpram/messages", json={"text": "APS 1,2"})
        assert (await http.get("/dpram")).json()["fics_flag"] == 1
        assert (await host.hears()).rstrip(b"\0") == b"APS 1,2\r"

        assert (await http.put("/dpram/stalled", json={"on": True})).json()["stalled"]
        await host.sends(b"MOD\r")
        state = (await http.get("/dpram")).json()
        assert (state["host_flag"], state["fics_flag"]) == (1, 0)
        assert not (await http.put("/dpram/ends-with-cr", json={"on": False})).json()["ends_with_cr"]
        await http.put("/dpram/torn", json={"next_messages": 1, "delay_s": 0.0})
        await http.put("/dpram/stalled", json={"on": False})
        await host.sees(512, 1)
        assert (await http.get("/dpram")).json()["torn"] == {"next_messages": 0, "delay_s": 0.0}
        assert (await http.post("/dpram/messages", json={"text": "\r"})).status_code == 422
    host.file.close()
    await port.aclose()
