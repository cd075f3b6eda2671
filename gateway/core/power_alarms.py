"""How the alarms of a loss of power say that it is certain, or only likely."""

from gateway.core.alarms import Facts
from gateway.texts import text


def facts_of_power_loss(loss: Facts) -> Facts:
    """Give the words that follow from its being `certain`."""
    how = "certain" if loss["certain"] else "likely"
    return {**loss, **{it: text(f"phrases.power-loss.{how}.{it}") for it in ("lost", "had_lost", "so")}}
