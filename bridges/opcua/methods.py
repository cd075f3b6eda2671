"""Methods of the plant's nodes: each asks the gateway in the name of the one whose session calls it."""

import asyncio
import logging
import re
from collections.abc import Awaitable, Callable, Iterable, Sequence
from typing import Any, Final, NamedTuple, Protocol
from urllib.parse import quote

from asyncua import ua
from motion_gateway_client import Answer, NoAnswer

from bridges.common.state import Figures, Outcome
from bridges.opcua.nodes import Argument, Space, Type
from bridges.opcua.plant import Axis
from bridges.opcua.sessions import GUEST, Guest

log = logging.getLogger(__name__)

Codes = ua.StatusCodes
STATUSES: Final = {
    400: Codes.BadInvalidArgument,
    401: Codes.BadUserAccessDenied,
    403: Codes.BadUserAccessDenied,
    404: Codes.BadNotFound,
    409: Codes.BadInvalidState,
    422: Codes.BadInvalidArgument,
    429: Codes.BadTooManyOperations,
    503: Codes.BadResourceUnavailable,
}
"""Status codes of OPC UA by the HTTP status of the gateway's refusal."""
KINDS: Final = {
    "lease": Codes.BadLocked,
    "body-offline": Codes.BadNoCommunication,
    "robot-offline": Codes.BadNoCommunication,
    "line-down": Codes.BadNoCommunication,
    "expired": Codes.BadTimeout,
    "not-found": Codes.BadNotFound,
}
"""Status codes of OPC UA by the kind of a refusal; they say more than those by the HTTP status."""
PREFIX: Final = "urn:motion-gateway:problem:"
_KEY: Final = re.compile("[!-~]{1,150}")

KEY: Final = Argument(
    "Key",
    Type.String,
    "1 to 150 printable characters, another for each command: repeated, it is carried out once",
)
WITHIN: Final = Argument(
    "StartWithin", Type.Double, "Seconds that it may wait for its turn; 0: as the gateway has it"
)
SPEED: Final = Argument("Speed", Type.Double, "Units a second, or for robots percent; 0: as configured")
DETAIL: Final = Argument(
    "Detail", Type.String, "What happened, and what became of the motor, in the session's language"
)
REMEDY: Final = Argument("Remedy", Type.String, "What to do next")
MOVED: Final = (
    Argument("MoveId", Type.String, "Names the move in events; empty: there is none"),
    Argument("Status", Type.String, "queued, sent, moving, ...; of a refusal its kind"),
    Argument(
        "Replayed",
        Type.Boolean,
        "Whether the key was known: this is the answer to it, and nothing was done again",
    ),
    DETAIL,
    REMEDY,
)
START: Final = (
    KEY,
    Argument("Kind", Type.String, "relative, absolute, position, home or continuous"),
    Argument("Position", Type.Double, "A relative one has its sign: positive is clockwise"),
    Argument("Unit", Type.String, "pulse, mm, um, deg or mdeg; empty: the axis's own"),
    SPEED,
    WITHIN,
)
STOPPED: Final = (Argument("Confirmed", Type.Boolean, "Whether all is seen to stand still"), DETAIL, REMEDY)
JOG: Final = (
    KEY,
    Argument("Direction", Type.String, "cw or +, ccw or -"),
    SPEED,
    Argument(
        "AtMost", Type.Double, "Length in the axis's unit after which it ends; 0: as the gateway has it"
    ),
)
JOGGED: Final = (
    Argument("JogId", Type.String, "Names the jog in Heartbeat and StopJog"),
    Argument("HeartbeatWithin", Type.Double, "Milliseconds: without a Heartbeat by then the axis is stopped"),
    DETAIL,
    REMEDY,
)
JOG_ID: Final = (Argument("JogId", Type.String, "As Jog gave it"),)
BEATEN: Final = (Argument("State", Type.String, "jogging, stopping, ended, lost or stopped"), DETAIL, REMEDY)

Handler = Callable[..., Awaitable[ua.CallMethodResult]]


class Wrong(Exception):
    """Arguments that are not sent to the gateway: a detail and a remedy."""

    def __init__(self, detail: str, remedy: str) -> None:
        super().__init__(detail)
        self.detail, self.remedy = detail, remedy


class Request(NamedTuple):
    """A request to the gateway."""

    path: str
    body: Any = None
    key: str | None = None
    method: str = "POST"


