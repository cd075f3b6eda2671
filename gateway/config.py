"""What the configuration file may say: the server, the lines, their bodies and groups."""

import re
import tomllib
from collections.abc import Iterable
from ipaddress import ip_address, ip_network
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar
from urllib.parse import urlsplit

from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    PlainValidator,
    ValidationError,
    model_validator,
)
from pydantic_core import ErrorDetails

from gateway.access.roles import Role
from gateway.core.toml_lines import KeyPath, LineIndex
from gateway.rorze.units import Scale
from protocols.fics.link import Terminator
from protocols.fics.notation import LAST_UNIT, MOST_AXES, AxisName, AxisSystem
from protocols.rorze.link import frame
from protocols.rorze.row import FIRST_GROUP, LAST_BODY, LAST_GROUP, LINK_MASTER
from protocols.wording import sentence, unknown
from transports import create
from transports.addresses import Address


class ConfigError(ValueError):
    """The configuration cannot be used: each line names file, line number, key and what is expected."""


class _Fault(ValueError):
    """A fault at a place inside the table whose validator raises it."""

    def __init__(self, message: str, *path: str | int) -> None:
        super().__init__(message)
        self.path = path


class _Table(BaseModel):
    """A TOML table: read-only, with the keys of its fields and no others."""

    model_config = ConfigDict(extra="forbid", frozen=True, strict=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _know_every_key(cls, table: Any) -> Any:
        for key in table if isinstance(table, dict) else ():
            if key not in cls.model_fields:
                raise _Fault(f"unknown key; {unknown(key, cls.model_fields)}", key)
        return table


def _hex_between(lowest: int, highest: int) -> AfterValidator:
    def canonical(text: str) -> str:
        if not re.fullmatch("[0-9A-Fa-f]{2}", text) or not lowest <= int(text, 16) <= highest:
            raise ValueError(f"must be two hex digits from {lowest:02X} to {highest:02X}, not {text!r}")
        return text.upper()

    return AfterValidator(canonical)


def _check_slug(text: str) -> str:
    if not re.fullmatch("[a-z][a-z0-9-]{0,31}", text):
        raise ValueError(
            f"must be up to 32 lower-case letters, digits and hyphens, a letter first, not {text!r}"
        )
    return text


def _check_address(text: str) -> str:
    create(text)
    return text


def _check_address_of_host(host: str) -> str:
    if host != "localhost":
        try:
            ip_address(host)
        except ValueError:
            raise ValueError(f"must be an IP address such as 127.0.0.1, not {host!r}") from None
    return host


def _check_network(text: str) -> str:
    try:
        return str(ip_network(text))
    except ValueError:
        raise ValueError(f"must be an IP address or network such as 10.0.0.0/24, not {text!r}") from None


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


def _check_origin(text: str) -> str:
    url = urlsplit(text)
    if url.scheme not in {"http", "https"} or not url.netloc or text != f"{url.scheme}://{url.netloc}":
        raise ValueError(f"must be an origin such as http://panel.example:8080, not {text!r}")
    return text.lower()


def _check_pipeline(value: int) -> int:
    if value != 1:
        raise ValueError(
            "must be 1: replies carry no number, so with a second command under way"
            " a late reply could be credited to the wrong one"
        )
    return value


def _check_printable(text: str) -> str:
    if not text.isprintable() or not text.strip():
        raise ValueError("must be printable text")
    return text


LAST_COMMENT = 7
"""User comments of a controller (RC-420 manual 14, 9VS)."""

T = TypeVar("T")
Array = Annotated[tuple[T, ...], Field(strict=False)]
"""A TOML array; its elements stay strict."""

BodyId = Annotated[str, _hex_between(0, LAST_BODY)]
GroupId = Annotated[str, _hex_between(FIRST_GROUP, LAST_GROUP)]


class Units(_Table, Scale):
    """How pulses of a body relate to a physical unit."""


def _check_comment(number: object) -> int:
    if number is False:
        return 0
    if isinstance(number, bool) or not isinstance(number, int) or not 0 <= number <= LAST_COMMENT:
        raise ValueError(f"must be from 1 to {LAST_COMMENT}, or 0 or false for none")
    return number


class Body(_Table):
    """A controller on a line."""

    id: BodyId
    """Setting of the rotary switches, 00-77 hex (RC-420 manual 2.2)."""
    name: Annotated[str, Field(max_length=64), AfterValidator(_check_printable)] | None = None
    units: Units | None = None
    position_tolerance: int = Field(0, ge=0, le=1_000_000)
    """Pulses by which a move may miss its target in encoder mode, where the motor need not stop exactly at it
    (RC-420 manual 13.7.5)."""

    power_comment: Annotated[int, PlainValidator(_check_comment)] = 7
    """User comment (9VS), 1-7, in which a mark tells that the power was kept; 0 or false: none."""
    needs_origin: bool = True
    """After a loss of power it refuses motions to places until it is homed, or somebody agrees."""

    @property
    def number(self) -> int:
        """The body number as it is, 0-119."""
        return int(self.id, 16)


class Group(_Table):
    """A virtual body: a command to it goes to all members at once (RC-420 manual 12)."""

    id: GroupId
    members: Array[BodyId]
    """In the order they are sent to the link master."""

    @property
    def number(self) -> int:
        """The virtual body number as it is, 128-158."""
        return int(self.id, 16)

    @model_validator(mode="after")
    def _fit_the_frame_that_defines_it(self) -> Self:
        if len(self.members) < 2:
            raise _Fault("must name at least 2 bodies", "members")
        _refuse_repeats(self.members, "members")
        try:
            frame(LINK_MASTER, f"XVS{','.join((self.id, *self.members))}")
        except ValueError as error:
            raise _Fault(f"names too many bodies for one definition: {error}", "members") from error
        return self


def _check_system(given: Any) -> Any:
    """Take one word for all axes, or a list with one for each."""
    if isinstance(given, str):
        return _axis_system(given)
    if not isinstance(given, list | tuple):
        raise _Fault(f"must be {_SYSTEMS}, or a list with one of them for each axis")
    return tuple(_axis_system(word, place) for place, word in enumerate(given))


def _axis_system(word: object, *place: int) -> AxisSystem:
    if not isinstance(word, str) or word not in tuple(AxisSystem):
        raise _Fault(f"must be {_SYSTEMS}, not {word!r}", *place)
    return AxisSystem(word)


_SYSTEMS = "'mm', 'pulse' or 'degree'"
System = Annotated[AxisSystem | tuple[AxisSystem, ...], PlainValidator(_check_system)]

THETA = "@"


class RobotUnit(_Table):
    """Axes of a robot that are commanded together (C-HOST manual 1-5, 1-6)."""

    number: int = Field(ge=1, le=LAST_UNIT)
    axes: Array[AxisName]
    """Names of the user axes in the order of coordinates: X, Y, Z .. and @ for theta."""
    system: System | None = None
    """What the user axes are counted in; left out, theta is counted in degrees and all others in mm."""
    motor_axes: Array[AxisName] = ()
    """Names of the motor axes, where they are not the user axes."""
    motor_system: System | None = None
    """What the motor axes are counted in; left out, those that are no user axes are counted in degrees."""

    @model_validator(mode="after")
    def _name_each_axis_once(self) -> Self:
        for key, names in ("axes", self.axes), ("motor_axes", self.motor_axes):
            if len(names) > MOST_AXES:
                raise _Fault(f"must name at most {MOST_AXES} axes", key)
            _refuse_repeats(names, key)
        if not self.axes:
            raise _Fault("must name at least one axis", "axes")
        return self

    @model_validator(mode="after")
    def _count_each_axis_in_one_system(self) -> Self:
        _require_one_each(self.axes, "system", self.system)
        if self.motor_system is not None and not self.motor_axes:
            raise _Fault("has no meaning without motor_axes", "motor_system")
        _require_one_each(self.motor_axes, "motor_system", self.motor_system)
        users = self._user_systems()
        for axis, system in self._motor_systems().items():
            if users.get(axis, system) is not system:
                raise _Fault(
                    f"axis {axis} is one of axes too, and is counted in {users[axis]} there", "motor_system"
                )
        return self

    @property
    def systems(self) -> dict[str, AxisSystem]:
        """What each axis is counted in, user axes and motor axes alike: one that is both has one system."""
        return self._motor_systems() | self._user_systems()

    def _user_systems(self) -> dict[str, AxisSystem]:
        if self.system is None:
            return {it: AxisSystem.DEGREE if it == THETA else AxisSystem.MILLIMETRE for it in self.axes}
        return _each(self.axes, self.system)

    def _motor_systems(self) -> dict[str, AxisSystem]:
        if self.motor_system is None:
            users = self._user_systems()
            return {it: users.get(it, AxisSystem.DEGREE) for it in self.motor_axes}
        return _each(self.motor_axes, self.motor_system)


def _each(axes: tuple[str, ...], system: AxisSystem | tuple[AxisSystem, ...]) -> dict[str, AxisSystem]:
    if isinstance(system, AxisSystem):
        return dict.fromkeys(axes, system)
    return dict(zip(axes, system, strict=True))


def _require_one_each(axes: tuple[str, ...], key: str, system: object) -> None:
    if isinstance(system, tuple) and len(system) != len(axes):
        raise _Fault(f"must have one entry for each of {', '.join(axes)}, not {len(system)}", key)


class Robot(_Table):
    """A Fics robot, alone on its line."""

    id: Annotated[str, AfterValidator(_check_slug)]
    name: Annotated[str, Field(max_length=64), AfterValidator(_check_printable)] | None = None
    units: Array[RobotUnit]

    @model_validator(mode="after")
    def _have_units(self) -> Self:
        if not self.units:
            raise _Fault("must list at least one unit", "units")
        _refuse_repeats([unit.number for unit in self.units], "units", key="number")
        return self


class Line(_Table):
    """A port with a link master and its bodies behind it, or with a robot."""

    id: Annotated[str, AfterValidator(_check_slug)]
    address: Annotated[str, AfterValidator(_check_address)]
    protocol: Literal["rorze", "fics"] = "rorze"
    introducer: Literal["&", "$", "#"] = "&"
    """What begins a command; after `$` and `#` a body number has one digit (RC-420 manual 12)."""
    reply_timeout_s: float = Field(0.5, gt=0, le=60)
    """From a command's last byte to the deadline of its reply; flash commands are given longer."""
    late_reply_s: float = Field(2.0, ge=0, le=60)
    """How long after its deadline a reply may still arrive."""
    pipeline: Annotated[int, AfterValidator(_check_pipeline)] = 1
    stop_mode: Literal["interject", "after_reply"] = "interject"
    """Whether a stop is sent at once or, should the link master not take it, after the reply under way."""
    poll_interval_s: float = Field(0.2, ge=0.01, le=60)
    """How often a moving body is asked whether it still moves."""
    trace_entries: int = Field(10_000, ge=0, le=1_000_000)
    """Records of the line's traffic that are kept in memory."""
    trace_file: Annotated[Path, Field(strict=False)] | None = None
    trace_file_bytes: int = Field(8_000_000, ge=4096)
    """Size of each file of the trace's ring."""
    trace_files: int = Field(4, ge=2, le=100)
    bodies: Array[Body] = ()
    groups: Array[Group] = ()
    robot: Robot | None = None
    """What is on a line of protocol fics."""
    mode: Literal[2, 3] = 3
    """The robot's communication mode; in 2 most commands are silent (C-HOST manual 1-1-1)."""
    terminator: Terminator = "cr"
    """What ends a command to the robot."""

    @model_validator(mode="after")
    def _belong_to_the_protocol(self) -> Self:
        foreign = _ONLY_RORZE if self.protocol == "fics" else _ONLY_FICS
        for key in foreign:
            if key in self.model_fields_set:
                raise _Fault(f"has no meaning on a line of protocol {self.protocol}", key)
        if self.protocol == "fics" and self.robot is None:
            raise _Fault("is required on a line of protocol fics", "robot")
        return self

    @model_validator(mode="after")
    def _be_consistent(self) -> Self:
        _refuse_repeats([body.id for body in self.bodies], "bodies", key="id")
        _refuse_repeats([group.id for group in self.groups], "groups", key="id")
        if self.introducer != "&":
            self._need_one_digit_bodies()
        bodies = {body.id for body in self.bodies}
        for index, group in enumerate(self.groups):
            for position, member in enumerate(group.members):
                if member not in bodies:
                    raise _Fault(
                        f"{member} is no body of line {self.id}", "groups", index, "members", position
                    )
        return self

    def _need_one_digit_bodies(self) -> None:
        if self.groups:
            raise _Fault(f'cannot be addressed after {self.introducer!r}; use introducer = "&"', "groups")
        for index, body in enumerate(self.bodies):
            if body.number > 0xF:
                raise _Fault(
                    f"must be from 00 to 0F on a line with introducer {self.introducer!r}, not {body.id!r}",
                    *("bodies", index, "id"),
                )


_ONLY_RORZE = ("introducer", "pipeline", "stop_mode", "bodies", "groups")
_ONLY_FICS = ("robot", "mode", "terminator")


class Server(_Table):
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
    trusted_proxies: Array[Annotated[str, AfterValidator(_check_network)]] = ()
    """Addresses or networks of proxies that keep TLS for us; X-Forwarded-* of others means nothing."""
    root_path: Annotated[str, AfterValidator(_check_root_path)] = ""
    """The path at which a proxy has the gateway, and which it takes off."""
    max_connections: int = Field(1000, ge=1, le=50_000)
    """Connections at once, event streams included; beyond them only stops are served."""
    raw_commands: bool = False
    """Whether commands may be sent as plain text."""
    allow_endless_moves: bool = False
    """Whether moves without an end may be started."""
    on_exit: Literal["leave", "stop"] = "leave"
    """Whether motors that move when the gateway ends go on to the ends of their moves, or are stopped; moves
    without an end and JOGs are always stopped."""

    @property
    def is_local(self) -> bool:
        """Whether only this machine reaches it."""
        return self.host == "localhost" or ip_address(self.host).is_loopback

    @property
    def names(self) -> tuple[str, ...]:
        """What the Host header may name besides the loopback interface."""
        if self.is_local or ip_address(self.host).is_unspecified:
            return self.allowed_hosts
        return (*self.allowed_hosts, f"[{self.host}]" if ":" in self.host else self.host)

    @model_validator(mode="after")
    def _be_private(self) -> Self:
        for key, other in ("tls_certificate", "tls_key"), ("tls_key", "tls_certificate"):
            if getattr(self, key) is None and getattr(self, other) is not None:
                raise _Fault(f"is required with {other}", key)
        if not (self.is_local or self.tls_certificate or self.trusted_proxies):
            raise _Fault(
                f"{self.host} is open to the network, where keys and commands must not go in plain text: set "
                "tls_certificate and tls_key, or trusted_proxies; or listen on 127.0.0.1",
                "host",
            )
        return self


class Oidc(_Table):
    """A provider whose tokens are taken besides keys."""

    issuer: Annotated[str, AfterValidator(_check_issuer)]
    audience: str = Field(min_length=1)
    """What tokens for this gateway have as `aud`."""
    roles: dict[str, Annotated[Role, Field(strict=False)]] = Field(min_length=1)
    """Which word in the role claim gives which role here."""
    role_claim: str = Field("roles", min_length=1)
    """The claim with the words, `realm_access.roles` for one inside another."""
    name_claim: str = Field("sub", min_length=1)
    scope_claim: str | None = Field(None, min_length=1)
    """The claim with addresses; left out, tokens are for everything."""
    algorithms: Array[
        Literal["RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "EdDSA"]
    ] = ("RS256", "ES256")


class Access(_Table):
    """Who may use the gateway."""

    mode: Literal["keys", "open"] = "keys"
    """`open`: everybody on this machine may do everything."""
    subscribers_per_key: int = Field(50, ge=1, le=50_000)
    requests_per_key: int = Field(200, ge=1, le=50_000)
    moves_per_key_and_s: int = Field(20, ge=1, le=10_000)
    oidc: Oidc | None = None


class Config(_Table):
    """A whole configuration, consistent in itself."""

    server: Server = Server()
    access: Access = Access()
    lines: Array[Line] = ()

    @model_validator(mode="after")
    def _be_guarded(self) -> Self:
        if self.access.mode == "open" and not (self.server.is_local and not self.server.trusted_proxies):
            raise _Fault(
                "open is only for a gateway that this machine alone reaches: use keys, or listen on "
                "127.0.0.1 without trusted_proxies",
                *("access", "mode"),
            )
        return self

    @model_validator(mode="after")
    def _share_nothing(self) -> Self:
        if not self.lines:
            raise _Fault("at least one [[lines]] table is required", "lines")
        _refuse_repeats([line.id for line in self.lines], "lines", key="id")
        ports = [Address.parse(line.address) for line in self.lines]
        _refuse_repeats(
            [(port.scheme, port.host, port.port, port.path) for port in ports], "lines", key="address"
        )
        robots: list[str] = []
        for index, line in enumerate(self.lines):
            if line.robot is not None and line.robot.id in robots:
                raise _Fault("another line has a robot of this id", "lines", index, "robot", "id")
            robots += [line.robot.id] if line.robot is not None else []
            if line.trace_file and line.trace_file in [other.trace_file for other in self.lines[:index]]:
                raise _Fault("two lines cannot write to one file", "lines", index, "trace_file")
        return self


def load(path: Path) -> Config:
    """Read a configuration file.

    :raises ConfigError: it cannot be read, or `parse` refuses it.
    """
    try:
        text = path.read_text("utf-8-sig")
    except (OSError, UnicodeDecodeError) as error:
        reason = error.strerror if isinstance(error, OSError) else "it is not UTF-8 text"
        raise ConfigError(f"{path}: cannot be read: {reason}") from error
    return parse(text, str(path))


def parse(text: str, name: str) -> Config:
    """Read a configuration; `name` is what errors call its file.

    :raises ConfigError: not TOML, or not a configuration; every fault that was found has a line of its own.
    """
    try:
        return Config.model_validate(tomllib.loads(text))
    except ValidationError as error:
        index = LineIndex(text)
        faults = [(index.line_of(path), path, said) for path, said in map(_explain, error.errors())]
        faults.sort(key=lambda fault: fault[0])
        sentences = (f"{name}:{line}: {_written(path)}: {said}" for line, path, said in faults)
        raise ConfigError("\n".join(sentences)) from error
    except ValueError as error:  # not only TOMLDecodeError: an integer of 5000 digits, for one
        place = re.search(r"at line (\d+)", str(error))
        line = place[1] if place else len(text.splitlines()) or 1
        raise ConfigError(f"{name}:{line}: not valid TOML: {error}") from error


_TOML_WORDS = {
    "model_type": "must be a table",
    "path_type": "must be a path in quotes",
    "string_type": "must be text in quotes",
}


def _explain(error: ErrorDetails) -> tuple[KeyPath, str]:
    """Say in plain words where the fault is and what is expected there."""
    fault = error.get("ctx", {}).get("error")
    if isinstance(fault, ValueError):
        return (*error["loc"], *getattr(fault, "path", ())), str(fault)
    return error["loc"], sentence(error, _TOML_WORDS)


def _written(path: KeyPath) -> str:
    """Write a path as `lines[0].bodies[1].id`."""
    return "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in path).lstrip(".")


def _refuse_repeats(values: Iterable[object], array: str, *, key: str | None = None) -> None:
    seen: list[object] = []
    for index, value in enumerate(values):
        if value in seen:
            place = f"{array}[{seen.index(value)}]" + (f".{key}" if key else "")
            raise _Fault(f"is the same as {place}", array, index, *([key] if key else []))
        seen.append(value)
