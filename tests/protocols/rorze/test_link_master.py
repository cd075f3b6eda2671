import pytest
from hypothesis import given
from hypothesis import strategies as st
from pydantic import ValidationError

from protocols.rorze import link_master
from protocols.rorze.row import FIRST_GROUP, LAST_BODY, LAST_GROUP, MAX_COMMAND_LENGTH
from protocols.table import RangeFault, SyntaxFault
from tests.protocols.rorze.examples import Row, check_examples

ROWS: list[Row] = [link_master.IdentifyControllers, link_master.SetReplyFormat, link_master.SetGroup]

groups = st.integers(FIRST_GROUP, LAST_GROUP).map("{:02X}".format)
bodies = st.integers(0, LAST_BODY).map("{:02X}".format)


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row.code)
def test_the_manuals_examples(row: Row) -> None:
    check_examples(row)
    assert not row.program


@given(group=groups, members=st.lists(bodies, min_size=1, max_size=link_master.MOST_MEMBERS, unique=True))
def test_every_group_fits_in_a_command_and_reads_back_as_written(group: str, members: list[str]) -> None:
    command = link_master.SetGroup(group=group, members=members)
    assert len(command.code + command.written()) <= MAX_COMMAND_LENGTH
    assert link_master.SetGroup.read(command.written()) == command


@pytest.mark.parametrize("group", ["7F", "9F", "A0", "8a", "8", "080", "80\n", 0x80])
def test_only_virtual_bodies_are_groups(group: object) -> None:
    with pytest.raises(ValidationError):
        link_master.SetGroup.model_validate({"group": group, "members": ["00"]})


@pytest.mark.parametrize(
    "members", [[], ["78"], ["7F"], ["80"], ["3f"], ["3"], [3], ["00", "01", "00"], "00", None]
)
def test_only_real_bodies_are_members_and_each_once(members: object) -> None:
    with pytest.raises(ValidationError):
        link_master.SetGroup.model_validate({"group": "80", "members": members})


def test_one_member_more_would_not_fit() -> None:
    too_many = [f"{number:02X}" for number in range(link_master.MOST_MEMBERS + 1)]
    with pytest.raises(ValidationError):
        link_master.SetGroup(group="80", members=too_many)


@pytest.mark.parametrize(
    ("parameters", "fault"),
    [
        ("80", SyntaxFault),
        ("80,", SyntaxFault),
        ("80,2", SyntaxFault),
        ("7F,02", RangeFault),
        ("80,80", RangeFault),
    ],
)
def test_the_link_master_refuses_what_is_no_group(parameters: str, fault: type[Exception]) -> None:
    with pytest.raises(fault):
        link_master.SetGroup.read(parameters)


def test_end_of_move_replies_are_on_or_off() -> None:
    assert [link_master.SetReplyFormat(end_of_move=flag).written() for flag in (0, 1)] == ["M0", "M1"]
    for value in (2, True, "1"):
        with pytest.raises(ValidationError):
            link_master.SetReplyFormat.model_validate({"end_of_move": value})
    with pytest.raises(RangeFault):
        link_master.SetReplyFormat.read("M2")


@pytest.mark.parametrize("text", ["", "00,01", "whatever it says @ > &"])
def test_the_answer_to_identification_is_kept_as_it_is(text: str) -> None:
    assert link_master.IdentifyControllers().read_reply(text).text == text


def test_the_answer_to_identification_is_printable() -> None:
    with pytest.raises(SyntaxFault):
        link_master.IdentifyControllers().read_reply("00\x00")
