"""The operations that callers may ask for, each described once for front ends, documents and tests."""

from collections.abc import Awaitable, Callable, Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from inspect import Parameter, Signature, getdoc, signature
from typing import Annotated, Any, Final, Literal, NamedTuple, TypeVar, get_origin
from warnings import catch_warnings, simplefilter

from pydantic import BaseModel, Field, TypeAdapter
from pydantic.warnings import UnsupportedFieldAttributeWarning

from gateway.core.rights import Right
from protocols.table import Effect

Verb = Literal["GET", "POST", "PUT", "PATCH", "DELETE"]
Run = Callable[..., Awaitable[Any]]
F = TypeVar("F", bound=Run)

MAX_WAIT_S: Final = 60
"""Longest time in seconds for which a request waits for the end of what it has started."""
Wait = Annotated[
    float | None,
    Field(
        ge=0,
        le=MAX_WAIT_S,
        allow_inf_nan=False,
        description=f"Seconds to wait for the end, {MAX_WAIT_S} at most; or use the header `Prefer: wait=N`.",
    ),
]
Expectation = Callable[[Any], None]
"""Refuses a present state that its sender does not know."""
EXPECTS: Final = "expects"
"""The parameter of an operation that refuses to change what is otherwise than its sender has read."""
KEYED: Final = "keyed"
"""The parameter that tells an operation if its sender relies on a key: its request says if that may be."""

_EFFECTS: Final[Mapping[Right, Effect]] = {
    Right.OPEN: Effect.READ,
    Right.VIEW: Effect.READ,
    Right.STOP: Effect.STOP,
    Right.OPERATE: Effect.SETTING,
    Right.SETUP: Effect.SETTING,
    Right.ADMIN: Effect.MAINTENANCE,
}
"""Default effect of an operation, by its right."""
LEASED: Final = frozenset({Right.OPERATE, Right.SETUP})
"""Rights that a lease reserves to its holder."""


class DocumentSection(NamedTuple):
    """A section of the documents."""

    tag: str
    told: str
    """One sentence."""
    before: str = ""
    """The section of the gateway itself that it stands before; else at the end."""
    is_needed_first: bool = False
    """True for the first operations that a user needs: to move, to stop, and to see what has happened."""


class RouteWords(NamedTuple):
    """The words of a place's routes."""

    replied: str = "The controller's reply."
    over: str = "The move is over; `status` says how it ended."
    begun: str = "The controller has accepted the move; ask again at Location."


@dataclass(frozen=True)
class PlainText:
    """A result that is a text of the row's media type."""

    content: str
    document: Any = None
    """The document whose tag the text has, where the row is `tagged`."""
    beside: Mapping[str, str] = field(default_factory=dict)
    """Facts that no cell of the text can tell, by the names that the row gives them."""


@dataclass(frozen=True)
class Written:
    """A result that is JSON already."""

    json: str


