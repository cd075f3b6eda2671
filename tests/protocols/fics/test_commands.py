import contextlib
import importlib
import json
import pkgutil
import re
from collections.abc import Iterator
from types import UnionType
from typing import Annotated, Any, Literal, Union, get_args, get_origin

import pytest
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

import protocols.fics
import protocols.rorze
from protocols.fics.commands import BY_NAME, COMMANDS, ROWS, Row, read
from protocols.fics.link import FicsRequest, FicsRequestReader, encode
from protocols.fics.macros import RESERVED, RunMacro
from protocols.fics.row import BLOCK_ERRORS, Block, WhenAnswered
from protocols.table import Ack, Retry, SyntaxFault, WireFault
from tests.protocols.fics.examples import check_examples, exchanges

every_row = pytest.mark.parametrize("row", ROWS, ids=lambda row: row.__name__)

# C-HOST manual 1-7: name, answer in Ver.2 (- none, ? without arguments only, ! always), what blocks it.
STANDARD = """
    MOD ? c      UNT ? abd    JOG - abc    JTE - abc    ORG - abc    LMI - abc    LMA - abc    AES - b
    ASS - b      DRT -        VAO ? abc    POM - abc    POF - abc    POS - abc    PCL - abc    IOT -
    SCV ? abc    HMT ? abc    HMO ? abc    HMV ? abc    HMB ? abc    VSB ? abc    VSO ? abc    VST ? abc
    VSS ? abc    SLP ? abc    SLM ? abc    VAR ? a      VER !
    APS !        ACD !        ASD !        ERR !        ERD !        POR ! abc    IDI !        IDO !
"""
# C-HOST manual 4-1.
MOTOR_AXES = """
    MMI - abc    MMA - abc    MPS !        MAO ? abc    MSO ? abc    MST ? abc    MSS ? abc    MSP ? abc
    MSM ? abc
"""
CELL = re.compile(r"([A-Z]{3}) ([-?!]) ?([a-d]*)")


def table(text: str) -> dict[str, tuple[str, str]]:
    return {name: (answer, blocks) for name, answer, blocks in CELL.findall(text)}


def test_the_table_has_every_command_of_the_manual_and_no_other() -> None:
    standard, motor_axes = table(STANDARD), table(MOTOR_AXES)
    assert (len(standard), len(motor_axes)) == (37, 9)
    assert set(COMMANDS) == {*standard, *motor_axes}
    assert {row for row in ROWS if not row.code} == {RunMacro}
    assert sum(map(len, COMMANDS.values())) + 1 == len(ROWS)


def test_no_macro_can_have_the_name_of_a_command() -> None:
    assert {*COMMANDS, "POE"} == RESERVED


@pytest.mark.parametrize(("name", "cell"), table(STANDARD + MOTOR_AXES).items())
def test_a_name_is_answered_and_blocked_as_the_manuals_table_says(name: str, cell: tuple[str, str]) -> None:
    answer, letters = cell
    rows = COMMANDS[name]
    queries = [row for row in rows if row.is_query()]
    assert len(queries) == {"-": 0, "?": 1, "!": 1}[answer]
    assert (len(queries) < len(rows)) is (answer != "!")
    for row in rows:
        # A JOG is stopped while it runs, so its stop cannot be blocked by it.
        expected = "ab" if row.__name__ == "StopJog" else letters
        assert row.blocked == frozenset(map(Block, expected))


def test_a_macro_is_blocked_as_motion_is() -> None:
    assert RunMacro.blocked == {Block.TERMINAL_RUNS, Block.TERMINAL_EDITS, Block.MOTION}
    assert RunMacro.starts_motion


def test_what_blocks_is_reported_as_the_manual_says() -> None:
    assert {block.value: BLOCK_ERRORS[block] for block in Block} == {
        "a": "E01",
        "b": "E03",
        "c": "E01",
        "d": "E01",
    }


