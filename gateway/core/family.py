"""The interface of a family of controllers: its lines, the parts on them, and the commands they take."""

import random
from abc import ABC, abstractmethod
from collections.abc import Awaitable, Callable, Collection, Coroutine, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, ClassVar, NamedTuple, NotRequired, Protocol

from pydantic import Field
from typing_extensions import TypedDict

from gateway.core import tables
from gateway.core.alarms import Cause
from gateway.core.errors import NotFound
from gateway.core.event_types import EventType
from gateway.core.events import EventHub
from gateway.core.known import FactStore
from gateway.core.line import LineDriver
from gateway.core.line_state import LineState
from gateway.core.marks import DETAIL
from gateway.core.move_log import MoveLog
from gateway.core.move_record import RESTARTED, MoveRecord
from gateway.core.operation import DocumentSection, RouteWords, Rows
from gateway.core.parts import Part
from gateway.core.records import Record
from gateway.core.stops import Report, StopMode
from gateway.core.supervisor import Deed, do_each
from gateway.core.targets import Stopped, Target
from gateway.core.works import DurableJobs
from gateway.texts import text
from protocols.table import Command
from transports.base import Transport

Row = type[Command[Any]]
AnyLine = LineDriver[Any, Any, Any]

ENDS_ITSELF = "It goes on to the end of its move."
NOT_OURS = "No move that the gateway follows explains it."


@dataclass(frozen=True)
class Site:
    """The common objects of all families."""

    events: EventHub
    allow_endless_moves: bool = False
    """True if moves without an end may be started."""
    rng: random.Random | None = None
    """Dice that tests load."""
    known: FactStore = field(default_factory=FactStore)


@dataclass(frozen=True)
class TargetKind:
    """A kind of targets: where they stand among the resources, and the record of their moves."""

    path: str
    """Path with the names of its parameters, such as `/bodies/{body_id}`."""
    move: type[MoveRecord] | None = None
    suffix: str = ""
    """Suffix that tells the operations of this place from those of others with the same rows."""
    members: bool = False
    """True if each of several members answers, and makes a move of its own."""
    tag: str = "commands"
    """The section of the documents that its commands stand in."""
    listed: bool = False
    """True if rows of the family, in words of their own, list its moves and stops."""


class MayMove(NamedTuple):
    """A part that may move on when the gateway has ended."""

    what: str
    """Kind of the part, as the types of its events begin: `body` or `robot`."""
    subject: str
    why: str
    move_id: str | None


def is_within(line_id: str, address: str, parts: Sequence[Part] | None) -> bool:
    """Say whether an address is among some parts of the plant; it is, if none are named."""
    return parts is None or any(part.contains(Part(line_id, address)) for part in parts)


def why_it_moves(*, stopped: bool, moving: bool | None, under_way: bool) -> str | None:
    """Why something may still move; None where it stands still, as far as is known."""
    if stopped:
        return text("stops.unconfirmed").en
    if not moving:
        return None
    return ENDS_ITSELF if under_way else NOT_OURS


Watch = Callable[[], Coroutine[Any, Any, None]]
"""Looks after something until it is cancelled; after a fault of the gateway itself it is begun again."""


class Now(Protocol):
    """The least that a family tells of a part on a line."""

    online: bool
    moving: bool | None


class Seen(NamedTuple):
    """A part of a line, as it is known now."""

    line_id: str
    address: str
    now: Now


class OwnerInfo(TypedDict):
    """The gateway that has a line which may be taken over."""

    gateway: Annotated[str | None, Field(description="Name of the gateway in the plant; null if unknown.")]
    epoch: Annotated[int, Field(description="Number of take-overs so far, plus one; the header Owner-Epoch.")]


class PortInfo(TypedDict):
    """A line as it is now; a family adds what is on it."""

    # No model: nothing of it comes from outside.
    line_id: str
    address: Annotated[str, Field(description="Address of the port.")]
    state: LineState
    down_reason: Annotated[
        str | None,
        Field(
            description="Reason why the line is `down` or `silent`, and what to check; null if it is neither."
        ),
    ]
    waiting: Annotated[
        dict[str, int], Field(description="Requests waiting in each lane.", json_schema_extra=DETAIL)
    ]
    load: Annotated[
        dict[str, float],
        Field(
            description="Percent of the last ten seconds that the line was taken up by clients, followers "
            "(they see moves to their ends), health, live (values that clients watch), probes (of silent "
            "controllers), fences, stops and set_up.",
            json_schema_extra=DETAIL,
        ),
    ]
    counters: Annotated[
        dict[str, int], Field(description="Counters of the line since the start.", json_schema_extra=DETAIL)
    ]
    owner: Annotated[
        NotRequired[OwnerInfo],
        Field(
            description="Owner of the line; only of a line that another gateway may take over.",
            json_schema_extra=DETAIL,
        ),
    ]


