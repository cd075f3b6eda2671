"""SCARA robots: what they are, where the finger is, how one calculates with them, and what they hold."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from typing import Annotated, Final, Literal

from pydantic import Field

from gateway.core.operation import Rows
from gateway.core.records import AnswerModel, RequestModel, SentBack, example
from gateway.core.rights import Right
from gateway.core.times import age_ms_of, utc_of
from gateway.door.caller import sees
from gateway.plant import Plant
from gateway.rorze.asked_body import Homed
from gateway.rorze_scara import geometry, paths
from gateway.rorze_scara.extension import Scaras
from gateway.rorze_scara.geometry import Geometry, HeldGeometry, wanted
from gateway.rorze_scara.record import Micrometres, ScaraPlace
from gateway.rorze_scara.requests import Angle, Distance, ViaPoint
from gateway.rorze_scara.scara import Scara
from protocols.rorze import interpolation
from protocols.rorze.interpolation import MOST_POINTS, PathPoint
from protocols.rorze.scara import FingerPlace

ROWS: Final = Rows("scaras")
PATHS: Final = Rows("scara paths")
PathNumber = Annotated[
    interpolation.Path, Field(description="Number of the interpolation path, 0-63.", examples=[3])
]


class ScaraAxis(AnswerModel):
    """An axis of a robot, and the body that drives it."""

    axis: int = Field(description="0 is the base, 1 the arm, 2 the finger.")
    body_id: str
    position: int | None = Field(description="Position in pulses, as last read.")


class ScaraInfo(AnswerModel):
    """A SCARA robot as the gateway knows it, without asking it."""

    scara_id: str
    name: str
    line_id: str
    group_id: str = Field(description="The virtual body that stands for all its bodies.")
    online: bool = Field(description="True if all its bodies can be asked now, as far as is known.")
    moving: bool | None = Field(description="True if an axis moves; null while that is not known.")
    move_id: str | None = Field(description="The move that is not over yet.")
    homed: Homed = Field(description="yes where all its bodies are, no where one has lost its power.")
    power_cycled: bool = Field(
        description="A body has lost its power: where the finger is means nothing, and moves are refused."
    )
    axes: list[ScaraAxis]
    geometry: Geometry = Field(description="Geometry in the configuration.")
    own_path: int = Field(description="The stored path that the gateway overwrites for its lines.")


class ScaraList(AnswerModel):
    """All SCARA robots of the configuration."""

    scaras: list[ScaraInfo]


class ScaraCoordinates(ScaraPlace):
    """Where the finger of a robot is now."""

    scara_id: str
    pulses: list[int] = Field(description="Positions of axes 0, 1 and 2.")
    moving: bool | None = Field(description="True if an axis moves, so that the finger is elsewhere by now.")
    power_cycled: bool = Field(description="A body has lost its power: this means nothing then.")
    read_at: datetime = Field(description="Time of the answer of all axes.")
    age_ms: float


class AxisPulses(RequestModel, json_schema_extra=example(pulses=[-10149, -10000, -16666])):
    """Positions of all axes."""

    pulses: list[Annotated[int, Field(gt=-1_000_000_000, lt=1_000_000_000)]] = Field(
        min_length=2, max_length=3, description="Positions of axes 0, 1 and 2; belt-linked robots have two."
    )


class WantedPlace(
    RequestModel,
    json_schema_extra=example(
        x={"value": 0, "unit": "mm"}, y={"value": 115, "unit": "mm"}, angle={"value": 90, "unit": "deg"}
    ),
):
    """A place of the finger."""

    x: Distance
    y: Distance
    angle: Angle | None = Field(
        None,
        description="Angle between finger and X axis; left out, 0, or the only one of a belt-linked robot.",
    )

    def place(self) -> FingerPlace:
        """As one calculates."""
        return FingerPlace(self.x.exactly, self.y.exactly, 0.0 if self.angle is None else self.angle.exactly)


class Kinematics(ScaraPlace):
    """Positions of the axes, and where the finger is then."""

    scara_id: str
    pulses: list[int] = Field(description="Positions of axes 0, 1 and 2.")


class ControllerGeometry(Geometry):
    """The mechanics that a controller holds."""

    body_id: str
    axis: int = Field(description="The one that it drives.")
    agrees: bool = Field(description="True if it equals the geometry in the configuration.")


class ScaraGeometry(AnswerModel):
    """The geometry as it is configured and as the controllers hold it."""

    scara_id: str
    agrees: bool = Field(description="True if all controllers hold the geometry in the configuration.")
    configured: Geometry
    controllers: list[ControllerGeometry]


class GeometryApplication(RequestModel, json_schema_extra=example(flash=False)):
    """How the geometry is given to the controllers."""

    flash: bool = Field(default=False, description="Write all their settings to flash memory too (FIS).")


PLAINLY: Final = GeometryApplication()


class PathDefinition(
    SentBack,
    json_schema_extra=example(
        points=[
            {
                "x": {"value": 255, "unit": "mm"},
                "y": {"value": 300, "unit": "mm"},
                "radius": {"value": 120, "unit": "mm"},
            },
            {"x": {"value": 255, "unit": "mm"}, "y": {"value": 450, "unit": "mm"}},
        ]
    ),
):
    """A whole path; without points it is cleared."""

    read_only = frozenset(("scara_id", "path"))

    points: list[ViaPoint] = Field(
        max_length=MOST_POINTS, description="Points in their order; the last is the end."
    )


class StoredPoint(AnswerModel):
    """A point of a path as the controllers hold it."""

    x: Micrometres | None
    y: Micrometres | None
    radius: Micrometres | None
    place: Literal["center"] | None


class StoredPath(AnswerModel):
    """A path as the controllers hold it."""

    scara_id: str
    path: int
    points: list[StoredPoint] = Field(description="Points in their order; empty where the path is.")


@ROWS.get("/scaras", any_scope=True)
async def list_scaras(plant: Plant) -> ScaraList:
    """List all SCARA robots; nothing is sent."""
    return ScaraList(
        scaras=[_info(scara) for scara in plant.family(Scaras).all() if sees(plant.access, scara.id)]
    )


@ROWS.get("/scaras/{scara_id}")
async def get_scara(scara: Scara) -> ScaraInfo:
    """Tell what is known of a SCARA robot; nothing is sent."""
    return _info(scara)


@ROWS.get("/scaras/{scara_id}/coordinates")
async def get_scara_coordinates(scara: Scara) -> ScaraCoordinates:
    """Ask all axes in one frame where they stand (6PD), and calculate where the finger ends."""
    pulses, at = await scara.stand()
    return ScaraCoordinates(
        scara_id=scara.id,
        **dict(ScaraPlace.of(scara.place_of(pulses))),
        pulses=list(pulses),
        moving=_moving(scara),
        power_cycled=_power_cycled(scara),
        read_at=utc_of(at),
        age_ms=age_ms_of(at),
    )


@ROWS.post("/scaras/{scara_id}/kinematics/forward", Right.VIEW)
async def calculate_coordinates(scara: Scara, axes: AxisPulses) -> Kinematics:
    """Calculate where the finger ends at positions of the axes; nothing is sent."""
    return _kinematics(scara, axes.pulses)


@ROWS.post("/scaras/{scara_id}/kinematics/inverse", Right.VIEW)
async def calculate_positions(scara: Scara, wanted: WantedPlace) -> Kinematics:
    """Calculate the positions of the axes for a place, the elbow bent as in the manual's example.

    Pulses are cut towards zero, as HLS answers them; the place in the answer is that of the whole pulses.
    Nothing is sent; 422 where the arm does not come.
    """
    return _kinematics(scara, scara.pulses_of(wanted.place(), is_turned=wanted.angle is not None))


@ROWS.get("/scaras/{scara_id}/geometry")
async def get_scara_geometry(scara: Scara) -> ScaraGeometry:
    """Ask the controllers for the geometry they calculate with (HTD, HCD, HAD, HFD, HZD), and compare."""
    return _geometry(scara, await geometry.read(scara))


@ROWS.post("/scaras/{scara_id}/geometry/apply", Right.SETUP)
async def apply_scara_geometry(scara: Scara, application: GeometryApplication = PLAINLY) -> ScaraGeometry:
    """Give the controllers the configured geometry (HTS, HCS, HAS, HFS, HZS), and read it back."""
    return _geometry(scara, await geometry.write(scara, flash=application.flash))


@PATHS.get("/scaras/{scara_id}/paths/{path}")
async def get_scara_path(scara: Scara, path: PathNumber) -> StoredPath:
    """Read a path from all controllers (HDD); 409 where they hold different ones."""
    return _stored(scara, path, await paths.read(scara, path))


@PATHS.put("/scaras/{scara_id}/paths/{path}", Right.SETUP)
async def write_scara_path(scara: Scara, path: PathNumber, wanted: PathDefinition) -> StoredPath:
    """Store a path in all controllers, undivided (HDS), in RAM; read it back."""
    wanted.require_unchanged(_stored(scara, path, {}))
    points = [point.point() for point in wanted.points]
    return _stored(scara, path, await paths.write(scara, path, points))


def _stored(scara: Scara, path: int, points: Mapping[int, PathPoint]) -> StoredPath:
    return StoredPath(scara_id=scara.id, path=path, points=[_point(point) for point in points.values()])


def _point(point: PathPoint) -> StoredPoint:
    x, y, radius = (
        None if length is None else Micrometres(value=length) for length in (point.x, point.y, point.radius)
    )
    return StoredPoint(x=x, y=y, radius=radius, place=point.place)


def _info(scara: Scara) -> ScaraInfo:
    return ScaraInfo(
        scara_id=scara.id,
        name=scara.name,
        line_id=scara.line.id,
        group_id=scara.group.address,
        online=all(body.online for body in scara.members),
        moving=_moving(scara),
        move_id=scara.move.id if scara.move else None,
        homed=_homed(scara),
        power_cycled=_power_cycled(scara),
        axes=[
            ScaraAxis(axis=axis, body_id=body.address, position=body.told.position)
            for axis, body in enumerate(scara.members)
        ],
        geometry=Geometry.of(scara.robot),
        own_path=scara.own_path,
    )


def _moving(scara: Scara) -> bool | None:
    states = {body.moving for body in scara.members}
    return True if True in states else None if None in states else False


def _homed(scara: Scara) -> Homed:
    told = {body.power.homed for body in scara.members}
    return "no" if "no" in told else "unknown" if "unknown" in told else "yes"


def _power_cycled(scara: Scara) -> bool:
    return any(body.power.cycled for body in scara.members)


def _kinematics(scara: Scara, pulses: Sequence[int]) -> Kinematics:
    place = ScaraPlace.of(scara.place_of(pulses))
    return Kinematics(scara_id=scara.id, pulses=list(pulses), **dict(place))


def _geometry(scara: Scara, found: list[HeldGeometry]) -> ScaraGeometry:
    controllers = [
        ControllerGeometry(
            **dict(held.geometry), axis=held.axis, body_id=body.address, agrees=held == configured
        )
        for body, held, configured in zip(scara.members, found, wanted(scara), strict=True)
    ]
    return ScaraGeometry(
        scara_id=scara.id,
        agrees=all(controller.agrees for controller in controllers),
        configured=Geometry.of(scara.robot),
        controllers=controllers,
    )
