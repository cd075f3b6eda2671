"""The security log, as an administrator reads it."""

from collections.abc import Sequence

from gateway.core.errors import NotFound, NotSent
from gateway.core.rights import Right
from gateway.operations.caller import needs
from gateway.plant import Plant
from gateway.security.entries import Entry


@needs(Right.ADMIN, whole_plant=True)
async def newest(plant: Plant, limit: int, before: int | None) -> Sequence[Entry]:
    """Read so many entries, the newest first, of those before a number.

    :raises NotFound: there is no security log.
    :raises NotSent: it cannot be read.
    """
    if plant.security.data is None:
        raise NotFound("This gateway has no data directory, and so no security log.")
    try:
        return await plant.security.newest(limit, before)
    except OSError as error:
        raise NotSent(f"The security log cannot be read: {error.strerror}.") from None
