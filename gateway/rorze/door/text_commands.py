"""Commands to bodies as plain text, where the configuration allows it."""

from typing import Annotated, Any, Final

from pydantic import BaseModel, Field

from gateway.core.move_record import Move
from gateway.core.operation import Rows, Wait
from gateway.core.records import RequestModel, example
from gateway.core.rights import Right
from gateway.core.targets import CommandReplies, Target
from gateway.core.times import age_ms_of
from gateway.door.doing import do_text
from gateway.door.results import StopResult
from gateway.plant import Plant
from gateway.rorze.bodies import Body

ROWS: Final = Rows("commands")


class RawRequest(RequestModel, json_schema_extra=example(text="6PD")):
    """A command as it stands on the line, without introducer, body number and CR."""

    text: Annotated[str, Field(pattern=r"^[0-9A-Z*+/-]{3}[ -%'-~]*$", max_length=58, examples=["6PD"])]


class RawReply(BaseModel):
    """What was answered."""

    body_id: str
    sent: str = Field(description="The exact bytes, CR as \\r.")
    reply: str = Field(description="What followed the code in the reply, as it came.")
    age_ms: float


@ROWS.post("/bodies/{body_id}/raw", Right.SETUP, leased=False, result=RawReply | StopResult, may_begin=Move)
async def send_raw(
    plant: Plant, body: Body, target: Target, raw: RawRequest, *, wait: Wait = None, keyed: bool
) -> Any:
    """Send a command as text. A command that moves makes a move, and one that stops makes a stop."""
    command, result = await do_text(plant, target, raw.text, wait, keyed=keyed)
    if not isinstance(result, CommandReplies):
        return result
    return RawReply(
        body_id=body.address,
        sent=body.line.frame_of(body.number, command),
        reply=result.texts[0],
        age_ms=age_ms_of(result.at or 0.0),
    )
