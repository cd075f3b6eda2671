import pytest

from protocols.fics.alarms import CurrentError, DetailKind, GetErrorDetail, TakeCurrentError
from protocols.table import SyntaxFault


@pytest.mark.parametrize("text", ["", "E5", "E005", "05", "0183", "E5x", "@05"])
def test_an_error_is_an_e_and_two_digits_or_three_digits(text: str) -> None:
    with pytest.raises(SyntaxFault):
        TakeCurrentError().read_reply(text)


def test_both_ways_to_say_that_nothing_is_wrong_are_read() -> None:
    for text in ("E00", "000"):
        assert TakeCurrentError().read_reply(text) == CurrentError(error=text)


def test_taking_the_error_clears_it_so_it_is_never_asked_twice_unasked() -> None:
    assert not TakeCurrentError().may_repeat
    assert GetErrorDetail().may_repeat


@pytest.mark.parametrize(
    ("text", "kind", "fields"),
    [
        ("----", DetailKind.NONE, {}),
        ("----E", DetailKind.EMERGENCY, {}),
        ("1XFFE+-", DetailKind.DRIVER, {"unit": 1, "axis": "X", "driver_error": 0xFF}),
        (" @21", DetailKind.DRIVER, {"unit": None, "axis": "@", "driver_error": 0x21}),
        ("2A C", DetailKind.CONNECTION, {"unit": 2, "axis": "A"}),
        ("-- T0010020", DetailKind.TIMEOUT, {"program": 1, "step": 20}),
        ("-2010010020", DetailKind.FICS, {"error": 201, "program": 1, "step": 20}),
        ("-183001002005", DetailKind.FICS, {"error": 183, "program": 1, "step": 20, "routine_error": 5}),
        ("what is this", DetailKind.UNREADABLE, {"text": "what is this"}),
        ("", DetailKind.UNREADABLE, {"text": ""}),
    ],
)
def test_each_kind_of_detail_is_told_apart(text: str, kind: DetailKind, fields: dict[str, object]) -> None:
    detail = GetErrorDetail().read_reply(text)
    assert detail.kind is kind
    assert detail.model_dump(include=detail.model_fields_set - {"signals"}) == fields


def test_the_signals_of_a_driver_stand_at_their_places() -> None:
    signals = GetErrorDetail().read_reply("1X21 +").signals
    assert signals is not None
    assert (signals.emergency, signals.plus_overtravel, signals.minus_overtravel) == (False, True, False)
    assert GetErrorDetail().read_reply("1X21").signals is None


def test_a_system_of_a_single_unit_has_no_unit_0_for_clients() -> None:
    detail = GetErrorDetail().read_reply(" XFFE+-")
    assert detail.kind is DetailKind.DRIVER
    assert detail.model_dump(mode="json")["unit"] is None