def test_an_upload_of_positions_lets_only_positions_errors_and_its_end_through() -> None:
    assert {row.__name__ for row in ROWS if row.during_upload} == {
        "UploadPosition",
        "TakeCurrentError",
        "EndPositionUpload",
    }


def test_the_motion_commands_are_those_of_the_manual() -> None:
    moving = {row.code for row in ROWS if row.starts_motion}
    assert moving == {"JOG", "JTE", "ORG", "LMI", "LMA", "POM", "MMI", "MMA", ""}


def test_only_jog_is_answered_before_it_is_over() -> None:
    assert {row.code for row in ROWS if row.answered is WhenAnswered.AT_ONCE} == {"JOG"}


@every_row
def test_what_is_always_answered_has_data_and_the_rest_is_only_acknowledged(row: Row) -> None:
    assert row.is_query() is (row.reply_type() is not Ack)


def test_every_row_can_be_found_by_its_name() -> None:
    assert len(BY_NAME) == len(ROWS)
    for row in ROWS:
        assert BY_NAME[row.name()] is row
        assert re.fullmatch("[a-z]+(-[a-z0-9]+)*", row.name())


def models(family: Any) -> Iterator[str]:
    """The names of a family's models: OpenAPI knows a model by its name alone."""
    for module in pkgutil.iter_modules(family.__path__, family.__name__ + "."):
        for name, item in vars(importlib.import_module(module.name)).items():
            is_model = isinstance(item, type) and issubclass(item, BaseModel)
            if is_model and item.__module__ == module.name and name.isidentifier():  # no generic's remains
                yield name


def test_no_model_is_named_as_one_of_the_other_family() -> None:
    ours = set(models(protocols.fics))
    assert {row.__name__ for row in ROWS} <= ours
    assert not ours & set(models(protocols.rorze))


@every_row
def test_a_row_has_a_title_in_both_languages(row: Row) -> None:
    japanese, english = row.titles()
    assert re.search("[\u3040-\u30ff\u4e00-\u9fff]", japanese)
    assert english.isascii()
    assert english
    assert english == english.strip(" .")
    assert "emergency stop" not in english


@every_row
def test_a_rows_examples_read_and_write_the_same_bytes(row: Row) -> None:
    check_examples(row)


@pytest.mark.parametrize(
    ("retry", "names"),
    [
        (Retry.STOP, "stop-all-immediately stop-all-decelerating stop-jog"),
        (
            Retry.NEVER,
            "start-jog step-axis move-relative move-motors-relative move-to-position run-macro "
            "upload-position take-current-error",
        ),
        (
            Retry.CONDITIONAL,
            "home-robot move-absolute move-motors-absolute reset-errors set-communication-mode select-unit "
            "begin-position-upload end-position-upload clear-positions switch-output",
        ),
    ],
)
def test_commands_are_in_the_retry_class_of_what_repeating_would_do(retry: Retry, names: str) -> None:
    assert {name for name, row in BY_NAME.items() if row.retry is retry} == set(names.split())


@every_row
def test_other_queries_are_repeated_and_settings_are_read_back(row: Row) -> None:
    if row.retry is Retry.READ:
        assert row.is_query()
    if row.retry is Retry.SETTING:
        assert not row.is_query()
        assert any(other.is_query() for other in COMMANDS[row.code])


@every_row
def test_a_row_and_its_reply_have_a_json_schema_that_forbids_surprises(row: Row) -> None:
    for model in (row, row.reply_type()):
        schema = json.loads(json.dumps(model.model_json_schema()))
        assert schema["additionalProperties"] is False


def wrong_for(value: object) -> list[object]:
    """Values that look like the value and are not valid."""
    wrong: list[object] = [float("nan"), float("inf"), b"5", {"surprise": 1}, 10**400]
    if isinstance(value, bool):
        return [*wrong, "true", 1, 0]
    if isinstance(value, int):
        wrong = [*wrong, float(value)]
    if isinstance(value, int | float):
        return [*wrong, True, str(value), f" {value}", [value]]
    if isinstance(value, list):
        inner = [[bad] for good in value if good is not None for bad in wrong_for(good)]
        return [*wrong, *inner, [], [None], "1,2", value * 9]
    return [*wrong, True, False, None] if value != "-" else wrong


