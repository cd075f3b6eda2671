import pytest
from pydantic import ValidationError

from protocols.rorze import flash
from protocols.table import Retry, SyntaxFault
from tests.protocols.rorze.examples import Row, check_examples

ROWS: list[Row] = [
    flash.EraseFlash,
    flash.SaveSettings,
    flash.LoadPositions,
    flash.SavePositions,
    flash.LoadProgram,
    flash.SaveProgram,
]


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.code)
def test_the_manuals_examples(row: Row) -> None:
    check_examples(row)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.code)
def test_flash_is_touched_only_at_standstill_and_never_twice_unasked(row: Row) -> None:
    assert (row.moving, row.program, row.retry) == (False, False, Retry.CONDITIONAL)


@pytest.mark.parametrize(
    ("store", "sign"), [("positions", "Posp"), ("settings", "Init"), ("program", "Upgm")]
)
def test_what_is_erased_has_a_name(store: str, sign: str) -> None:
    assert flash.EraseFlash.model_validate({"store": store}).written() == sign


@pytest.mark.parametrize("parameters", ["", "posp", "Posp,Init", "Pos", "ALL"])
def test_nothing_else_can_be_erased(parameters: str) -> None:
    with pytest.raises(SyntaxFault):
        flash.EraseFlash.read(parameters)
    with pytest.raises(ValidationError):
        flash.EraseFlash.model_validate({"store": parameters})
