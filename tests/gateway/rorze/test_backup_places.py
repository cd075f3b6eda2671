"""The places of a body: all that flash memory can hold has one, with the question that reads it."""

import pytest

from gateway.rorze.backup_places import PLACES, PLACES_OF, RAM_ONLY, BackupPlace, place_of, words_of
from protocols.rorze.commands import COMMANDS
from protocols.rorze.patterns import GetSpeedChange, SetSpeedChange
from protocols.rorze.programs import MemoryReply, SetProgramMemory
from protocols.rorze.speeds import SpeedReply

IN_FLASH = {
    *(
        "0BS",
        "0RS",
        "0SS",
        "3IS",
        "9VS",
        "CCS",
        "CES",
        "CFS",
        "COS",
        "CPS",
        "CSS",
        "DCS",
        "DIS",
        "DLS",
        "EAS",
    ),
    *(
        "EDS",
        "EPS",
        "HAS",
        "HCS",
        "HFS",
        "HTS",
        "HZS",
        "OAS",
        "OBS",
        "OHS",
        "OLS",
        "OSS",
        "PAS",
        "PBS",
        "PES",
    ),
    *("PJS", "PKS", "PLS", "PSS", "PTS", "QIS", "QSS", "SPS", "UAS", "3PS"),
}
"""RC-420 manual 18: what FIS and FPS write."""


def test_all_that_flash_memory_can_hold_has_a_place() -> None:
    codes = {place.row.code for place in PLACES.values()}
    assert codes == {*IN_FLASH, *(row.code for row in RAM_ONLY)}
    assert len(PLACES) == sum(map(len, PLACES_OF.values())) == 3047


def test_every_place_has_a_question_and_words() -> None:
    for key, place in PLACES.items():
        question = place.question
        assert COMMANDS[question.code].read(question.written()) == question
        assert (place.key, bool(words_of(place.row))) == (key, True)


def test_a_value_that_cannot_be_set_was_never_set() -> None:
    place = PLACES["OHDS[3]"]
    assert place.setting(SpeedReply(speed=0)) is None
    found = place.setting(SpeedReply(speed=5))
    assert found is not None
    assert (found.written(), place_of(found)) == ("S[3],5", place)


def test_a_change_of_speed_is_told_by_where_it_begins() -> None:
    place = BackupPlace(SetSpeedChange, {"pattern": 3, "point": 2})
    told = GetSpeedChange(pattern=3, point=2).read_reply("F5321,T8000,S5000")
    found = place.setting(told)
    assert found is not None
    assert found.written() == "A[3],2,F5321,S5000"
    assert place.setting(GetSpeedChange(pattern=3, point=5).read_reply("NoData")) is None


@pytest.mark.parametrize(
    ("bits", "text"), [(5, "D0,5"), (0xFFFFFFFB, "D0,-5"), (1 << 30, "D0,H40000000"), (0, None)]
)
def test_a_data_memory_is_read_by_its_bits(bits: int, text: str | None) -> None:
    found = PLACES["UDDHD0"].setting(MemoryReply(bits=bits))
    assert (found and found.written()) == text


def test_what_a_backup_does_not_have_has_no_place() -> None:
    for code, text in (("COS", "3,1"), ("3PS", "P[+],5"), ("3PS", "P[1]"), ("1+M", "500"), ("SES", "A[3]")):
        assert place_of(COMMANDS[code].read(text)) is None
    assert place_of(SetProgramMemory(memory="C3", value=1)) is PLACES["UDDC3"]
