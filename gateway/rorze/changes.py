"""Settings that a body tells and takes by pairs of commands: read as values, changed where they differ."""

from collections.abc import AsyncIterator, Awaitable, Callable, Iterable, Mapping, Sequence
from contextlib import asynccontextmanager
from dataclasses import dataclass, field
from typing import Annotated, Any, Final, Literal, NamedTuple

from pydantic import BaseModel, Field, JsonValue, ValidationError

from gateway.core.errors import (
    CommandGarbled,
    ControllerRefused,
    GatewayError,
    InvalidRequest,
    NoReply,
    Outdated,
)
from gateway.core.operation import Expectation
from gateway.core.records import Record
from gateway.rorze.asked_body import AskedBody, believed
from gateway.rorze.errors import PartlyDone, TakenOtherwise
from protocols.rorze.flash import SaveSettings
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack, Reply, Retry
from protocols.wording import expectation

Query = RorzeCommand[Any]
Setter = RorzeCommand[Ack]
Flash = Annotated[bool, Field(description="Write all settings of the body to flash memory afterwards (FIS).")]
TRIES: Final = 2
"""A setting that was not done, or whose command arrived garbled, is sent once more: it is absolute."""


class SettingCodec(NamedTuple):
    """A value in the words of clients, in a reply and as parameters of the command that sets it."""

    read: Callable[[Any], Any]
    write: Callable[[Any], Mapping[str, Any]]


def plain(name: str, parameter: str | None = None) -> SettingCodec:
    """A field of the reply, and the parameter that sets it."""
    return SettingCodec(lambda reply: getattr(reply, name), lambda value: {parameter or name: value})


def switch(name: str) -> SettingCodec:
    """A field that is 0 or 1."""
    return SettingCodec(lambda reply: bool(getattr(reply, name)), lambda value: {name: int(value)})


@dataclass(frozen=True)
class Item:
    """One value that a body keeps."""

    name: str
    question: Query
    setter: type[Setter]
    codec: SettingCodec
    place: Mapping[str, Any] = field(default_factory=dict)
    """The parameters that say which one it is."""
    refused_as: Mapping[str, Any] = field(default_factory=dict)
    """The value that a refusal with one of these errors means."""

    def value_in(self, reply: Reply | None) -> Any:
        """The value that a reply tells; None without one."""
        return None if reply is None else self.codec.read(reply)

    def command(self, value: Any) -> Setter:
        """The command that sets the value.

        :raises InvalidRequest: no command can.
        """
        try:
            return self.setter(**self.place, **self.codec.write(value))
        except ValidationError as error:
            said = expectation(error.errors()[0])
            raise InvalidRequest(f"{self.name}: {said}; nothing was sent.") from None


class ChangeStep(Record):
    """The outcome of one value that was asked for."""

    name: str
    command: str = Field(description="The command that sets it, without frame.")
    outcome: Literal["unchanged", "changed"] = Field(
        description="unchanged: it was so already, and nothing was sent; changed: set, and read back."
    )
    before: JsonValue = Field(description="Value before; null also where it could not be read.")


Wanted = tuple[Item, Any]


async def read(body: AskedBody, item: Item) -> Any:
    """Ask a body for one value; while the line errs, twice.

    :raises GatewayError: it was not read.
    """

    async def ask() -> Any:
        try:
            return item.value_in((await body.ask(item.question))[0])
        except ControllerRefused as refusal:
            code = refusal.error_code or ""
            if code not in item.refused_as:
                raise
            return item.refused_as[code]

    return await believed(body.line, ask)


