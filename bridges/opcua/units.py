"""Units of positions as OPC UA writes them: UNECE codes, as numbers."""

from typing import Any, Final

from asyncua import ua

UNECE: Final = "http://www.opcfoundation.org/UA/units/un/cefact"
OWN: Final = "urn:motion-gateway:units"
CODES: Final = {
    "mm": ("MMT", "mm", "millimetre"),
    "um": ("4H", "µm", "micrometre"),
    "deg": ("DD", "°", "degree [unit of angle]"),
    "degree": ("DD", "°", "degree [unit of angle]"),
}
"""Units by the gateway's names: the common code of UN/ECE, the sign, and the name."""


def engineering_unit(unit: str) -> ua.EUInformation:
    """Give a unit; one without a code of UNECE is the bridge's own."""
    if unit not in CODES:
        return ua.EUInformation(OWN, -1, ua.LocalizedText(unit), ua.LocalizedText(unit))
    code, sign, name = CODES[unit]
    return ua.EUInformation(UNECE, unit_id(code), ua.LocalizedText(sign), ua.LocalizedText(name))


def unit_id(code: str) -> int:
    """Write a common code as a number: its characters, each of eight bits (Part 8, 5.6.4.3)."""
    return int.from_bytes(code.encode("ascii"), "big")


def scale_of(body: dict[str, Any]) -> tuple[str, float]:
    """Give the unit that a body's positions are told in, and the pulses of one."""
    pulses = body.get("pulses_per_unit")
    return (body["unit"], float(pulses)) if body.get("unit") and pulses else ("pulse", 1.0)
