"""The names in paths, and of what stands there, as every front end describes them."""

from collections.abc import Mapping
from typing import Annotated, Any, Final

from pydantic import Field

from gateway.families import registered

LineId = Annotated[str, Field(description="The line's id.", examples=["line1"])]

NAMES: Final[Mapping[str, Any]] = {
    "line_id": LineId,
    **{name: described for kind in registered() for name, described in kind.names.items()},
}
"""The descriptions of names in paths; all others are text."""
COLLECTIONS: Final = tuple(f"/{name}" for kind in registered() for name in kind.collections)
"""The resources of what is on lines."""
CALLED: Final = tuple(name for kind in registered() for name in kind.called or kind.collections)
"""Names of the kinds as people call them."""
