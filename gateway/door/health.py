"""Which version runs; and what only HTTP tells: whether it lives, and whether it is ready."""

from typing import Final

from pydantic import BaseModel, Field

from gateway.core.operation import Rows
from gateway.core.rights import Right
from gateway.version import VERSION

__all__ = ["ROWS", "VERSION", "Version", "version"]

ROWS: Final = Rows("health")


class Version(BaseModel):
    """What is running here."""

    name: str
    version: str = Field(description="Semantic version of the gateway.")


@ROWS.get("/version", Right.OPEN)
async def version() -> Version:
    """Tell the version."""
    return Version(name="motion-gateway", version=VERSION)
