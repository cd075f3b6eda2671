"""What is known of a body at one moment."""

from typing import Self

from pydantic import Field

from gateway.core.move_record import CountedIn
from gateway.core.records import Record
from gateway.rorze.bodies import Body
from protocols.rorze.status import CONTROLLER_STATUS_BITS, names_of


class BodyNow(Record):
    """A body, as far as is known."""

    body_id: str
    online: bool
    moving: bool | None
    move_id: str | None
    counted_in: CountedIn | None = Field(description="Of the position; null where that is not known.")
    position: int | None = Field(description="In `counted_in`, as last read.")
    homed: str
    power_cycled: bool
    status: list[str] | None

    @classmethod
    def of(cls, body: Body) -> Self:
        """Tell it without asking the controller."""
        bits = body.told.status_bits
        return cls(
            body_id=body.address,
            online=body.online,
            moving=body.moving if body.online else None,
            move_id=None if body.move is None else body.move.id,
            counted_in=body.counted_in,
            position=body.told.position,
            homed=body.power.homed,
            power_cycled=body.power.cycled,
            status=None if bits is None else names_of(bits, CONTROLLER_STATUS_BITS),
        )
