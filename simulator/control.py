"""The common part of all control interfaces, over HTTP: faults, the truth, the forms of requests."""

from collections.abc import Callable
from dataclasses import asdict
from typing import Annotated, Any, Protocol, TypeVar

from fastapi import FastAPI, Query
from pydantic import BaseModel, ConfigDict, Field

from simulator.faults import Direction, Fault, Faults, Switch
from simulator.truth import TruthLog

T = TypeVar("T")

MOST_FACTS = 10_000
"""Facts of the truth log in one answer."""


class Touchable(Protocol):
    """Where the running machine can be touched."""

    def touch(self, deed: Callable[[float], T]) -> T:
        """Do something to the machine now, and what follows from it."""


class Strict(BaseModel):
    """A model that takes nothing for what it is not."""

    model_config = ConfigDict(strict=True, extra="forbid", frozen=True)


class Power(Strict):
    """The power of something, on or off."""

    on: bool


class Hold(Strict):
    """A sensor held by hand; null lets go of it."""

    on: bool | None


class FaultSwitch(Strict):
    """One fault on the line; neither probability nor next frames turn it off."""

    fault: Fault = Field(strict=False)
    direction: Direction = Field(strict=False)
    probability: float = Field(default=0.0, ge=0, le=1, description="Chance of each frame.")
    next_frames: int = Field(default=0, ge=0, le=1_000_000, description="Frames that are hit for certain.")
    pass_frames: int = Field(default=0, ge=0, le=1_000_000, description="Frames that pass unharmed before.")
    delay_s: float = Field(default=0.1, ge=0, le=3600, description="Delay of silence, split, late, doubled.")
    spread_s: float = Field(default=0.0, ge=0, le=3600, description="A random part of this is added.")
    holds_up: bool = Field(default=False, description="True if frames behind a late one wait for it.")


class FactLine(Strict):
    """One fact of the truth log."""

    kind: str
    time_s: float
    body: str
    request: int | None
    facts: dict[str, Any]


class TruthTail(Strict):
    """Facts in order; `next` is what to ask for as `after` next time."""

    next: int
    facts: list[FactLine]


# All routes are coroutines: they run on the event loop's thread, as the machine does.
def add_faults(app: FastAPI, faults: Faults) -> None:
    """Offer the faults that hit frames on the line."""

    @app.get("/faults")
    async def list_faults() -> list[FaultSwitch]:
        """Tell the faults that are switched on."""
        return [FaultSwitch(**asdict(switch)) for switch in faults.switches]

    @app.put("/faults")
    async def set_fault(fault: FaultSwitch) -> list[FaultSwitch]:
        """Switch one fault in one direction."""
        faults.set(Switch(**fault.model_dump()))
        return await list_faults()

    @app.delete("/faults", status_code=204)
    async def clear_faults() -> None:
        """Switch all faults off."""
        faults.clear()


def add_truth(app: FastAPI, truth: TruthLog) -> None:
    """Offer the truth log."""

    @app.get("/truth")
    async def get_truth(
        after: Annotated[int, Query(ge=0)] = 0, limit: Annotated[int, Query(ge=1, le=MOST_FACTS)] = 1000
    ) -> TruthTail:
        """Tell what has really happened since the first `after` facts; the oldest may be forgotten."""
        return _tail(truth, after, limit)


def _tail(truth: TruthLog, after: int, limit: int) -> TruthTail:
    facts = truth.since(after)
    oldest = truth.count - len(facts)
    lines = [
        FactLine(
            kind=fact.kind,
            time_s=fact.at,
            body=f"{fact.body:02X}",
            request=fact.request,
            facts=fact.facts,
        )
        for fact in facts[:limit]
    ]
    return TruthTail(next=oldest + len(lines), facts=lines)