def result(status: int, gives: Sequence[Argument], *values: Any) -> ua.CallMethodResult:
    """Make an answer; one that is bad has its outputs all the same."""
    answer = ua.CallMethodResult()
    answer.StatusCode = ua.StatusCode(status)
    answer.OutputArguments = [
        ua.Variant(value, argument.type) for argument, value in zip(gives, values, strict=True)
    ]
    return answer


def status_of(answer: Answer) -> int:
    """Give the status of a refusal."""
    if answer.is_success:
        return Codes.Good
    return KINDS.get(kind_of(answer)) or STATUSES.get(answer.status, Codes.BadUnexpectedError)


def kind_of(answer: Answer) -> str:
    """Give the kind of a refusal, as the gateway names it."""
    content = answer.content if isinstance(answer.content, dict) else {}
    return str(content.get("type", "refused")).removeprefix(PREFIX)


def sentences(answer: Answer) -> tuple[str, str]:
    """Give what is said of a refusal, and what to do next."""
    content = answer.content if isinstance(answer.content, dict) else {}
    if answer.is_success:
        return "", ""
    return str(content.get("detail") or ""), str(content.get("remedy") or "")


class Commands:
    """Asks the gateway in the name of the session's guest, and counts how it ended."""

    def __init__(self, figures: Figures) -> None:
        self._figures = figures

    async def ask(self, request: Request, *, stops: bool = False) -> Answer:
        """Send a command once, a stop until it has an answer, which may be a refusal of the bridge, too."""
        guest = GUEST.get()
        if guest is None:
            return Answer(
                401, {"detail": "Nobody is signed in; nothing was sent.", "remedy": "Sign in."}, False
            )
        try:
            if stops:
                answer = await guest.caller.stop(request.path)
            else:
                answer = await guest.ask(request.method, request.path, request.body, request.key)
        except NoAnswer as error:
            answer = Answer(
                503 if error.moved == "no" else 504,
                {"type": error.type, "detail": error.detail, "remedy": error.remedy, "moved": error.moved},
                False,
            )
        self._count(guest, request, answer, stops=stops)
        return answer

    def refuse(self, wrong: Wrong) -> Answer:
        """Refuse what is not sent."""
        self._figures.command("refused")
        log.warning("command refused: %s", wrong.detail)
        return Answer(400, {"detail": f"{wrong.detail}; nothing was sent.", "remedy": wrong.remedy}, False)

    def _count(self, guest: Guest, request: Request, answer: Answer, *, stops: bool) -> None:
        outcome: Outcome = "refused"
        if answer.is_success:
            outcome = "replayed" if answer.replayed else "done"
        elif answer.status == 504:
            outcome = "unknown"
        self._figures.command(outcome)
        kind = None if answer.is_success else kind_of(answer)
        facts = {"who": guest.name, "path": request.path, "status": answer.status, "kind": kind}
        say = log.info if answer.is_success or stops else log.warning
        say("command %s", outcome, extra={"facts": facts})


class Locks(Protocol):
    """Adds the locks of the plant's nodes."""

    def add(self, name: str, address: str, node: ua.NodeId) -> None:
        """Add that of an axis, a line or a robot."""


