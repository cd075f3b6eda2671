"""Recordings of lines with what happened at them: taken, listed, downloaded."""

from pathlib import Path
from typing import Final

from pydantic import Field

from gateway.access.principal import current
from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.operation import Rows, Wait
from gateway.core.records import AnswerModel, RequestModel, example
from gateway.core.rights import Right
from gateway.door.caller import require, sees
from gateway.plant import Plant
from gateway.recordings import GATEWAY, RecordingInfo
from protocols.wording import as_given

ROWS: Final = Rows("recordings")
DAY_S: Final = 86_400
CONTENT: Final = "application/zip"


class RecordingList(AnswerModel):
    """Recordings, the newest first."""

    recordings: list[RecordingInfo]


class RecordingRequest(RequestModel, json_schema_extra=example(last_s=60)):
    """The time and the lines to record."""

    last_s: float = Field(
        default=0.0, ge=0, le=DAY_S, description="Seconds before now, as far as the memory reaches."
    )
    for_s: float = Field(default=0.0, ge=0, le=DAY_S, description="Seconds after now.")
    lines: list[str] | None = Field(
        default=None,
        min_length=1,
        max_length=1000,
        description="Only these lines with what is on them; left out, all that the caller may see.",
    )


@ROWS.post("/recordings", Right.VIEW, any_scope=True, over="The recording is over.", kept_at="/recordings")
async def start_recording(plant: Plant, wanted: RecordingRequest, *, wait: Wait = None) -> RecordingInfo:
    """Record the traffic of lines, with the events, the journal and the samples of that time.

    Nothing is sent to a controller. Keys record the lines in their scopes.
    """
    seen = [line_id for line_id in plant.ports() if sees(plant.access, line_id)]
    lines = seen if wanted.lines is None else wanted.lines
    for line_id in lines:
        plant.port(line_id)
    require(plant.access, Right.VIEW, *(() if len(lines) == len(plant.ports()) else lines))
    if not (wanted.last_s or wanted.for_s):
        raise InvalidRequest("No time is recorded: last_s and for_s are 0.", "Give one of them, or both.")
    record = plant.works.recordings.start(lines, wanted.last_s, wanted.for_s)
    await plant.works.recordings.wait(record, wait or 0.0)
    return record


@ROWS.get("/recordings", any_scope=True)
async def list_recordings(plant: Plant) -> RecordingList:
    """List the recordings of the lines that the caller may see."""
    return RecordingList(
        recordings=[record for record in plant.works.recordings.list() if _sees(plant, record)]
    )


@ROWS.get("/recordings/{recording_id}", any_scope=True, whole_plant=True)
async def get_recording(plant: Plant, recording_id: str, *, wait: Wait = None) -> RecordingInfo:
    """Get a recording, at once or when it is over."""
    record = _find(plant, recording_id)
    await plant.works.recordings.wait(record, wait or 0.0)
    return record


@ROWS.post("/recordings/{recording_id}/finish", Right.VIEW, any_scope=True, whole_plant=True)
async def finish_recording(plant: Plant, recording_id: str) -> RecordingInfo:
    """End a recording before its time; the part until now is kept."""
    record = _find(plant, recording_id)
    await plant.works.recordings.finish(record)
    return record


@ROWS.delete("/recordings/{recording_id}", Right.SETUP, leased=False, whole_plant=True)
async def delete_recording(plant: Plant, recording_id: str) -> RecordingInfo:
    """Break a recording off, or delete its file."""
    record = _find(plant, recording_id)
    await plant.works.recordings.remove(record)
    return record


def file_of(plant: Plant, recording_id: str) -> Path:
    """Find the file of a recording for a caller who may read all that is in it.

    :raises NotFound: there is none, or it is not over.
    """
    record = _find(plant, recording_id)
    if record.status != "finished":
        raise NotFound(f"The recording {as_given(recording_id)} has no file: it is {record.status}.")
    return plant.works.recordings.file_of(record)


def _find(plant: Plant, recording_id: str) -> RecordingInfo:
    record = plant.works.recordings.find(GATEWAY, recording_id)
    if record is None or not _sees(plant, record):
        raise NotFound(f"There is no recording {as_given(recording_id)}.", "GET /recordings lists them.")
    return record


def _sees(plant: Plant, record: RecordingInfo) -> bool:
    """Say whether the caller may read the whole recording; of a whole plant it takes a full scope."""
    if record.whole_plant:
        return current().scope is None
    return all(sees(plant.access, line_id) for line_id in record.lines)