async def change(
    body: AskedBody, wanted: Sequence[Wanted], *, flash: bool = False, told: int | None = None
) -> list[ChangeStep]:
    """Set what differs, in order, and read each back; then write flash memory if asked for (FIS).

    A value that may never have been set, though it reads as wanted, is set, too. Each value is set and read
    back undivided; between two values others may ask, but no other change comes between. A stop of the body
    ends the change. `told` is the body's count of commands at which it was as the sender expects, where that
    matters.

    :raises InvalidRequest: one cannot be set; nothing was sent.
    :raises Outdated: it was told something since; nothing was sent.
    :raises PartlyDone: it was broken off after the first change.
    :raises GatewayError: nothing was changed.
    """
    commands = [item.command(value) for item, value in wanted]
    steps: list[ChangeStep] = []
    saved = False
    async with body.changing:
        if told is not None and body.sent_count != told:
            raise Outdated
        epoch = body.line.gate.epoch(body.number)
        try:
            for (item, value), command in zip(wanted, commands, strict=True):
                steps.append(await _step(body, item, value, command, epoch))
            if flash:
                async with _undivided(body, epoch):
                    await body.ask(SaveSettings())
                saved = True
        except GatewayError as error:
            left = [_text(command) for command in commands[len(steps) :]] + ["FIS"] * flash
            raise _broken_off(body, steps, left, error) from error
        finally:
            if saved or _done(steps):
                body.on_news("body.settings.changed", {"commands": _done(steps), "saved": saved})
    return steps


@asynccontextmanager
async def _undivided(body: AskedBody, epoch: int) -> AsyncIterator[None]:
    """Hold a body's lock for one value, unless a stop has come since the change began."""
    gate = body.line.gate
    async with body.line.undivided([body.number]):
        if gate.epoch(body.number) != epoch:
            raise gate.overtaken(body.number)
        yield


async def as_expected(
    body: AskedBody, document: Callable[[], Awaitable[BaseModel]], expects: Expectation | None
) -> int | None:
    """Require a body to be as expected; gives its count of commands before the reading, or None.

    :raises Outdated: it is otherwise.
    :raises GatewayError: it was not read.
    """
    if expects is None:
        return None
    told = body.sent_count
    expects(await document())
    return told


async def _step(body: AskedBody, item: Item, value: Any, command: Setter, epoch: int) -> ChangeStep:
    before, is_so = None, False
    try:
        before = await read(body, item)
        is_so = _agree(before, value) and not body.flash.may_be_unset(command)
    except ControllerRefused as refusal:
        if not refusal.lasting:
            raise  # what cannot be read can be set
    if is_so:
        return ChangeStep(name=item.name, command=_text(command), outcome="unchanged", before=before)
    async with _undivided(body, epoch):
        await _set(body, item, value, command)
    return ChangeStep(name=item.name, command=_text(command), outcome="changed", before=before)


def _agree(found: Any, wanted: Any) -> bool:
    """True if a value is as wanted; of one with several members, those that are given."""
    if isinstance(found, dict) and isinstance(wanted, dict):
        return wanted.items() <= found.items()
    return bool(found == wanted)


async def _set(body: AskedBody, item: Item, value: Any, command: Setter) -> None:
    """Set a value, and see that it is kept."""
    failed: GatewayError | None = None
    for _ in range(TRIES if command.retry is Retry.SETTING else 1):
        failed = None
        try:
            await body.ask(command)
        except (NoReply, CommandGarbled) as error:
            failed = error
        if _agree(found := await read(body, item), value) and not body.flash.may_be_unset(command):
            return
    raise failed or TakenOtherwise(
        f"{body.address} took {_text(command)}, and tells {found!r} afterwards.",
        "Read it again; a user program or another host may have set it meanwhile.",
    )


def _done(steps: Iterable[ChangeStep]) -> list[str]:
    return [step.command for step in steps if step.outcome == "changed"]


def _broken_off(
    body: AskedBody, steps: Iterable[ChangeStep], left: Sequence[str], cause: GatewayError
) -> GatewayError:
    done = _done(steps)
    return PartlyDone(body.address, done, left, cause) if done else cause


def _text(command: Setter) -> str:
    return command.code + command.written()
