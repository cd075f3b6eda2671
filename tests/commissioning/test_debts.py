"""Settings of a trial are set back, if need be by the next one: they are written down before they are set."""

import asyncio
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from commissioning.assumptions import Level
from commissioning.bench import Places, Terms
from commissioning.debts import Debt, Debts, DebtsUnreadable, debts_file
from commissioning.findings import Result
from commissioning.report import Report
from commissioning.run import commission
from gateway.config import parse
from simulator.fics.layout import Layout
from simulator.fics.line import SimulatedFics, build_line
from tests.commissioning.benches import CONFIG, Machine, all_allowed, fics, rc400, result_of
from tests.commissioning.test_quirks import away, homed, in_mode_3
from tests.plants import in_virtual_time
from tests.simulated_line import SimulatedCable
from transports.base import TransportLost

NEAR = Places(140, 180)
TWO_UNITS = CONFIG + '[[lines.robot.units]]\nnumber = 2\naxes = ["X", "Y", "Z"]\n'
MOTION, SETTINGS = frozenset({Level.MOTION}), frozenset({Level.SETTINGS})


class Killed(SimulatedCable):
    """A cable on which nothing is sent any more from a certain frame on, as by a program that was killed."""

    def __init__(self, machine: Machine, last: bytes, file: Path) -> None:
        super().__init__(machine)
        self.last = last
        self.file = file
        self.is_killed = False
        self.owed = ""
        """The debts that were written down when the last frame was sent."""

    def write(self, data: bytes) -> None:
        if self.is_killed:
            raise TransportLost("killed")
        super().write(data)
        if data.startswith(self.last):
            self.is_killed = True
            self.owed = self.file.read_text("utf-8")


async def tried(
    machine: Machine, cable: SimulatedCable, file: Path, terms: Terms, text: str = CONFIG
) -> Report:
    protocol = "fics" if isinstance(machine, SimulatedFics) else "rorze"
    line: Any = next(table for table in parse(text, "gateway.toml").lines if table.protocol == protocol)
    return await commission(line, terms, Debts(file), open_transport=lambda _: cable)


def in_its_second_unit() -> SimulatedFics:
    machine = build_line(Layout(units=2))
    machine.receive(b"UNT 2\r", 0.0)
    return machine


def set_up(machine: Machine) -> Any:
    """The settings of a machine that trials change."""
    if not isinstance(machine, SimulatedFics):
        return [body.settings.comments for body in machine.axes.values()]
    robot = machine.robot
    return [
        robot.upload,
        robot.variables,
        [(unit.positions, [axis_settings(axis) for axis in unit.users]) for unit in robot.units.values()],
    ]


def axis_settings(axis: Any) -> Any:
    return axis.percent, axis.top_speed, axis.plus_limit, axis.minus_limit


DEEDS = [
    (fics, homed, MOTION, b"VAO 5", "set-speed-percent", CONFIG),
    (fics, homed, MOTION, b"LMA", "set-speed-percent", CONFIG),
    (fics, in_mode_3, MOTION, b"VSO ", "set-maximum-speeds", CONFIG),
    (fics, in_mode_3, MOTION, b"JOG", "set-lower-soft-limits", CONFIG),
    (in_its_second_unit, homed, MOTION, b"JOG", "set-lower-soft-limits", TWO_UNITS),
    (fics, homed, SETTINGS, b"POF 1", "end-position-upload", CONFIG),
    (fics, in_mode_3, SETTINGS, b"POF 1", "end-position-upload", CONFIG),
    (fics, in_mode_3, SETTINGS, b"VAR V99=-", "set-variable", CONFIG),
    (fics, homed, SETTINGS, b"POS", "clear-positions", CONFIG),
    (rc400, away, SETTINGS, b"&0A9VS", "set-user-comment", CONFIG),
]


