"""The configuration of the plant process: `plant.toml`."""

from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from gateway.config import AccessTable, Server
from gateway.core.tables import Fault, Slug, Table
from gateway.core.toml_files import load
from gateway.membership import Engine, check_gateway_url


class PlantEngine(Engine):
    """The servers of the plant, and what is known of its gateways without them."""

    replicas: int = Field(1, ge=1, le=5)
    """Servers that have a copy of the stream: 1, or 3 of a cluster."""
    gateways: dict[Slug, Annotated[str, AfterValidator(check_gateway_url)]] = Field({})
    """Addresses of gateways by their names: these count, whatever the registry says."""

    @model_validator(mode="after")
    def _be_odd(self) -> "PlantEngine":
        if self.replicas % 2 == 0:
            raise Fault(
                f"{self.replicas} replicas are no safer than {self.replicas - 1}, and stop with either: "
                "use 1 or 3",
                "replicas",
            )
        return self


class PlantConfig(Table):
    """A whole configuration of the plant process."""

    server: Server = Server()
    access: AccessTable = AccessTable()
    plant: PlantEngine

    @model_validator(mode="after")
    def _be_guarded(self) -> "PlantConfig":
        if self.access.mode == "open" and not (self.server.is_local and not self.server.trusted_proxies):
            raise Fault(
                "open is only for a plant process that this machine alone reaches: use keys, or listen on "
                "127.0.0.1 without trusted_proxies",
                *("access", "mode"),
            )
        return self


def load_plant(path: Path) -> PlantConfig:
    """Read a configuration file of a plant.

    :raises ConfigError: it cannot be read, or is none.
    """
    return load(path, PlantConfig)
