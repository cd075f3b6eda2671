"""The configuration file: the server, and the lines in the words of their families."""

import re
from collections.abc import Iterable, Mapping, Sequence
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Final, Literal, Self
from urllib.parse import urlsplit

from pydantic import AfterValidator, Field, PlainValidator, create_model, model_validator

from gateway.access.roles import Role
from gateway.core import toml_files
from gateway.core.tables import Array, Fault, LineTable, Made, Table, refuse_repeats
from gateway.core.toml_lines import KeyPath
from gateway.families import EXTENSIONS, FAMILIES
from gateway.membership import PlantOfGateways
from transports.addresses import Address


def _check_address_of_host(host: str) -> str:
    if host != "localhost":
        try:
            ip_address(host)
        except ValueError:
            raise ValueError(f"must be an IP address such as 127.0.0.1, not {host!r}") from None
    return host


def _check_network(text: str) -> str:
    try:
        network = ip_network(text)
    except ValueError:
        raise ValueError(f"must be an IP address or network such as 10.0.0.0/24, not {text!r}") from None
    if not network.prefixlen:
        raise ValueError(f"must name proxies or networks, not everybody, as {text} does")
    return str(network)


_PRIVATE: Final = ("127.0.0.0/8", "10.0.0.0/8", "172.16.0.0/12", "192.168.0.0/16", "::1/128", "fc00::/7")
"""This machine and private networks (RFC 1918, RFC 4193), in which only a site's own machines are."""


def _is_in(host: str, networks: Iterable[str]) -> bool:
    """Say whether a host is an IP address in one of these networks; no name is looked up."""
    try:
        address = ip_address("127.0.0.1" if host == "localhost" else host)
    except ValueError:
        return False
    address = getattr(address, "ipv4_mapped", None) or address
    return any(address in ip_network(network) for network in networks)


def _check_root_path(text: str) -> str:
    if not re.fullmatch("(?:/[A-Za-z0-9._~-]+)*", text):
        raise ValueError(f"must be a path such as /motion, without a slash at its end, not {text!r}")
    return text


def _check_issuer(text: str) -> str:
    url = urlsplit(text)
    at_home = url.scheme == "http" and url.hostname in {"127.0.0.1", "localhost", "::1"}
    if not url.netloc or url.query or url.fragment or not (url.scheme == "https" or at_home):
        raise ValueError(f"must be an issuer such as https://id.example/realms/plant, not {text!r}")
    return text


def _check_host(text: str) -> str:
    if not re.fullmatch(r"[A-Za-z0-9.-]+|\[[0-9A-Fa-f:.]+\]", text):
        raise ValueError(f"must be a host name without scheme or port, not {text!r}")
    return text.lower()


def _check_syslog(text: str) -> str:
    url = urlsplit(f"//{text}")
    try:
        port = url.port
    except ValueError:
        port = None
    if not url.hostname or not port or url.netloc != text or url.username is not None:
        raise ValueError(f"must be a server with its port such as logs.example:6514, not {text!r}")
    return text


def _check_origin(text: str) -> str:
    url = urlsplit(text)
    if url.scheme not in {"http", "https"} or not url.netloc or text != f"{url.scheme}://{url.netloc}":
        raise ValueError(f"must be an origin such as http://panel.example:8080, not {text!r}")
    return text.lower()


