"""SCARA robots over HTTP: what they are, where the finger is, and how one calculates with them."""

from datetime import datetime
from typing import Annotated

from fastapi import Body, Request, Response
from pydantic import BaseModel, Field

from api.common.requests import is_seen, json_response, new_router, origin, plant_of
from api.common.results import StopResult
from api.scaras.names import ScaraId
from api.stops import StopBody, perform_stop
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.times import age_ms_of, utc_of
from gateway.operations import scaras
from gateway.rorze.family import Rorze
from gateway.rorze.power import Homed
from gateway.rorze.scaras.geometry import Geometry, HeldGeometry, wanted
from gateway.rorze.scaras.record import ScaraPlace
from gateway.rorze.scaras.requests import Angle, Distance
from gateway.rorze.scaras.scara import Scara
from protocols.rorze.scara import Place

router = new_router("scaras")


class ScaraAxis(BaseModel):
    """An axis of a robot, and the body that drives it."""

    axis: int = Field(description="0 is the base, 1 the arm, 2 the finger.")
    body_id: str
    position: int | None = Field(description="In pulses, as last read.")


class ScaraInfo(BaseModel):
    """A SCARA robot as the gateway knows it, without asking it."""

    scara_id: str
    name: str
    line_id: str
    group_id: str = Field(description="The virtual body that stands for all its bodies.")
    online: bool = Field(description="Whether all its bodies can be asked now, as far as is known.")
    moving: bool | None = Field(description="Whether an axis moves; null while that is not known.")
    move_id: str | None = Field(description="The move that is not over yet.")
    homed: Homed = Field(description="yes where all its bodies are, no where one has lost its power.")
    power_cycled: bool = Field(
        description="A body has lost its power: where the finger is means nothing, and moves are refused."
    )
    axes: list[ScaraAxis]
    geometry: Geometry = Field(description="As it is configured.")
    own_path: int = Field(description="The stored path that the gateway overwrites for its lines.")


class ScaraList(BaseModel):
    """All SCARA robots of the configuration."""

    scaras: list[ScaraInfo]


class ScaraCoordinates(ScaraPlace):
    """Where the finger of a robot is now."""

    scara_id: str
    pulses: list[int] = Field(description="Of axes 0, 1 and 2.")
    moving: bool | None = Field(description="Whether an axis moves, so that it is elsewhere by now.")
    power_cycled: bool = Field(description="A body has lost its power: this means nothing then.")
    read_at: datetime = Field(description="When the answer of all axes came.")
    age_ms: float


class AxisPulses(RequestModel, json_schema_extra=example(pulses=[-10149, -10000, -16666])):
    """Positions of all axes."""

    pulses: list[Annotated[int, Field(gt=-1_000_000_000, lt=1_000_000_000)]] = Field(
        min_length=2, max_length=3, description="Of axes 0, 1 and 2; belt-linked robots have two."
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
        description="Between finger and X axis; left out, 0, or the only one of a belt-linked robot.",
    )

    def place(self) -> Place:
        """As one calculates."""
        return Place(self.x.exactly, self.y.exactly, 0.0 if self.angle is None else self.angle.exactly)


class Kinematics(ScaraPlace):
    """Positions of the axes, and where the finger is then."""

    scara_id: str
    pulses: list[int] = Field(description="Of axes 0, 1 and 2.")


class ControllerGeometry(Geometry):
    """What a controller holds."""

    body_id: str
    axis: int = Field(description="The one that it drives.")
    agrees: bool = Field(description="Whether it is what the configuration has.")


class ScaraGeometry(BaseModel):
    """The geometry as it is configured and as the controllers hold it."""

    scara_id: str
    agrees: bool = Field(description="Whether all controllers hold what the configuration has.")
    configured: Geometry
    controllers: list[ControllerGeometry]


class GeometryApplication(RequestModel, json_schema_extra=example(flash=False)):
    """How the geometry is given to the controllers."""

    flash: bool = Field(default=False, description="Write all their settings to flash memory too (FIS).")


@router.get("/scaras", Right.VIEW, any_scope=True, response_model=ScaraList)
async def list_scaras(request: Request) -> Response:
    """List all SCARA robots; nothing is sent."""
    there = plant_of(request).family(Rorze).scaras()
    return json_response(ScaraList(scaras=[_info(it) for it in there if is_seen(request, it.id)]))


