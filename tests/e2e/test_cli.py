"""The command line as scripts use it: exit codes, one clear sentence, and plain words of help."""

import os
import signal
import socket
import subprocess
from pathlib import Path
from threading import Thread

import pytest

from tests.e2e.processes import (
    MOTION_GATEWAY,
    PATIENCE_S,
    Gateway,
    Program,
    SimulatedLine,
    SimulatedRobot,
    gateway_at,
    simulated_line,
    until,
    write_config,
)
from tests.open_access import OPEN

pytestmark = pytest.mark.prove


def run(*arguments: str | Path, url: str = "http://127.0.0.1:9") -> subprocess.CompletedProcess[str]:
    """Run a command to its end; without a gateway's URL there is none."""
    return subprocess.run(  # noqa: S603
        [MOTION_GATEWAY, *arguments],
        env={
            **{name: value for name, value in os.environ.items() if name == "PYTHONPATH"},
            "MOTION_GATEWAY_URL": url,
            "COLUMNS": "100",
            "NO_COLOR": "1",
            "TERM": "dumb",
        },
        capture_output=True,
        text=True,
        check=False,
        timeout=PATIENCE_S,
    )


def test_version() -> None:
    said = run("--version")
    assert said.returncode == 0
    assert said.stdout.strip().count(".") == 2


def test_send_prints_the_answer_as_json(gateway: Gateway) -> None:
    said = run("send", "3F", "3PDP[7]", url=gateway.url)
    assert (said.returncode, said.stderr) == (0, "")
    assert said.stdout.split() == ["{", '"pulses":', "0", "}"]


def test_send_waits_for_the_end_of_a_move(gateway: Gateway, line: SimulatedLine) -> None:
    said = run("send", "line1.01", "1-M250", "--wait", "10", url=gateway.url)
    assert said.returncode == 0, said.stderr
    assert '"status": "succeeded"' in said.stdout
    assert len(line.executed("1-M250")) == 1


@pytest.mark.parametrize(
    ("words", "code", "sentence"),
    [
        (("3F", "1AM5,5"), 2, "1AM"),
        (("3F", "ZZZ"), 2, "There is no command 'ZZZ'"),
        (("44", "6PD"), 2, "There is no body 44"),
        (("3F", "1+MA[29],500"), 1, "1+M"),
    ],
)
def test_send_says_why_not(
    words: tuple[str, str], code: int, sentence: str, gateway: Gateway, line: SimulatedLine
) -> None:
    said = run("send", *words, url=gateway.url)
    assert (said.returncode, said.stdout) == (code, "")
    assert sentence in said.stderr
    assert "Traceback" not in said.stderr
    assert not line.truth("pulses_start")


def test_send_without_a_gateway_says_that_nothing_was_sent() -> None:
    said = run("send", "3F", "6PD")
    assert said.returncode == 3
    assert "Nothing was sent" in said.stderr


def test_an_answer_that_is_lost_on_its_way_is_not_called_unsent() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        hangs_up = Thread(target=lambda: server.accept()[0].close())
        hangs_up.start()
        said = run("send", "3F", "1+M500", url=f"http://127.0.0.1:{server.getsockname()[1]}")
        hangs_up.join()
    assert said.returncode == 4
    assert "may have been carried out" in said.stderr
    assert "Nothing was sent" not in said.stderr


def test_scan_prints_who_answers(tmp_path: Path) -> None:
    """Over TCP, and with one digit for a body: there are only sixteen to wait for."""
    with (
        simulated_line(tmp_path, "00,0A", "--listen", "tcp://127.0.0.1:0") as line,
        gateway_at(line, bodies="00,01", introducer='"$"') as gateway,
    ):
        said = run("scan", "line1", url=gateway.wait_until_ready().url)
    assert said.returncode == 0, said.stderr
    assert said.stdout == "line1.00\nline1.0A  (not in the configuration)\n"


def test_scan_of_a_line_that_is_not_there(gateway: Gateway) -> None:
    said = run("scan", "line2", url=gateway.url)
    assert said.returncode == 2
    assert "There is no line line2" in said.stderr


def test_move_status_and_stop_in_few_words(gateway: Gateway, line: SimulatedLine) -> None:
    said = run("move", "01", "relative", "-250", "--wait", "10", url=gateway.url)
    assert said.returncode == 0, said.stderr
    assert len(line.executed("1-M")) == 1
    said = run("status", url=gateway.url)
    assert said.returncode == 0, said.stderr
    assert [row.split()[:2] for row in said.stdout.splitlines()[:2]] == [
        ["LINE", "STATE"],
        ["line1", "ready"],
    ]
    assert "line1.01        standing" in said.stdout
    gateway.moving("3F", 400_000)
    said = run("stop", url=gateway.url)
    assert said.returncode == 0, said.stderr
    assert "line1.3F  confirmed" in said.stdout