class Server(Table):
    """Where the gateway listens, and what it allows."""

    host: Annotated[str, AfterValidator(_check_address_of_host)] = "127.0.0.1"
    port: int = Field(8420, ge=0, le=65535)
    """TCP port; 0 lets the operating system choose one."""
    allowed_hosts: Array[Annotated[str, AfterValidator(_check_host)]] = ()
    """Names accepted in the Host header besides those of the loopback interface."""
    allowed_origins: Array[Annotated[str, AfterValidator(_check_origin)]] = ()
    """Web pages of other origins that may use the gateway."""
    tls_certificate: Annotated[Path, Field(strict=False)] | None = None
    """Certificate with its chain (PEM); read again when it is renewed."""
    tls_key: Annotated[Path, Field(strict=False)] | None = None
    tls_client_ca: Annotated[Path, Field(strict=False)] | None = None
    """Authorities (PEM) whose certificates clients may show instead of a key, which the common name names."""
    tls_client_required: bool = False
    """True if a client without such a certificate is turned away at the handshake."""
    trusted_proxies: Array[Annotated[str, AfterValidator(_check_network)]] = ()
    """Addresses or networks of proxies that keep TLS for us; X-Forwarded-* of others means nothing."""
    client_networks: Array[Annotated[str, AfterValidator(_check_network)]] = ()
    """Networks that clients may come from besides this machine; empty for all."""
    line_networks: Array[Annotated[str, AfterValidator(_check_network)]] = ()
    """Networks that terminal servers of `tcp://` lines are in; empty for all that the file names."""
    root_path: Annotated[str, AfterValidator(_check_root_path)] = ""
    """The path at which a proxy has the gateway, and which it takes off."""
    max_connections: int = Field(1000, ge=1, le=50_000)
    """Connections at once, event streams included; beyond them only stops are served."""
    raw_commands: bool = False
    """True if commands may be sent as plain text."""
    latch: bool = False
    """True if an alarm keeps its subject from moving until it is reset.

    Alarms of the gateway itself keep everything from moving.
    """
    allow_endless_moves: bool = False
    """True if moves without an end may be started."""
    log_level: Literal["debug", "info", "warning", "error"] = "info"
    """The least that is logged."""
    log_format: Literal["text", "json"] = "text"
    """`json`: one object a line; text has priorities where the journal of systemd reads it."""
    on_exit: Literal["leave", "stop"] = "leave"
    """End of the gateway: `leave` lets motors go on to the ends of their moves, `stop` stops them.

    Moves without an end and JOGs are always stopped.
    """

    @property
    def is_local(self) -> bool:
        """True if only this machine reaches the gateway."""
        return self.host == "localhost" or ip_address(self.host).is_loopback

    def may_request(self, host: str) -> bool:
        """Say whether a request may add or search a terminal server there.

        Where no networks are configured, a private address may be one. A name is none: its name server
        decides where it leads.
        """
        return _is_in(host, self.line_networks or _PRIVATE)

    @property
    def names(self) -> tuple[str, ...]:
        """Names that the Host header may have besides those of the loopback interface."""
        if self.is_local or ip_address(self.host).is_unspecified:
            return self.allowed_hosts
        return (*self.allowed_hosts, f"[{self.host}]" if ":" in self.host else self.host)

    @model_validator(mode="after")
    def _be_private(self) -> Self:
        for key, other in ("tls_certificate", "tls_key"), ("tls_key", "tls_certificate"):
            if getattr(self, key) is None and getattr(self, other) is not None:
                raise Fault(f"is required with {other}", key)
        if self.tls_client_ca and not self.tls_certificate:
            raise Fault("takes tls_certificate and tls_key: certificates are shown over TLS", "tls_client_ca")
        if self.tls_client_required and not self.tls_client_ca:
            raise Fault("takes tls_client_ca, which says whose certificates are good", "tls_client_required")
        if not (self.is_local or self.tls_certificate or self.trusted_proxies):
            raise Fault(
                f"{self.host} is open to the network, where keys and commands must not go in plain text: set "
                "tls_certificate and tls_key, or trusted_proxies; or listen on 127.0.0.1",
                "host",
            )
        return self