@router.get("/scaras/{scara_id}", Right.VIEW, response_model=ScaraInfo)
async def get_scara(request: Request, scara_id: ScaraId) -> Response:
    """Tell what is known of a SCARA robot; nothing is sent."""
    return json_response(_info(_scara(request, scara_id)))


@router.get("/scaras/{scara_id}/coordinates", Right.VIEW, response_model=ScaraCoordinates)
async def get_scara_coordinates(request: Request, scara_id: ScaraId) -> Response:
    """Ask all axes in one frame where they stand (6PD), and calculate where the finger ends."""
    scara = _scara(request, scara_id)
    pulses, at = await scaras.stand(plant_of(request), origin(), scara_id)
    place = ScaraPlace.of(scaras.forward(plant_of(request), scara_id, pulses))
    return json_response(
        ScaraCoordinates(
            scara_id=scara.id,
            **dict(place),
            pulses=list(pulses),
            moving=_moving(scara),
            power_cycled=_power_cycled(scara),
            read_at=utc_of(at),
            age_ms=age_ms_of(at),
        )
    )


@router.post("/scaras/{scara_id}/kinematics/forward", Right.VIEW, response_model=Kinematics)
async def calculate_coordinates(request: Request, scara_id: ScaraId, axes: AxisPulses) -> Response:
    """Calculate where the finger ends at positions of the axes; nothing is sent."""
    return _kinematics(request, scara_id, axes.pulses)


@router.post("/scaras/{scara_id}/kinematics/inverse", Right.VIEW, response_model=Kinematics)
async def calculate_positions(request: Request, scara_id: ScaraId, wanted: WantedPlace) -> Response:
    """Calculate the positions of the axes for a place, the elbow bent as in the manual's example.

    Pulses are cut towards zero, as HLS answers them; the place in the answer is that of the whole pulses.
    Nothing is sent; 422 where the arm does not come.
    """
    plant, is_turned = plant_of(request), wanted.angle is not None
    pulses = scaras.inverse(plant, scara_id, wanted.place(), is_turned=is_turned)
    return _kinematics(request, scara_id, pulses)


@router.get("/scaras/{scara_id}/geometry", Right.VIEW, response_model=ScaraGeometry)
async def get_scara_geometry(request: Request, scara_id: ScaraId) -> Response:
    """Ask the controllers for the geometry they calculate with (HTD, HCD, HAD, HFD, HZD), and compare."""
    found = await scaras.read_geometry(plant_of(request), origin(), scara_id)
    return json_response(_geometry(_scara(request, scara_id), found))


@router.post("/scaras/{scara_id}/geometry/apply", Right.SETUP, response_model=ScaraGeometry)
async def apply_scara_geometry(
    request: Request,
    scara_id: ScaraId,
    application: Annotated[GeometryApplication, Body(default_factory=GeometryApplication)],
) -> Response:
    """Give the controllers the configured geometry (HTS, HCS, HAS, HFS, HZS), and read it back."""
    found = await scaras.apply_geometry(plant_of(request), origin(), scara_id, application.flash)
    return json_response(_geometry(_scara(request, scara_id), found))


@router.post("/scaras/{scara_id}/stop", Right.STOP, response_model=StopResult)
async def stop_scara(request: Request, scara_id: ScaraId, stop: StopBody) -> Response:
    """Stop all axes of a robot by software, with one frame for all and then one for each."""
    return await perform_stop(request, f"/scaras/{scara_id}", stop)


def _scara(request: Request, scara_id: str) -> Scara:
    return plant_of(request).family(Rorze).scara(scara_id)


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
            ScaraAxis(axis=axis, body_id=body.address, position=body.position)
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


def _kinematics(request: Request, scara_id: str, pulses: list[int] | tuple[int, ...]) -> Response:
    place = ScaraPlace.of(scaras.forward(plant_of(request), scara_id, pulses))
    scara = _scara(request, scara_id)
    return json_response(Kinematics(scara_id=scara.id, pulses=list(pulses), **dict(place)))


def _geometry(scara: Scara, found: list[HeldGeometry]) -> ScaraGeometry:
    controllers = [
        ControllerGeometry(**dict(held.geometry), axis=held.axis, body_id=body.address, agrees=held == it)
        for body, held, it in zip(scara.members, found, wanted(scara), strict=True)
    ]
    return ScaraGeometry(
        scara_id=scara.id,
        agrees=all(it.agrees for it in controllers),
        configured=Geometry.of(scara.robot),
        controllers=controllers,
    )
