"""JSON is read exactly, or refused with the place that could mean something else."""

import json
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gateway.door.strict_json import MAX_DIGITS, NotStrict, parse

# No deeper than a request may be, and no numbers that are too large for JSON.
JSON = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**30), 10**30)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=10,
)


@given(JSON)
def test_honest_json_is_read_as_it_is(value: object) -> None:
    assert parse(json.dumps(value).encode()) == value


@given(st.binary(max_size=200))
def test_no_bytes_make_the_reader_fail_otherwise_than_by_refusing(data: bytes) -> None:
    try:
        parse(data)
    except ValueError:
        return


def test_every_number_that_is_read_is_finite() -> None:
    value = parse(b"[1e308, -1.5]")
    assert isinstance(value, list)
    assert all(math.isfinite(number) for number in value)
    with pytest.raises(NotStrict):
        parse(b"[1e309]")


@pytest.mark.parametrize(
    ("text", "place"),
    [
        ('{"axes": {"X": {"value": NaN}}}', "axes.X.value"),
        ('{"positions": [{}, {"number": 1e999}]}', "positions.1.number"),
        ("[1, -Infinity]", "1"),
        ('{"pulses": ' + "9" * (MAX_DIGITS + 1) + "}", "pulses"),
        ("NaN", "it"),
    ],
)
def test_what_is_no_finite_number_is_told_with_its_place(text: str, place: str) -> None:
    with pytest.raises(NotStrict, match=f"^{place} is not a number"):
        parse(text.encode())
