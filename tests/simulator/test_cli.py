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

from simulator.cli import app, read_bodies, read_endpoint, read_place, start_demo_line

RUN = "from simulator.cli import app; app()"


@asynccontextmanager
async def running(*options: str, end_by: signal.Signals = signal.SIGTERM) -> AsyncIterator[list[str]]:
    """The program in a process of its own; gives what it says at first, and ends it."""
    process = await asyncio.create_subprocess_exec(
        sys.executable, "-c", RUN, "rc400", *options, stdout=asyncio.subprocess.PIPE
    )
    assert process.stdout is not None
    said = [(await asyncio.wait_for(process.stdout.readline(), 20)).decode()]
    while "bodies" not in said[-1]:
        said.append((await asyncio.wait_for(process.stdout.readline(), 20)).decode())
    try:
        yield said
        process.send_signal(end_by)
        assert await asyncio.wait_for(process.wait(), 20) == 0
    finally:
        if process.returncode is None:
            process.kill()
            await process.wait()


@pytest.mark.anyio
async def test_a_line_over_tcp_with_control_and_truth(tmp_path: Path) -> None:
    truth = tmp_path / "truth.jsonl"
    options = ["--bodies", "00,3f", "--listen", "tcp://127.0.0.1:0", "--control", "127.0.0.1:0"]
    async with running(*options, "--truth", str(truth)) as said:
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
    async with running(*options, end_by=signal.SIGINT):
        device = os.open(link, os.O_RDWR | os.O_NOCTTY)
        tty.setraw(device)
        os.write(device, b"&3F6PD\r")
        reply = b""
        while not reply.endswith(b"\r"):
            reply += await asyncio.to_thread(os.read, device, 100)
        os.close(device)
        assert reply == b">&3F6PD+000000000\r"
    assert not link.is_symlink()


@pytest.mark.anyio
async def test_the_demo_runs_in_a_programs_own_event_loop(tmp_path: Path) -> None:
    demo = start_demo_line([0x3F], tmp_path / "demo")
    device = os.open(tmp_path / "demo", os.O_RDWR | os.O_NOCTTY)
    tty.setraw(device)
    os.write(device, b"&3F9MD\r")
    assert await asyncio.to_thread(os.read, device, 100) == b">&3F9MDH00\r"
    os.close(device)
    await demo.aclose()


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
