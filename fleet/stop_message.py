"""The message by which a plant is stopped besides HTTP."""

from typing import Literal

from pydantic import BaseModel, ConfigDict, Field


class StopMessage(BaseModel):
    """A stop of everything. It carries the hash of the caller's key, which is good for stops and no more."""

    model_config = ConfigDict(extra="ignore", frozen=True)

    mode: Literal["decelerate", "immediate"] = "decelerate"
    request_id: str = Field(pattern="^[A-Za-z0-9]{1,64}$")
    """Id by which the gateways' reports are matched to this stop."""
    key_prefix: str = ""
    key_sha256: str = ""