@pytest.mark.parametrize(
    ("number", "code", "state"),
    [(signal.SIGINT, 0, "ended"), (signal.SIGTERM, 0, "ended"), (signal.SIGKILL, -9, "lost")],
)
def test_a_jog_lasts_as_long_as_the_program(
    gateway: Gateway, tmp_path: Path, number: signal.Signals, code: int, state: str
) -> None:
    begin = gateway.now()
    program = Program(tmp_path / "jog.log", "jog", "3F", "+", "--url", gateway.url)
    program.said("It jogs; Ctrl-C stops it.")
    assert gateway.get("/bodies/3F/status")["moving"]
    program.signal(number)
    assert program.ended() == code
    until(lambda: not gateway.get("/bodies/3F/status")["moving"], "it stands still")
    told = gateway.get(f"/events?after={begin}&types=body.jog.{state}")
    assert len(told["events"]) == 1


def test_watch_begins_after_a_cursor_and_shows_what_is_asked_for(gateway: Gateway) -> None:
    begin = gateway.now()
    for body in ("00", "01"):
        gateway.move(body, 10, wait=10)
    words = ("--bodies", "01", "--types", "body.move.*", "--after", begin, "--count", "3")
    said = run("watch", *words, url=gateway.url)
    assert said.returncode == 0, said.stderr
    happened = [line.split()[1:3] for line in said.stdout.splitlines()]
    assert happened == [[f"body.move.{news}", "/bodies/line1.01"] for news in ("queued", "sent", "started")]


@pytest.mark.long
def test_from_ports_to_a_moving_motor(tmp_path: Path) -> None:
    """A search that is interrupted is enough, once everybody is found."""
    robot = SimulatedRobot(tmp_path)
    config = tmp_path / "found.toml"
    with simulated_line(tmp_path, "00,01") as line:
        ports = ("--port", line.place, "--port", str(robot.place))
        search = Program(tmp_path / "init.log", "init", "--thorough", "--out", str(config), *ports)
        search.said("asking body .*; 2 found")
        search.signal(signal.SIGINT)
        assert search.ended() == 1
        assert "only what was found until then is written" in search.words()
        checked = run("check", config)
        assert checked.returncode == 0, checked.stderr
        assert "bodies 00, 01" in checked.stdout
        assert "robot r1, unit 1 of X, Y, Z" in checked.stdout
        config.write_text(config.read_text("utf-8").replace("8420", "0") + OPEN, "utf-8")
        gateway = Gateway(config).wait_until_ready()
        try:
            for words in (("line1.01", "relative", "20"), ("r1/units/1", "home")):
                said = run("move", *words, "--wait", "60", url=gateway.url)
                assert said.returncode == 0, said.stderr
            assert len(line.executed("1+M")) == 1
            assert run("send", "r1/units/1", "APS", url=gateway.url).returncode == 0
            assert run("stop", "r1", "00", url=gateway.url).returncode == 0
        finally:
            gateway.end()
    robot.program.end()


@pytest.mark.parametrize(
    ("wrong", "right", "sentence"),
    [
        ("adress", "address", "gateway.toml:6: lines[0].adress: unknown key (did you mean address?)"),
        ('host = "0.0.0.0"\nport', "port", "server.host: 0.0.0.0 is open to the network"),
    ],
)
def test_a_wrong_configuration_is_refused_with_its_line(
    wrong: str, right: str, sentence: str, line: SimulatedLine, tmp_path: Path
) -> None:
    config = tmp_path / "gateway.toml"
    text = write_config(line, "template").read_text("utf-8")
    config.write_text(text.replace(right, wrong, 1), "utf-8")
    said = run("serve", "--config", config, "--data", tmp_path / "data")
    checked = run("check", config)
    assert (checked.returncode, checked.stderr) == (78, said.stderr)
    assert said.returncode == 78
    assert sentence in said.stderr
    assert said.stdout == ""


def test_a_configuration_that_is_not_there() -> None:
    said = run("serve", "--config", "/nowhere/gateway.toml")
    assert said.returncode == 78
    assert "/nowhere/gateway.toml: cannot be read: No such file or directory" in said.stderr


def test_serve_wants_to_know_what() -> None:
    said = run("serve")
    assert (said.returncode, said.stderr) == (2, "Say either --config FILE or --demo.\n")


@pytest.mark.parametrize(
    ("words", "told"),
    [
        ((), ("serve", "simulate", "send", "scan", "--version", "not a safety function")),
        (("move",), ("relative|absolute", "--unit", "--wait")),
        (("stop",), ("does not replace a hardware stop", "--mode")),
        (("watch",), ("--bodies", "--types", "--after")),
        (("init",), ("Nothing is sent that moves or changes a motor", "--port")),
        (("serve",), ("--config", "--demo", "--port", "SIGTERM")),
        (("send",), ("Code and parameters as in the manual", "Seconds to wait")),
        (("scan",), ("120 body numbers",)),
        (("simulate", "rc400"), ("--bodies", "--pty", "--listen", "--truth", "--control")),
    ],
)
def test_help_in_plain_words(words: tuple[str, ...], told: tuple[str, ...]) -> None:
    said = run(*words, "--help")
    assert said.returncode == 0
    for word in told:
        assert word in " ".join(said.stdout.split())