class Oidc(Table):
    """A provider whose tokens are taken besides keys."""

    issuer: Annotated[str, AfterValidator(_check_issuer)]
    audience: str = Field(min_length=1)
    """Value of `aud` in tokens for this gateway."""
    roles: dict[str, Annotated[Role, Field(strict=False)]] = Field(min_length=1)
    """Role here for each word in the role claim."""
    role_claim: str = Field("roles", min_length=1)
    """The claim with the words, `realm_access.roles` for one inside another."""
    name_claim: str = Field("sub", min_length=1)
    scope_claim: str | None = Field(None, min_length=1)
    """The claim with addresses; left out, tokens are for everything."""
    algorithms: Array[
        Literal["RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "EdDSA"]
    ] = ("RS256", "ES256")


class AccessTable(Table):
    """Access control of the gateway."""

    mode: Literal["keys", "open"] = "keys"
    """`open`: everybody on this machine may do everything."""
    subscribers_per_key: int = Field(50, ge=1, le=50_000)
    requests_per_key: int = Field(200, ge=1, le=50_000)
    moves_per_key_and_s: int = Field(20, ge=1, le=10_000)
    key_lifetime_d: int = Field(365, ge=0, le=3650)
    """Days for which a key is good of which nothing else is said; 0: for ever."""
    key_warning_d: int = Field(30, ge=0, le=365)
    """Days before the end of a key at which it is warned of."""
    four_eyes: bool = False
    """True if a key of an admin takes a second admin."""
    lease_mode: Literal["off", "optional", "required"] = "optional"
    """Leases for motions and settings: never, only where another caller has one, or always."""
    oidc: Oidc | None = None


class SyslogTable(Table):
    """A server that takes a copy of the security log: RFC 5424 over TLS, as RFC 5425 has it."""

    address: Annotated[str, AfterValidator(_check_syslog)]
    """Name and port of the server, such as logs.example:6514."""
    ca: Annotated[Path, Field(strict=False)] | None = None
    """The certificates that its own is checked against (PEM); left out, those of the system."""
    certificate: Annotated[Path, Field(strict=False)] | None = None
    """Certificate with its chain (PEM) that the gateway shows, where the server asks for one."""
    key: Annotated[Path, Field(strict=False)] | None = None

    @model_validator(mode="after")
    def _be_whole(self) -> Self:
        if (self.certificate is None) != (self.key is None):
            raise Fault("certificate and key come together", "key" if self.key is None else "certificate")
        return self


class Security(Table):
    """How the security log is kept, and what is a burst of refusals."""

    keep_days: float = Field(365.0, ge=1, le=36_500)
    """Entries that are older are forgotten."""
    refusals_per_minute: int = Field(30, ge=0, le=10_000)
    """More refused requests and sign-ins are an alarm; 0 for none."""
    syslog: SyslogTable | None = None


def _check_hour(text: str) -> str:
    if not re.fullmatch(r"([01]\d|2[0-3]):[0-5]\d", text):
        raise ValueError(f"must be a time such as 02:30, not {text!r}")
    return text


class RecordingsTable(Table):
    """Memory for recordings, and their share of the disk."""

    memory_mib: int = Field(4, ge=1, le=1000)
    """Memory for the newest records of each line, packed: some 160,000 of them."""
    disk_mib: int = Field(500, ge=1, le=1_000_000)
    """Room on the disk for all recordings together; the oldest are deleted for newer ones."""
    before_alarm_s: float = Field(0.0, ge=0, le=3600)
    """Seconds that a recording begins before the alarm that causes it; with both 0 no alarm causes one."""
    after_alarm_s: float = Field(0.0, ge=0, le=3600)


class BackupsTable(Table):
    """Backups that are read by night."""

    nightly_at: Annotated[str, AfterValidator(_check_hour)] | None = None
    """HH:MM, in the time of this place; left out, none are read."""
    keep_days: int = Field(30, ge=1, le=3650)


EXTENSIONS_BY_KEY: Final = {extension.collections[0]: extension for extension in EXTENSIONS}


def _of_its_family(given: object) -> LineTable:
    """Read a line by the table of its protocol."""
    if isinstance(given, LineTable):
        return given
    if not isinstance(given, dict):
        return LineTable.model_validate(given)
    given = {"protocol": next(iter(FAMILIES)), **given}
    protocol = given["protocol"]
    if not isinstance(protocol, str) or protocol not in FAMILIES:
        known = " or ".join(repr(name) for name in FAMILIES)
        raise Fault(f"must be {known}, not {protocol!r}", "protocol")
    table = FAMILIES[protocol].line_table
    for key in (key for family in FAMILIES.values() for key in family.line_table.model_fields):
        if key in given and key not in table.model_fields:
            raise Fault(f"has no meaning on a line of protocol {protocol}", key)
    return table.model_validate(given)


class Config(Table):
    """A whole configuration, consistent in itself."""

    server: Server = Server()
    access: AccessTable = AccessTable()
    security: Security = Security()
    recordings: RecordingsTable = RecordingsTable()
    backups: BackupsTable = BackupsTable()
    plant: PlantOfGateways | None = None
    lines: Array[Annotated[LineTable, PlainValidator(_of_its_family)]] = ()

    def made(self) -> Mapping[str, Sequence[Made]]:
        """Things that extensions make of things on lines, by the names of their arrays."""
        return {key: getattr(self, key) for key in EXTENSIONS_BY_KEY}

    def served(self) -> dict[str, dict[str, Any]]:
        """Parts that each line serves, those of extensions included, by the line's id."""
        return {
            line.id: {
                **line.model_dump(),
                **{
                    key: tuple(thing.model_dump() for thing in made if thing.line == line.id)
                    for key, made in self.made().items()
                },
            }
            for line in self.lines
        }

    @model_validator(mode="after")
    def _be_guarded(self) -> Self:
        if self.access.mode == "open" and not (self.server.is_local and not self.server.trusted_proxies):
            raise Fault(
                "open is only for a gateway that this machine alone reaches: use keys, or listen on "
                "127.0.0.1 without trusted_proxies",
                *("access", "mode"),
            )
        return self

    @model_validator(mode="after")
    def _share_nothing(self) -> Self:
        if not self.lines:
            raise Fault("at least one [[lines]] table is required", "lines")
        refuse_repeats([line.id for line in self.lines], "lines", key="id")
        ports = [Address.parse(line.address) for line in self.lines]
        refuse_repeats(
            [(port.scheme, port.host, port.port, port.path) for port in ports], "lines", key="address"
        )
        taken: set[tuple[KeyPath, str]] = set()
        for index, line in enumerate(self.lines):
            for path, its_id in line.unique_ids().items():
                if (path, its_id) in taken:
                    raise Fault(f"another line has a {path[0]} of this id", "lines", index, *path)
                taken.add((path, its_id))
            if line.trace_file and line.trace_file in [other.trace_file for other in self.lines[:index]]:
                raise Fault("two lines cannot write to one file", "lines", index, "trace_file")
        return self

    @model_validator(mode="after")
    def _be_in_their_networks(self) -> Self:
        networks = self.server.line_networks
        for index, line in enumerate(self.lines):
            at = Address.parse(line.address)
            if networks and at.scheme == "tcp" and not _is_in(at.host, networks):
                raise Fault(
                    f"must be an IP address in server.line_networks ({', '.join(networks)}), not {at.host}",
                    *("lines", index, "address"),
                )
        return self

    @model_validator(mode="after")
    def _have_owners(self) -> Self:
        """A line that may be taken over hangs on a terminal server that can throw its client out."""
        for index, line in enumerate(self.lines):
            if not line.owners:
                continue
            refuse_repeats(line.owners, "owners")
            if self.plant is None or self.plant.name not in line.owners:
                raise Fault("have to name this gateway as plant.name does", "lines", index, "owners")
            if len(line.owners) > 1 and Address.parse(line.address).scheme != "tcp":
                raise Fault(
                    "a line with several owners takes a terminal server (tcp://) that ends old connections: "
                    "two cables on one line cannot be kept apart",
                    *("lines", index, "address"),
                )
        return self

    @model_validator(mode="after")
    def _place_made(self) -> Self:
        """Check that each made thing has an id of its own, and stands where its extension allows."""
        lines = {line.id: line for line in self.lines}
        taken = {*lines, *(taken_id for line in self.lines for taken_id in line.unique_ids().values())}
        for key, made in self.made().items():
            for index, thing in enumerate(made):
                if thing.id in taken:
                    raise Fault("is the id of something else", key, index, "id")
                taken.add(thing.id)
            try:
                EXTENSIONS_BY_KEY[key].table.require_places(made, lines)
            except Fault as fault:
                raise Fault(str(fault), key, *fault.path) from None
        return self


if not TYPE_CHECKING:  # which arrays there are is known when the extensions are
    Config = create_model(
        "Config",
        __base__=Config,
        __doc__=Config.__doc__,
        __module__=__name__,
        **{key: (Array[extension.table], ()) for key, extension in EXTENSIONS_BY_KEY.items()},
    )


def load(path: Path) -> Config:
    """Read a configuration file.

    :raises ConfigError: it cannot be read, or `parse` refuses it.
    """
    return toml_files.load(path, Config)


def parse(text: str, name: str) -> Config:
    """Read a configuration; `name` is what errors call its file.

    :raises ConfigError: not TOML, or not a configuration; every fault that was found has a line of its own.
    """
    return toml_files.parse(text, name, Config)
