"""A codec of binary protocols: the fields of a row one behind the other, each in a fixed number of bytes."""

from collections.abc import Mapping
from dataclasses import dataclass
from struct import Struct

from protocols.table import Codec, Form, Spoken, Wire, wire_of


@dataclass(frozen=True)
class Packed(Wire):
    """A value as a letter of `struct`, such as `H`; the most significant byte comes first."""

    layout: str


class PackedForm(Form):
    """The only form of a row; zeros behind its values fill up a frame."""

    def __init__(self, row: type[Spoken]) -> None:
        wires = {name: wire_of(field.annotation, field.metadata) for name, field in row.model_fields.items()}
        self.syntax = " ".join(wires)
        self._names = tuple(wires)
        self._layout = Struct(
            ">" + "".join(wire.layout for wire in wires.values() if isinstance(wire, Packed))
        )

    def variants(self) -> set[frozenset[str]]:
        """All fields."""
        return {frozenset(self._names)}

    def read(self, data: bytes, /) -> dict[str, object] | None:
        """Decode the bytes."""
        if len(data) < self._layout.size or any(data[self._layout.size :]):
            return None
        return dict(zip(self._names, self._layout.unpack_from(data), strict=True))

    def write(self, values: Mapping[str, object]) -> bytes:
        """Encode as bytes."""
        return self._layout.pack(*(values[name] for name in self._names))


class Packing(Codec):
    """Rows whose fields are all `Packed`."""

    def forms_of(self, row: type[Spoken], _syntax: str) -> tuple[Form, ...]:
        """Build the one form."""
        return (PackedForm(row),)
