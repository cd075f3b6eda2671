"""The settings of a body as one document: read, compared, and set where they differ (RC-420 manual 18)."""

from collections.abc import Awaitable, Callable, Iterator, Mapping
from functools import cache
from operator import itemgetter
from typing import Annotated, Any, Final, TypeVar

from pydantic import BaseModel, Field, JsonValue

from gateway.core.errors import BodyBusy, ControllerRefused, InvalidRequest
from gateway.core.operation import Expectation, Rows
from gateway.core.records import AnswerModel, RequestModel, SentBack, example
from gateway.core.rights import Right
from gateway.rorze.asked_body import AskedBody, Homed
from gateway.rorze.changes import ChangeStep, Flash, Item, Wanted, as_expected, change, read
from gateway.rorze.errors import MOVING
from gateway.rorze.settings_table import (
    SETTINGS,
    BodySetting,
    BodySettingsChange,
    FilteredInput,
    HomingChange,
    HomingSettings,
    Key,
    Sensor,
    Settings,
)
from gateway.rorze.speed_sets import SHARES, SPEEDS
from gateway.rorze.units import Per, Scaled
from protocols.rorze.origin import GetHomingDistance
from protocols.rorze.row import MODE_NAMES, ModeName
from protocols.rorze.status import GetInformation

ROWS: Final = Rows("body settings")
MODE: Final = "operating_mode"
_DIGITS: Final = {name: digit for digit, name in MODE_NAMES.items()}
B = TypeVar("B", bound=AskedBody)
_PER: Final[Mapping[str | None, Per]] = {"pulse": "", "pps": "/s", "pps/s": "/s2"}


class AboutSetting(AnswerModel):
    """The manual's words on a setting."""

    command: str = Field(description="The code that sets it.")
    unit: str | None = Field(description="pulse, pps, pps/s, percent, ms, um, pulse/count; null for none.")
    minimum: float | None
    maximum: float | None
    default: JsonValue = Field(description="Value when nothing was written to flash memory.")


class BodySettings(AnswerModel):
    """The settings of a body."""

    body_id: str
    version: str = Field(description="Version of the control software (9VD).")
    settings: Settings = Field(description="Settings in RAM: those in force.")
    in_unit: dict[str, Scaled] = Field(
        description="Settings in pulses, in the body's unit, by their names; empty without a scale."
    )
    unavailable: dict[str, str] = Field(description="Settings that cannot be read now, and why.")
    flash: Settings | None = Field(
        description=(
            "Settings in flash memory, as far as is known; null where the gateway has seen neither the "
            "power come on nor FIS. Position index and outputs change without a command, so they are never "
            "told."
        )
    )
    about: dict[str, AboutSetting] = Field(description="Units, ranges, and values of the factory, by name.")


class ChangedSettings(AnswerModel):
    """Settings after a change, as they were read back."""

    body_id: str
    settings: Settings = Field(description="Settings that were named; the others are left out.")
    steps: list[ChangeStep] = Field(description="Steps of the change, in order.")


async def read_settings(body: AskedBody) -> BodySettings:
    """Ask a body for all settings: one frame for all inputs, sensors and outputs each.

    :raises GatewayError: they were not read.
    """
    version = (await body.ask(GetInformation()))[0].text
    mode = await read(body, SETTINGS[MODE].item)
    unavailable = unavailable_in(mode, SETTINGS)
    values, moving = await read_values(
        body, {name: setting for name, setting in SETTINGS.items() if name not in unavailable}
    )
    return BodySettings(
        body_id=body.address,
        version=version,
        settings=_document(values),
        in_unit=dict(scaled(body, values)),
        unavailable=unavailable | moving,
        flash=_in_flash(body) if body.flash.known else None,
        about=about(),
    )


