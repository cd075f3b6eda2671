"""Alarms of a loss of power, and of another controller: certain or only likely."""

from typing import Any, Final

from gateway.core.alarms import CauseKind, Facts
from gateway.core.next_calls import post
from gateway.core.rights import Right
from gateway.texts import text

COMPARE: Final = post("{subject}/comparisons", Right.SETUP, "compare-last-night", nightly="last")


def facts_of_power_loss(loss: Facts) -> Facts:
    """Give the words that follow from its being `certain`."""
    how = "certain" if loss["certain"] else "likely"
    return {
        **loss,
        **{phrase: text(f"phrases.power-loss.{how}.{phrase}") for phrase in ("lost", "had_lost", "so")},
    }


def swapped(what: str, manual: str) -> CauseKind[Any]:
    """The alarm of a body or a robot that came back otherwise than it was: it may be another controller."""
    return CauseKind(f"{what}.swapped", manual, (COMPARE,), facts=_facts_of_swap, words="swapped")


def _facts_of_swap(swap: Facts) -> Facts:
    how = "certain" if swap["certain"] else "likely"
    return {**swap, "first": swap["told"][0], "who": text(f"phrases.swap.{how}")}
