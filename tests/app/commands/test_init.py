"""`init` and `check`: a configuration is written for what is found, and told before it is served."""

import asyncio
import os
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner, Result

from app.cli import app
from app.commands import init
from app.found import ask_for_names, config_of, tables_of
from gateway import search
from gateway.config import parse
from gateway.fics import config as fics
from gateway.found import Found, FoundLine, FoundRobot
from gateway.rorze import config as rorze
from protocols.fics.system import GetSystemVersion

LINE = FoundLine("serial:///dev/ttyUSB0?baud=9600", "00,3F", [0x00, 0x3F], complete=True)
ROBOT = FoundRobot("tcp://cell:1", "crlf", mode=2, units={1: 3, 2: 4})


def run(*words: str | Path, answer: str = "") -> Result:
    return CliRunner().invoke(app, [str(word) for word in words], input=answer)


def finds(monkeypatch: pytest.MonkeyPatch, *found: Found, then: type[BaseException] | None = None) -> None:
    """Let every search find the same."""

    async def find(_: object, kept: list[Found], *__: object, **___: object) -> None:
        kept += found
        if then is not None:
            raise then
        await asyncio.sleep(0)

    monkeypatch.setattr(search, "search", find)


# init


def test_what_is_written_is_what_was_found_and_check_accepts_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    finds(monkeypatch, ROBOT, LINE)
    file = tmp_path / "gateway.toml"
    said = run("init", "--out", file, "--port", "/dev/ttyUSB0")
    assert said.exit_code == 0, said.output
    assert said.stdout == ""
    assert "an RC-400 with bodies 00, 3F." in said.stderr
    line, cell = parse(file.read_text("utf-8"), "written").lines
    assert isinstance(line, rorze.RorzeLineTable)
    assert isinstance(cell, fics.FicsLineTable)
    assert (line.id, line.address, [body.id for body in line.bodies]) == ("line1", LINE.address, ["00", "3F"])
    assert (cell.address, cell.terminator, cell.robot.id) == (ROBOT.address, "crlf", "r1")
    units = [(unit.number, unit.axes) for unit in cell.robot.units]
    assert units == [(1, ("X", "Y", "Z")), (2, ("X", "Y", "Z", "@"))]
    checked = run("check", file)
    assert checked.exit_code == 0
    assert "bodies 00, 3F" in checked.stdout
    assert "unit 2 of X, Y, Z, @" in checked.stdout


def test_without_a_file_it_is_printed(monkeypatch: pytest.MonkeyPatch) -> None:
    finds(monkeypatch, LINE)
    said = run("init", "--port", "tcp://host:1")
    assert parse(said.stdout, "printed").lines[0].address == LINE.address


def test_what_was_found_before_an_interruption_is_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    finds(monkeypatch, FoundLine(LINE.address, "", [0x00]), then=asyncio.CancelledError)
    file = tmp_path / "gateway.toml"
    said = run("init", "--out", file, "--port", "/dev/ttyUSB0")
    assert said.exit_code == 1
    assert "only what was found until then is written" in said.stderr
    text = file.read_text("utf-8")
    assert "ended before it was over" in text
    assert "Not all 120 body numbers were asked" in text
    (line,) = parse(text, "written").lines
    assert isinstance(line, rorze.RorzeLineTable)
    assert [body.id for body in line.bodies] == ["00"]


def test_where_nobody_is_found_nothing_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    finds(monkeypatch)
    file = tmp_path / "gateway.toml"
    said = run("init", "--out", file, "--port", "/dev/ttyUSB0")
    assert (said.exit_code, file.exists()) == (1, False)
    assert "Nobody was found" in said.stderr