class Registered(ABC):
    """The interface of a package: the kinds of things that it adds to every plant, and their operations."""

    collections: ClassVar[Sequence[str]]
    """The resources its targets are among, such as `bodies`."""
    called: ClassVar[Sequence[str]] = ()
    """Names of the collections as people call them, if otherwise."""
    move_records: ClassVar[Sequence[type[MoveRecord]]] = ()
    """Types of the records in `move_logs`."""
    event_types: ClassVar[Sequence[EventType]] = ()
    """Types of the events that it publishes, beside those of all lines."""
    rows: ClassVar[Sequence[Rows]] = ()
    """Operations on its things beside the commands; those that take the plant are in its `door`."""
    things: ClassVar[Mapping[type, Callable[..., Any]]] = {}
    """Functions that find a thing by the names in its path, by the thing's type."""
    names: ClassVar[Mapping[str, Any]] = {}
    """The descriptions of the names in its paths; all others are text."""
    sections: ClassVar[Sequence[DocumentSection]] = ()
    """The sections of the documents that its rows stand in, in their order."""
    words: ClassVar[Mapping[str, RouteWords]] = {}
    """Words of the places whose routes have words of their own."""

    def __init__(self, site: Site) -> None:
        self.site = site

    # what there is

    @abstractmethod
    def target(self, collection: str, names: Sequence[str]) -> Target:
        """Find what commands are addressed to.

        :raises GatewayError: there is no such thing, or several.
        """

    @abstractmethod
    def addresses(self) -> Iterable[str]:
        """All addresses by which events can be wanted."""

    @abstractmethod
    def parts(self, address: str) -> Sequence[Part]:
        """Find the parts that an address means now: all members of a group; none if the address is unknown.

        :raises Ambiguous: it fits several lines.
        """

    def parts_in_scope(self, name: str) -> Sequence[Part]:
        """Find the parts that a name in a scope covers, by the configuration; none if it is ambiguous."""
        return self.parts(name)

    def causes(self) -> Iterable[Cause]:
        """Causes of alarms at its targets."""
        return ()

    def at_work(self, _line: Any) -> Iterable[str]:
        """Addresses on a line in the middle of something beside moves that must not be broken off."""
        return ()

    # over restarts

    def trajectories(self) -> Iterable[Any]:
        """Where motors were seen during the newest moves: `Trajectory` with its `move`."""
        return ()

    def move_logs(self) -> Iterable[MoveLog[Any]]:
        """Where its moves are remembered."""
        return ()

    def works(self) -> Mapping[str, DurableJobs[Any]]:
        """Long work whose records outlive the gateway, by unique names."""
        return {}

    def resume(  # noqa: B027  # what has no moves has nothing to take over
        self, records: Sequence[Mapping[str, Any]], begun: Collection[str], since: str = RESTARTED
    ) -> None:
        """Take over those moves of an earlier life that are its own, before the lines are opened.

        A move that was not over is in `begun` if its intent was written; one that is not, and was not sent,
        was never written. Nothing is sent again: controllers are asked, and moves that go on are followed.
        `since` tells in their records why that is another life.
        """

    # the end

    @abstractmethod
    def end_motion(self, *, everything: bool, within: Sequence[Part] | None = None) -> tuple[Deed, ...]:
        """Name what stops what would never end, or `everything` that moves; each queues stops at once.

        `within` names the only parts that are meant, if not all are. Each may be done twice.
        """

    @abstractmethod
    def left_moving(self) -> Iterable[MayMove]:
        """Name what may still move."""

    @abstractmethod
    async def at_rest(self) -> None:
        """Wait for the stops of the end, and for refusals of moves."""

    @abstractmethod
    def letting_go(self) -> tuple[Deed, ...]:
        """Name what gives waiters for long work and moves what is known now; each may be done twice."""

    @abstractmethod
    def closing(self) -> tuple[Deed, ...]:
        """Name what ends all work and closes lines; the motors keep doing what they do.

        Each may be done twice.
        """


