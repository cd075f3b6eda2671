"""Command rows: one typed class per controller command, with its wire form and no behaviour."""

import re
from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property, lru_cache
from inspect import getdoc
from itertools import chain, product
from types import GenericAlias, NoneType, UnionType
from typing import (
    TYPE_CHECKING,
    Annotated,
    Any,
    ClassVar,
    Generic,
    Self,
    TypeVar,
    Union,
    get_args,
    get_origin,
)

from pydantic import BaseModel, ConfigDict, ValidationError, model_validator

from protocols.members import at_hand
from protocols.wording import sentence

READINGS_KEPT = 512
"""Texts whose decoded models are kept: axes at rest and their status answer the same again and again."""


class WireFault(ValueError):
    """Text from the wire that is not what it should be."""


class SyntaxFault(WireFault):
    """The text does not have the form its row prescribes."""


class RangeFault(WireFault):
    """The form is right, but a value lies outside its range."""


@at_hand
class Retry(StrEnum):
    """The effect of repeating a command that was not answered; the gateway repeats only reads and stops."""

    READ = "read"
    """Changes nothing: repeated after a passed fence, unless it steps the position index."""
    SETTING = "setting"
    """Never repeated unasked. Absolute and readable: read it back, and repeat it if it differs."""
    CONDITIONAL = "conditional"
    """Never repeated unasked. Repeating may hide an alarm, wear flash or move: only a person decides."""
    NEVER = "never"
    """Never repeated unasked: repeating does it twice."""
    STOP = "stop"
    """Harmless to repeat: a software stop is repeated until standstill is proved."""


@at_hand
class Effect(StrEnum):
    """The effect of a command, which alone decides who may send it and how it is carried out."""

    READ = "read"
    """Changes nothing."""
    SETTING = "setting"
    """Changes what the controller keeps or shows: no motor moves because of it."""
    CLEARING = "clearing"
    """Takes back an error that was seen to: no motor moves because of it."""
    MOTION = "motion"
    """Could move a motor, or changes how it moves."""
    STOP = "stop"
    """Stops a motor."""
    MAINTENANCE = "maintenance"
    """Changes what only a set-up should: the flash memory, user programs, the communication."""


_EFFECTS = {Retry.READ: Effect.READ, Retry.SETTING: Effect.SETTING, Retry.STOP: Effect.STOP}
"""Effect of a row that names none: these retry classes leave only one."""


class Wire:
    """The notation of one value on the wire: a regular expression without groups, and two functions."""

    pattern: str

    def encode(self, value: Any) -> str:
        """Write a value that is valid for its field."""
        return str(value)

    def decode(self, text: str) -> object:
        """Read text that matches `pattern`; the range is checked by the field."""
        return text


@dataclass(frozen=True)
class Choice(Wire):
    """The first of several notations that fits."""

    wires: tuple[Wire, ...]

    @cached_property
    def pattern(self) -> str:  # type: ignore[override]  # computed here, constant elsewhere
        """Any of the notations."""
        return "|".join(wire.pattern for wire in self.wires)

    def encode(self, value: Any) -> str:
        """Write the value in the first notation that can hold it."""
        for wire in self.wires:
            text = _try_encode(wire, value)
            if text is not None:
                return text
        raise RangeFault(f"{value!r} has no notation on the wire")

    def decode(self, text: str) -> object:
        """Read with the first notation that fits."""
        for wire in self.wires:
            if re.fullmatch(wire.pattern, text):
                return wire.decode(text)
        raise SyntaxFault(f"{text!r} is in no known notation")


def _try_encode(wire: Wire, value: object) -> str | None:
    """Write the value if this notation can hold it and reads back as the same."""
    try:
        text = wire.encode(value)
        same = re.fullmatch(wire.pattern, text) is not None and wire.decode(text) == value
    except (TypeError, ValueError, AttributeError, KeyError):
        return None
    return text if same else None


def wire_of(annotation: object, metadata: Sequence[object] = ()) -> Wire:
    """Find the notation of a field: a `Wire` in its `Annotated`, or those of the members of its union."""
    for item in metadata:
        if isinstance(item, Wire):
            return item
    if get_origin(annotation) is Annotated:
        inner, *extras = get_args(annotation)
        return wire_of(inner, extras)
    if get_origin(annotation) in (Union, UnionType):
        members = [wire_of(member) for member in get_args(annotation) if member is not NoneType]
        return members[0] if len(members) == 1 else Choice(tuple(members))
    raise TypeError(f"{annotation} does not say how it is written on the wire")


