"""All settings of a body over HTTP, as one document; and those of homing and of the encoder."""

from fastapi import Request, Response

from api.bodies.speed_sets import Flash
from api.common.etags import IF_MATCH, expected_by, tagged
from api.common.requests import BodyId, new_router, origin, plant_of
from gateway.core.rights import Right
from gateway.operations import body_settings
from gateway.rorze.encoders import Encoder, Resolution, ResolutionRequest
from gateway.rorze.homing import Homing
from gateway.rorze.settings import BodySettings, ChangedSettings
from gateway.rorze.settings_document import BodySettingsChange, EncoderChange, HomingChange

router = new_router("body settings")


@router.get("/bodies/{body_id}/settings", Right.VIEW, response_model=BodySettings)
async def get_body_settings(request: Request, body_id: BodyId) -> Response:
    """Ask a body for the settings that FIS keeps (RC-420 manual 18), some ninety frames.

    Speed sets 0-29 and patterns stand at `/speed-sets` and `/patterns`; the standard set is here.
    """
    return tagged(await body_settings.read_settings(plant_of(request), origin(), body_id))


@router.patch("/bodies/{body_id}/settings", Right.SETUP, response_model=ChangedSettings, **IF_MATCH)
async def change_body_settings(
    request: Request, body_id: BodyId, change: BodySettingsChange, *, flash: Flash = False
) -> Response:
    """Set those of the named settings that differ, one by one, and read each back; refused while it moves.

    Null ends soft limits, error outputs and what interrupts do. With `If-Match` all settings are read before,
    and nothing is sent where they are otherwise than they were.
    """
    return await _change(request, body_id, change, flash=flash)


@router.get("/bodies/{body_id}/homing", Right.VIEW, response_model=Homing)
async def get_homing(request: Request, body_id: BodyId) -> Response:
    """Ask a body how it searches its origin, and how far its last search went (0PD)."""
    return tagged(await body_settings.read_homing(plant_of(request), origin(), body_id))


@router.patch("/bodies/{body_id}/homing", Right.SETUP, response_model=ChangedSettings, **IF_MATCH)
async def change_homing(
    request: Request, body_id: BodyId, change: HomingChange, *, flash: Flash = False
) -> Response:
    """Set what differs of the set-up of homing, and read it back; refused while the motor moves."""
    return await _change(request, body_id, change, flash=flash)


@router.get("/bodies/{body_id}/encoder", Right.VIEW, response_model=Encoder)
async def get_encoder(request: Request, body_id: BodyId) -> Response:
    """Ask a body what its encoder counts (6ED, 6MD), and how it is set up (RC-420 manual 13.7)."""
    return tagged(await body_settings.read_encoder(plant_of(request), origin(), body_id))


@router.patch("/bodies/{body_id}/encoder", Right.SETUP, response_model=ChangedSettings, **IF_MATCH)
async def change_encoder(
    request: Request, body_id: BodyId, change: EncoderChange, *, flash: Flash = False
) -> Response:
    """Set what differs of the set-up of the encoder, and read it back; refused while the motor moves."""
    return await _change(request, body_id, change, flash=flash)


@router.put("/bodies/{body_id}/encoder/resolution", Right.SETUP, response_model=Resolution, **IF_MATCH)
async def set_encoder_resolution(
    request: Request, body_id: BodyId, resolution: ResolutionRequest, *, flash: Flash = False
) -> Response:
    """Set multiplier and ratio (PAS, PBS) by what a turn is to motor and encoder (RC-420 manual 13.7.2)."""
    plant, expects = plant_of(request), expected_by(request)
    caller = origin()
    return _told(await body_settings.set_resolution(plant, caller, body_id, resolution, expects, flash=flash))


async def _change(
    request: Request, body_id: str, change: BodySettingsChange | HomingChange | EncoderChange, *, flash: bool
) -> Response:
    plant, expects = plant_of(request), expected_by(request, change)
    caller = origin()
    return _told(await body_settings.change_settings(plant, caller, body_id, change, expects, flash=flash))


def _told(changed: ChangedSettings | Resolution) -> Response:
    """Answer with the settings that were named, without the others."""
    return Response(changed.model_dump_json(exclude_unset=True), media_type="application/json")