class Family(Registered):
    """All controllers of one kind, with their lines. A plant has one of each kind."""

    line_table: ClassVar[type[tables.LineTable]]
    """Table of the configuration for a line."""
    controllers: ClassVar[str] = ""
    """Noun for its controllers, as the documents begin."""
    told_when_up: ClassVar[Mapping[str, Any]] = {}
    """Facts in `line.up` of its lines: the type of each, and its field."""
    told_of_ports: ClassVar[str] = ""
    """Controllers that may be at a port, in words."""
    told_of_stops: ClassVar[str] = ""
    """Words for both ways in which its controllers stop."""
    stop_report: ClassVar[type[Report]]
    """Report of a stop of one part that is `seen`."""
    line_info: ClassVar[type[PortInfo]]
    """Type of a line's description."""
    now: ClassVar[type[Record]]
    """Type in a snapshot of each part that is `seen`; these are the first of `collections`."""
    commands: ClassVar[Sequence[tuple[TargetKind, Row]]]
    """The whole command table, by the targets of the commands."""
    stop_modes: ClassVar[Mapping[Row, StopMode]] = {}
    """The rows that stop all of what they are addressed to."""
    sessions: ClassVar[Mapping[Row, type[Record]]] = {}
    """Rows whose motion lasts only as long as its client sends heartbeats."""
    never_alone: ClassVar[Collection[Row]] = ()
    """The rows that are sent only as parts of something larger."""

    # what there is

    @abstractmethod
    def add(self, table: Any, port: Transport) -> AnyLine:
        """Build a line, and everything on it, as `table` of `line_table` says."""

    @abstractmethod
    def removing(self, line: Any) -> tuple[Deed, ...]:
        """Name what closes one of its lines, and forgets everything on it but the records of its moves."""

    def link_of(self, line_id: str) -> Target:
        """Find the part that answers for a line as a whole.

        :raises GatewayError: none does.
        """
        raise NotFound(f"Nobody on line {line_id} answers for the line; nothing was sent.")

    @abstractmethod
    def seen(self) -> Iterable[Seen]:
        """Tell of what is on its lines; no controller is asked."""

    def parts(self, address: str) -> Sequence[Part]:
        """Parts `seen` at an address."""
        own = address.partition("/")[0]
        return [Part(part.line_id, part.address) for part in self.seen() if part.address == own]

    @abstractmethod
    def info(self, line: Any) -> PortInfo:
        """Tell the state of one of its lines."""

    @classmethod
    def alarmed(cls) -> Sequence[str]:
        """The paths of what it has alarms of."""
        return ()

    @classmethod
    def facts(cls, row: Any) -> Sequence[str]:
        """Tell about a row of its table what all clients should know."""
        return (f"Retry class `{row.retry}`.",)

    @classmethod
    def answer_model(cls, row: Any) -> Any:
        """Give the model of a row's answer."""
        return row.reply_type()

    @classmethod
    def is_dated(cls, row: Any) -> bool:
        """Say whether the age of the row's answer means something."""
        return bool(row.reply_type().model_fields)

    # life

    def watches(self, _line: Any) -> Iterable[Watch]:
        """Watches over the controllers of one of its lines, for as long as the line is there."""
        return ()

    @abstractmethod
    def was_left_alone(self) -> tuple[Deed, ...]:
        """Name what is due where nothing was looked at for seconds: stop what jogs, believe nothing read."""

    @abstractmethod
    def stop_all(self, mode: StopMode) -> Awaitable[Stopped]:
        """Stop everything; every stop is queued before this returns."""


class Extension(Registered):
    """Things made of the things of a family, each by a table of the configuration.

    Motion stays the family's: its stops, and the end of the gateway, concern the things themselves.
    """

    of: ClassVar[type[Family]]
    table: ClassVar[type[tables.Made]]
    """Table of the configuration for one thing; the array has the name of the first of `collections`."""

    def __init__(self, site: Site, family: Any) -> None:
        super().__init__(site)
        self.family = family

    @abstractmethod
    def make(self, table: Any) -> None:
        """Make one of what is on its line, as `table` says."""

    @abstractmethod
    def forget(self, line: Any) -> None:
        """Forget what was made on a line, which is removed, but the records of its moves."""

    def end_motion(self, **_: Any) -> tuple[Deed, ...]:
        """Stop nothing: the family does."""
        return ()

    def left_moving(self) -> Iterable[MayMove]:
        """Name nothing: the family does."""
        return ()


def in_doubt(question: Callable[[], bool]) -> bool:
    """Answer whether motion is to be stopped; after a fault of the gateway itself that is so."""
    return do_each("the end of motion", question).first(otherwise=True)


def facts_of(line: AnyLine) -> PortInfo:
    """Tell what every line has."""
    return {
        "line_id": line.id,
        "address": line.transport.address,
        "state": line.state,
        "down_reason": line.trouble,
        "waiting": line.waiting(),
        "load": line.load_percent(),
        "counters": line.counters,
    }
