"""The simulator as a program."""

import asyncio
import json
import os
import re
import signal
import socket
import sys
import tty
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import httpx
import pytest
import typer.testing

from simulator.cli import app, demo_line, demo_robot, read_bodies, read_endpoint, read_place
from simulator.fics.dpram_port import serve_dpram
from simulator.ports import serve_pty
from tests.simulator.fics.test_dpram_port import Host

PATIENCE_S = 60.0
"""Seconds after which, on a busy machine too, a thing that has not happened never will."""
RUN = "from simulator.cli import app; app()"


@asynccontextmanager
async def running(
    machine: str, *options: str, end_by: signal.Signals = signal.SIGTERM
) -> AsyncIterator[list[str]]:
    """The program in a process of its own; gives what it says at first, and ends it."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-c", RUN, machine, *options, stdout=asyncio.subprocess.PIPE
    )
    assert process.stdout is not None
    said = [(await asyncio.wait_for(process.stdout.readline(), PATIENCE_S)).decode()]
    while "control interface" in said[-1]:
        said.append((await asyncio.wait_for(process.stdout.readline(), PATIENCE_S)).decode())
    try:
        yield said
        process.send_signal(end_by)
        assert await asyncio.wait_for(process.wait(), PATIENCE_S) == 0
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()


async def answer_of(terminal: Path, command: bytes) -> bytes:
    """The answer to a command that is written to a terminal."""
    device = os.open(terminal, os.O_RDWR | os.O_NOCTTY)
    tty.setraw(device)
    os.write(device, command)
    reply = b""
    while not reply.endswith(b"\r"):
        reply += await asyncio.to_thread(os.read, device, 100)
    os.close(device)
    return reply


@pytest.mark.anyio
async def test_a_line_over_tcp_with_control_and_truth(tmp_path: Path) -> None:
    truth = tmp_path / "truth.jsonl"
    options = ["--bodies", "00,3f", "--listen", "tcp://127.0.0.1:0", "--control", "127.0.0.1:0"]
    async with running("rc400", *options, "--truth", str(truth)) as said:
        control, line = said
        (address,) = re.findall(r"http://\S+", control)
        (port,) = re.findall(r"tcp://127.0.0.1:(\d+)", line)
        reader, writer = await asyncio.open_connection("127.0.0.1", int(port))
        async with httpx.AsyncClient(base_url=address) as http:
            await http.put("/faults", json={"fault": "lost", "direction": "requests", "next_frames": 1})
            writer.write(b"&006PD\r")
            writer.write(b"&3F6PD\r")
            assert await reader.readuntil(b"\r") == b">&3F6PD+000000000\r"
            assert (await http.get("/link")).json()["requests"] == 2
        writer.close()
    facts = [json.loads(fact) for fact in truth.read_text().splitlines()]
    assert [(fact["kind"], fact["request"]) for fact in facts if fact["request"]] == [
        ("request", 1),
        ("request", 2),
        ("command", 2),
        ("reply", 2),
    ]


@pytest.mark.anyio
async def test_a_paced_line_at_a_terminal_ends_on_ctrl_c(tmp_path: Path) -> None:
    link = tmp_path / "line"
    options = ["--bodies", "3F", "--pty", str(link), "--baud", "115200"]
    async with running("rc400", *options, end_by=signal.SIGINT):
        assert await answer_of(link, b"&3F6PD\r") == b">&3F6PD+000000000\r"
    assert not link.is_symlink()


@pytest.mark.anyio
async def test_a_line_with_a_quirk(tmp_path: Path) -> None:
    link = tmp_path / "line"
    async with running("rc400", "--bodies", "3F", "--pty", str(link), "--quirk", "wrong-mode"):
        assert await answer_of(link, b"&3FPKD\r") == b">&3FPKD@4A\r"


@pytest.mark.anyio
async def test_a_line_like_one_that_was_commissioned(tmp_path: Path) -> None:
    link, report = tmp_path / "line", tmp_path / "F.json"
    other = {"assumption": "wrong-mode", "result": "contradicts", "setting": None}
    told = {"protocol": "rorze", "line": "robot", "table": {"bodies": [{"id": "3F"}]}, "results": [other]}
    report.write_text(json.dumps(told | {"measured": {"replies_s": [0.001], "copies_s": []}}))
    async with running("--like", str(report), "--pty", str(link)) as said:
        assert said == [f"RC-400 like line robot at {link}\n"]
        assert await answer_of(link, b"&3FPKD\r") == b">&3FPKD@4A\r"


@pytest.mark.anyio
async def test_the_demo_runs_in_a_programs_own_event_loop(tmp_path: Path) -> None:
    demo = serve_pty(demo_line([0x3F]), tmp_path / "demo")
    assert await answer_of(tmp_path / "demo", b"&3F9MD\r") == b">&3F9MDH00\r"
    await demo.aclose()


@pytest.mark.anyio
async def test_the_demos_robot_has_two_units(tmp_path: Path) -> None:
    demo = serve_dpram(demo_robot(), tmp_path / "demo")
    host = Host(tmp_path / "demo")
    await host.sends(b"UNT 2\r")
    await host.sends(b"UNT\r")
    assert (await host.hears()).rstrip(b"\0") == b"UNT 2,2\r"
    host.file.close()
    await demo.aclose()


MACROS = """
[macros.UPD]
program = 7
steps = ["LMI ,,$1", "IOT 1-0:+"]
"""


@pytest.mark.anyio
async def test_a_robot_over_tcp_with_macros_control_and_truth(tmp_path: Path) -> None:
    truth, macros = tmp_path / "truth.jsonl", tmp_path / "macros.toml"
    macros.write_text(MACROS)
    options = ["--units", "2", "--macros", str(macros), "--truth", str(truth), "--terminator", "crlf"]
    ports = ["--listen", "tcp://127.0.0.1:0", "--control", "127.0.0.1:0"]
    async with running("fics", *options, *ports) as said:
        assert "Fics with 2 units of axes XYZ at tcp://" in said[1]
        (address,) = re.findall(r"http://\S+", said[0])
        (port,) = re.findall(r"tcp://127.0.0.1:(\d+)", said[1])
        reader, writer = await asyncio.open_connection("127.0.0.1", int(port))
        async with httpx.AsyncClient(base_url=address) as http:
            writer.write(b"MOD 3\rUPD 0.5\r")
            assert await reader.readuntil(b"UPD\r\n") == b"MOD\r\nUPD\r\n"
            await http.put("/terminal/activity", json={"activity": "editing"})
            writer.write(b"UPD 0.5\r")
            assert await reader.readuntil(b"\r\n") == b"UPD E03\r\n"
            assert (await http.get("/system")).json()["outputs"] == [1, 0, 0, 0]
            await http.put("/system/power", json={"on": False})
        writer.close()
    facts = [json.loads(fact) for fact in truth.read_text().splitlines()]
    kinds = [fact["kind"] for fact in facts if fact["request"] == 2]
    assert kinds == ["request", "motion_start", "axis_start", "command", "reply"]
    (stop,) = (fact for fact in facts if fact["kind"] == "axis_stop")
    assert (stop["body"], stop["axis"], stop["place"]) == ("01", "Z", 0.5)


@pytest.mark.anyio
async def test_a_paced_robot_at_a_terminal(tmp_path: Path) -> None:
    link = tmp_path / "robot"
    async with running("fics", "--axes", "Z@W", "--pty", str(link), "--baud", "56000") as said:
        assert said == [f"Fics with 1 unit of axes Z@W at {link}\n"]
        assert await answer_of(link, b"ASD\r") == b"ASD 0,0,0\r"
    assert not link.is_symlink()


@pytest.mark.anyio
async def test_a_robot_behind_a_dual_port_ram(tmp_path: Path) -> None:
    path = tmp_path / "ram"
    async with running("fics", "--dpram", str(path), "--control", "127.0.0.1:0") as said:
        (address,) = re.findall(r"http://\S+", said[0])
        ram = Host(path)
        async with httpx.AsyncClient(base_url=address) as http:
            await http.put("/dpram/stalled", json={"on": True})
            await ram.sends(b"MOD\r")
            assert (await http.get("/dpram")).json()["host_flag"] == 1
            await http.put("/dpram/stalled", json={"on": False})
            assert (await ram.hears()).rstrip(b"\0") == b"MOD 2\r"
        ram.file.close()
    assert not path.exists()


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        ([], "give one of --pty PATH, --listen tcp://HOST:PORT and --dpram FILE"),
        (["--pty", "x", "--dpram", "y"], "give one of --pty PATH"),
        (["--listen", "h:1"], "--listen tcp://HOST:PORT"),
        (["--pty", "x", "--units", "0"], "there can be 1 to 9 units, not 0"),
        (["--pty", "x", "--units", "two"], "'two' is not a valid int"),
        (["--pty", "x", "--axes", "XQ"], "'XQ' is no set of axes; take each of XYZ@W at most once"),
        (["--pty", "x", "--macros", "none.toml"], "none.toml cannot be read: No such file"),
        (["--pty", "x", "--terminator", "lf"], "'lf' is not one of 'cr', 'crlf'"),
        (
            ["--dpram", "x", "--baud", "9600"],
            "--baud is the speed of a serial line; leave it out with --dpram",
        ),
        (["--pty", "x", "--baud", "10"], "300"),
        (["--pty", "x", "--control", "8421"], "'8421' is not HOST:PORT"),
        (["--pty", "x", "--bodies", "00"], "No such option"),
    ],
)
def test_wrong_options_of_a_robot_are_told_in_a_sentence(options: list[str], complaint: str) -> None:
    result = typer.testing.CliRunner().invoke(app, ["fics", *options])
    assert result.exit_code == 2
    assert complaint in re.sub(r"[\s│]+", " ", result.output)


@pytest.mark.parametrize("option", ["--dpram", "--truth"])
def test_a_file_that_cannot_be_made_is_told_in_a_sentence(option: str, tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    place = [] if option == "--dpram" else ["--listen", "tcp://127.0.0.1:0"]
    result = typer.testing.CliRunner().invoke(app, ["fics", option, str(tmp_path / "file" / "x"), *place])
    assert result.exit_code == 1
    assert result.output.startswith("The simulated line did not start: ")


@pytest.mark.parametrize(
    ("options", "complaint"),
    [
        (["--bodies", "00"], "either --pty PATH or --listen"),
        (["--bodies", "00", "--pty", "x", "--listen", "tcp://h:1"], "either --pty PATH or --listen"),
        (["--bodies", "00", "--listen", "h:1"], "either --pty PATH or --listen"),
        (["--bodies", "80", "--pty", "x"], "no body number"),
        (["--bodies", "00,00", "--pty", "x"], "listed twice"),
        (["--bodies", "00", "--pty", "x", "--control", "8421"], "not HOST:PORT"),
        (["--bodies", "00", "--pty", "x", "--baud", "10"], "300"),
    ],
)
def test_wrong_options_are_told_in_a_sentence(options: list[str], complaint: str) -> None:
    result = typer.testing.CliRunner().invoke(app, ["rc400", *options])
    assert result.exit_code == 2
    assert complaint in re.sub(r"[\s│]+", " ", result.output)


def test_a_port_that_is_taken_is_told_in_a_sentence() -> None:
    with socket.create_server(("127.0.0.1", 0)) as taken:
        listen = f"tcp://127.0.0.1:{taken.getsockname()[1]}"
        result = typer.testing.CliRunner().invoke(app, ["rc400", "--bodies", "00", "--listen", listen])
    assert result.exit_code == 1
    assert result.output.startswith("The simulated line did not start: ")


def test_options_are_read_to_the_last_character() -> None:
    assert read_bodies("00, 3f,77") == (0x00, 0x3F, 0x77)
    assert read_endpoint("localhost:80") == ("localhost", 80)
    assert read_endpoint("[::1]:80") == ("::1", 80)
    assert read_place(Path("line"), None) == Path("line")
    assert read_place(None, "tcp://h:1") == ("h", 1)
    for wrong in ("h", "h:", ":80", "h:80/", "h:99999", "u@h:80", "h:80?x"):
        with pytest.raises(ValueError, match="not HOST:PORT"):
            read_endpoint(wrong)
