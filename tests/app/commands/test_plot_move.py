"""`plot move`: the measured speed over the planned one."""

from pathlib import Path
from typing import Any

import pytest

from app.commands.plot_move import panels_of_body, panels_of_unit, speeds_of
from tests.app.fake_gateway import Answer, FakeGateway
from tests.app.test_charts import SVG, read_svg

MOVE = "01a2"
NOT_FOUND = (404, {"detail": "There is no move.", "remedy": "", "moved": "no"})


def sample(time_s: float, pulses: int) -> dict[str, Any]:
    return {"time_s": time_s, "pulses": pulses}


def of_body(**others: Any) -> dict[str, Any]:
    plan = [{"time_s": 0.0, "pulses": 0, "speed": 100}, {"time_s": 2.0, "pulses": 300, "speed": 200}]
    told = {"body_id": "arm.3F", "unit": "mm", "pulses_per_unit": 10.0, "plan": plan, "note": None}
    return {**told, "samples": [sample(0.0, 0), sample(1.0, 100), sample(2.0, 300)], **others}


def of_unit() -> dict[str, Any]:
    places = [(0.0, {"X": None, "Z": 1.0}), (1.0, {"X": None, "Z": 2.0}), (3.0, {"X": None, "Z": 8.0})]
    samples = [{"time_s": at, "axes": axes} for at, axes in places]
    return {"robot_id": "r1", "unit": 1, "units": {"X": "mm", "Z": "mm"}, "samples": samples}


def texts_of(file: Path) -> set[str | None]:
    return {text.text for text in read_svg(file.read_text()).iter(f"{SVG}text")}


def test_measured_and_planned_speed_are_drawn_over_each_other(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "move.svg"
    fake = FakeGateway({f"/bodies/3F/moves/{MOVE}/samples": [(200, of_body())]})
    said = fake.run(monkeypatch, "plot", "move", MOVE, "--of", "3F", "--output", str(file))
    assert (said.exit_code, said.stdout.strip()) == (0, str(file)), said.stderr
    assert {f"arm.3F, move {MOVE}", "Speed [mm/s]", "Position [mm]", "planned", "measured"} <= texts_of(file)


def test_a_move_is_found_by_its_id_alone(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    unit = f"/robots/r1/units/1/moves/{MOVE}"
    file = tmp_path / "move.svg"
    fake = FakeGateway(
        {
            "/bodies": [(200, {"bodies": [{"body_id": "arm.00"}, {"body_id": "arm.01"}]})],
            "/scaras": [(200, {"scaras": []})],
            "/robots": [(200, {"robots": [{"robot_id": "r1", "units": [{"number": 1}]}]})],
            f"/bodies/arm.00/moves/{MOVE}": [NOT_FOUND],
            f"/bodies/arm.01/moves/{MOVE}": [NOT_FOUND],
            unit: [(200, {"id": MOVE})],
            f"{unit}/samples": [(200, of_unit())],
        }
    )
    said = fake.run(monkeypatch, "plot", "move", MOVE, "--output", str(file))
    assert said.exit_code == 0, said.stderr
    assert {f"r1/units/1, move {MOVE}", "Speed [mm/s]"} <= texts_of(file)


def test_a_move_that_nobody_has_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    nobody: dict[str, list[Answer]] = {
        f"/{kind}": [(200, {kind: []})] for kind in ("bodies", "scaras", "robots")
    }
    fake = FakeGateway(nobody)
    said = fake.run(monkeypatch, "plot", "move", MOVE, "--output", str(tmp_path / "move.svg"))
    assert said.exit_code == 2
    assert f"No body, SCARA robot or unit has a move {MOVE} that is kept" in said.stderr


def test_the_move_of_a_scara_robot_is_drawn_axis_by_axis(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    axes = [
        {"axis": 0, "body_id": "arm.00", "move_id": "02", "target_position": 400},
        {"axis": 2, "body_id": "arm.01", "move_id": None, "target_position": 0},
    ]
    file = tmp_path / "move.svg"
    no_plan = of_body(plan=None, note="How far it goes was only known when it was done.")
    fake = FakeGateway(
        {
            "/bodies": [(200, {"bodies": [{"body_id": "arm.00"}]})],
            "/scaras": [(200, {"scaras": [{"scara_id": "wafer"}]})],
            f"/bodies/arm.00/moves/{MOVE}": [NOT_FOUND],
            f"/scaras/wafer/moves/{MOVE}": [(200, {"scara_id": "wafer", "axes": axes})] * 2,
            "/bodies/arm.00/moves/02/samples": [(200, no_plan)],
        }
    )
    said = fake.run(monkeypatch, "plot", "move", MOVE, "--output", str(file))
    assert (said.exit_code, said.stderr) == (0, "")
    assert {f"wafer, move {MOVE}", "Speed of axis 0 [mm/s]", "Position of axis 0 [mm]", "target"} <= texts_of(
        file
    )


def test_without_a_plan_the_reason_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    told = of_body(plan=None, note="Settings of the body may have changed since the move began.")
    fake = FakeGateway({f"/bodies/3F/moves/{MOVE}/samples": [(200, told)]})
    file = tmp_path / "move.svg"
    said = fake.run(monkeypatch, "plot", "move", MOVE, "--of", "3F", "--output", str(file))
    assert said.exit_code == 0
    assert "No plan is drawn: Settings of the body may have changed" in said.stderr
    assert "planned" not in texts_of(file)


def test_too_few_samples_are_not_drawn(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    fake = FakeGateway({f"/bodies/3F/moves/{MOVE}/samples": [(200, of_body(samples=[sample(0.0, 0)]))]})
    file = tmp_path / "move.svg"
    said = fake.run(monkeypatch, "plot", "move", MOVE, "--of", "3F", "--output", str(file))
    assert (said.exit_code, file.exists()) == (1, False)
    assert "too few samples" in said.stderr


def test_speed_is_the_way_between_two_answers_by_their_time() -> None:
    assert speeds_of([(0.0, 0), (1.0, 100), (1.01, 100), (2.0, 300)]) == [(0.5, 100.0), (1.5, 200.0)]
    assert not speeds_of([(0.0, 0), (0.01, 100)])


def test_lines_are_in_the_unit_of_the_body() -> None:
    [speed, position] = panels_of_body(of_body())
    assert [line.label for line in speed.lines] == ["planned", "measured"]
    assert list(speed.lines[1].points) == [(0.5, 10.0), (1.5, 20.0)]
    assert list(position.lines[0].points) == [(0.0, 0.0), (2.0, 30.0)]
    [speed, position] = panels_of_body(of_body(unit=None, pulses_per_unit=None))
    assert speed.title == "Speed [pulses/s]"


def test_axes_that_are_not_known_are_left_out() -> None:
    [speed, position] = panels_of_unit(of_unit())
    assert [(line.label, list(line.points)) for line in speed.lines] == [("Z", [(0.5, 1.0), (2.0, 3.0)])]
    assert [line.label for line in position.lines] == ["Z"]
