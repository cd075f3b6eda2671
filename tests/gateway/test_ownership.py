"""The owner of a line that another gateway may take over, over restarts and in spite of the servers."""

from pathlib import Path

import pytest

from gateway.config import parse
from gateway.core.errors import NotSent
from gateway.core.toml_files import ConfigError
from gateway.ownership import LOST, UNKNOWN, Owner, OwnerChanged, Ownership

OWNERS = {"line1": ("stocker1", "spare1"), "line2": ("stocker1",)}


def of(name: str, folder: Path | None = None) -> Ownership:
    return Ownership(name, OWNERS, folder)


def test_a_line_without_a_spare_is_nobodys_business() -> None:
    it = of("stocker1")
    assert it.of("line2") is None
    assert it.stands_by("line2") is None
    it.require_owner("line2", 7)


def test_the_first_owner_opens_a_line_once_it_hears_that_nobody_else_has_it() -> None:
    it = of("stocker1")
    assert it.stands_by("line1") == UNKNOWN
    it.is_current = True
    assert it.stands_by("line1") is None
    it.require_owner("line1", None)
    it.require_owner("line1", 1)
    with pytest.raises(OwnerChanged):
        it.require_owner("line1", 2)


def test_the_spare_stands_by_until_a_person_takes_the_line_over() -> None:
    it, claims = of("spare1"), []
    it.on_claim = lambda line, epoch: claims.append((line, epoch))
    assert it.stands_by("line1") == "gateway stocker1 has it"
    with pytest.raises(OwnerChanged, match="stocker1 since epoch 1"):
        it.require_owner("line1", None)
    assert it.take("line1") == 2
    assert it.stands_by("line1") is None
    assert (it.held(), claims) == ({"line1": 2}, [("line1", 2)])


def test_who_has_lost_a_line_stays_away_over_restarts(tmp_path: Path) -> None:
    it = of("stocker1", tmp_path)
    it.is_current = True
    it.lose("line1")
    assert it.stands_by("line1") == LOST
    again = of("stocker1", tmp_path)
    again.is_current = True
    assert again.stands_by("line1") == LOST
    assert again.elsewhere("line1") is None


def test_a_newer_claim_takes_the_line_away_and_an_older_one_means_nothing(tmp_path: Path) -> None:
    it, lost = of("stocker1", tmp_path), []
    it.on_loss = lambda line, why: lost.append((line, why))
    it.note_claim("line1", "spare1", 1)
    assert lost == []
    it.note_claim("line1", "spare1", 2)
    assert lost == [("line1", "gateway spare1 has taken it over")]
    assert it.elsewhere("line1") == "spare1"
    assert of("stocker1", tmp_path).of("line1") == Owner("spare1", 2)


def test_a_take_over_that_cannot_be_written_down_changes_nothing(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    it = of("spare1", tmp_path / "file")
    with pytest.raises(NotSent):
        it.take("line1")
    assert it.of("line1") == Owner("stocker1", 1)


def test_a_broken_record_opens_nothing(tmp_path: Path) -> None:
    (tmp_path / "owners.json").write_text("{")
    it = of("stocker1", tmp_path)
    it.is_current = True
    assert it.stands_by("line1") == LOST


LINE = '[[lines]]\nid = "line1"\naddress = "{}"\nowners = {}\nbodies = [{{ id = "3F" }}]\n'
PLANT = '[plant]\nname = "stocker1"\nservers = ["nats://127.0.0.1"]\n'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PLANT + LINE.format("serial:///dev/ttyUSB0", '["stocker1", "spare1"]'), "two cables on one line"),
        (LINE.format("tcp://terminal:1", '["stocker1"]'), "have to name this gateway"),
        (PLANT + LINE.format("tcp://terminal:1", '["a", "b"]'), "have to name this gateway"),
        (PLANT + LINE.format("tcp://terminal:1", '["stocker1", "stocker1"]'), "is the same as owners[0]"),
    ],
)
def test_owners_that_make_no_sense_are_refused(text: str, said: str) -> None:
    with pytest.raises(ConfigError) as refused:
        parse(text, "x")
    assert said in str(refused.value)
