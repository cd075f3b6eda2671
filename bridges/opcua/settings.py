"""The table `[opcua]` of a bridge's file."""

import re
from pathlib import Path
from typing import Annotated, Final

from pydantic import AfterValidator, Field

from bridges.common.settings import BridgeFile, Table

SCHEME: Final = "opc.tcp://"
URI: Final = "urn:motion-gateway"
"""The namespace of the plant's nodes, and the application's name where the file has no other."""


def _check_listen(text: str) -> str:
    place = text.removeprefix(SCHEME).rstrip("/")
    host, _, port = place.rpartition(":")
    if not host or not re.fullmatch("[0-9]{1,5}", port) or int(port) > 65535:
        raise ValueError(f"must be an address and a port such as 0.0.0.0:4840, not {text!r}")
    return place


def _check_uri(text: str) -> str:
    if not re.fullmatch(r"urn:[!-~]{1,200}", text):
        raise ValueError(f"must be a URN such as urn:acme:fab2:motion-gateway, not {text!r}")
    return text


class Opcua(Table):
    """The server, and which clients it trusts."""

    listen: Annotated[str, AfterValidator(_check_listen)] = "0.0.0.0:4840"
    trusted: Annotated[Path, Field(strict=False)] | None = None
    """A folder with certificates of clients, or of authorities that signed them, as .der or .pem;
    None: `opcua/trusted` in the data directory."""
    application_uri: Annotated[str, AfterValidator(_check_uri)] = URI
    """Stands in the server's own certificate; of several bridges each needs one of its own."""
    good_for_s: float = Field(10.0, ge=0.1, le=3600)
    """A position that is older is told as uncertain."""
    position_rate: float = Field(2.0, ge=0.1, le=50)
    """Most readings a second of each position that a client monitors."""


class OpcuaFile(BridgeFile):
    """The file of a bridge to OPC UA."""

    opcua: Opcua = Opcua()

    @property
    def place(self) -> tuple[str, int]:
        """Where the server listens: host and port."""
        host, _, port = self.opcua.listen.rpartition(":")
        return host.strip("[]"), int(port)
