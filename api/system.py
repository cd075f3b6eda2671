"""The gateway itself: how open it is, and tickets for those that can send no header."""

from typing import Annotated, Literal

from fastapi import Request, Response
from pydantic import BaseModel, Field

from api.common.requests import access_of, json_response, new_router, plant_of
from gateway.access.grants import TICKET_S
from gateway.access.posture import weakened
from gateway.access.principal import current
from gateway.access.roles import RIGHTS_OF, Role
from gateway.core.rights import Right

router = new_router("system")


class Ticket(BaseModel):
    """What opens one event stream."""

    ticket: str = Field(
        description="To be sent as the query parameter `ticket` of /events or /events/stream."
    )
    expires_in_s: float = Field(description="It is valid for this time, and once.")


class Weakened(BaseModel):
    """A setting that protects less than its default."""

    setting: str = Field(description="As the configuration writes it.")
    value: str | None = Field(description="What it is set to; null to those who are no admins.")
    meaning: str = Field(description="What that allows.")


class Posture(BaseModel):
    """How the gateway is protected."""

    access: Literal["keys", "open"] = Field(description="Whether a key is needed.")
    tls: bool = Field(description="Whether the gateway itself speaks TLS.")
    network: bool = Field(description="Whether other machines may reach it, a proxy's clients included.")
    weakened: Annotated[
        list[Weakened],
        Field(description="Every default of the configuration that protects less than it could."),
    ]


class Identity(BaseModel):
    """Who asks, and what they may do."""

    name: str = Field(
        description="The name of the key, or of the person; `everybody` where no key is needed."
    )
    role: Role
    rights: list[Right]
    scope: list[str] | None = Field(
        description="The lines, bodies, groups and robots that the key is for; null means all."
    )


@router.post("/tickets", Right.VIEW, any_scope=True, response_model=Ticket)
async def issue_ticket(request: Request) -> Response:
    """Give a ticket for one event stream, which ends with the session or the key it was given for.

    It is for browsers, whose WebSockets and EventSources send no key.
    """
    access = access_of(request)
    ticket = Ticket(ticket=access.ticket_for(request.scope), expires_in_s=TICKET_S)
    return json_response(ticket, headers={"Cache-Control": "no-store"})


@router.get("/system/identity", Right.VIEW, any_scope=True, response_model=Identity)
async def get_identity(_: Request) -> Response:
    """Tell who asks, with which role and rights, and for what."""
    who = current()
    scope = None if who.scope is None else sorted(who.scope)
    rights = [right for right in Right if right in RIGHTS_OF[who.role]]
    return json_response(Identity(name=who.name, role=who.role, rights=rights, scope=scope))


@router.get("/system/posture", Right.VIEW, any_scope=True, response_model=Posture)
async def get_posture(request: Request) -> Response:
    """Tell how the gateway is protected, and name each default that was weakened; values to admins only."""
    config = plant_of(request).config
    server = config.server
    told = current().role is Role.ADMIN
    posture = Posture(
        access=config.access.mode,
        tls=server.tls_certificate is not None,
        network=not server.is_local or bool(server.trusted_proxies),
        weakened=[
            Weakened(setting=it.setting, value=str(it.value) if told else None, meaning=it.meaning)
            for it in weakened(config)
        ],
    )
    return json_response(posture)
