"""A whole simulated line: an RC-400 with its RC-420s."""

from collections.abc import Iterable
from random import Random

from simulator.faults import Faults
from simulator.rorze.controller import Rc420
from simulator.rorze.rc400 import LinkSettings, Rc400
from simulator.truth import TruthLog

Rc400Line = Rc400[Rc420]


def build_line(
    bodies: Iterable[int],
    now: float,
    truth: TruthLog | None = None,
    settings: LinkSettings | None = None,
    seed: int = 0,
) -> Rc400Line:
    """Build a line with controllers of these body numbers, just powered on; the seed is the faults'."""
    truth = truth or TruthLog()
    axes = {body: Rc420(body, now, truth) for body in bodies}
    return Rc400(axes, truth, Faults(Random(seed)), settings)  # noqa: S311  # dice of a simulation
