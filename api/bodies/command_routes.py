"""One route for each row of the command table, with its own types: for bodies, groups and lines."""

from collections.abc import Callable, Coroutine
from functools import cache
from inspect import getdoc
from typing import Annotated, Any, Final

from fastapi import Body, Request, Response
from pydantic import BaseModel, ConfigDict, Field, SerializeAsAny, WithJsonSchema

from api.bodies.moves import ENDS_DECLARED, GROUP_ENDS_DECLARED, perform
from api.common.problems import DECLARED, Problem, instance_of, problem_of, wants_japanese
from api.common.requests import BodyId, GroupId, LineId, Wait, age_ms_of, json_response, new_router, plant_of
from api.common.routes import Router
from api.stops import StopResult, perform_stop
from gateway.core.errors import GatewayError
from gateway.core.move_record import Move
from gateway.core.rights import RIGHT_OF
from gateway.core.stops import StopMode
from gateway.rorze.bodies import Body as PlantBody
from gateway.rorze.bodies import Group, answer_or_raise, reply_of
from gateway.rorze.line import lane_of
from protocols.rorze.commands import COMMANDS, Row
from protocols.rorze.errors import lookup
from protocols.rorze.link_master import SetGroup
from protocols.rorze.row import LINK_MASTER, MODE_NAMES, LinkMasterCommand, RorzeCommand
from protocols.rorze.stops import StopDecelerating, StopImmediately
from protocols.table import Command, Reply

Endpoint = Callable[..., Coroutine[Any, Any, Response]]
AnyRow = type[Command[Any]]

AGE_HEADER = "Age-Ms"
ADDRESS_LENGTH = 3
"""`&3F`, before the code of an example."""
AXES_OF_THE_DEMO = 3
"""The manual's robot has more."""
STOP_MODES: Final[dict[str, StopMode]] = {
    StopDecelerating.code: "decelerate",
    StopImmediately.code: "immediate",
}


_ANY_REPLY: Final = {"anyOf": [{"type": "object", "additionalProperties": True}, {"type": "null"}]}


class MemberReply(BaseModel):
    """What one member answered."""

    model_config = ConfigDict(frozen=True)

    body_id: str
    reply: Annotated[SerializeAsAny[Reply] | None, WithJsonSchema(_ANY_REPLY)] = Field(
        description="As the same command to a single body is answered; null if there is none: see `error`."
    )
    error: Problem | None = Field(description="Why there is no reply.")


class GroupReply(BaseModel):
    """What the members of a group answered to one command."""

    model_config = ConfigDict(frozen=True)

    group_id: str
    members: list[MemberReply]


@cache
def routers() -> list[Router]:
    """Make the routes of the whole table."""
    bodies, groups, lines = map(new_router, ("commands", "group commands", "line commands"))
    for row in COMMANDS.values():
        if issubclass(row, LinkMasterCommand):
            _add(lines, "/lines/{line_id}", f"send_{snake(row)}", row, _line_endpoint(row))
        else:
            _add(bodies, "/bodies/{body_id}", f"send_{snake(row)}", row, _body_endpoint(row))
            _add(groups, "/groups/{group_id}", f"send_{snake(row)}_to_group", row, _group_endpoint(row))
    return [bodies, lines, groups]


def snake(row: AnyRow) -> str:
    """The row's name as it stands in the names of operations."""
    return row.name().replace("-", "_")


def _add(router: Router, place: str, name: str, row: Row, endpoint: Endpoint) -> None:
    to_group = router.tag == "group commands"
    add_row(
        router,
        place,
        name,
        row,
        endpoint,
        status_code=202 if row.starts_motion() else 200,
        response_model=_answer_type(row, to_group=to_group),
        responses=_responses(row, to_group=to_group),
        description=describe(row),
    )


def add_row(router: Router, place: str, name: str, row: AnyRow, endpoint: Endpoint, **told: Any) -> None:
    """Register a row's route, with the right that its effect takes.

    Its parameters may be left out altogether where none is required.
    """
    required = not row.may_be_empty() or any(field.is_required() for field in row.model_fields.values())
    endpoint.__annotations__["command"] = row if required else Annotated[row, Body(default_factory=row)]
    router.add(
        "POST",
        f"{place}/commands/{row.name()}",
        RIGHT_OF[row.effect],
        endpoint,
        name=name,
        summary=row.titles()[1].capitalize(),
        openapi_extra=_shown(row),
        **told,
    )


def _shown(row: AnyRow) -> dict[str, Any]:
    """The row's code, and the first example of its manual as a request body."""
    code = {"x-code": row.code} if row.code else {}
    if not row.model_fields:
        return code
    address = ADDRESS_LENGTH if issubclass(row, RorzeCommand) else 0
    command = row.read(row.example[0][address + len(row.code) :].lstrip())
    shown = {
        name: value[:AXES_OF_THE_DEMO] if isinstance(value, list) else value
        for name, value in command.model_dump(mode="json", exclude_none=True).items()
    }
    content = {"application/json": {"examples": {"of the manual": {"value": shown}}}}
    return {**code, "requestBody": {"content": content}}


