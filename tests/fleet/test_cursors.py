"""The cursor of a plant."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fleet.cursors import read, written
from gateway.core.errors import InvalidRequest

PLACES = st.dictionaries(
    st.from_regex("[a-z][a-z0-9-]{0,31}", fullmatch=True),
    st.from_regex("[0-9a-f]{8}-[0-9]{12}", fullmatch=True),
    max_size=40,
)


@given(PLACES)
def test_what_is_written_is_read(places: dict[str, str]) -> None:
    assert read(written(places)) == places


@pytest.mark.parametrize(
    "text",
    [
        "",
        "x",
        "05806f8b-000000000009",
        "s1:05806f8b-9",
        "s1:05806f8b-000000000009,",
        "S1:05806f8b-000000000009",
    ],
)
def test_anything_else_is_refused(text: str) -> None:
    with pytest.raises(InvalidRequest):
        read(text)
