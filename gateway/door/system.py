"""The gateway itself: which version it is, who asks it, and how open it is."""

import asyncio
from typing import Annotated, Final, Literal

from pydantic import Field

from gateway.access.posture import weakened
from gateway.access.principal import current
from gateway.access.roles import RIGHTS_OF, Role
from gateway.core.operation import Rows
from gateway.core.records import AnswerModel
from gateway.core.rights import Right
from gateway.core.tried import Untried, untried
from gateway.door.caller import sees
from gateway.plant import Plant
from gateway.version import VERSION as VERSION  # front ends ask for it here

ROWS: Final = Rows("system")
HEALTH: Final = Rows("health")


class Weakened(AnswerModel):
    """A setting that protects less than its default."""

    setting: str = Field(description="Name of the setting in the configuration file.")
    value: str | None = Field(description="Value of the setting; null for callers who are no admins.")
    meaning: str = Field(description="The risk that the value allows, in words.")


class UntriedLine(AnswerModel):
    """A line that rests on assumptions about real hardware."""

    line_id: str
    assumptions: list[str] = Field(description="Names of the assumptions; empty if none was ever tried.")
    meaning: str = Field(description="The meaning for the line, and what to do.")


class Posture(AnswerModel):
    """The protection of the gateway, and the assumptions that it rests on."""

    access: Literal["keys", "open"] = Field(
        description="`keys`: each request needs a key; `open`: none does."
    )
    tls: bool = Field(description="True if the gateway itself speaks TLS.")
    network: bool = Field(
        description="True if other machines can reach the gateway, a proxy's clients included."
    )
    weakened: Annotated[
        list[Weakened],
        Field(description="Every default of the configuration that protects less than it could."),
    ]
    untried: list[UntriedLine] = Field(
        description="Lines whose assumptions about real hardware were not all tried, or do not all hold."
    )


class Identity(AnswerModel):
    """The caller as the gateway knows it: name, role and rights."""

    name: str = Field(description="Name of the key, or of the person; `everybody` if no key is needed.")
    role: Role
    rights: list[Right]
    scope: list[str] | None = Field(
        description="The lines, bodies, groups and robots that the key is for; null means all."
    )


@ROWS.get("/system/identity", any_scope=True)
async def get_identity() -> Identity:
    """Tell the caller's name, role, rights and scope."""
    who = current()
    scope = None if who.scope is None else sorted(who.scope)
    rights = [right for right in Right if right in RIGHTS_OF[who.role]]
    return Identity(name=who.name, role=who.role, rights=rights, scope=scope)


@ROWS.get("/system/posture", any_scope=True, later=True)
async def get_posture(plant: Plant) -> Posture:
    """Tell the protection of the gateway, and each weakened default; values to admins only."""
    config = plant.config
    server = config.server
    told = current().role is Role.ADMIN
    return Posture(
        access=config.access.mode,
        tls=server.tls_certificate is not None,
        network=not server.is_local or bool(server.trusted_proxies),
        weakened=[
            Weakened(
                setting=setting.setting, value=str(setting.value) if told else None, meaning=setting.meaning
            )
            for setting in weakened(config)
        ],
        untried=[UntriedLine(**line._asdict()) for line in await asyncio.to_thread(_untried, plant)],
    )


def _untried(plant: Plant) -> list[Untried]:
    """Read the reports of the lines that the caller sees."""
    seen = (line for line in plant.config.lines if sees(plant.access, line.id))
    return [found for line in seen for found in untried(line)]


class Version(AnswerModel):
    """The program that runs here, and its version."""

    name: str
    version: str = Field(description="Semantic version of the gateway.")


@HEALTH.get("/version", Right.OPEN, later=True)
async def version() -> Version:
    """Tell the version."""
    return Version(name="motion-gateway", version=VERSION)
