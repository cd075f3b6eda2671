"""The entries of the security log: one row for each type, and the form of all of them."""

from dataclasses import dataclass
from datetime import datetime
from typing import Any, Final

from pydantic import Field

from gateway.core.records import AnswerModel


class Entry(AnswerModel):
    """An entry of the security log, as it stands in its file."""

    number: int = Field(
        description="Number of the entry, one more than that of the entry before; none is given twice."
    )
    time: datetime
    type: str = Field(description="Type of the entry, such as `key.made`; docs/configuration.md lists all.")
    caller: str | None = Field(
        description="Name of the key or of the token's holder, or another cause such as SIGHUP; null if the "
        "caller is not known."
    )
    address: str | None = Field(description="The network address that the request came from.")
    request_id: str | None = Field(description="The X-Request-Id of the request.")
    target: str = Field(description="Subject of the entry: the name of a key, an address, a path.")
    count: int = Field(description="Number of like entries that were counted in this one in a flood, else 1.")
    since: datetime | None = Field(description="Time of the first of them; null where `count` is 1.")
    data: dict[str, Any] = Field(description="Further facts, by the entry's type.")
    previous: str = Field(description="The `hash` of the entry before, 64 zeros in the first.")
    hash: str = Field(description="SHA-256 of the entry's line up to this member, in hex.")


@dataclass(frozen=True)
class EntryType:
    """One type of entries."""

    name: str
    when: str
    """One sentence, without its full stop."""
    data: frozenset[str] = frozenset()
    """The names of what else belongs to it."""
    folds: bool = True
    """True if entries of one caller may be counted in one: for all that needs no right to administer."""
    is_refusal: bool = False
    """True if a burst of these entries raises an alarm."""


def _row(name: str, when: str, *data: str, folds: bool = True, is_refusal: bool = False) -> EntryType:
    return EntryType(name, when, frozenset(data), folds, is_refusal)


GATEWAY_STARTED: Final = _row("gateway.started", "the gateway has started", folds=False)
GATEWAY_ENDED: Final = _row("gateway.ended", "the gateway has ended as it should", folds=False)
SIGN_IN_ACCEPTED: Final = _row("sign_in.accepted", "a session has begun", "role")
SIGN_IN_REFUSED: Final = _row(
    "sign_in.refused", "a key shown at the sign-in is not good", "why", is_refusal=True
)
CREDENTIAL_REFUSED: Final = _row(
    "credential.refused", "a request has shown a credential that is not good", "why", is_refusal=True
)
REQUEST_REFUSED: Final = _row(
    "request.refused", "the caller does not have the right, or not there", "why", is_refusal=True
)
SESSION_ENDED: Final = _row("session.ended", "a session has ended before its time", "why", "of")
KEY_MADE: Final = _row("key.made", "a key was made", "role", "scope", "expires_at", folds=False)
KEY_CHANGED: Final = _row(
    "key.changed", "a key was changed", "role", "scope", "expires_at", "overlap", folds=False
)
KEY_APPROVED: Final = _row(
    "key.approved", "a second admin has approved a key", "role", "scope", "expires_at", folds=False
)
KEY_REVOKED: Final = _row("key.revoked", "a key was ended", "role", "scope", folds=False)
LEASE_TAKEN: Final = _row("lease.taken", "a part of the plant was leased", "lease", "ttl_s")
LEASE_TAKEN_OVER: Final = _row("lease.taken_over", "an admin has taken over a lease", "lease", "holder")
LEASE_RELEASED: Final = _row("lease.released", "a lease was given back", "lease", "holder")
LEASE_EXPIRED: Final = _row("lease.expired", "a lease was not renewed", "lease", "holder")
LEASE_BROKEN: Final = _row("lease.broken", "an admin has ended a lease of another", "lease", "holder")
RELOAD: Final = _row("reload", "another configuration is served", "lines", "needs_restart", folds=False)
RELOAD_REFUSED: Final = _row("reload.refused", "the configuration was not taken", "why", folds=False)
PORT_SCAN: Final = _row("port_scan.started", "ports are asked for controllers", "scan", folds=False)
LINE_ADDED: Final = _row("line.added", "a line was written into the configuration", "address", folds=False)
BODIES_ADDED: Final = _row(
    "bodies.added", "bodies were written into the configuration", "bodies", folds=False
)
LINE_TAKEN_OVER: Final = _row("line.taken_over", "a person has had this gateway take a line over", "old")
POSITION_NAMED: Final = _row("position.named", "positions were named", "names")
POWER_CYCLE_ACKNOWLEDGED: Final = _row("power_cycle.acknowledged", "a loss of power was acknowledged")
ALARM_RESET: Final = _row("alarm.reset", "an alarm was reset", "alarm", "cause")
LOG_MENDED: Final = _row(
    "log.mended", "a line that was cut off in writing was taken off", "text", folds=False
)
LOG_CHANGED: Final = _row("log.changed", "something else has changed the log", "why", folds=False)
LOG_LOST: Final = _row("log.lost", "so many entries could not be written", "lost", folds=False)
LOG_PRUNED: Final = _row(
    "log.pruned", "entries that are old enough were forgotten", "through", "hash", folds=False
)
SYSLOG_LOST: Final = _row("syslog.lost", "so many entries could not be sent", "lost", folds=False)

LEASE_ENDS: Final = {
    "taken_over": LEASE_TAKEN_OVER,
    "released": LEASE_RELEASED,
    "expired": LEASE_EXPIRED,
    "broken": LEASE_BROKEN,
}