class PlantMethods:
    """Adds methods to nodes, and does what they say."""

    def __init__(self, space: Space, commands: Commands, locks: Locks) -> None:
        self._space, self._commands, self._locks = space, commands, locks

    # what there is

    def of_axis(self, axis: Axis, node: ua.NodeId) -> None:
        """Add those of an axis."""
        name, address = axis.node, axis.address
        body = axis.name is None

        def start_of(*given: Any) -> Request:
            return (_body_move if body else _robot_move)(axis, *given)

        self._add(node, name, "StartMove", address, START, MOVED, self._moving(start_of))
        self._add(node, name, "Stop", address, (), STOPPED, self._stopping([axis.path]))
        if body:
            self._add(
                node,
                name,
                "Home",
                address,
                (KEY, WITHIN),
                MOVED,
                self._moving(lambda key, within: _home(axis.path, key, within)),
            )
        self._locks.add(name, address, node)
        self._add(node, name, "Jog", address, JOG, JOGGED, self._jogging(axis))
        jogs = f"{_owner(axis.path)}/jogs"
        for method, verb in (("Heartbeat", "heartbeat"), ("StopJog", "stop")):
            self._add(node, name, method, address, JOG_ID, BEATEN, self._beating(jogs, verb))

    def of_unit(self, name: str, path: str, address: str, node: ua.NodeId) -> None:
        """Add those of a robot's unit."""
        self._add(
            node,
            name,
            "StartMove",
            address,
            START,
            MOVED,
            self._moving(lambda *given: _unit_move(path, *given)),
        )
        self._add(
            node,
            name,
            "Home",
            address,
            (KEY, WITHIN),
            MOVED,
            self._moving(lambda key, within: _home(path, key, within)),
        )
        self._add(node, name, "Stop", address, (), STOPPED, self._stopping([path]))

    def of_device(self, name: str, paths: list[str], address: str, node: ua.NodeId) -> None:
        """Add the stop and the lock of a line or a robot."""
        self._locks.add(name, address, node)
        self._add(node, name, "Stop", address, (), STOPPED, self._stopping(paths))

    def of_plant(self) -> None:
        """Add the plant's stop, beside the devices."""
        self._space.method(
            self._space.device_set,
            "Stop",
            ("Stop", self._space.own),
            checked((), self._stopping([""])),
            "",
            gives=STOPPED,
        )

    def _add(
        self,
        node: ua.NodeId,
        name: str,
        method: str,
        address: str,
        takes: Sequence[Argument],
        gives: Sequence[Argument],
        handler: Handler,
    ) -> None:
        call = checked(takes, handler)
        browse = (method, self._space.own)
        self._space.method(node, f"{name}.{method}", browse, call, address, takes=takes, gives=gives)

    # what is done

    def _moving(self, request_of: Callable[..., Request]) -> Handler:
        async def move(*given: Any) -> ua.CallMethodResult:
            try:
                _check_key(given[0])
                answer = await self._commands.ask(request_of(*given))
            except Wrong as wrong:
                answer = self._commands.refuse(wrong)
            content = answer.content
            if not answer.is_success:
                return result(status_of(answer), MOVED, "", kind_of(answer), False, *sentences(answer))
            error = content.get("error") or {}
            said = (str(error.get("detail") or ""), str(error.get("remedy") or ""))
            return result(Codes.Good, MOVED, content["id"], content["status"], answer.replayed, *said)

        return move

    def _stopping(self, paths: Iterable[str]) -> Handler:
        async def stop() -> ua.CallMethodResult:
            asking = (self._commands.ask(Request(f"{path}/stop", None), stops=True) for path in paths)
            answers = await asyncio.gather(*asking)
            refused = next((answer for answer in answers if not answer.is_success), None)
            if refused is not None:
                return result(status_of(refused), STOPPED, False, *sentences(refused))
            confirmed = all(answer.content.get("confirmed") for answer in answers)
            reports = [one for answer in answers for one in _reports(answer.content)]
            detail = " ".join(dict.fromkeys(report["detail"] for report in reports if report["detail"]))
            return result(Codes.Good, STOPPED, confirmed, detail, "")

        return stop

    def _jogging(self, axis: Axis) -> Handler:
        async def jog(key: str, direction: str, speed: float, at_most: float) -> ua.CallMethodResult:
            try:
                _check_key(key)
                answer = await self._commands.ask(_jog(axis, key, direction, speed, at_most))
            except Wrong as wrong:
                answer = self._commands.refuse(wrong)
            if not answer.is_success:
                return result(status_of(answer), JOGGED, "", 0.0, *sentences(answer))
            within_ms = float(answer.content["heartbeat_within_ms"])
            return result(Codes.Good, JOGGED, answer.content["id"], within_ms, "", "")

        return jog

    def _beating(self, jogs: str, verb: str) -> Handler:
        async def beat(jog_id: str) -> ua.CallMethodResult:
            request = Request(f"{jogs}/{quote(jog_id or '', safe='')}/{verb}", None)
            answer = await self._commands.ask(request, stops=verb == "stop")
            state = str(answer.content.get("state", "")) if answer.is_success else ""
            return result(status_of(answer), BEATEN, state, *sentences(answer))

        return beat


def checked(takes: Sequence[Argument], handler: Handler) -> Handler:
    """Call a handler with arguments of the right number and kinds alone."""

    async def call(_parent: ua.NodeId, *given: ua.Variant) -> ua.CallMethodResult:
        if len(given) != len(takes):
            few = len(given) < len(takes)
            return _plain(Codes.BadArgumentsMissing if few else Codes.BadTooManyArguments)
        fits = [_fits(value, argument) for value, argument in zip(given, takes, strict=True)]
        if not all(fits):
            answer = _plain(Codes.BadInvalidArgument)
            answer.InputArgumentResults = [
                ua.StatusCode(Codes.Good if fits_type else Codes.BadTypeMismatch) for fits_type in fits
            ]
            return answer
        return await handler(*(value.Value for value in given))

    return call


