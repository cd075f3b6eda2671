import pytest

from protocols.fics.system import GetSystemVersion, GetUnit, SelectUnit, SetCommunicationMode
from protocols.table import RangeFault, SyntaxFault


def test_the_version_is_taken_apart_at_fixed_places() -> None:
    version = GetSystemVersion().read_reply("DYNAX0010310041112MY PROJ       041215R07H30")
    assert version.project_id == "DYNAX001"
    assert version.version == "0310"
    assert (version.built, version.saved) == ("041112", "041215")
    assert version.project_folder == "MY PROJ"
    assert (version.revision, version.c_host) == (7, 30)


def test_ver_2_leaves_out_the_version_of_c_host() -> None:
    assert GetSystemVersion().read_reply("DYNAX0010310041112              041215R01").c_host is None


@pytest.mark.parametrize("text", ["", "DYNAX001", "DYNAX0010310041112PROJECT1041215R01H30"])
def test_a_version_of_another_width_is_none(text: str) -> None:
    with pytest.raises(SyntaxFault):
        GetSystemVersion().read_reply(text)


def test_the_host_and_the_system_may_be_at_different_units() -> None:
    units = GetUnit().read_reply("2,1")
    assert (units.host_unit, units.fics_unit) == (2, 1)


@pytest.mark.parametrize("text", ["0", "10", "-1"])
def test_units_are_numbered_from_one(text: str) -> None:
    with pytest.raises(RangeFault):
        SelectUnit.read(text)


@pytest.mark.parametrize("text", ["1", "4"])
def test_there_are_two_modes(text: str) -> None:
    with pytest.raises(RangeFault):
        SetCommunicationMode.read(text)