@dataclass(frozen=True)
class _Literal:
    text: str


@dataclass(frozen=True)
class _Value:
    name: str
    wire: Wire


@dataclass(frozen=True)
class _Optional:
    parts: "tuple[_Part, ...]"


_Part = _Literal | _Value | _Optional
_TOKEN = re.compile(r"\{(\w+)\}|([<>])|([^{}<>]+)")


class Form(ABC):
    """One way in which a row's parameters stand on the wire: as text, or as the bytes of a codec."""

    syntax: str
    """The form in words a person can follow."""

    @abstractmethod
    def variants(self) -> set[frozenset[str]]:
        """Sets of fields that this form can write."""

    @abstractmethod
    def read(self, data: Any, /) -> dict[str, object] | None:
        """Decode the fields present; None where the data has another form."""

    @abstractmethod
    def write(self, values: Mapping[str, object]) -> Any:
        """Encode the given fields; their set must be one of `variants`."""


class Codec(ABC):
    """The notation of a protocol's rows on the wire: a row says what is said, its codec says how."""

    @abstractmethod
    def forms_of(self, row: "type[Spoken]", syntax: str) -> tuple[Form, ...]:
        """Build the forms of a row, whose fields are known now; `syntax` is its keyword `args`."""


class TextForm(Form):
    """A form such as `<A[{pattern}],>{distance}`."""

    def __init__(self, syntax: str, wires: Mapping[str, Wire]) -> None:
        self.syntax = syntax
        self._parts = _parse(syntax, wires)
        self._wires = {part.name: part.wire for part in _values(self._parts)}

    @cached_property
    def _pattern(self) -> re.Pattern[str]:
        """The pattern of its text; hundreds of forms are written, and never read."""
        return re.compile(_pattern(self._parts))

    def variants(self) -> set[frozenset[str]]:
        """Every choice of its optional groups."""
        return set(_variants(self._parts))

    def read(self, text: str, /) -> dict[str, object] | None:
        """Decode the text."""
        match = self._pattern.fullmatch(text)
        if match is None:
            return None
        found = match.groupdict()
        return {name: self._wires[name].decode(text) for name, text in found.items() if text is not None}

    def write(self, values: Mapping[str, object]) -> str:
        """Encode as text."""
        return _write(self._parts, values)


class TextCodec(Codec):
    """Plain text, by the forms of `args`, separated by `|`."""

    def forms_of(self, row: "type[Spoken]", syntax: str) -> tuple[Form, ...]:
        """Build one for each alternative."""
        named = {name: field for name, field in row.model_fields.items() if f"{{{name}}}" in syntax}
        wires = {name: wire_of(field.annotation, field.metadata) for name, field in named.items()}
        return tuple(TextForm(form, wires) for form in syntax.split("|"))


def _parse(syntax: str, wires: Mapping[str, Wire]) -> tuple[_Part, ...]:
    stack: list[list[_Part]] = [[]]
    for name, bracket, text in _TOKEN.findall(syntax):
        if name:
            stack[-1].append(_Value(name, wires[name]))
        elif text:
            stack[-1].append(_Literal(text))
        elif bracket == "<":
            stack.append([])
        else:
            group = tuple(stack.pop())
            stack[-1].append(_Optional(group))
    return tuple(stack[0])


def _pattern(parts: Sequence[_Part]) -> str:
    return "".join(
        re.escape(part.text)
        if isinstance(part, _Literal)
        else f"(?P<{part.name}>{part.wire.pattern})"
        if isinstance(part, _Value)
        else f"(?:{_pattern(part.parts)})?"
        for part in parts
    )


def _values(parts: Sequence[_Part]) -> Iterator[_Value]:
    for part in parts:
        if isinstance(part, _Value):
            yield part
        elif isinstance(part, _Optional):
            yield from _values(part.parts)


def _variants(parts: Sequence[_Part]) -> Iterator[frozenset[str]]:
    choices: list[list[frozenset[str]]] = []
    for part in parts:
        if isinstance(part, _Value):
            choices.append([frozenset([part.name])])
        elif isinstance(part, _Optional):
            choices.append([frozenset(), *_variants(part.parts)])
    for chosen in product(*choices):
        yield frozenset(chain.from_iterable(chosen))