def _answer_type(row: Row, *, to_group: bool) -> Any:
    if row.starts_motion():
        return GROUP_ENDS_DECLARED[200]["model"] if to_group else Move
    if row.code in STOP_MODES:
        return StopResult
    return GroupReply if to_group else row.reply_type()


def _responses(row: Row, *, to_group: bool) -> dict[int | str, dict[str, Any]]:
    if row.starts_motion():
        return GROUP_ENDS_DECLARED if to_group else ENDS_DECLARED
    if to_group or row.code in STOP_MODES:
        return DECLARED
    age = {"description": "How old the answer is, in milliseconds.", "schema": {"type": "number"}}
    return {**DECLARED, 200: {"description": "The controller's reply.", "headers": {AGE_HEADER: age}}}


def describe(row: Row) -> str:
    """The row's documentation: what the manual's page says, in few words."""
    japanese, english = row.titles()
    more = (getdoc(row) or "").partition("\n")[2].strip()
    modes = ", ".join(f"{mode} ({MODE_NAMES[mode]})" for mode in row.modes)
    facts = [
        f"Command `{row.code}`; operating modes {modes}; "
        f"{'allowed' if row.moving else 'refused'} while the motor moves; "
        f"{'allowed' if row.program else 'not allowed'} in user programs; retry class `{row.retry}`.",
        f"Example: `{row.example[0]}`"
        + (f" is answered `{row.example[1]}`." if len(row.example) > 1 else "."),
    ]
    errors = [f"- 0x{code:02X}: {lookup(code, row.code).en}" for code in sorted(row.errors)]
    listed = "Errors:\n\n" + "\n".join(errors) if errors else ""
    return "\n\n".join(part for part in (f"{japanese}: {english}.", more, *facts, listed) if part)


# bodies


def _body_endpoint(row: Row) -> Endpoint:
    if row.starts_motion():

        async def start(request: Request, body_id: BodyId, command: Any, wait: Wait = None) -> Response:
            return await perform(request, plant_of(request).body(body_id), command, wait)

        return start

    async def send(request: Request, body_id: BodyId, command: Any) -> Response:
        return await _send_to_body(request, plant_of(request).body(body_id), command)

    return send


async def _send_to_body(request: Request, body: PlantBody, command: RorzeCommand[Any]) -> Response:
    if command.code in STOP_MODES:
        return await perform_stop(request, [body], STOP_MODES[command.code])
    reply, answered = await body.ask(command)
    return json_response(reply, headers={AGE_HEADER: str(age_ms_of(answered.at))})


# groups


def _group_endpoint(row: Row) -> Endpoint:
    if row.starts_motion():

        async def start(request: Request, group_id: GroupId, command: Any, wait: Wait = None) -> Response:
            return await perform(request, plant_of(request).group(group_id), command, wait)

        return start

    async def send(request: Request, group_id: GroupId, command: Any) -> Response:
        return await _send_to_group(request, plant_of(request).group(group_id), command)

    return send


async def _send_to_group(request: Request, group: Group, command: RorzeCommand[Any]) -> Response:
    if command.code in STOP_MODES:
        return await perform_stop(request, group.members, STOP_MODES[command.code])
    results = await group.ask(command)
    members = [_member_reply(request, body, result) for body, result in results.items()]
    return json_response(GroupReply(group_id=group.address, members=members))


def _member_reply(request: Request, body: PlantBody, result: Reply | GatewayError) -> MemberReply:
    if isinstance(result, Reply):
        return MemberReply(body_id=body.address, reply=result, error=None)
    problem = problem_of(result, instance_of(request), japanese=wants_japanese(request))
    return MemberReply(body_id=body.address, reply=None, error=problem)


# lines


def _line_endpoint(row: Row) -> Endpoint:
    if row is SetGroup:
        return _set_group

    async def send(request: Request, line_id: LineId, command: Any) -> Response:
        line = plant_of(request).line(line_id)
        address = f"{line.id}.{LINK_MASTER:02X}"
        outcome = await line.submit(LINK_MASTER, command, lane_of(command))
        answered = answer_or_raise(address, command, outcome)
        reply = reply_of(LINK_MASTER, command, answered, address)
        return json_response(reply, headers={AGE_HEADER: str(age_ms_of(answered.at))})

    return send


async def _set_group(request: Request, line_id: LineId, command: Any) -> Response:
    """Define a group as `PUT /groups/{group_id}` does, so that the gateway knows its members."""
    plant = plant_of(request)
    line = plant.line(line_id)
    members = [f"{line.id}.{member}" for member in command.members]
    await plant.define_group(f"{line.id}.{command.group}", members)
    return json_response(SetGroup.reply_type()())
