"""`plot curve`: what it asks, what it writes, and what it says where it cannot."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from app.commands.plot import panels_of_body, panels_of_unit, speeds_of
from tests.app.fake_gateway import Answer, FakeGateway
from tests.app.test_charts import SVG, read_svg

PATH = "/bodies/3F/patterns/12/curve"


def points(scale: float | None) -> list[dict[str, Any]]:
    rows = [(0.0, 0.0, 100.0, 50.0), (1.0, 125.0, 150.0, 50.0), (2.0, 300.0, 200.0, 0.0)]
    names = ("position", "speed", "acceleration")
    return [
        {"time_s": time, **dict(zip(names, values, strict=True))}
        | {
            f"{name}_in_unit": value * scale if scale else None
            for name, value in zip(names, values, strict=True)
        }
        for time, *values in rows
    ]


def gateway(scale: float | None = None) -> FakeGateway:
    found = {"body_id": "arm.3F", "pattern": 12, "distance": 300, "pulses": 300, "total_time_s": 2.0}
    found |= {"unit": "mm" if scale else None, "points": points(scale)}
    return FakeGateway({PATH: [(200, found)]})


def test_a_curve_is_drawn_with_speed_position_and_acceleration(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    file = tmp_path / "curve.svg"
    for scale, unit in ((None, "pulses"), (0.001, "mm")):
        said = gateway(scale).run(
            monkeypatch, "plot", "curve", "3F", "12", "--distance", "300", "--output", str(file)
        )
        assert (said.exit_code, said.stdout.strip()) == (0, str(file)), said.stderr
        picture = read_svg(file.read_text())
        texts = [text.text for text in picture.iter(f"{SVG}text")]
        assert "arm.3F, pattern 12: 300 pulses in 2.000 s" in texts
        assert {f"Speed [{unit}/s]", f"Position [{unit}]", f"Acceleration [{unit}/s²]"} <= set(texts)


def test_the_distance_is_asked_for_as_it_was_given(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    asked: list[str] = []
    fake = gateway()
    answer = fake.request

    def request(method: str, url: str, **options: Any) -> Any:
        asked.append(url)
        return answer(method, url, **options)

    monkeypatch.setattr(fake, "request", request)
    words = (
        "plot",
        "curve",
        "3F",
        "12",
        "--distance",
        "12.5",
        "--unit",
        "mm",
        "--output",
        str(tmp_path / "c.svg"),
    )
    assert fake.run(monkeypatch, *words).exit_code == 0
    assert asked[0].endswith("/curve?distance=12.5&unit=mm&points=600")


def test_what_the_gateway_refuses_is_said_and_nothing_is_written(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    problem = {"detail": "Pattern 12 of arm.3F was never set.", "remedy": "Set it first.", "moved": "no"}
    file = tmp_path / "curve.svg"
    fake = FakeGateway({PATH: [(422, problem)]})
    said = fake.run(monkeypatch, "plot", "curve", "3F", "12", "--distance", "1", "--output", str(file))
    assert (said.exit_code, file.exists()) == (2, False)
    assert "never set. Set it first." in said.stderr


@pytest.mark.parametrize(
    ("name", "body", "said"),
    [
        ("c.jpg", "3F", "neither .svg nor .png"),
        ("c.svg", "80", "only bodies have patterns"),
        ("c.png", "3F", "extra `png`"),
    ],
)
def test_what_cannot_be_drawn_is_not_asked_for(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str, body: str, said: str
) -> None:
    monkeypatch.setattr("app.commands.plot.find_spec", lambda _: None)
    fake = gateway()
    words = ("plot", "curve", body, "12", "--distance", "1", "--output", str(tmp_path / name))
    result = fake.run(monkeypatch, *words)
    assert (result.exit_code, fake.asked) == (2, [])
    assert said in result.stderr


@pytest.mark.parametrize("has_fonts", [True, False])
def test_png_is_made_of_the_same_picture_where_there_is_a_font(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, has_fonts: bool
) -> None:
    drawn: list[str] = []

    def svg_to_bytes(svg_string: str) -> list[int]:
        drawn.append(svg_string)
        return list(b"\x89PNG" + b"M" * (has_fonts and "<text" in svg_string))

    monkeypatch.setitem(__import__("sys").modules, "resvg_py", SimpleNamespace(svg_to_bytes=svg_to_bytes))
    monkeypatch.setattr("app.commands.plot.find_spec", lambda _: object())
    file = tmp_path / "curve.png"
    said = gateway().run(monkeypatch, "plot", "curve", "3F", "12", "--distance", "300", "--output", str(file))
    if not has_fonts:
        assert (said.exit_code, file.exists()) == (2, False)
        assert "this machine has none" in said.stderr
        return
    assert said.exit_code == 0
    assert file.read_bytes() == b"\x89PNGM"
    assert "arm.3F, pattern 12" in drawn[-1]


def test_a_file_that_cannot_be_written_is_told(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    file = tmp_path / "nowhere" / "curve.svg"
    said = gateway().run(monkeypatch, "plot", "curve", "3F", "12", "--distance", "300", "--output", str(file))
    assert said.exit_code == 2
    assert "was not written" in said.stderr


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
