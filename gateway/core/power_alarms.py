"""How the alarms of a loss of power say that it is certain, or only likely."""

from typing import Final

from gateway.core.alarms import Facts

_CERTAIN: Final = {
    "lost": "has lost its power",
    "had_lost": "had lost its power",
    "so": "The",
    "lost_ja": "切れました",
    "had_lost_ja": "切れました",
    "so_ja": "",
}
_LIKELY: Final = {
    "lost": "seems to have lost its power",
    "had_lost": "seemed to have lost its power",
    "so": "If so, the",
    "lost_ja": "切れた可能性があります",
    "had_lost_ja": "切れた可能性がありました",
    "so_ja": "その場合、",
}


def facts_of_power_loss(loss: Facts) -> Facts:
    """Give the words that follow from its being `certain`."""
    return {**loss, **(_CERTAIN if loss["certain"] else _LIKELY)}
