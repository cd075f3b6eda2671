"""The right that each command takes."""

from gateway.core.rights import RIGHT_OF, Right
from protocols.table import Effect


def test_every_effect_takes_a_right_that_somebody_must_have() -> None:
    assert set(RIGHT_OF) == set(Effect)
    assert Right.OPEN not in RIGHT_OF.values()


def test_who_may_only_look_or_stop_can_neither_move_nor_change_anything() -> None:
    harmless = {Right.VIEW, Right.STOP}
    assert {effect for effect, right in RIGHT_OF.items() if right in harmless} == {Effect.READ, Effect.STOP}