@dataclass(frozen=True, eq=False)
class Operation:
    """One row of the door: who may ask for it, what goes in, what comes out, and what does it."""

    run: Run
    """Takes what the door provides, what the path names, then the request; by name what the query says."""
    name: str
    """Name in generated clients: `getCapture`."""
    verb: Verb
    path: str
    tag: str
    """The section of the documents that it stands in."""
    right: Right
    leased: bool
    """True if another caller's lease forbids it."""
    any_scope: bool
    """True if callers with any scope may ask, and are shown the part in their scope."""
    target: str | None
    """The parameter that names what it is about; None: the whole plant. One of the query may name several."""
    expects: bool
    """True if it can be bound to the document that its sender has read."""
    effect: Effect
    title: str
    description: str
    parameters: Mapping[str, Parameter]
    """Parameters of path and query, by name."""
    provided: Mapping[str, type]
    """Values that the door finds: the plant, a family, or the thing at the path."""
    request_name: str | None
    """The parameter that takes the request, if there is one."""
    request: Any
    request_optional: bool
    """True if the request may be left out: its model's defaults then count."""
    result: Any
    tagged: bool = False
    """True if the result is a document that a change of it can be bound to (ETag)."""
    named_only: bool = False
    """True if the result tells only the members that are set."""
    opens: bool = False
    """True if it makes something that lasts until a caller ends it."""
    over: str | None = None
    """Words for the end of long work; until then the result is its record."""
    stopping: str | None = None
    """Words for an end that was not seen in time, whose `state` is `stopping`."""
    kept_at: str | None = None
    """Path at which such records are found again; None for the path of the request."""
    most_bytes: int | None = None
    """The longest request, where it may be longer than others."""
    plain: str | None = None
    """The member of request and result that may go alone, as plain text."""
    media: str | None = None
    """The media type of its request and its result, where these are texts and no JSON."""
    beside: Mapping[str, Any] = field(default_factory=dict)
    """Headers beside such a text, as OpenAPI describes them."""
    answered: str | None = None
    """The words for its answer, where the documents need some."""
    documented: bool = True
    """True if the documents show it: clients made of them cannot send every media type."""
    may_begin: Any = None
    """The record of a move, where only the request tells whether it begins one."""
    moves: bool = False
    """True if it begins moves, each with its record."""
    planned: Any = None
    """Type of the answer to a request that only asks for the plan."""
    dated: bool = False
    """True if the age of its answer means something."""
    code: str = ""
    """The controller's code, where it is a row of a command table."""
    example: Callable[[], Mapping[str, Any] | None] | None = None
    """Gives a request, as the manual has it."""
    later: bool = False
    """True if the core of the documents leaves it out: no client needs it on its first day."""
    by_hand: str | None = None
    """Why HTTP's route is written by hand beside it."""
    http_only: str | None = None
    """Why only HTTP can serve it."""

    @cached_property
    def keyed(self) -> bool:
        """True if only the request tells whether its sender may rely on a key."""
        return KEYED in self.provided

    @cached_property
    def named(self) -> list[str]:
        """The parameters of its path."""
        return names_in(self.path)

    def may_leave_out(self, name: str) -> bool:
        """Say whether a parameter has a default."""
        parameter = self.parameters.get(name)
        return parameter is not None and parameter.default is not Parameter.empty

    @property
    def ended(self) -> Any:
        """Type of the answer where nothing is under way any more."""
        return self.result if self.planned is None else self.result | self.planned


def taking(run: Run, **annotations: Any) -> Run:
    """Say which parameters a function takes that is made, not written; `wait` may be left out."""
    run.__signature__ = Signature(  # type: ignore[attr-defined]  # it is looked for there
        [
            Parameter(name, Parameter.POSITIONAL_OR_KEYWORD, annotation=annotation)
            if name != "wait"
            else Parameter(name, Parameter.KEYWORD_ONLY, annotation=annotation, default=None)
            for name, annotation in annotations.items()
        ]
    )
    return run


def adapter_of(annotation: Any) -> TypeAdapter[Any]:
    """Make what reads a parameter of this type; words for documents alone are passed over."""
    with catch_warnings():
        simplefilter("ignore", UnsupportedFieldAttributeWarning)
        adapter = TypeAdapter[Any](annotation)
        adapter.rebuild()
    return adapter


def names_in(path: str) -> list[str]:
    """The parameters of a path."""
    return [part[1:-1] for part in path.split("/") if part.startswith("{")]


