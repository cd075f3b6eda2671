import contextlib
import json
import re
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from protocols.rorze.commands import BY_NAME, COMMANDS, Row
from protocols.rorze.errors import ERRORS
from protocols.rorze.link import Request, RequestReader, encode
from protocols.rorze.moves import MoveClockwise, MoveTo
from protocols.rorze.notation import PositionReference
from protocols.rorze.position_table import GetNumberedPositionEntry, GetPositionEntry
from protocols.rorze.row import LINK_MASTER, LinkMasterCommand
from protocols.table import Retry, SyntaxFault, WireFault
from tests.protocols.rorze.examples import check_examples, exchanges

ROWS = list(COMMANDS.values())
every_row = pytest.mark.parametrize("row", ROWS, ids=list(COMMANDS))

# RC-420 manual 19.1: 76 rows. Origin search has a zero in front, speeds the letter O.
BASIC = """
    00M 01M 0QM 1+M 1-M 1AM 2+M 2-M 2AM 5IS 5SS 6PD 6PS 9CD 9CS 9MD
    CBS CID CLD CLS COD COS CRD CRS FES FIS FPD FPS FUD FUS
    0BD 0BS 0SD 0SS 3+S 3-S 3*S 3/S 3CS 3ID 3IS 3ND 3PD 3PS CCD CCS DID DIS DLD DLS EAD EAS EDD EDS
    OAD OAS OBD OBS OHD OHS OLD OLS OSD OSS QID QIS QRD QRS QSD QSS SED SES SHD SPD SPS SSD
"""
# RC-420 manual 19.2: 89 rows.
EXTENDED = """
    02M 03M 04M 5AS 5CS 5DS 6ED 6ES 6MD H+S H-S HAD HAS HCD HCS HDD HDS HFD HFS HPD HPS HTD HTS HZD HZS
    HFM HLD HLS HMM HMS HNM HRS HXS HYS UBD UCS UDD UDS UED UES UND UPD URD URG USG UWD UWS
    0PD 0RD 0RS 5MD 5MS 9VD 9VS CED CES CFD CFS CPD CPS CSD CSS DCD DCS EMD EMS ERD ESD ESS
    PAD PAS PBD PBS PED PES PJD PJS PKD PKS PLD PLS PRD PRS PSD PSS PTD PTS UAD UAS
"""
# These two have pages in chapter 14 and no row in chapter 19.
ONLY_PAGES = "EPD EPS"
LINK = "XID XRS XVS"


def test_the_table_has_every_command_of_the_manual_and_no_other() -> None:
    basic, extended, only_pages, link = (text.split() for text in (BASIC, EXTENDED, ONLY_PAGES, LINK))
    assert (len(basic), len(extended)) == (76, 89)
    assert len({*basic, *extended, *only_pages}) == 167
    assert set(COMMANDS) == {*basic, *extended, *only_pages, *link}


def test_link_master_commands_are_the_x_commands() -> None:
    assert {row.code for row in ROWS if issubclass(row, LinkMasterCommand)} == set(LINK.split())


def test_every_row_can_be_found_by_its_code_and_by_its_name() -> None:
    assert len(BY_NAME) == len(COMMANDS)
    for code, row in COMMANDS.items():
        assert row.code == code
        assert BY_NAME[row.name()] is row
        assert re.fullmatch("[a-z]+(-[a-z0-9]+)*", row.name())


@every_row
def test_a_row_has_a_title_in_both_languages(row: Row) -> None:
    japanese, english = row.titles()
    assert re.search("[\u3040-\u30ff\u4e00-\u9fff]", japanese)
    assert english
    assert english.isascii()
    assert english == english.strip(" .")


@every_row
def test_a_rows_examples_read_and_write_the_same_bytes(row: Row) -> None:
    check_examples(row)


@every_row
def test_a_rows_examples_are_whole_frames(row: Row) -> None:
    for (parameters, _), printed in zip(exchanges(row), row.example[::2], strict=True):
        body = int(printed[1:3], 16)
        assert (body == LINK_MASTER) is issubclass(row, LinkMasterCommand)
        assert encode(body, row.read(parameters)) == printed.encode() + b"\r"


