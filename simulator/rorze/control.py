"""The control interface of a simulated line, over HTTP: its sensors, its power and its faults."""

from collections.abc import Callable, Mapping
from dataclasses import fields, replace
from functools import partial
from typing import Annotated, Any, Literal

from fastapi import FastAPI, HTTPException, Path
from pydantic import AfterValidator, Field

from protocols.rorze.notation import BILLION
from simulator.control import Hold, Power, Strict, Touchable, add_faults, add_truth
from simulator.rorze.breakdowns import INTERNAL_ERRORS, Breakdown
from simulator.rorze.controller import Rc420
from simulator.rorze.line import Rc400Line
from simulator.rorze.rc400 import LinkSettings
from simulator.rorze.world import (
    CCW_LIMIT,
    CW_LIMIT,
    EMS,
    IN_POSITION,
    INPUTS,
    ORIGIN,
    STALL,
    Slits,
    Span,
)

SensorName = Literal["stall", "origin", "cw_limit", "ccw_limit", "in_position", "ems"]
SENSOR_BITS: Mapping[SensorName, int] = {
    "stall": STALL,
    "origin": ORIGIN,
    "cw_limit": CW_LIMIT,
    "ccw_limit": CCW_LIMIT,
    "in_position": IN_POSITION,
    "ems": EMS,
}


_INTERNAL = [f"{code:02X}" for code in sorted(INTERNAL_ERRORS)]


def _is_internal(code: str) -> str:
    if code not in _INTERNAL:
        raise ValueError(f"not one of {', '.join(_INTERNAL)}")
    return code


class BrownOut(Strict):
    """A loss of power that ends after a time."""

    for_s: float = Field(ge=0, le=3600, description="Seconds without power.")


class BodyChange(Strict):
    """Settings that the RC-420 manual leaves open about a controller; see docs/simulator.md."""

    keeps_position: bool | None = None
    keeps_comments: bool | None = None
    compares_inclusively: bool | None = None
    refuses_stale_positions: bool | None = None
    labels_lead_on: bool | None = None
    wrong_mode_error: int | None = Field(default=None, ge=0x10, le=0x6F)
    forgets_errors: bool | None = None
    pace: float | None = Field(default=None, ge=0.1, le=10)
    refuses_second_stop: bool | None = None


class Level(Strict):
    """The raw level of an input, before the controller's logic."""

    on: bool


class Stretch(Strict):
    """Where a sensor is covered, ends included, in pulses from where the axis stood at first, CW positive."""

    first: int
    last: int


class Disc(Strict):
    """A slit disc: covered for the first half of every `period` pulses, from `phase` on."""

    phase: int
    period: int = Field(ge=2)


class Mechanics(Strict):
    """The mechanics of an axis; what is left out stays as it is."""

    origin: Stretch | None = None
    cw_limit: Stretch | None = None
    ccw_limit: Stretch | None = None
    slits: Disc | None = None
    encoder: float | None = Field(
        default=None, ge=0.01, le=1e6, description="Motor pulses to a line of the encoder."
    )
    slipped: int | None = Field(
        default=None, gt=-BILLION, lt=BILLION, description="Pulses the motor did not follow, CW positive."
    )


class InternalError(Strict):
    """An error from inside the controller; 0 commands switch it off."""

    code: Annotated[str, AfterValidator(_is_internal)] = Field(
        description=f"Two hexadecimal digits, one of {', '.join(_INTERNAL)}."
    )
    next_commands: int = Field(default=1, ge=0, le=1_000_000, description="Commands that fail with it.")


class FlashMemory(Strict):
    """The settings in flash memory."""

    damaged: bool = Field(description="True if the next power-on finds the settings wrong.")


class BodyState(Strict):
    """One controller and its motor as they really are; words are bits as the manual counts them."""

    body: str
    powered: bool
    moving: bool
    position: int = Field(description="Position as 6PD tells it.")
    pulses: int = Field(description="Pulses from where the axis stood at first, CW positive.")
    status: int = Field(description="Status as 9CD tells it.")
    end_cause: int = Field(description="End cause as 9MD tells it.")
    sensors: dict[SensorName, bool]
    inputs: int
    outputs: int
    mechanics: Mechanics


class LinkState(Strict):
    """The link master: its power, the frames it has been sent, its settings."""

    powered: bool
    requests: int
    settings: dict[str, Any]