class Rows:
    """The operations of one section, in the order of the documents; all of them `later`, if so told."""

    def __init__(self, tag: str, *, later: bool = False) -> None:
        self.tag, self._later = tag, later
        self._rows: list[Operation] = []

    def __iter__(self) -> Iterator[Operation]:
        return iter(self._rows)

    def get(self, path: str, right: Right = Right.VIEW, **told: Any) -> Callable[[F], F]:
        """Make an operation of the function below; `told` is what its row says besides."""
        return self._listing("GET", path, right, told)

    def post(self, path: str, right: Right, **told: Any) -> Callable[[F], F]:
        """Add an operation as `get` does, for POST."""
        return self._listing("POST", path, right, told)

    def put(self, path: str, right: Right, **told: Any) -> Callable[[F], F]:
        """Add an operation as `get` does, for PUT."""
        return self._listing("PUT", path, right, told)

    def patch(self, path: str, right: Right, **told: Any) -> Callable[[F], F]:
        """Add an operation as `get` does, for PATCH."""
        return self._listing("PATCH", path, right, told)

    def delete(self, path: str, right: Right, **told: Any) -> Callable[[F], F]:
        """Add an operation as `get` does, for DELETE."""
        return self._listing("DELETE", path, right, told)

    def add(self, verb: Verb, path: str, right: Right, run: Run, **told: Any) -> None:
        """List an operation that is made, not written; `told` may name and describe it."""
        self._rows.append(operation(self.tag, verb, path, right, run, **{"later": self._later, **told}))

    def _listing(self, verb: Verb, path: str, right: Right, told: Mapping[str, Any]) -> Callable[[F], F]:
        def listed(run: F) -> F:
            self.add(verb, path, right, run, **told)
            return run

        return listed


def operation(tag: str, verb: Verb, path: str, right: Right, run: Run, **told: Any) -> Operation:
    """Describe what a function does: by its signature, its docstring, and what is `told` besides.

    One that is about the `whole_plant` has no target, though its path names something; `about` names the
    parameter of the query that does.

    :raises TypeError: a parameter fits nothing, or there are two requests.
    """
    about_all = told.pop("whole_plant", False)
    about = told.pop("about", None)
    name = told.pop("name", None) or getattr(run, "__name__", "")
    of_path = set(names_in(path))
    parameters: dict[str, Parameter] = {}
    provided: dict[str, type] = {}
    requests: list[Parameter] = []
    for parameter in signature(run).parameters.values():
        if parameter.name in (EXPECTS, KEYED):
            provided[parameter.name] = type(None)
        elif parameter.name in of_path or parameter.kind is Parameter.KEYWORD_ONLY:
            parameters[parameter.name] = parameter
        elif isinstance(parameter.annotation, type) and not _is_data(parameter.annotation):
            provided[parameter.name] = parameter.annotation
        else:
            requests.append(parameter)
    if len(requests) > 1:
        raise TypeError(f"{name} takes two requests: {requests}")
    request = requests[0] if requests else None
    returned = signature(run).return_annotation
    described = {
        "title": name.replace("_", " ").title(),
        "description": getdoc(run) or "",
        "effect": Effect.MOTION if told.get("moves") else _EFFECTS[right],
        "leased": right in LEASED,
        "request_optional": request is not None and request.default is not Parameter.empty,
        "any_scope": False,
        "result": str if returned is PlainText else returned,
        **told,
    }
    return Operation(
        run=run if told.get("http_only") is None else _by_http,
        name=in_camel_case(name),
        verb=verb,
        path=path,
        tag=tag,
        right=right,
        target=None if about_all else about or next(iter(names_in(path)), None),
        expects=EXPECTS in provided,
        parameters=parameters,
        provided=provided,
        request_name=None if request is None else request.name,
        request=None if request is None else request.annotation,
        **described,
    )


async def _by_http(**_: object) -> None:
    """Leave it to HTTP.

    :raises TypeError: it was asked otherwise.
    """
    raise TypeError("HTTP alone serves this")


def _is_data(annotation: type) -> bool:
    """Say whether a client sends it."""
    return get_origin(annotation) is not None or issubclass(annotation, BaseModel)


def in_camel_case(name: str) -> str:
    """Name an operation as clients in most languages do: startMove."""
    first, *others = name.split("_")
    return first + "".join(map(str.capitalize, others))