@every_row
def test_a_rows_errors_stand_in_the_error_table(row: Row) -> None:
    assert row.errors <= set(ERRORS)


@every_row
def test_what_a_moving_motor_forbids_is_refused_with_50(row: Row) -> None:
    """Chapter 21, whether the page lists it or not."""
    assert row.moving or 0x50 in row.errors


@every_row
def test_a_rows_columns_have_sensible_values(row: Row) -> None:
    assert set(row.modes) <= set("012")
    assert row.modes
    assert row.starts_motion is row.code.endswith("M")
    if row.starts_motion:
        assert row.retry in (Retry.NEVER, Retry.CONDITIONAL)
    if row.retry is Retry.SETTING:
        assert row.code.endswith("S") or row.code in LINK


@every_row
def test_a_row_and_its_reply_have_a_json_schema_that_forbids_surprises(row: Row) -> None:
    for model in (row, row.reply_type()):
        schema = json.loads(json.dumps(model.model_json_schema()))
        assert schema["additionalProperties"] is False


# Names that generated clients, FastAPI or pydantic would stumble over.
TRAPS = {"body", "body_id", "line_id", "group_id", "wait", "json", "copy", "dict", "schema", "self", "type_"}


@every_row
def test_no_field_has_a_name_that_is_a_trap(row: Row) -> None:
    for model in (row, row.reply_type()):
        for name in model.model_fields:
            assert name not in TRAPS
            assert not name.startswith("model_")
            assert re.fullmatch("[a-z][a-z0-9_]*", name)


def wrong_for(value: object) -> list[object]:
    """Values that look like the value and are not valid."""
    wrong: list[object] = [float("nan"), float("inf"), b"5", [None], {"surprise": 1}]
    if isinstance(value, bool):
        return [*wrong, "true", 1, 0]
    if isinstance(value, int):
        return [*wrong, True, str(value), float(value), f" {value}", 10**400]
    return [*wrong, True, False]


@every_row
def test_fields_take_no_value_of_another_type(row: Row) -> None:
    for parameters, _ in exchanges(row):
        good = row.read(parameters).model_dump(exclude_none=True)
        for name, value in good.items():
            for bad in wrong_for(value):
                with pytest.raises(ValidationError):
                    row.model_validate({**good, name: bad})
        with pytest.raises(ValidationError):
            row.model_validate({**good, "surprise": 1})


def values(annotation: object, metadata: list[Any]) -> st.SearchStrategy[Any]:
    """All values that a field may hold, from its type and constraints."""
    if get_origin(annotation) is Annotated:
        inner, *extras = get_args(annotation)
        flat = [
            item for extra in extras for item in (extra.metadata if isinstance(extra, FieldInfo) else [extra])
        ]
        return values(inner, [*flat, *metadata])
    if get_origin(annotation) in (Union, UnionType):
        return st.one_of(*(values(member, metadata) for member in get_args(annotation)))
    if get_origin(annotation) is Literal:
        return st.sampled_from(get_args(annotation))
    if get_origin(annotation) is list:
        return st.lists(values(get_args(annotation)[0], []), min_size=1, max_size=17, unique=True)
    if annotation is float:
        return st.integers(0, 10**9).map(lambda hundredths: hundredths / 100)
    if annotation is int:
        return integers(metadata)
    if annotation is str:
        pattern = next(
            item.pattern
            for item in metadata
            if getattr(item, "pattern", None) and not hasattr(item, "encode")
        )
        return st.from_regex(pattern, fullmatch=True, alphabet=st.characters(codec="ascii"))
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return instances(annotation)
    return st.sampled_from([True, False]) if annotation is bool else st.none()


def integers(metadata: list[Any]) -> st.SearchStrategy[int]:
    lowest, highest = -(10**9), 10**9
    for item in metadata:
        lowest = max(lowest, getattr(item, "ge", lowest), getattr(item, "gt", lowest - 1) + 1)
        highest = min(highest, getattr(item, "le", highest), getattr(item, "lt", highest + 1) - 1)
    return st.integers(lowest, highest) | st.sampled_from([lowest, highest])