@pytest.mark.parametrize(("make", "prepare", "allowed", "last", "name", "text"), DEEDS)
@in_virtual_time
async def test_the_next_commissioning_sets_back_what_a_killed_one_has_left(
    make: Callable[[], Machine],
    prepare: Callable[[Any], None],
    allowed: frozenset[Level],
    last: bytes,
    name: str,
    text: str,
    tmp_path: Path,
) -> None:
    machine, file = make(), tmp_path / "owed"
    prepare(machine)
    before = str(set_up(machine))
    people = all_allowed(machine, NEAR if make is fics else Places(0, 200))
    killed = Killed(machine, last, file)
    await tried(machine, killed, file, replace(people, allowed=allowed), text)
    assert killed.is_killed
    await asyncio.sleep(120.0)  # what was to move has come to its place
    assert name in killed.owed, "it is written down before it is set"
    assert str(set_up(machine)) != before
    if make is in_its_second_unit:
        machine.receive(b"UNT 1\r", asyncio.get_running_loop().time())
    asked = await tried(machine, SimulatedCable(machine), file, Terms(), text)
    assert asked.left
    assert not asked.is_right()
    assert all(left in asked.markdown() for left in asked.left)
    switch = Terms().switch
    paid = await tried(machine, SimulatedCable(machine), file, replace(people, switch=switch), text)
    assert paid.left == []
    assert str(set_up(machine)) == before
    assert not file.exists()


@in_virtual_time
async def test_without_an_answer_it_stays_and_nothing_else_is_set(tmp_path: Path) -> None:
    machine, file = rc400(), tmp_path / "owed"
    comment = {"comment_number": 1, "text": ""}
    Debts(file).note(Debt(place=0x0A, command="set-user-comment", fields=comment))
    cable = SimulatedCable(machine)
    report = await tried(machine, cable, file, Terms(frozenset(Level)))
    assert report.left == ["0A: &0A9VS1,"]
    assert not any(b"9VS" in frame for frame in cable.written)
    assert result_of(report, "comment-kept").result is Result.CANNOT_TELL
    assert "set back" in (result_of(report, "comment-kept").needed or "")


@in_virtual_time
async def test_an_axis_that_still_jogs_is_not_given_its_speed_back(tmp_path: Path) -> None:
    machine, file = fics(), tmp_path / "owed"
    in_mode_3(machine)
    people = replace(all_allowed(machine, NEAR), allowed=MOTION)
    await tried(machine, Killed(machine, b"JOG", file), file, people)
    next_one = SimulatedCable(machine)
    report = await tried(machine, next_one, file, people)
    assert machine.robot.job is not None
    assert not any(frame.startswith((b"VSO ", b"SLP ", b"SLM ")) for frame in next_one.written)
    assert len(report.left) == 3


@in_virtual_time
async def test_what_cannot_be_written_down_is_not_set() -> None:
    machine = fics()
    homed(machine)
    cable = SimulatedCable(machine)
    report = await tried(machine, cable, Path("/proc/owed"), all_allowed(machine, NEAR))
    setting = (b"POF 1", b"POS", b"VAO ", b"VSO ", b"SLP ", b"SLM ", b"LMA", b"JOG")
    assert not any(frame.startswith(setting) or b"=" in frame for frame in cable.written)
    told = result_of(report, "numbers-as-set")
    assert told.result is Result.CANNOT_TELL
    assert "/proc/owed cannot be written" in told.seen


@pytest.mark.parametrize("text", ["", "{}", '[{"place": 0, "command": "no-such", "fields": {}}]'])
@in_virtual_time
async def test_debts_that_cannot_be_read_send_nothing(text: str, tmp_path: Path) -> None:
    file = tmp_path / "owed"
    file.write_text(text, "utf-8")
    cable = SimulatedCable(fics())
    with pytest.raises(DebtsUnreadable, match="cannot be read"):
        await tried(fics(), cable, file, Terms())
    assert cable.written == []


def test_they_stand_beside_the_configuration(tmp_path: Path) -> None:
    assert debts_file(tmp_path / "gateway.toml", "line1") == tmp_path / "gateway.toml.line1.owed"


def test_a_debt_that_cannot_be_crossed_out_stands_and_is_crossed_out_later(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    debts = Debts(tmp_path / "owed")
    first, second = (Debt(place=place, command="set-user-comment", fields={}) for place in (0, 1))
    debts.note(first)
    debts.note(second)

    def full(*_: object) -> None:
        raise OSError

    with monkeypatch.context() as patched:
        patched.setattr("commissioning.debts.write_whole", full)
        for _ in range(2):
            with pytest.raises(OSError):  # noqa: PT011  # the disk's
                debts.cross_out(second)
        with pytest.raises(OSError):  # noqa: PT011  # the disk's
            debts.note(second)
    debts.cross_out(second)
    assert list(debts.left()) == [first]
    debts.cross_out(first)
    assert not (tmp_path / "owed").exists()
