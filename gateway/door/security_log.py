"""The security log: who was let in, who was refused, and who changed who may do what."""

from typing import Annotated, Final

from pydantic import Field

from gateway.access.territory import PlantAccess
from gateway.core.errors import NotFound, NotSent
from gateway.core.operation import Rows
from gateway.core.records import AnswerModel
from gateway.core.rights import Right
from gateway.security.entries import Entry

ROWS: Final = Rows("security log")


class SecurityEntries(AnswerModel):
    """Entries, the newest first."""

    entries: list[Entry]
    cursor: int | None = Field(
        description="Number to give as `cursor` for the next page, with older entries; null if there is none."
    )


@ROWS.get("/security", Right.ADMIN)
async def list_security_entries(
    access: PlantAccess,
    *,
    limit: Annotated[int, Field(ge=1, le=1000)] = 100,
    cursor: Annotated[int | None, Field(ge=1, description="Only those older than this cursor.")] = None,
) -> SecurityEntries:
    """List the security log: sign-ins, refusals, keys, sessions, leases, reloads and what else needs a name.

    No use of the gateway pushes an entry out; a flood is counted in one entry.
    """
    if access.security.data is None:
        raise NotFound("This gateway has no data directory, and so no security log.")
    try:
        found = list(await access.security.newest(limit, cursor))
    except OSError as error:
        raise NotSent(f"The security log cannot be read: {error.strerror}.") from None
    older = found[-1].number if len(found) == limit and found[-1].number > 1 else None
    return SecurityEntries(entries=found, cursor=older)