async def change_settings(
    body: B,
    wanted: RequestModel,
    document: Callable[[B], Awaitable[BaseModel]],
    expects: Expectation | None,
    *,
    flash: bool,
) -> ChangedSettings:
    """Set those of the named settings that differ, and read each back; errors as of `changes.change`.

    `document` reads that of which the settings are a part: `expects` is shown it.

    :raises InvalidRequest: none is named, or one cannot be set in the operating mode; nothing was sent.
    :raises BodyBusy: the motor moves; nothing was sent.
    """
    named = wanted.model_dump(include=wanted.model_fields_set)
    if not named:
        raise InvalidRequest("No setting is named; nothing was sent.", "Name what shall change.")
    named = await _without_nulls(body, named)
    await _require_mode(body, named)
    if body.move is not None or (await body.where_it_rests()).runs:
        raise BodyBusy(f"{body.address} moves; no setting was changed.", "Wait for standstill.")
    told = await as_expected(body, lambda: document(body), expects)
    steps = await change(body, list(_wanted(named)), flash=flash, told=told)
    found, _ = await read_values(body, {name: setting for name, setting in SETTINGS.items() if name in named})
    return ChangedSettings(body_id=body.address, settings=_document(found), steps=steps)


@cache
def about() -> dict[str, AboutSetting]:
    """The manual's words on each setting, by name."""
    properties = Settings.model_json_schema()["properties"]
    return {name: _about(setting, properties[name]) for name, setting in SETTINGS.items()}


def _about(setting: BodySetting, schema: Mapping[str, Any]) -> AboutSetting:
    inner = schema["anyOf"][0]
    ranged = inner.get("additionalProperties", inner)
    most = ranged.get("maximum", ranged.get("exclusiveMaximum", 0) - 1)
    return AboutSetting(
        command=setting.item.setter.code,
        unit=setting.unit,
        minimum=ranged.get("minimum"),
        maximum=most if most >= 0 else None,
        default=setting.default,
    )


def unavailable_in(mode: ModeName, settings: Mapping[str, BodySetting]) -> dict[str, str]:
    """Name the settings that an operating mode does not have, and say why."""
    return {
        name: _only_in(setting) for name, setting in settings.items() if _DIGITS[mode] not in setting.modes
    }


def _only_in(setting: BodySetting) -> str:
    return f"Only in the operating mode {_modes_of(setting)}."


def _modes_of(setting: BodySetting) -> str:
    return " or ".join(MODE_NAMES[digit] for digit in setting.modes)


async def read_values(
    body: AskedBody, settings: Mapping[str, BodySetting]
) -> tuple[dict[str, Any], dict[str, str]]:
    """Ask a body for settings: their values, and why some cannot be read.

    The first members of all come first, then the second ones: one fence serves a round of different
    questions, where equal ones in a row take a fence each.
    """
    found: dict[str, dict[Key, Any]] = {name: {} for name in settings}
    unavailable: dict[str, str] = {}
    for name, key in _rounds(settings):
        try:
            found[name][key] = await _ask(body, settings[name], key)
        except ControllerRefused as refusal:
            if refusal.error_code == MOVING:
                unavailable[name] = "Not while the motor moves."
            elif refusal.lasting:
                unavailable[name] = refusal.detail
            else:
                raise
    return {name: _nested(values) for name, values in found.items() if name not in unavailable}, unavailable


def _rounds(settings: Mapping[str, BodySetting]) -> list[tuple[str, Key]]:
    numbered = [
        (number, name, key)
        for name, setting in settings.items()
        for number, key in enumerate([None] if setting.whole else setting.items)
    ]
    return [(name, key) for _, name, key in sorted(numbered, key=itemgetter(0))]


async def _ask(body: AskedBody, setting: BodySetting, key: Key) -> Any:
    if setting.whole is not None:
        return setting.whole.values_in((await body.ask(setting.whole.question))[0])
    return await read(body, setting.items[key])


def _nested(values: Mapping[Key, Any]) -> Any:
    """The members of a setting as the document has them; a key with a point has members of its own."""
    if None in values:
        return values[None]
    nested: dict[str, Any] = {}
    for key, value in values.items():
        outer, _, inner = (key or "").partition(".")
        if inner:
            nested.setdefault(outer, {})[inner] = value
        else:
            nested[outer] = value
    return nested


def known(values: Mapping[str, Any]) -> dict[str, Any]:
    """Give the values without speeds that were never set, which are told as 0."""
    return {name: value for name, value in values.items() if name not in SPEEDS or name in SHARES or value}


