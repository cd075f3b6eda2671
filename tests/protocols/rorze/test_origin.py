import pytest
from pydantic import ValidationError

from protocols.rorze import origin
from protocols.table import RangeFault, Retry, SyntaxFault
from tests.protocols.rorze.examples import Row, check_examples

MOTIONS: list[Row] = [
    origin.Home,
    origin.HomeWithStallDetection,
    origin.HomeFastThenStop,
    origin.HomeFastThenDecelerate,
    origin.HomeLikeRc204,
    origin.CentreStallDog,
]
SETTINGS: list[Row] = [
    origin.GetOverrunFactor,
    origin.SetOverrunFactor,
    origin.GetHomingDistance,
    origin.GetHomingRetries,
    origin.SetHomingRetries,
    origin.GetOriginOffset,
    origin.SetOriginOffset,
]


@pytest.mark.parametrize("row", [*MOTIONS, *SETTINGS], ids=lambda row: row.code)
def test_the_manuals_examples(row: Row) -> None:
    check_examples(row)


@pytest.mark.parametrize("row", MOTIONS, ids=lambda row: row.code)
def test_homing_moves_and_is_never_repeated_unasked(row: Row) -> None:
    assert row.starts_motion
    assert not row.moving
    assert row.retry is Retry.CONDITIONAL
    assert {0x50, 0x51, 0x66} <= row.errors


def test_every_code_begins_with_zero_not_with_the_letter() -> None:
    assert {row.code[0] for row in [*MOTIONS, *SETTINGS]} == {"0"}


@pytest.mark.parametrize(
    ("row", "field", "lowest", "highest"),
    [
        (origin.SetOverrunFactor, "factor", 0, 5),
        (origin.SetHomingRetries, "retries", 0, 9),
        (origin.SetOriginOffset, "offset", 1, 65_535),
    ],
)
def test_settings_keep_their_range(row: Row, field: str, lowest: int, highest: int) -> None:
    for value in (lowest, highest):
        assert row.model_validate({field: value}).written() == str(value)
        assert getattr(row.read(f"H{value:X}"), field) == value
    for value in (lowest - 1, highest + 1):
        with pytest.raises(ValidationError):
            row.model_validate({field: value})
        with pytest.raises(RangeFault):
            row.read(str(value))


@pytest.mark.parametrize("payload", ["20", "000020", "+0020", "H0014", ""])
def test_a_reply_of_another_width_is_no_origin_offset(payload: str) -> None:
    with pytest.raises(SyntaxFault):
        origin.GetOriginOffset().read_reply(payload)
