"""The file of a bridge, `bridge.toml`: the tables that all protocols share."""

import re
from pathlib import Path
from typing import Annotated, Any, Final, Literal
from urllib.parse import urlsplit

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

LONGEST_KEY: Final = 4096
"""Characters that a file with a key is read for."""


class Table(BaseModel):
    """A TOML table: read-only, with the keys of its fields and no others."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)


def secret_in(path: Path) -> str:
    """Read a key or a password: the only line of a file.

    :raises ValueError: it cannot be read, or holds none.
    """
    try:
        with path.open(encoding="utf-8") as file:
            secret = file.read(LONGEST_KEY).strip()
    except OSError as error:
        raise ValueError(f"cannot be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ValueError("holds no text") from None
    if not secret or not secret.isprintable():
        raise ValueError("holds no secret: it has to be one line of text")
    return secret


def key_in(path: Path | None) -> str | None:
    """Read a key, if a file is named.

    :raises ValueError: it cannot be read, or holds none.
    """
    return None if path is None else secret_in(path)


def _check_secret(path: Path) -> Path:
    secret_in(path)
    return path


def _check_file(path: Path) -> Path:
    try:
        path.open("rb").close()
    except OSError as error:
        raise ValueError(f"cannot be read: {error.strerror}") from None
    return path


def check_url(text: str, schemes: tuple[str, ...]) -> str:
    """Refuse what is no address of these schemes; a password in it would be read by everybody."""
    try:
        url = urlsplit(text)
        port_fits = url.port is None or url.port > 0
    except ValueError:
        port_fits = False
    if not port_fits or url.scheme not in schemes or not url.hostname:
        raise ValueError(f"must be an address such as {schemes[0]}://127.0.0.1, not {text!r}")
    if url.password is not None or url.username is not None or url.query or url.fragment:
        raise ValueError("must be an address alone: user names and secrets have keys of their own")
    return text.rstrip("/")


def _check_gateway(text: str) -> str:
    return check_url(text, ("http", "https"))


def _check_name(text: str) -> str:
    if not re.fullmatch(r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}", text):
        raise ValueError(f"must be a name of letters, digits, _, . and -, not {text!r}")
    return text


def _check_listen(text: str) -> str:
    host, _, port = text.rpartition(":")
    if not host or not re.fullmatch("[0-9]{1,5}", port) or int(port) > 65535:
        raise ValueError(f"must be an address and a port such as 127.0.0.1:9464, not {text!r}")
    return text


SecretFile = Annotated[Path, Field(strict=False), AfterValidator(_check_secret)]
"""A file with a key or a password in its only line."""
ExistingFile = Annotated[Path, Field(strict=False), AfterValidator(_check_file)]
Name = Annotated[str, AfterValidator(_check_name)]


class GatewayTable(Table):
    """Where the gateway is, and the bridge's own key there."""

    url: Annotated[str, AfterValidator(_check_gateway)]
    name: Name = "gateway"
    """The gateway's name in other systems."""
    key_file: SecretFile | None = None
    """Holds a key with the role viewer for the whole plant; None: the gateway lets everybody in."""
    ca_file: ExistingFile | None = None
    """The authority that signed the gateway's certificate, if it is a private one."""


class BridgeTable(Table):
    """The bridge's own process."""

    listen: Annotated[str, AfterValidator(_check_listen)] | None = None
    """Address of `/metrics` and `/status` over HTTP, open to every client that reaches it; None: not
    served."""
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    log_format: Literal["text", "json"] = "text"


class CallerTable(Table):
    """One who may give commands: its key at the gateway decides what it may."""

    key_file: SecretFile | None = None
    """File of the caller's API key; None for a gateway without access control."""


class BridgeFile(Table):
    """The whole file. A protocol's own is a class made of this, with the table of the protocol."""

    gateway: GatewayTable
    bridge: BridgeTable = BridgeTable()
    callers: dict[Name, CallerTable] = {}
    mqtt: Any = None
    opcua: Any = None

    @property
    def secret_files(self) -> list[Path]:
        """Every file that holds a secret: only the bridge's own user should be able to read it."""
        files = (self.gateway.key_file, *(caller.key_file for caller in self.callers.values()))
        return [file for file in files if file is not None]
