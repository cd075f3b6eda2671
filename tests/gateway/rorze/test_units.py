import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from gateway.core.errors import InvalidRequest
from gateway.rorze.units import Scale, to_pulses

MM = Scale(unit="mm", pulses_per_unit=1000.0)
DEG = Scale(unit="deg", pulses_per_unit=166.6667)


@pytest.mark.parametrize(
    ("value", "unit", "scale", "pulses"),
    [
        (500, "pulse", None, 500),
        (500.0, "pulse", MM, 500),
        (12.5, "mm", MM, 12500),
        (12500, "um", MM, 12500),
        (-0.001, "mm", MM, -1),
        (360, "deg", DEG, 60000),
        (360_000, "mdeg", DEG, 60000),
        (1, "mm", Scale(unit="um", pulses_per_unit=2.0), 2000),
    ],
)
def test_lengths_and_angles_become_the_nearest_pulses(
    value: float, unit: str, scale: Scale | None, pulses: int
) -> None:
    assert to_pulses(value, unit, scale) == pulses  # type: ignore[arg-type]  # literals, from a table


@pytest.mark.parametrize(
    ("value", "unit", "scale"),
    [(0.5, "pulse", MM), (1, "mm", None), (1, "deg", MM), (1, "um", DEG), (1, "mdeg", MM)],
)
def test_what_makes_no_sense_for_the_body_is_refused_and_nothing_is_sent(
    value: float, unit: str, scale: Scale | None
) -> None:
    with pytest.raises(InvalidRequest, match="nothing was sent"):
        to_pulses(value, unit, scale)  # type: ignore[arg-type]  # literals, from a table


@pytest.mark.parametrize("factor", [0, -1.0, float("nan"), float("inf"), "1000", True])
def test_a_scale_is_a_positive_finite_number(factor: object) -> None:
    with pytest.raises(ValidationError):
        Scale.model_validate({"unit": "mm", "pulses_per_unit": factor})


@given(st.integers(-999_999_999, 999_999_999), st.floats(0.01, 1e6))
def test_pulses_shown_in_a_unit_lead_back_to_the_same_pulses(pulses: int, factor: float) -> None:
    scale = Scale(unit="mm", pulses_per_unit=factor)
    assert to_pulses(scale.value(pulses), "mm", scale) == pulses
