import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import moves
from protocols.table import RangeFault, Retry, SyntaxFault
from tests.protocols.rorze.examples import Row, check_examples

BY_DISTANCE: list[Row] = [
    moves.MoveClockwise,
    moves.MoveCounterclockwise,
    moves.MoveClockwiseSlowly,
    moves.MoveCounterclockwiseSlowly,
]
TO_POSITION: list[Row] = [moves.MoveTo, moves.MoveToSlowly]
by_distance = pytest.mark.parametrize("row", BY_DISTANCE, ids=lambda row: row.code)
to_position = pytest.mark.parametrize("row", TO_POSITION, ids=lambda row: row.code)
every_move = pytest.mark.parametrize("row", [*BY_DISTANCE, *TO_POSITION], ids=lambda row: row.code)

references = st.fixed_dictionaries({"position": st.integers(0, 2047) | st.sampled_from(["next", "previous"])})
patterns = st.none() | st.integers(0, 29)


@every_move
def test_the_manuals_examples(row: Row) -> None:
    check_examples(row)


@every_move
def test_a_move_is_refused_while_the_motor_turns(row: Row) -> None:
    assert row.starts_motion
    assert not row.moving
    assert row.program
    assert row.errors >= {0x50, 0x65, 0x66}


@by_distance
def test_a_move_by_a_distance_is_never_repeated(row: Row) -> None:
    assert row.retry is Retry.NEVER


@by_distance
@given(distance=st.integers(1, 999_999_999) | references | st.just("endless"), pattern=patterns)
def test_moves_by_a_distance_read_back_as_written(row: Row, distance: object, pattern: int | None) -> None:
    command = row.model_validate({"distance": distance, "pattern": pattern})
    assert row.read(command.written()) == command


@to_position
@given(position=st.integers(-999_999_999, 999_999_999) | references, pattern=patterns)
def test_moves_to_a_position_read_back_as_written(row: Row, position: object, pattern: int | None) -> None:
    command = row.model_validate({"position": position, "pattern": pattern})
    assert row.read(command.written()) == command


@pytest.mark.parametrize("distance", [0, -1, 1_000_000_000])
def test_a_distance_is_a_positive_number_of_pulses(distance: int) -> None:
    with pytest.raises(ValidationError):
        moves.MoveClockwise(distance=distance)
    with pytest.raises(RangeFault):
        moves.MoveClockwise.read(str(distance))


@pytest.mark.parametrize("position", [-1_000_000_000, 1_000_000_000])
def test_a_position_lies_within_the_managed_range(position: int) -> None:
    with pytest.raises(ValidationError):
        moves.MoveTo(position=position)
    with pytest.raises(RangeFault):
        moves.MoveTo.read(str(position))


@pytest.mark.parametrize("parameters", ["A[30],500", "P[2048]"])
def test_the_controller_refuses_slots_that_it_does_not_have(parameters: str) -> None:
    with pytest.raises(RangeFault):
        moves.MoveClockwise.read(parameters)


@pytest.mark.parametrize("parameters", ["", "A[3]", "A[3]500", "5,A[3]", "5.0", "1_000", "P[*]", "Z1", "z"])
def test_the_controller_refuses_what_is_no_distance(parameters: str) -> None:
    with pytest.raises(SyntaxFault):
        moves.MoveClockwise.read(parameters)


def test_an_absolute_move_has_an_end() -> None:
    with pytest.raises(SyntaxFault):
        moves.MoveTo.read("Z")
    with pytest.raises(ValidationError):
        moves.MoveTo.model_validate({"position": "endless"})


def test_a_distance_may_come_in_hexadecimal_and_leaves_in_decimal() -> None:
    assert moves.MoveClockwise.read("A[H3],H1F4").written() == "A[3],500"


@pytest.mark.parametrize(
    "text",
    [
        '{"distance": true}',
        '{"distance": "500"}',
        '{"distance": 5.0}',
        '{"distance": NaN}',
        '{"distance": null}',
        '{"distance": "Z"}',
        '{"distance": {"position": true}}',
        '{"distance": {"position": 2048}}',
        '{"distance": {"position": "+"}}',
        '{"distance": 500, "pattern": 30}',
        '{"distance": 500, "pattern": "3"}',
        '{"distance": 500, "speed": 3}',
        "{}",
    ],
)
def test_json_that_only_resembles_a_move_is_refused(text: str) -> None:
    with pytest.raises(ValidationError):
        moves.MoveClockwise.model_validate_json(text)