def _document(values: Mapping[str, Any]) -> Settings:
    return Settings.model_validate(known(values))


def _in_flash(body: AskedBody) -> Settings:
    return _document({name: _held(body, setting) for name, setting in SETTINGS.items()})


def _held(body: AskedBody, setting: BodySetting) -> Any:
    if setting.whole is not None:
        reply = body.flash.held(setting.whole.question)
        return None if reply is None else setting.whole.values_in(reply)
    held = {key: (item, body.flash.held(item.question)) for key, item in setting.items.items()}
    if any(reply is None for _, reply in held.values()):
        return None
    return _nested({key: item.value_in(reply) for key, (item, reply) in held.items()})


def scaled(body: AskedBody, values: Mapping[str, Any]) -> Iterator[tuple[str, Scaled]]:
    """Give those in pulses, in the body's unit, by their names."""
    for name, value in values.items():
        if (per := _PER.get(SETTINGS[name].unit)) is None:
            continue
        for path, pulses in _numbers(name, value):
            if (converted := Scaled.of(pulses, body.scale, per)) is not None:
                yield path, converted


def _numbers(path: str, value: Any) -> Iterator[tuple[str, float]]:
    if isinstance(value, dict):
        for name, inner in value.items():
            yield from _numbers(f"{path}.{name}", inner)
    elif value is not None:
        yield path, value


async def _without_nulls(body: AskedBody, named: Mapping[str, Any]) -> dict[str, Any]:
    """Leave out those that are named as not set or not known, and are.

    :raises InvalidRequest: one has a value, which null cannot end; nothing was sent.
    """
    nulls = {name: SETTINGS[name] for name, value in named.items() if value is None}
    nulls = {name: setting for name, setting in nulls.items() if setting.default is not None}
    if nulls:
        mode = named.get(MODE) or await read(body, SETTINGS[MODE].item)
        there = {name: setting for name, setting in nulls.items() if _DIGITS[mode] in setting.modes}
        found, _ = await read_values(body, there)
        for name in known(found):
            raise InvalidRequest(f"{name}: null is no value of it; nothing was sent.")
    return {name: value for name, value in named.items() if name not in nulls}


async def _require_mode(body: AskedBody, named: Mapping[str, Any]) -> None:
    """Refuse what the operating mode that will be does not have."""
    bound = [name for name in named if SETTINGS[name].modes != "012"]
    if not bound:
        return
    mode = named.get(MODE) or await read(body, SETTINGS[MODE].item)
    for name in bound:
        if _DIGITS[mode] not in SETTINGS[name].modes:
            raise InvalidRequest(
                f"{name}: only the operating mode {_modes_of(SETTINGS[name])} has it, and {body.address} "
                f"is in mode {mode}; only questions were sent."
            )


def _wanted(named: Mapping[str, Any]) -> Iterator[Wanted]:
    for name, setting in SETTINGS.items():
        if name in named:
            for key, item in setting.items.items():
                yield from _wanted_of(setting, item, named[name], key)


def _wanted_of(setting: BodySetting, item: Item, value: Any, key: Key) -> Iterator[Wanted]:
    """The wanted value of one item, if it is named; null is a value only where an item need not be set."""
    for part in key.split(".") if key else ():
        if value is None:
            break
        if part not in value:
            return
        value = value[part]
    if value is None and setting.default is not None:
        raise InvalidRequest(f"{setting.name}: null is no value of it; nothing was sent.")
    yield item, value


@ROWS.get("/bodies/{body_id}/settings", tagged=True)
async def get_body_settings(body: AskedBody) -> BodySettings:
    """Ask a body for the settings that FIS keeps (RC-420 manual 18), some ninety frames.

    Speed sets 0-29 and patterns stand at `/speed-sets` and `/patterns`; the standard set is here.
    """
    return await read_settings(body)


