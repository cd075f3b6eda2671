"""The configuration of a SCARA robot."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from gateway.core.tables import Array, Fault, Name, Slug, Table, named, refuse_repeats
from gateway.core.tables import LineTable as AnyLine
from gateway.rorze.config import BodyId, GroupId, RorzeLineTable
from protocols.rorze.interpolation import PulsesOfTurn
from protocols.rorze.notation import BILLION
from protocols.rorze.scara import BeltLinked, Mechanics, ThreeAxes

ROBOTS: Mapping[int, type[Mechanics]] = {2: BeltLinked, 3: ThreeAxes}
"""The mechanics by the number of axes (HTS)."""

Micrometres = Annotated[int, Field(ge=1, lt=BILLION)]


class ScaraTable(Table):
    """A SCARA robot: bodies of one line, which one frame starts (RC-420 manual 13.10)."""

    id: Slug
    name: Name | None = None
    line: Slug
    group: GroupId
    """The virtual body that stands for all members."""
    members: Array[BodyId] = Field(min_length=2, max_length=3)
    """The bodies of axes 0, 1 and 2: base, arm and finger; two where belts turn the finger (HTS, HCS)."""
    arm_um: Micrometres
    """Length of each of the two links (HAS)."""
    finger_um: Micrometres
    """Length from the third joint to the centre of the wafer (HFS)."""
    pulses_per_turn: Array[PulsesOfTurn]
    """Pulses per turn of each axis (HZS)."""
    own_path: int = Field(63, ge=0, le=63)
    """The interpolation path that the gateway overwrites for its lines (HDS)."""
    keep_out_um: int = Field(10_000, ge=0, lt=BILLION)
    """Least distance of a path from the origin unless it goes straight through it: nearer, the base would
    turn too fast, and the move is refused (RC-420 manual 13.10.6). The distance depends on the robot, an
    assumption; 0 refuses none."""
    tolerance_pulses: int = Field(2, ge=0, le=10_000)
    """Distance in pulses by which an axis may end beside the place that the gateway calculates. The manual
    tells neither the rounding nor the bend of the elbow, so the calculated place is an assumption."""
    on_fault: Literal["decelerate", "immediate"] = "decelerate"
    """Stop of the other axes when one fails."""

    @model_validator(mode="after")
    def _be_consistent(self) -> Self:
        refuse_repeats(self.members, "members")
        if len(self.pulses_per_turn) != len(self.members):
            raise Fault(f"must have {len(self.members)} numbers, one for each member", "pulses_per_turn")
        return self

    @property
    def group_number(self) -> int:
        """The virtual body number as it is, 128-158."""
        return int(self.group, 16)

    @property
    def robot(self) -> Mechanics:
        """Its mechanics."""
        return ROBOTS[len(self.members)](self.arm_um, self.finger_um, self.pulses_per_turn)

    def served(self) -> str:
        """Name it with its bodies, in words."""
        return f"SCARA robot {named(self.id, self.name)} of {', '.join(self.members)} on {self.line}"

    @classmethod
    def require_places(cls, made: Sequence[Self], lines: Mapping[str, AnyLine]) -> None:
        """Refuse what is not on its line, or is something else there, or has what another one has.

        :raises Fault: that is so.
        """
        busy: set[tuple[str, str]] = set()
        for index, scara in enumerate(made):
            line = lines.get(scara.line)
            try:
                scara.require_place_on(line if isinstance(line, RorzeLineTable) else None)
            except Fault as fault:
                raise Fault(str(fault), index, *fault.path) from None
            wanted = {(scara.line, number) for number in (scara.group, *scara.members)}
            if not busy.isdisjoint(wanted):
                raise Fault("has a body or the group of another one", index, "members")
            busy |= wanted

    def require_place_on(self, line: RorzeLineTable | None) -> None:
        """Refuse what is not on its line, or is something else there; errors as of `require_places`."""
        if line is None:
            raise Fault(f"there is no line {self.line} of protocol rorze", "line")
        bodies = {body.id for body in line.bodies}
        for position, member in enumerate(self.members):
            if member not in bodies:
                raise Fault(f"{member} is no body of line {self.line}", "members", position)
        others = [group.members for group in line.groups if group.id == self.group]
        if others not in ([], [self.members]):
            raise Fault("is a group of other members, or in another order", "group")
        if self.group_number in line.sweep_numbers:
            raise Fault("is among the line's sweep_groups", "group")
        if line.introducer != "&":
            raise Fault(f"cannot be addressed after {line.introducer!r}", "group")