def test_a_file_that_exists_is_left_as_it_is(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    finds(monkeypatch, LINE)
    file = tmp_path / "gateway.toml"
    file.write_text("mine", "utf-8")
    said = run("init", "--out", file, "--port", "/dev/ttyUSB0")
    assert (said.exit_code, file.read_text("utf-8")) == (2, "mine")


def test_a_file_that_cannot_be_written_is_printed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    finds(monkeypatch, LINE)
    said = run("init", "--out", tmp_path / "nowhere" / "gateway.toml", "--port", "/dev/ttyUSB0")
    assert said.exit_code == 1
    assert parse(said.stdout, "printed").lines


def test_ports_nobody_named_are_spoken_to_only_when_people_agree(monkeypatch: pytest.MonkeyPatch) -> None:
    finds(monkeypatch, LINE)
    monkeypatch.setattr(search, "serial_devices", lambda: ["/dev/ttyS7"])
    asked = run("init")
    assert asked.exit_code == 2
    assert "/dev/ttyS7" in asked.stderr
    assert "Nothing was sent" in asked.stderr
    assert run("init", "--yes").exit_code == 0
    monkeypatch.setattr(init, "_is_asked", lambda: True)
    assert run("init", answer="n\n").exit_code == 2
    assert run("init", answer="y\n").exit_code == 0


def test_a_machine_without_ports(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(search, "serial_devices", list)
    said = run("init", "--yes")
    assert (said.exit_code, "has no serial port" in said.stderr) == (1, True)


def test_what_is_no_port_is_refused() -> None:
    said = run("init", "--port", "http://host")
    assert (said.exit_code, "Nothing was sent" in said.stderr) == (2, True)


@pytest.mark.parametrize(
    "found",
    [
        FoundLine("tcp://host:1", '# "quoted"\n[[lines]]', [], complete=True),
        FoundRobot("tcp://host:1", "cr"),
        FoundRobot(
            "dpram:///dev/uio0",
            "cr",
            3,
            GetSystemVersion().read_reply(GetSystemVersion.example[1][4:]),
            dict.fromkeys(range(1, 10), 8),
        ),
        FoundLine("serial:///dev/serial/by-id/usb-A%20B?baud=9600", "", list(range(0x78)), complete=True),
    ],
)
def test_whatever_is_found_makes_a_configuration(found: Found) -> None:
    text = config_of(tables_of([found]), finished=True)
    assert parse(text, "written").lines[0].address == found.address


def test_each_body_and_each_unit_is_one_line_of_the_file() -> None:
    text = config_of(tables_of([ROBOT, LINE]), finished=True)
    assert [row for row in text.splitlines() if row.startswith("  ")] == [
        '  { id = "00" },',
        '  { id = "3F" },',
        '  { number = 1, axes = ["X", "Y", "Z"] },',
        '  { number = 2, axes = ["X", "Y", "Z", "@"] },',
    ]
    filled_in = re.sub(r"(?m)^# (?=\w+ = (?!.*,))", "", text)
    assert len(parse(filled_in, "written").lines) == 2


# names and scales

ANSWERS = {
    "line1.00, name": ["left rail"],
    "line1.00, pulses per mm or deg": [""],
    "line1.3F, name": ["a\x1b[2J", "リフト"],
    "line1.3F, pulses per mm or deg": ["many", "0/mm", "333.33 pulses/deg"],
    "r1, name": ["picker"],
    "r1/units/1, axes [X,Y,Z]": ["X,X", "x y z"],
    "r1/units/1, counted in": ["inches", "mm, mm", "mm, mm, degree"],
    "r1/units/2, axes [X,Y,Z,@]": [""],
    "r1/units/2, counted in": ["pulse"],
}


def asked(question: str, left: dict[str, list[str]]) -> str:
    [key] = (key for key in left if question.startswith(key))
    return left[key].pop(0)


def test_what_people_answer_is_written_and_a_wrong_answer_is_told_and_asked_for_again() -> None:
    tables, told, left = tables_of([ROBOT, LINE]), list[str](), {k: list(v) for k, v in ANSWERS.items()}
    for _, table in tables:
        ask_for_names(table, lambda question: asked(question, left), told.append)
    assert not any(left.values()), "each answer was asked for"
    line, cell = parse(config_of(tables, finished=True), "written").lines
    assert isinstance(line, rorze.RorzeLineTable)
    assert isinstance(cell, fics.FicsLineTable)
    assert [(body.name, body.units and body.units.words) for body in line.bodies] == [
        ("left rail", None),
        ("リフト", "333.33 pulses/deg"),
    ]
    first, second = cell.robot.units
    assert (cell.robot.name, first.axes, first.system) == ("picker", ("X", "Y", "Z"), ("mm", "mm", "degree"))
    assert (second.axes, second.system) == (("X", "Y", "Z", "@"), "pulse")
    assert len(told) == 6
    assert all(sentence.endswith(".") for sentence in told)


def test_names_are_asked_for_at_a_terminal_alone_and_may_be_left_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    finds(monkeypatch, LINE)
    monkeypatch.setattr(init, "_is_asked", lambda: True)
    words = ("init", "--port", "tcp://host:1", "--out")
    said = run(*words, tmp_path / "a.toml", answer="lift\n100/mm\n")  # then Ctrl-D
    assert said.exit_code == 0
    written = (tmp_path / "a.toml").read_text("utf-8")
    assert '{ id = "00", name = "lift", units = { unit = "mm", pulses_per_unit = 100.0 } }' in written
    assert '{ id = "3F" }' in written
    assert "Names and scales" not in run(*words, tmp_path / "b.toml", "--yes").stderr
    monkeypatch.setattr(init, "_is_asked", lambda: False)
    assert "Names and scales" not in run(*words, tmp_path / "c.toml").stderr


# check

WEAK = """
[server]
raw_commands = true
tls_certificate = "/nowhere/cert.pem"
tls_key = "/nowhere/key.pem"
allow_endless_moves = true
allowed_origins = ["http://panel.example", "https://panel.example"]
[[lines]]
id = "a"
address = "serial:///nowhere/tty?baud=9600"
bodies = [{ id = "00", name = "lift", needs_origin = false }, { id = "3F" }]
groups = [{ id = "80", members = ["00", "3F"] }]
"""


def test_check_says_what_is_served_and_warns_of_what_is_weak(tmp_path: Path) -> None:
    file = tmp_path / "gateway.toml"
    file.write_text(WEAK, "utf-8")
    said = run("check", file)
    assert said.exit_code == 0
    assert "line a at serial:///nowhere/tty?baud=9600, RC-400: bodies 00 (lift), 3F; group 80 of 00, 3F" in (
        said.stdout
    )
    warnings = said.stderr.splitlines()
    assert all(line.startswith("warning: ") for line in warnings)
    for word in (
        "raw_commands",
        "endless",
        "http://panel.example",
        "bodies.00.needs_origin",
        "tty",
        "cert.pem",
        "key.pem",
    ):
        assert sum(word in warning for warning in warnings) == 1, word


def test_check_warns_of_lines_that_lead_to_no_port_of_controllers(tmp_path: Path) -> None:
    leader, pseudo_terminal = os.openpty()
    plain = tmp_path / "ram"
    plain.write_bytes(bytes(4096))
    (tmp_path / "port").symlink_to(os.ttyname(pseudo_terminal))
    places = {
        "tcp://8.8.8.8:53": "8.8.8.8 is in no network of terminal servers",
        "tcp://moxa:4001": "moxa is in no network of terminal servers",
        "tcp://10.1.2.3:4001": None,
        "serial:///dev/null": "/dev/null is no serial port",
        f"dpram://{plain}": f"{plain} is no UIO device",
        f"serial://{tmp_path}/port": None,
    }
    file = tmp_path / "gateway.toml"
    for address, why in places.items():
        file.write_text(f'[[lines]]\nid = "a"\naddress = "{address}"\nbodies = [{{ id = "3F" }}]\n', "utf-8")
        said = run("check", file).stderr
        told = [line.partition("line a: ")[2] for line in said.splitlines() if "line a: " in line]
        assert [line.partition(",")[0] for line in told] == ([why] if why else []), address
    os.close(leader)
    os.close(pseudo_terminal)


def test_check_names_every_fault_with_its_line(tmp_path: Path) -> None:
    file = tmp_path / "gateway.toml"
    file.write_text(WEAK.replace("raw_commands", "raw").replace('"3F" }', '"99" }'), "utf-8")
    said = run("check", file)
    assert (said.exit_code, said.stdout) == (78, "")
    assert f"{file}:3: server.raw: unknown key" in said.stderr
    assert f"{file}:11: lines[0].bodies[1].id: " in said.stderr