@ROWS.patch("/bodies/{body_id}/settings", Right.SETUP, named_only=True)
async def change_body_settings(
    body: AskedBody, change: BodySettingsChange, *, flash: Flash = False, expects: Expectation | None
) -> ChangedSettings:
    """Set those of the named settings that differ, one by one, and read each back; refused while it moves.

    Null ends soft limits, error outputs and what interrupts do. With `If-Match` all settings are read before,
    and nothing is sent where they are otherwise than they were.
    """
    return await change_settings(body, change, read_settings, expects, flash=flash)


NOISE_FILTERS: Final = "noise_filters"
Filters = dict[FilteredInput | Sensor, Annotated[int, Field(ge=1, le=99)]]


class NoiseFilters(AnswerModel):
    """The time for which an input or a sensor has to hold a new level before it counts as changed."""

    body_id: str
    noise_filters: Filters = Field(
        description="Equal samples, one each ms, that make a change of level, by input or sensor."
    )


class NoiseFiltersChange(SentBack, json_schema_extra=example(noise_filters={"d3": 5})):
    """Noise filters to be set; those that are not named stay as they are."""

    read_only = frozenset(("body_id",))

    noise_filters: Filters = Field(min_length=1, description="Samples by input or sensor.")


async def read_filters(body: AskedBody) -> NoiseFilters:
    """Ask a body for all of its noise filters.

    :raises GatewayError: they were not read.
    """
    values, _ = await read_values(body, {NOISE_FILTERS: SETTINGS[NOISE_FILTERS]})
    return NoiseFilters(body_id=body.address, noise_filters=values[NOISE_FILTERS])


@ROWS.get("/bodies/{body_id}/noise-filters", tagged=True)
async def get_noise_filters(body: AskedBody) -> NoiseFilters:
    """Ask a body for the noise filters of its inputs and sensors, one by one (DCD)."""
    return await read_filters(body)


@ROWS.patch("/bodies/{body_id}/noise-filters", Right.SETUP, named_only=True)
async def change_noise_filters(
    body: AskedBody, change: NoiseFiltersChange, *, flash: Flash = False, expects: Expectation | None
) -> ChangedSettings:
    """Set those of the named noise filters that differ (DCS), and read each back; refused while it moves."""
    return await change_settings(body, change, read_filters, expects, flash=flash)


class LastHoming(AnswerModel):
    """The outcome of the last search."""

    homed: Homed
    distance: int = Field(description="Pulses from its end back to its start (0PD); 0 after power-on.")
    in_unit: Scaled | None


class Homing(AnswerModel):
    """How a body searches its origin."""

    body_id: str
    settings: HomingSettings = Field(description="Settings in RAM; the speeds are those of the standard set.")
    in_unit: dict[str, Scaled] = Field(
        description="Settings in pulses, in the body's unit, by their names; empty without a scale."
    )
    overrun: int = Field(description="Pulses to overrun the sensor: the offset times the factor.")
    last: LastHoming


async def read_homing(body: AskedBody) -> Homing:
    """Ask a body how it searches its origin, and how far its last search went.

    :raises GatewayError: it was not read.
    """
    values, _ = await read_values(body, {name: SETTINGS[name] for name in HomingSettings.model_fields})
    distance, _ = await body.ask(GetHomingDistance())
    return Homing(
        body_id=body.address,
        settings=HomingSettings.model_validate(known(values)),
        in_unit=dict(scaled(body, values)),
        overrun=values["origin_offset"] * values["overrun_factor"],
        last=LastHoming(
            homed=body.power.homed, distance=distance.pulses, in_unit=Scaled.of(distance.pulses, body.scale)
        ),
    )


@ROWS.get("/bodies/{body_id}/homing", tagged=True)
async def get_homing(body: AskedBody) -> Homing:
    """Ask a body how it searches its origin, and how far its last search went (0PD)."""
    return await read_homing(body)


@ROWS.patch("/bodies/{body_id}/homing", Right.SETUP, named_only=True)
async def change_homing(
    body: AskedBody, change: HomingChange, *, flash: Flash = False, expects: Expectation | None
) -> ChangedSettings:
    """Set what differs of the set-up of homing, and read it back; refused while the motor moves."""
    return await change_settings(body, change, read_homing, expects, flash=flash)
