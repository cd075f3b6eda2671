"""The mechanics that the controllers of a SCARA robot calculate with (RC-420 manual 13.10.7)."""

from collections.abc import Iterator, Sequence
from typing import Any, Final, Literal, NamedTuple

from gateway.core.errors import ControllerRefused, GatewayError
from gateway.core.exchange import Lane
from gateway.core.records import Record
from gateway.rorze_scara.scara import Scara
from protocols.rorze.flash import SaveSettings
from protocols.rorze.interpolation import (
    ConvertPulsesToCoordinates,
    Coordinates,
    GetArmLength,
    GetDrivenAxis,
    GetFingerLength,
    GetPulsesPerTurn,
    GetRobotType,
    RobotType,
    SetArmLength,
    SetDrivenAxis,
    SetFingerLength,
    SetPulsesPerTurn,
    SetRobotType,
)
from protocols.rorze.row import RorzeCommand
from protocols.rorze.scara import TURN, FingerPlace, Mechanics

ROUNDING: Final = 1.0
"""Rounding of a controller beyond its pulses, in micrometres or thousandths of a degree."""
TYPES: Final[dict[int, RobotType]] = {2: "two_axes_belt_linked", 3: "three_axes"}
WHOLE_TURN_MDEG: Final = 360_000
OUT_OF_REACH: Final = "0x63"
"""The refusal of coordinates that the mechanics do not reach (RC-420 manual 21)."""


class LinkLength(Record):
    """A length of the mechanics."""

    value: int
    unit: Literal["um"] = "um"


class Geometry(Record):
    """A robot's mechanics."""

    type: RobotType
    arm: LinkLength
    finger: LinkLength
    pulses_per_turn: list[float]

    @classmethod
    def of(cls, robot: Mechanics) -> "Geometry":
        """The configured mechanics."""
        return cls(
            type=TYPES[robot.axes],
            arm=LinkLength(value=robot.link),
            finger=LinkLength(value=robot.finger),
            pulses_per_turn=list(robot.pulses_per_turn),
        )


class HeldGeometry(NamedTuple):
    """The axis that a controller drives, and the mechanics that it holds."""

    axis: int
    geometry: Geometry


class GeometryDiffers(GatewayError):
    """A controller calculates with other mechanics than the configuration has, or of other positions."""

    kind = "geometry-differs"


def wanted(scara: Scara) -> list[HeldGeometry]:
    """The configuration for each controller."""
    return [HeldGeometry(axis, Geometry.of(scara.robot)) for axis in range(scara.robot.axes)]


async def read(scara: Scara) -> list[HeldGeometry]:
    """Ask the controllers what they hold, in the order of the axes; errors as of `Scara.ask`."""
    kinds = await scara.ask(GetRobotType())
    axes = await scara.ask(GetDrivenAxis())
    arms = await scara.ask(GetArmLength())
    fingers = await scara.ask(GetFingerLength())
    turns = [await scara.ask(GetPulsesPerTurn(axis=axis)) for axis in range(scara.robot.axes)]
    return [
        HeldGeometry(
            axis.axis,
            Geometry(
                type=kind.robot,
                arm=LinkLength(value=arm.length),
                finger=LinkLength(value=finger.length),
                pulses_per_turn=[turn.pulses for turn in pulses],
            ),
        )
        for kind, axis, arm, finger, *pulses in zip(kinds, axes, arms, fingers, *turns, strict=True)
    ]


async def write(scara: Scara, *, flash: bool) -> list[HeldGeometry]:
    """Give the controllers what the configuration has where they differ, and read it back.

    :raises GatewayError: one has refused it or did not answer; what was set stays set.
    :raises GeometryDiffers: they hold something else nevertheless.
    """
    async with scara.line.undivided([scara.group.number]):
        for body, held, configured in zip(scara.members, await read(scara), wanted(scara), strict=True):
            for command in _missing(held, configured):
                await body.ask(command)
        found = await read(scara)
        for body, held, configured in zip(scara.members, found, wanted(scara), strict=True):
            if held != configured:
                raise _differs(body.address, "holds another geometry than it was sent")
        if flash:
            await scara.ask(SaveSettings())
    return found


def _missing(held: HeldGeometry, configured: HeldGeometry) -> Iterator[RorzeCommand[Any]]:
    has, wants = held.geometry, configured.geometry
    if has.type != wants.type:
        yield SetRobotType(robot=wants.type)
    if held.axis != configured.axis:
        yield SetDrivenAxis(axis=configured.axis)
    if has.arm != wants.arm:
        yield SetArmLength(length=wants.arm.value)
    if has.finger != wants.finger:
        yield SetFingerLength(length=wants.finger.value)
    for axis, (before, pulses) in enumerate(zip(has.pulses_per_turn, wants.pulses_per_turn, strict=True)):
        if before != pulses:
            yield SetPulsesPerTurn(axis=axis, pulses=pulses)


async def require_agreement(scara: Scara, pulses: Sequence[int]) -> None:
    """See that every controller drives its axis, and finds the finger where the gateway does (HCD, HLD).

    So they have all been told these positions (HPS), and calculate with the same mechanics.

    :raises GeometryDiffers: one does not.
    :raises GatewayError: one did not tell.
    """
    place = scara.robot.place(pulses)
    driven = await scara.ask(GetDrivenAxis(), lane=Lane.VERIFY)
    try:
        found = await scara.ask(ConvertPulsesToCoordinates(), lane=Lane.VERIFY)
    except ControllerRefused as refusal:
        if refusal.error_code != OUT_OF_REACH:
            raise
        raise _differs(refusal.address, "calculates that the arm cannot be where it stands") from None
    for axis, (body, drives, told) in enumerate(zip(scara.members, driven, found, strict=True)):
        if drives.axis != axis:
            raise _differs(body.address, f"drives axis {drives.axis}, not {axis}")
        if not _agrees(scara.robot, place, told):
            raise _differs(
                body.address,
                f"finds the finger at X {told.x} um, Y {told.y} um, {told.angle} mdeg; the gateway at "
                f"X {place.x:.0f} um, Y {place.y:.0f} um, {place.direction:.0f} mdeg",
            )


def _agrees(robot: Mechanics, place: FingerPlace, told: Coordinates) -> bool:
    """True if both are the same but for a pulse of each axis: the manual does not tell the rounding."""
    pulse = sum(1 / turn for turn in robot.pulses_per_turn)
    slack_um = ROUNDING + pulse * TURN * (2 * robot.link + robot.finger)
    slack_mdeg = ROUNDING + pulse * WHOLE_TURN_MDEG
    beside = (told.angle - place.direction + WHOLE_TURN_MDEG / 2) % WHOLE_TURN_MDEG - WHOLE_TURN_MDEG / 2
    return abs(complex(told.x - place.x, told.y - place.y)) <= slack_um and abs(beside) <= slack_mdeg


def _differs(address: str, what: str) -> GeometryDiffers:
    return GeometryDiffers(
        f"{address} {what}; nothing was moved.",
        "Compare GET .../geometry with the configuration, and give the controllers the geometry by POST "
        ".../geometry/apply.",
    )
