"""A document can be sent back as GET gives it: unchanged it changes nothing; a changed fact is refused."""

import asyncio
import re
from collections.abc import Callable, Iterator, Mapping
from typing import Any, Final, NamedTuple

import pytest

from gateway.core.errors import InvalidRequest
from gateway.core.operation import Operation
from gateway.core.records import SentBack
from gateway.door import Door, operations
from simulator.demo import GEOMETRY, SPEEDS
from tests.fics_plants import FicsRig, fics_rig
from tests.gateway.rorze_scara.cell import SCARA
from tests.plants import Rig, in_virtual_time, rig

ROWS: Final = {row.name: row for row in operations()}
READS: Final = {row.path: row for row in ROWS.values() if row.verb == "GET"}
WRITES: Final = [
    row
    for row in ROWS.values()
    if row.verb in ("PUT", "PATCH") and row.path in READS and row.http_only is None and row.media is None
]
"""Every document: what GET gives at a path, PUT or PATCH takes there. Tables as text are tested apart."""
OPTIONS: Final = (
    'units = { unit = "mm", pulses_per_unit = 100.0 }, inputs = { 8 = "index" }, outputs = { 3 = "brake" }'
)
PAIR: Final = {"80": ("02", "3F")}
BODY: Final = {"body_id": "3F"}
ROBOT: Final = {"robot_id": "r1"}
NAMED: Final[Mapping[str, Mapping[str, Any]]] = {
    "body_id": BODY,
    "group_id": {"group_id": "80"},
    "scara_id": {"scara_id": "wafer", "path": 3},
    "robot_id": {**ROBOT, "unit": 1},
}
"""Names in paths by the first of them; the tables below have the rest."""
SETS: Final = ({"n": 12}, {"n": 20}, {"n": 30})
"""One that is set, one that never was, and the standard one."""
VARIANTS: Final[Mapping[str, tuple[Mapping[str, Any], ...]]] = {
    **dict.fromkeys(("setSpeedSet", "changeSpeedSet", "setPattern", "changePattern"), SETS),
    "setPosition": ({}, {"body_id": "02"}),
    "defineGroup": ({}, {"group_id": "8A"}),
    "writeScaraPath": ({}, {"path": 9}),
    "storeBodyPositions": ({"first": 5, "last": 9},),
    "storePositions": ({}, {"unit": 2, "first": 1, "last": 2}, {"first": 900}),
    "setMemories": ({"first": "D0", "count": 3}, {"first": "T0"}),
    "uploadProgram": ({}, {"body_id": "02"}),
    "armCapture": ({"port": 8}, {"port": 9}),
    "changeSettings": ({}, {"unit": 2}),
}
STORED_ANEW: Final = {
    "setPosition": "6PS",
    "storeBodyPositions": "3PS",
    "setMemories": "UDS",
    "setMemory": "UDS",
    "uploadProgram": "UCS UWS",
    "writeScaraPath": "HDS",
    "switchBodyOutput": "COS",
    "storePositions": "POF POS END",
    "setVariable": "V",
    "setErrorOutput": "CES",
    "changeSettings": "V H S M",
}
"""Commands that store once more what is there."""


class Document(NamedTuple):
    """A document, and the operation that it is sent back to."""

    write: Operation
    arguments: Mapping[str, Any]
    read: Operation
    asked: Mapping[str, Any]
    part: Callable[[Any], Any] = lambda whole: whole
    """The part that has a place of its own."""

    @property
    def facts(self) -> frozenset[str]:
        request: type[SentBack] = self.write.request
        return request.read_only

    async def told(self, door: Door) -> Any:
        return self.part(await door.call(self.read.name, self.asked))

    async def send(self, door: Door, document: Any) -> Any:
        slow = {"wait": 60} if "wait" in self.write.parameters else {}
        return await door.call(self.write.name, {**self.arguments, **slow}, document)


def documents() -> Iterator[Document]:
    for write in WRITES:
        read = READS[write.path]
        for variant in VARIANTS.get(write.name, ({},)):
            values = {**NAMED[write.named[0]], **variant}
            yield Document(write, taken(write, values), read, taken(read, values))
    parts: tuple[tuple[str, Mapping[str, Any], str, Mapping[str, Any], Callable[[Any], Any]], ...] = (
        ("switchBodyOutput", {**BODY, "output": 3}, "getBodyOutputs", BODY, lambda it: it["outputs"][3]),
        *(
            ("setErrorOutput", {**BODY, "cause": cause}, "getErrorOutputs", BODY, of_cause(cause))
            for cause in ("limit", "stall")
        ),
        ("setMemory", {**BODY, "name": "D1"}, "getMemories", {**BODY, "first": "D1"}, first_of("memories")),
        ("setVariable", {**ROBOT, "number": 7}, "getVariables", {**ROBOT, "first": 7}, first_of("variables")),
    )
    for write_name, arguments, read_name, asked, part in parts:
        yield Document(ROWS[write_name], arguments, ROWS[read_name], asked, part)


def taken(row: Operation, values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: it for name, it in values.items() if name in {*row.named, *row.parameters}}


def of_cause(cause: str) -> Callable[[Any], Any]:
    return lambda it: next(one for one in it["error_outputs"] if one["cause"] == cause)


def first_of(name: str) -> Callable[[Any], Any]:
    return lambda it: it[name][0]


def label(document: Document) -> str:
    return f"{document.write.name} {' '.join(map(str, document.arguments.values()))}"


OF_BODIES: Final = [it for it in documents() if "robot_id" not in it.arguments]
OF_ROBOTS: Final = [it for it in documents() if "robot_id" in it.arguments]
of_bodies = pytest.mark.parametrize("document", OF_BODIES, ids=label)
modes = pytest.mark.parametrize("mode", [3, 2])
of_robots = pytest.mark.parametrize("document", OF_ROBOTS, ids=label)


