"""Parts of a plant, as scopes and leases name them."""

from typing import NamedTuple


class Part(NamedTuple):
    """A body, a robot or a whole line, and the line it is on."""

    line_id: str
    address: str

    @property
    def is_line(self) -> bool:
        """Say whether the part is a whole line."""
        return self.address == self.line_id

    def contains(self, other: "Part") -> bool:
        """Say whether the other part is this one, or on this line."""
        return self == other or (self.is_line and self.line_id == other.line_id)

    def meets(self, other: "Part") -> bool:
        """Say whether one of both contains the other."""
        return self.contains(other) or other.contains(self)
