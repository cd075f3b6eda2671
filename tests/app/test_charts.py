"""Charts: well-formed, everything inside, round numbers at the axes."""

from xml.etree import ElementTree as ET

from hypothesis import given
from hypothesis import strategies as st

from app.charts import MOST_TICKS, WIDTH, Panel, PlottedLine, chart, ticks_of

SVG = "{http://www.w3.org/2000/svg}"
values = st.floats(-1e9, 1e9, allow_nan=False)


def read_svg(text: str) -> ET.Element:
    return ET.fromstring(text)  # noqa: S314  # our own


def test_lines_of_a_panel_lie_over_each_other_with_their_names() -> None:
    lines = [PlottedLine("planned", [(0, 0), (1, 10)]), PlottedLine("measured <5 Hz", [(0, 0), (1, 9)])]
    picture = read_svg(chart("3F & others", [Panel("Speed", lines)]))
    assert len(picture.findall(f"{SVG}polyline")) == 2
    said = [text.text for text in picture.iter(f"{SVG}text")]
    assert {"3F & others", "Speed", "planned", "measured <5 Hz", "Time [s]"} <= set(said)


@given(st.lists(st.tuples(st.floats(0, 1e6), values), min_size=1, max_size=20))
def test_every_point_lies_inside_the_picture(points: list[tuple[float, float]]) -> None:
    picture = read_svg(
        chart("any", [Panel("one", [PlottedLine("a", points)]), Panel("two", [PlottedLine("b", points)])])
    )
    height = float(picture.attrib["height"])
    for line in picture.findall(f"{SVG}polyline"):
        for place in line.attrib["points"].split():
            x, y = map(float, place.split(","))
            assert 0 <= x <= WIDTH
            assert 0 <= y <= height


@given(st.lists(values, min_size=1, max_size=20))
def test_ticks_enclose_what_they_measure(numbers: list[float]) -> None:
    ticks = ticks_of(numbers)
    step = ticks[1] - ticks[0]
    assert ticks[0] <= min(numbers) + step * 1e-6
    assert ticks[-1] >= max(numbers) - step * 1e-6
    assert 2 <= len(ticks) <= MOST_TICKS + 1


def test_ticks_are_round_numbers_and_there_are_some_for_a_value_that_never_changes() -> None:
    assert ticks_of([0, 50_000]) == [0, 10_000, 20_000, 30_000, 40_000, 50_000]
    assert ticks_of([3.0, 3.0]) == [3.0, 3.5]
    assert ticks_of([0.0, 5e-324]) == [0.0, 0.2]