def _plain(status: int) -> ua.CallMethodResult:
    answer = ua.CallMethodResult()
    answer.StatusCode = ua.StatusCode(status)
    return answer


def _fits(given: ua.Variant, argument: Argument) -> bool:
    """Tell if a value is of an argument's kind; any number is a number, and a null text is an empty one."""
    value = given.Value
    if argument.type == Type.Double:
        return isinstance(value, int | float) and not isinstance(value, bool)
    return value is None or isinstance(value, str)


def _check_key(key: str | None) -> None:
    if not _KEY.fullmatch(key or ""):
        raise Wrong(
            "Key has to be 1 to 150 printable characters without spaces",
            "Give each command a key of its own, such as a UUID, and repeat it with the same.",
        )


def _owner(path: str) -> str:
    """Give the path of the one who jogs: a body, or the robot of a unit."""
    return path.partition("/units/")[0]


def _reports(content: dict[str, Any]) -> list[dict[str, Any]]:
    return [*content.get("bodies", ()), *content.get("robots", ())]


def _given(**members: Any) -> dict[str, Any]:
    return {name: value for name, value in members.items() if value is not None}


def _length(axis: Axis, value: float, unit: str) -> dict[str, Any]:
    return {"value": value, "unit": unit or axis.unit}


def _rate(axis: Axis, speed: float, unit: str) -> dict[str, Any] | None:
    return {"value": speed, "unit": f"{unit or axis.unit}/s"} if speed else None


def _number(position: float) -> int:
    if position != int(position):
        raise Wrong("Position is the number of a stored position, and whole", "Give its number.")
    return int(position)


def _home(path: str, key: str, within: float) -> Request:
    return Request(f"{path}/moves", _given(kind="home", start_within_s=within or None), key)


def _body_move(
    axis: Axis, key: str, kind: str, position: float, unit: str, speed: float, within: float
) -> Request:
    common = {"kind": kind, "max_speed": _rate(axis, speed, unit), "start_within_s": within or None}
    direction = "cw" if position >= 0 else "ccw"
    if kind == "relative":
        moving = _given(**common, direction=direction, distance=_length(axis, abs(position), unit))
    elif kind == "absolute":
        moving = _given(**common, position=_length(axis, position, unit))
    elif kind == "position":
        moving = _given(**common, position=_number(position))
    elif kind == "continuous":
        moving = _given(kind=kind, direction=direction, start_within_s=within or None)
    elif kind == "home":
        return _home(axis.path, key, within)
    else:
        raise _unknown_kind(kind, START[1].told)
    return Request(f"{axis.path}/moves", moving, key)


def _robot_move(
    axis: Axis, key: str, kind: str, position: float, unit: str, speed: float, within: float
) -> Request:
    if unit not in ("", axis.unit):
        raise Wrong(f"The axis is moved in {axis.unit}, and not in {unit}", "Leave Unit empty.")
    common = {"kind": kind, "start_within_s": within or None}
    if kind in ("relative", "absolute"):
        moving = _given(**common, axes={axis.name: _length(axis, position, "")}, speed_percent=speed or None)
    elif kind == "step":
        moving = _given(**common, axis=axis.name, steps=_number(position))
    else:
        raise _unknown_kind(kind, "relative, absolute or step; home and position are the unit's")
    return Request(f"{axis.path}/moves", moving, key)


def _unit_move(
    path: str, key: str, kind: str, position: float, _unit: str, speed: float, within: float
) -> Request:
    if kind == "home":
        return _home(path, key, within)
    if kind != "position":
        raise _unknown_kind(kind, "position or home; relative and absolute are the axes'")
    number = _number(position)
    moving = _given(kind=kind, position=number, speed_percent=speed or None, start_within_s=within or None)
    return Request(f"{path}/moves", moving, key)


def _unknown_kind(kind: str, kinds: str) -> Wrong:
    return Wrong(f"There is no kind of move {kind!r}", f"Kind is {kinds}.")


def _jog(axis: Axis, key: str, direction: str, speed: float, at_most: float) -> Request:
    if axis.name is not None:
        unit = int(axis.path.rpartition("/")[2])
        sign = {"cw": "+", "ccw": "-"}.get(direction, direction)
        return Request(f"{_owner(axis.path)}/jogs", {"unit": unit, "axis": axis.name, "direction": sign}, key)
    limit = _length(axis, at_most, "") if at_most else None
    body = _given(direction=direction, max_speed=_rate(axis, speed, ""), at_most=limit)
    return Request(f"{axis.path}/jogs", body, key)