class LinkChange(Strict):
    """Settings of the link master; what is left out stays as it is."""

    reply_delay_s: float | None = Field(default=None, ge=0, le=60)
    error_codes: bool | None = None
    absent_bodies: Literal["silent", "error"] | None = None
    interjection: Literal["accept", "drop"] | None = None
    partners: Literal["go_on", "stop"] | None = None
    line_end: Literal["\r", "\r\n"] | None = None
    excess_line_ends: Literal["invalid", "ignored"] | None = None
    reply_order: Literal["in_turn", "swapped"] | None = None
    introducers: str | None = Field(default=None, pattern="^[&$#]{1,3}$")
    set_up: Literal["forgotten", "kept"] | None = None
    overlong: Literal["refused", "executed"] | None = None
    echoes: bool | None = None


class ProgramMessage(Strict):
    """The text of a user program."""

    text: str = Field(min_length=1, max_length=16, pattern=r"^[!-~]+$")


BodyId = Annotated[str, Path(pattern="^[0-7][0-9A-Fa-f]$", description="Two hexadecimal digits.")]
InputNumber = Annotated[int, Path(ge=0, lt=INPUTS)]


# All routes are coroutines: they run on the event loop's thread, as the machine does.
def create_control(line: Rc400Line, port: Touchable) -> FastAPI:
    """Build the interface to a line that runs in this event loop."""
    app = FastAPI(title="Simulated RC-400 line", docs_url=None, redoc_url=None)
    _add_bodies(app, line, port)
    _add_breakdowns(app, line, port)
    _add_power(app, line, port)
    _add_link(app, line, port)
    add_faults(app, line.faults)
    add_truth(app, line.truth)
    return app


def _add_bodies(app: FastAPI, line: Rc400Line, port: Touchable) -> None:
    change = partial(_change, line, port)

    @app.get("/bodies")
    async def list_bodies() -> list[BodyState]:
        """Tell the state of every controller."""
        return port.touch(lambda now: [_state(axis, now) for axis in line.axes.values()])

    @app.get("/bodies/{body_id}")
    async def get_body(body_id: BodyId) -> BodyState:
        """Tell the state of a controller."""
        axis = _axis(line, body_id)
        return port.touch(lambda now: _state(axis, now))

    @app.put("/bodies/{body_id}/sensors/{sensor}")
    async def hold_sensor(body_id: BodyId, sensor: SensorName, hold: Hold) -> BodyState:
        """Hold a sensor on or off, or let go of it."""
        return change(body_id, lambda axis: _hold(axis, SENSOR_BITS[sensor], hold.on))

    @app.put("/bodies/{body_id}/inputs/{number}")
    async def set_input(body_id: BodyId, number: InputNumber, level: Level) -> BodyState:
        """Set the raw level of a general input."""
        return change(body_id, lambda axis: _set_input(axis, number, level.on))

    @app.patch("/bodies/{body_id}/mechanics")
    async def move_mechanics(body_id: BodyId, mechanics: Mechanics) -> BodyState:
        """Move the sensors along the axis, or let the motor slip."""
        return change(body_id, lambda axis: _mount(axis, mechanics))

    @app.post("/bodies/{body_id}/messages", status_code=204)
    async def send_message(body_id: BodyId, message: ProgramMessage) -> None:
        """Send a text as a user program would; it reaches the host only after XID."""
        body = _axis(line, body_id).body
        port.touch(lambda now: line.send_program_message(body, message.text, now))


def _add_breakdowns(app: FastAPI, line: Rc400Line, port: Touchable) -> None:
    change = partial(_change, line, port)

    @app.put("/bodies/{body_id}/errors")
    async def break_down(body_id: BodyId, error: InternalError) -> BodyState:
        """Answer the next commands with an error of the hardware or of the RS-485 line."""
        breakdown = Breakdown(int(error.code, 16), error.next_commands)
        return change(body_id, lambda axis: setattr(axis, "breakdown", breakdown))

    @app.put("/bodies/{body_id}/flash")
    async def damage_flash(body_id: BodyId, memory: FlashMemory) -> BodyState:
        """Damage or mend the settings in flash memory."""
        return change(body_id, lambda axis: setattr(axis.flash, "damaged", memory.damaged))