async def teach(it: Rig) -> Door:
    """Let the bodies hold something of each kind."""
    now = asyncio.get_running_loop().time()
    for number in (0x02, 0x03, 0x04, 0x3F):
        own = ("UCS", "UWS*UP", "UWS1AM500", "UWSEND", "UDSD1,H40000000", "CES L,7,1", "EPS-500,90000")
        for text in (*SPEEDS, *GEOMETRY, f"HCS{number % 3}", *(own if number == 0x3F else ())):
            reply = it.axis(number).execute(text.replace(" ", ""), now).payload
            assert not reply.startswith("@"), (text, reply)
    door = Door(it.plant)
    named = {"number": 7, "position": {"value": 12, "unit": "mm"}, "name": "load"}
    await door.call("storeBodyPositions", BODY, {"positions": [named], "flash": True})
    armed = {"edge": "rising", "position": 25, "between": {"lower": 0, "upper": 500}}
    await door.call("armCapture", {**BODY, "port": 8}, armed)
    change = {"point": 2, "begin": 30_000, "speed_pps": 20_000}
    sets = {"acceleration_set": 12, "deceleration_set": 12}
    await door.call("setPattern", {**BODY, "n": 12}, {**sets, "changes": [change]})
    return door


async def learn(it: FicsRig) -> Door:
    """Let the robot hold positions and a variable."""
    door = Door(it.plant)
    positions = [{"number": n, "axes": {"X": {"value": 10.5 * n, "unit": "mm"}}} for n in (1, 2, 3)]
    for unit in (1, 2):
        await door.call("storePositions", {**ROBOT, "unit": unit}, {"positions": positions})
    await door.call("setVariable", {**ROBOT, "number": 7}, {"value": 12.5})
    return door


def without_time(told: Any) -> Any:
    """A document without what each reading tells anew."""
    return {name: it for name, it in told.items() if name not in ("read_at", "age_ms", "flash")}


def otherwise(value: object) -> object:
    """Another value of the same kind."""
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float):
        return value + 1
    return f"{value}x" if isinstance(value, str) else {"other": "1"} if isinstance(value, dict) else ["other"]


async def goes_back_unchanged(door: Door, document: Document, sent: Callable[[], list[str]]) -> None:
    before, told = len(sent()), await document.told(door)
    await document.send(door, told)
    assert without_time(await document.told(door)) == without_time(told)
    stored = STORED_ANEW.get(document.write.name, "none").split()
    assert [it for it in sent()[before:] if not any(it.startswith(code) for code in stored)] == []


async def is_refused_by_each_fact(door: Door, document: Document, sent: Callable[[], list[str]]) -> None:
    told = await document.told(door)
    for fact in document.facts & told.keys():
        before = sent()
        with pytest.raises(InvalidRequest, match=f"{fact}: it cannot be set, and is otherwise now; nothing"):
            await document.send(door, {**told, fact: otherwise(told[fact])})
        assert sent() == before
    with pytest.raises(InvalidRequest, match="colour"):
        await document.send(door, {**told, "colour": "red"})


def set_by_bodies(it: Rig) -> list[str]:
    """The settings that bodies have taken, without fences and marks."""
    taken_by = (str(fact.facts["text"]) for fact in it.truth.of("command"))
    return [text for text in taken_by if text[2:3] == "S" and not text.startswith(("9VS", "9CS"))]


def set_by_robots(it: FicsRig) -> list[str]:
    """Commands to the robot, without questions."""
    questions = re.compile(r"[A-Z]{3}|VAR V\d\d|(ID[IO]|POR|UNT|ACD|APS|MPS|ASD) .*")
    return [text for text in it.heard("") if not questions.fullmatch(text)]


def test_every_document_is_one_that_can_be_sent_back() -> None:
    assert [row.name for row in WRITES if not issubclass(row.request, SentBack)] == []


@of_bodies
def test_a_document_of_bodies_as_it_was_read_changes_nothing(document: Document) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig(bodies=(2, 3, 4, 0x3F), groups=PAIR, body_options=OPTIONS, more=SCARA) as it:
            await goes_back_unchanged(await teach(it), document, lambda: set_by_bodies(it))

    story()


@of_bodies
def test_a_fact_of_bodies_that_was_changed_is_refused(document: Document) -> None:
    @in_virtual_time
    async def story() -> None:
        async with rig(bodies=(2, 3, 4, 0x3F), groups=PAIR, body_options=OPTIONS, more=SCARA) as it:
            await is_refused_by_each_fact(await teach(it), document, lambda: set_by_bodies(it))

    story()


@modes
@of_robots
def test_a_document_of_robots_as_it_was_read_changes_nothing(document: Document, mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(units=2, mode=mode) as it:
            await goes_back_unchanged(await learn(it), document, lambda: set_by_robots(it))

    story()


@modes
@of_robots
def test_a_fact_of_robots_that_was_changed_is_refused(document: Document, mode: int) -> None:
    @in_virtual_time
    async def story() -> None:
        async with fics_rig(units=2, mode=mode) as it:
            await is_refused_by_each_fact(await learn(it), document, lambda: set_by_robots(it))

    story()


@in_virtual_time
async def test_a_part_of_a_table_that_is_sent_back_has_no_more_of_it_read() -> None:
    async with rig(bodies=(0x3F,), groups={}) as it:
        door = Door(it.plant)
        told = await door.call("listBodyPositions", {**BODY, "first": 5, "last": 9})
        before = len(it.wire.sent)
        await door.call("storeBodyPositions", BODY, told)
        assert len([frame for frame in it.wire.frames(before) if "3ND" in frame]) < 20
