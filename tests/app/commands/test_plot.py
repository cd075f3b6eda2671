"""`plot curve`: what it asks, what it writes, and what it says where it cannot."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from tests.app.fake_gateway import FakeGateway
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