def _add_power(app: FastAPI, line: Rc400Line, port: Touchable) -> None:
    @app.put("/bodies/{body_id}/power")
    async def switch_body(body_id: BodyId, power: Power) -> BodyState:
        """Cut or restore the power of a controller."""
        axis = _axis(line, body_id)
        port.touch(lambda now: line.switch_body(axis.body, power.on, now))
        return port.touch(lambda now: _state(axis, now))

    @app.post("/bodies/{body_id}/brown-outs")
    async def brown_out(body_id: BodyId, loss: BrownOut) -> BodyState:
        """Cut the power of a controller for a while."""
        axis = _axis(line, body_id)
        port.touch(lambda now: line.brown_out(axis.body, loss.for_s, now))
        return port.touch(lambda now: _state(axis, now))

    @app.patch("/bodies/{body_id}/settings")
    async def set_body(body_id: BodyId, change: BodyChange) -> BodyState:
        """Change what the manual leaves open about a controller."""
        axis = _axis(line, body_id)
        for switch, on in change.model_dump(exclude_none=True).items():
            setattr(axis, switch, on)
        return port.touch(lambda now: _state(axis, now))


def _add_link(app: FastAPI, line: Rc400Line, port: Touchable) -> None:
    @app.get("/link")
    async def get_link() -> LinkState:
        """Tell the state of the link master."""
        return _link_state(line)

    @app.put("/link/power")
    async def switch_link(power: Power) -> LinkState:
        """Cut or restore the power of the link master; the controllers keep theirs."""
        port.touch(line.power_on if power.on else line.power_off)
        return _link_state(line)

    @app.patch("/link/settings")
    async def set_link(change: LinkChange) -> LinkState:
        """Change what the manual leaves open about the link master."""
        line.settings = replace(line.settings, **change.model_dump(exclude_none=True))
        return _link_state(line)


def _axis(line: Rc400Line, body_id: str) -> Rc420:
    axis = line.axes.get(int(body_id, 16))
    if axis is None:
        known = ", ".join(f"{body:02X}" for body in line.axes)
        raise HTTPException(404, f"This line has no body {body_id.upper()}; it has {known}.")
    return axis


def _change(line: Rc400Line, port: Touchable, body_id: str, deed: Callable[[Rc420], None]) -> BodyState:
    """Do something to a controller, and let it and the line notice."""
    axis = _axis(line, body_id)

    def act(now: float) -> BodyState:
        axis.advance(now)
        deed(axis)
        axis.sense(now)
        line.look_after(axis.body)
        return _state(axis, now)

    return port.touch(act)


def _hold(axis: Rc420, sensor: int, on: bool | None) -> None:
    if on is None:
        axis.world.forced.pop(sensor, None)
    else:
        axis.world.forced[sensor] = on


def _set_input(axis: Rc420, number: int, on: bool) -> None:
    axis.world.inputs = axis.world.inputs & ~(1 << number) | on << number


def _mount(axis: Rc420, mechanics: Mechanics) -> None:
    world = axis.world
    if mechanics.origin is not None:
        world.origin = Span(mechanics.origin.first, mechanics.origin.last)
    if mechanics.cw_limit is not None:
        world.cw_limit = Span(mechanics.cw_limit.first, mechanics.cw_limit.last)
    if mechanics.ccw_limit is not None:
        world.ccw_limit = Span(mechanics.ccw_limit.first, mechanics.ccw_limit.last)
    if mechanics.slits is not None:
        world.slits = Slits(mechanics.slits.phase, mechanics.slits.period)
    if mechanics.encoder is not None:
        world.encoder = mechanics.encoder
    if mechanics.slipped is not None:
        world.slipped = mechanics.slipped


def _state(axis: Rc420, now: float) -> BodyState:
    world, sensors = axis.world, axis.io.sensors()
    return BodyState(
        body=f"{axis.body:02X}",
        powered=axis.powered,
        moving=axis.motor.moving,
        position=axis.position(now),
        pulses=axis.motor.pulses(now),
        status=axis.status_now(),
        end_cause=axis.end_cause,
        sensors={name: bool(sensors >> bit & 1) for name, bit in SENSOR_BITS.items()},
        inputs=axis.io.inputs(),
        outputs=axis.io.outputs.bits(),
        mechanics=Mechanics(
            origin=Stretch(**world.origin._asdict()),
            cw_limit=Stretch(**world.cw_limit._asdict()),
            ccw_limit=Stretch(**world.ccw_limit._asdict()),
            slits=Disc(**world.slits._asdict()),
            encoder=world.encoder,
            slipped=world.slipped,
        ),
    )


def _link_state(line: Rc400Line) -> LinkState:
    settings = {field.name: getattr(line.settings, field.name) for field in fields(LinkSettings)}
    return LinkState(powered=line.powered, requests=line.requests, settings=settings)