@every_row
def test_fields_take_no_value_of_another_type(row: Row) -> None:
    for sent, _ in exchanges(row):
        good = read(sent[:3], sent[4:]).model_dump(exclude_none=True)
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
        longest = min(item.max_length for item in metadata if hasattr(item, "max_length"))
        return st.lists(values(get_args(annotation)[0], []), min_size=1, max_size=longest)
    if annotation is float:
        lowest, highest = limits(metadata)
        return st.integers(max(lowest, -(10**6)) * 10 + 1, highest * 10).map(lambda tenths: tenths / 10)
    if annotation is int:
        return st.integers(*limits(metadata)) | st.sampled_from(limits(metadata))
    if annotation is str:
        pattern = next(
            item.pattern
            for item in metadata
            if getattr(item, "pattern", None) and not hasattr(item, "encode")
        )
        return st.from_regex(pattern, fullmatch=True, alphabet=st.characters(codec="ascii"))
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return instances(annotation)
    return st.booleans() if annotation is bool else st.none()


def limits(metadata: list[Any]) -> tuple[int, int]:
    lowest = max((getattr(item, "ge", getattr(item, "gt", -(10**9))) for item in metadata), default=-(10**9))
    return int(lowest), int(min((getattr(item, "le", 10**9) for item in metadata), default=10**9))


@st.composite
def instances(draw: st.DrawFn, model: type[BaseModel]) -> Any:
    fields = {name: values(field.annotation, field.metadata) for name, field in model.model_fields.items()}
    variants = [
        variant for form in getattr(model, "forms", ()) for variant in sorted(map(sorted, form.variants()))
    ]
    names = draw(st.sampled_from(variants)) if variants else list(fields)
    try:
        return model.model_validate({name: draw(fields[name]) for name in names})
    except ValidationError:
        assume(False)


@every_row
@settings(max_examples=10, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_whatever_a_row_can_hold_reaches_the_robot_as_it_is(row: Row, data: st.DataObject) -> None:
    command = data.draw(instances(row))
    (request,) = FicsRequestReader().feed(encode(command))
    assert isinstance(request, FicsRequest)
    assert read(request.name, request.arguments) == command
    assert row.model_validate_json(command.model_dump_json()) == command


@pytest.mark.parametrize(
    "row", [row for row in ROWS if row.is_query() and not row.echo], ids=lambda row: row.__name__
)
@settings(max_examples=10, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_whatever_a_robot_can_answer_is_read_as_it_is(row: Row, data: st.DataObject) -> None:
    reply = data.draw(instances(row.reply_type()))
    again = row.reply_type().read(reply.written())
    # Text of no known layout may still happen to be in one.
    assert again.written() == reply.written()
    assert again == reply or getattr(reply, "text", None) is not None


@settings(max_examples=400, deadline=None)
@given(row=st.sampled_from(ROWS), text=st.text(st.characters(max_codepoint=0x17F), max_size=30))
def test_hostile_text_is_a_wire_fault_or_a_command_and_nothing_else(row: Row, text: str) -> None:
    for model in (row, row.reply_type()):
        with contextlib.suppress(WireFault):
            assert isinstance(model.read(text), model)


@settings(max_examples=200, deadline=None)
@given(
    name=st.sampled_from(sorted(COMMANDS)) | st.text("ABX012", min_size=3, max_size=3),
    arguments=st.text("0123456789.,+-V=:X@#E ", max_size=20),
)
def test_any_request_is_a_command_or_a_wire_fault(name: str, arguments: str) -> None:
    with contextlib.suppress(WireFault):
        assert read(name, arguments).wire_name() == name


@pytest.mark.parametrize("name", ["aps", "A B", "", "AB", "ÄPS"])
def test_what_does_not_look_like_a_name_is_badly_written(name: str) -> None:
    with pytest.raises(SyntaxFault):
        read(name, "1")
