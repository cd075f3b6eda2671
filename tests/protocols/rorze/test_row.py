import pytest
from pydantic import Field, ValidationError

from protocols.rorze.moves import MoveClockwise
from protocols.rorze.notation import PositionRef, PositionReference, Pulses
from protocols.rorze.position import GetPosition
from protocols.rorze.position_table import SetPositionEntry
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack, Effect, Reply, Retry


class Base(RorzeCommand[Ack], moving=False, errors=frozenset({0x4A}), retry=Retry.READ):
    """Base of both rows below."""

    entry: PositionRef


class One(Base, code="1XD", args="{entry}", modes="0", takes_s=1.5):
    """一: one."""


class Two(
    Base, code="2XM", args="{entry}", moving=True, program=False, effect=Effect.MOTION, echo=("entry",)
):
    """二: two, with a colon: here."""


def test_columns_are_inherited_unless_a_row_sets_its_own() -> None:
    assert (One.code, One.modes, One.moving, One.program, One.takes_s) == ("1XD", "0", False, True, 1.5)
    assert (Two.code, Two.modes, Two.moving, Two.program, Two.takes_s) == ("2XM", "012", True, False, 0.0)
    assert One.errors == Two.errors == {0x4A}
    assert (One.echo, Two.echo) == ((), ("entry",))


def test_a_command_that_says_nothing_may_not_be_repeated() -> None:
    assert RorzeCommand.retry is Retry.NEVER


def test_what_is_answered_is_the_type_parameter_of_the_nearest_base() -> None:
    assert One.reply_type() is Ack
    assert GetPosition.reply_type() is not Ack
    with pytest.raises(TypeError):
        RorzeCommand.reply_type()


def test_name_and_titles_come_from_the_class() -> None:
    assert MoveClockwise.name() == "move-clockwise"
    assert One.titles() == ("一", "one")
    assert Two.titles() == ("二", "two, with a colon: here")


@pytest.mark.parametrize(
    ("position", "repeatable"), [(0, True), (2047, True), ("next", False), ("previous", False)]
)
def test_a_read_that_steps_the_position_index_is_not_repeatable(position: object, repeatable: bool) -> None:
    entry = PositionReference.model_validate({"position": position})
    assert One(entry=entry).may_repeat is repeatable


@pytest.mark.parametrize("text", ["P[+],50", "P[-],50", "P[+]"])
def test_a_setting_that_steps_the_position_index_is_no_setting_to_repeat(text: str) -> None:
    assert SetPositionEntry.read(text).retry_class() is Retry.NEVER
    assert SetPositionEntry.read("P[25],50").retry_class() is Retry.SETTING


def test_the_effect_tells_what_starts_motion() -> None:
    assert Two.starts_motion
    assert not One.starts_motion


def test_a_row_without_parameters_has_one_empty_form() -> None:
    assert GetPosition().written() == ""
    assert GetPosition.usage() == ["no parameters"]


def test_a_row_cannot_be_changed_after_it_was_checked() -> None:
    command = MoveClockwise(distance=5)
    with pytest.raises(ValidationError):
        command.distance = -5  # type: ignore[misc]  # that it is frozen is the point


def test_repeated_fields_must_exist_on_both_sides() -> None:
    class Numbered(Reply, args="{slot},{pulses}"):
        slot: Pulses
        pulses: Pulses

    class AskNumbered(RorzeCommand[Numbered], code="9XD", args="<{slot}>", echo=("slot",)):
        """番号: numbered."""

        slot: Pulses | None = Field(default=None)

    assert AskNumbered(slot=5).read_reply("5,7").pulses == 7
    assert AskNumbered().read_reply("6,7").slot == 6, "not given, so anything may come back"
    with pytest.raises(ValueError, match="asked was 5"):
        AskNumbered(slot=5).read_reply("6,7")