@st.composite
def instances(draw: st.DrawFn, model: type[BaseModel]) -> Any:
    fields = {name: values(field.annotation, field.metadata) for name, field in model.model_fields.items()}
    forms = getattr(model, "forms", ())
    chosen = sorted(draw(st.sampled_from(sorted(map(sorted, form.variants())))) for form in forms)
    names = draw(st.sampled_from(chosen)) if chosen and any(chosen) else list(fields)
    try:
        return model.model_validate({name: draw(fields[name]) for name in names})
    except ValidationError:
        assume(False)


@every_row
@settings(max_examples=6, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_whatever_a_row_can_hold_reaches_the_controller_as_it_is(row: Row, data: st.DataObject) -> None:
    command = data.draw(instances(row))
    frame = encode(LINK_MASTER if issubclass(row, LinkMasterCommand) else 0x3F, command)
    (request,) = RequestReader().feed(frame)
    assert isinstance(request, Request)
    assert not request.too_long()
    assert row.read(request.text.removeprefix(row.code)) == command
    assert row.model_validate_json(command.model_dump_json()) == command


@settings(max_examples=400, deadline=None)
@given(row=st.sampled_from(ROWS), text=st.text(st.characters(max_codepoint=0x17F), max_size=30))
def test_hostile_text_is_a_wire_fault_or_a_command_and_nothing_else(row: Row, text: str) -> None:
    for model in (row, row.reply_type()):
        with contextlib.suppress(WireFault):
            assert isinstance(model.read(text), model)


# Repeating


@pytest.mark.parametrize("step", ["next", "previous"])
def test_what_steps_the_position_index_is_never_repeated(step: Literal["next", "previous"]) -> None:
    by_index = PositionReference(position=step)
    for command in (
        GetPositionEntry(entry=by_index),
        GetNumberedPositionEntry(entry=by_index),
        MoveClockwise(distance=by_index),
        MoveTo(position=by_index),
    ):
        assert not command.may_repeat
    assert GetPositionEntry(entry=PositionReference(position=0)).may_repeat


@every_row
def test_only_reads_are_repeated_unasked(row: Row) -> None:
    for parameters, _ in exchanges(row):
        steps_index = "P[+]" in parameters or "P[-]" in parameters
        steps_cursor = row.code in ("UPD", "UWD") and not parameters
        assert row.read(parameters).may_repeat is (
            row.retry is Retry.READ and not (steps_index or steps_cursor)
        )


@pytest.mark.parametrize(
    ("retry", "codes"),
    [
        (Retry.STOP, "5IS 5SS UES"),
        (Retry.NEVER, "1+M 1-M 2+M 2-M 3+S 3-S 3*S 3/S CBS CPS USG UWS HMM HFM HNM 5AS 5CS 5DS"),
        (
            Retry.CONDITIONAL,
            "1AM 2AM 00M 01M 02M 03M 04M 0QM 6PS 6ES URG 9CS QRS PRS CRS FIS FPS FUS FES UCS",
        ),
        (Retry.READ, "6PD 6ED 6MD 9CD 9MD 9VD CID CLD COD CRD 3ND 3PD URD UND UED UBD UAD HLS HLD"),
        (Retry.SETTING, "OHS SPS SES QIS QSS PBS DIS EDS EPS ESS EMS HAS HDS 3PS 3IS COS UDS XID XRS XVS"),
    ],
)
def test_commands_are_in_the_retry_class_of_what_repeating_would_do(retry: Retry, codes: str) -> None:
    assert {code: COMMANDS[code].retry for code in codes.split()} == dict.fromkeys(codes.split(), retry)


def test_a_nonce_that_comes_back_differently_is_not_the_reply() -> None:
    asked = GetNumberedPositionEntry(entry=PositionReference(position=25))
    assert asked.read_reply("P[0025],-000000001").pulses == -1
    with pytest.raises(SyntaxFault):
        asked.read_reply("P[0026],-000000001")


@every_row
def test_what_the_reply_repeats_is_checked(row: Row) -> None:
    repeated = row.model_fields.keys() & row.reply_type().model_fields.keys()
    assert repeated <= set(row.echo)


def test_these_rows_have_a_reply_that_repeats_what_was_asked_for() -> None:
    repeating = {code: row.echo for code, row in COMMANDS.items() if row.echo}
    assert repeating == {"3ND": ("position",), "UPD": ("address", "instruction"), "UWD": ("instruction",)}