def _write(parts: Sequence[_Part], values: Mapping[str, object]) -> str:
    out: list[str] = []
    for part in parts:
        if isinstance(part, _Literal):
            out.append(part.text)
        elif isinstance(part, _Value):
            out.append(part.wire.encode(values[part.name]))
        elif any(value.name in values for value in _values(part.parts)):
            out.append(_write(part.parts, values))
    return "".join(out)


class Spoken(BaseModel):
    """A model with a written form: the parameters of a command, or those of a reply.

    The class keyword `args` is its syntax: fields in braces, optional groups in angle brackets, alternatives
    separated by `|`. A field is absent when it is None. A combination that no form can write cannot be built.
    """

    model_config = ConfigDict(strict=True, frozen=True, extra="forbid", defer_build=True)

    codec: ClassVar[Codec] = TextCodec()
    forms: ClassVar[tuple[Form, ...]] = ()
    _syntax: ClassVar[str] = ""
    _writer: ClassVar[dict[frozenset[str], Form]] = {}

    def __init_subclass__(cls, *, args: str | None = None) -> None:
        """Take the class keywords; pydantic completes the fields afterwards."""
        super().__init_subclass__()
        if args is not None:
            cls._syntax = args

    @classmethod
    def __pydantic_init_subclass__(cls, **_: object) -> None:
        """Compile the forms, now that the fields are known."""
        cls.forms = cls.codec.forms_of(cls, cls._syntax)
        # Where two forms write the same fields, the first is the one we speak.
        cls._writer = {variant: form for form in reversed(cls.forms) for variant in form.variants()}

    @model_validator(mode="after")
    def _has_a_form(self) -> Self:
        if self._given() not in self._writer:
            raise ValueError(f"this combination of parameters cannot be written: {' or '.join(self.usage())}")
        return self

    def _given(self) -> frozenset[str]:
        return frozenset([name for name in self.__pydantic_fields__ if self.__dict__[name] is not None])

    @classmethod
    def usage(cls) -> list[str]:
        """The written forms, in words a person can follow."""
        return [form.syntax or "no parameters" for form in cls.forms]

    @classmethod
    def may_be_empty(cls) -> bool:
        """Say whether the command can be written without any parameter."""
        return frozenset() in cls._writer

    def written(self) -> str:
        """The parameters as text on the wire, without code and frame."""
        text: str = self._encoded()
        return text

    def packed(self) -> bytes:
        """The parameters as bytes on the wire, where the codec is binary."""
        data: bytes = self._encoded()
        return data

    @classmethod
    def text_of(cls, values: Mapping[str, object]) -> str:
        """The text of parameters that are known to be good.

        :raises KeyError: this combination of parameters cannot be written.
        """
        text: str = cls._writer[frozenset(values)].write(values)
        return text

    def _encoded(self) -> Any:
        given = self._given()
        return self._writer[given].write({name: getattr(self, name) for name in given})

    @cached_property
    def form_index(self) -> int:
        """Index of the row's form that writes this command."""
        return self.forms.index(self._writer[self._given()])

    @classmethod
    def read(cls, text: str) -> Self:
        """Decode the text after the code.

        :raises SyntaxFault: it has none of the forms.
        :raises RangeFault: a value is outside its range.
        """
        return cls.read_form(text, cls.forms)

    @classmethod
    def unpack(cls, data: bytes) -> Self:
        """Decode the bytes of a binary codec; errors as of `read`."""
        return cls.read_form(data, cls.forms)

    @classmethod
    @lru_cache(READINGS_KEPT)
    def read_form(cls, text: str | bytes, forms: tuple[Form, ...]) -> Self:
        """Decode what must have one of the given forms."""
        try:
            for form in forms:
                values = form.read(text)
                if values is not None:
                    return cls.model_validate(values)
        except ValidationError as error:
            raise RangeFault(f"{text!r}: {sentence(error.errors()[0])}") from None
        raise SyntaxFault(f"{text!r} is not of the form {' or '.join(cls.usage())}")


class Reply(Spoken):
    """A controller's answer; numbers always have their printed width."""


