"""All types of events that the gateway publishes."""

from collections.abc import Mapping
from typing import Any, Final

from pydantic import Field, create_model

from gateway import snapshot
from gateway.access.keys import KeyInfo
from gateway.config_file import Changes
from gateway.core.event_types import (
    CORE,
    LINE,
    SIGNALS,
    EventData,
    EventType,
    Nothing,
    alarm_types,
    news_types,
    table_of,
)
from gateway.core.parts import GATEWAY
from gateway.families import FAMILIES, registered
from gateway.port_scans import PortScan
from gateway.recordings import RecordingInfo


class ReloadFailed(EventData):
    """Why the configuration is served as before."""

    reason: str


OF_THE_CONFIGURATION = (
    EventType("gateway.reloaded", GATEWAY, Changes, "the lines are served as the file has them now"),
    EventType("gateway.reload_failed", GATEWAY, ReloadFailed, "the file was not taken; nothing has changed"),
)

OF_PORTS = news_types(
    "gateway.scan",
    GATEWAY,
    PortScan,
    finished="a scan of ports has asked at all of them",
    failed="a scan of ports was broken off",
)


OF_RECORDINGS = news_types(
    "gateway.recording",
    GATEWAY,
    RecordingInfo,
    finished="a recording is over, and can be downloaded",
    failed="the disk has not taken a recording",
)


class SecurityTrouble(EventData):
    """Why the security log cannot be written."""

    reason: str


class RefusalsBurst(EventData):
    """Refusals that came faster than by mistake."""

    refusals: int = Field(description="Their number.")
    seconds: float = Field(description="Within this time.")
    type: str = Field(description="The type of the last, as in the security log.")
    address: str | None = Field(description="The network address of the last.")


OF_ACCESS = (
    EventType(
        "gateway.security.trouble",
        GATEWAY,
        SecurityTrouble,
        "the security log cannot be written; what is to stand in it waits",
    ),
    EventType("gateway.security.recovered", GATEWAY, Nothing, "the security log can be written again"),
    EventType(
        "gateway.refusals.burst", GATEWAY, RefusalsBurst, "many requests or sign-ins were refused in a minute"
    ),
    EventType("gateway.key.made", GATEWAY, KeyInfo, "an administrator has made a key"),
    EventType("gateway.key.approved", GATEWAY, KeyInfo, "a second administrator has approved a key"),
    EventType("gateway.key.rotated", GATEWAY, KeyInfo, "a new key has taken the place of one that ends soon"),
    EventType("gateway.key.ends_soon", GATEWAY, KeyInfo, "a key ends within `access.key_warning_d`"),
    EventType("gateway.key.expired", GATEWAY, KeyInfo, "the time of a key is over"),
    EventType("gateway.key.revoked", GATEWAY, KeyInfo, "a key can never be used again"),
)


class PlantUnreachable(EventData):
    """Why the servers of the plant do not take the gateway's events."""

    reason: str


OF_THE_PLANT = (
    EventType(
        "plant.unreachable",
        GATEWAY,
        PlantUnreachable,
        "the servers of the plant do not take this gateway's events; they are sent later",
    ),
    EventType("plant.reached", GATEWAY, Nothing, "the servers of the plant take this gateway's events again"),
)


_FACTS: Final[dict[str, Any]] = {
    name: field for family in FAMILIES.values() for name, field in family.told_when_up.items()
}
LINE_UP: Final = EventType(
    "line.up",
    LINE,
    create_model(
        "LineUp",
        __base__=EventData,
        __doc__="The controllers that answered when the line was set up.",
        **_FACTS,
    ),
    "somebody answers on the line, and it is set up",
)


def event_types() -> Mapping[str, EventType]:
    """The types of the core and of every family, by their names."""
    families = (package.event_types for package in registered())
    alarmed = (path for family in FAMILIES.values() for path in family.alarmed())
    return table_of(
        [LINE_UP],
        CORE,
        alarm_types(alarmed),
        [SIGNALS],
        OF_THE_CONFIGURATION,
        OF_PORTS,
        OF_RECORDINGS,
        OF_ACCESS,
        OF_THE_PLANT,
        snapshot.TYPES,
        *families,
    )


EVENT_TYPES = event_types()