class Ack(Reply, args=""):
    """The bare echo of the code: accepted."""


R_co = TypeVar("R_co", bound=Reply, covariant=True)
_WORD = re.compile(r"(?<=[a-z0-9])(?=[A-Z])")


class Command(Spoken, Generic[R_co]):
    """A row of a controller's command table: an instance is one command with its parameters."""

    code: ClassVar[str] = ""
    retry: ClassVar[Retry] = Retry.NEVER
    effect: ClassVar[Effect] = Effect.MOTION
    """Rows whose retry class leaves several effects name theirs."""
    for_questions: ClassVar[bool] = False
    """True if the command only chooses the subject of later commands; it moves and sets nothing."""
    starts: ClassVar[bool] = True
    """True for a motion with an end that the controller shows; false to change one, and for programs."""
    starts_motion: ClassVar[bool] = True
    """True if the command sets a motor moving, to an end that the controller shows."""
    echo: ClassVar[tuple[str, ...]] = ()
    """Fields that the reply repeats and that must be equal."""
    example: ClassVar[tuple[Any, ...]] = ()
    """Command and reply in turn: without CR, as the manual prints them (misprints mended, spaces removed);
    of a binary protocol the whole frames."""
    _reply_type: ClassVar[type[Reply] | None] = None

    if not TYPE_CHECKING:

        def __class_getitem__(cls, reply: object) -> GenericAlias:
            """Say what is answered; pydantic would make one more class of it, which takes a millisecond."""
            return GenericAlias(cls, reply)

    @classmethod
    def __pydantic_init_subclass__(cls, **keywords: object) -> None:
        """Note the R of `Command[R]`, for this class and its subclasses."""
        super().__pydantic_init_subclass__(**keywords)
        for base in cls.__dict__.get("__orig_bases__", ()):
            for argument in get_args(base):
                if isinstance(argument, type):
                    cls._reply_type = argument

    @classmethod
    def reply_type(cls) -> type[Reply]:
        """Type of the reply: the R of `Command[R]`."""
        if cls._reply_type is None:
            raise TypeError(f"{cls.__name__} does not say what is answered")
        return cls._reply_type

    @classmethod
    def _take_columns(cls, columns: Mapping[str, object]) -> None:
        """Note the columns that a row gives; the others are those of its base."""
        for name, value in columns.items():
            if value is not None:
                setattr(cls, name, value)
        retry = columns["retry"]
        if isinstance(retry, Retry) and columns["effect"] is None and retry in _EFFECTS:
            cls.effect = _EFFECTS[retry]
        cls.starts_motion = cls.effect is Effect.MOTION and cls.starts

    @classmethod
    def name(cls) -> str:
        """The row's name in paths and on the command line, such as `move-clockwise`."""
        return _WORD.sub("-", cls.__name__).lower()

    @classmethod
    def titles(cls) -> tuple[str, str]:
        """The manual's title in Japanese, and ours in English: the halves of the docstring's first line."""
        japanese, _, english = (getdoc(cls) or "").partition("\n")[0].partition(": ")
        return japanese, english.rstrip(".")

    @classmethod
    def of_example(cls) -> Self:
        """The command of the first example."""
        text = cls.example[0]
        return cls.read(text.partition(cls.code)[2].lstrip() if cls.code else text)

    def retry_class(self) -> Retry:
        """The retry class of this very command."""
        return self.retry

    @cached_property
    def may_repeat(self) -> bool:
        """True if the gateway may repeat the command after a missing reply."""
        return self.retry_class() is Retry.READ

    def read_reply(self, text: str | bytes) -> R_co:
        """Decode the payload of the reply to this very command.

        Where command and reply have equally many forms, they correspond one to one: asked for one bit, a
        controller answers one bit. Repeated fields must be equal, where the command gave them.

        :raises WireFault: it cannot be the reply to this command.
        """
        model: Any = self.reply_type()
        forms: tuple[Form, ...] = model.forms
        if len(forms) == len(self.forms) > 1:
            forms = (forms[self.form_index],)
        reply: R_co = model.read_form(text, forms)
        for name in self.echo:
            asked, repeated = getattr(self, name), getattr(reply, name)
            if asked is not None and repeated != asked:
                raise SyntaxFault(f"the reply repeats {name} as {repeated!r}, asked was {asked!r}")
        return reply
