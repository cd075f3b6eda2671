"""Knowledge of the flash memory, story by story."""

import pytest

from gateway.rorze.knowledge import KEPT, FlashState
from gateway.rorze.settings_table import SETTINGS
from protocols.rorze.commands import COMMANDS
from protocols.rorze.flash import EraseFlash, SaveSettings
from protocols.rorze.origin import GetOriginOffset, OriginOffset, SetOriginOffset
from protocols.rorze.position import GetPosition
from protocols.rorze.position_table import GetPositionIndex
from protocols.rorze.programs import RunProgram
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack

QUESTION = GetOriginOffset()


def saved() -> FlashState:
    """A body whose settings were just saved, and one of them read."""
    flash = FlashState()
    flash.done(SaveSettings(), certain=True)
    flash.replied(QUESTION, OriginOffset(offset=10), 0.0)
    return flash


def test_nothing_is_known_of_a_body_that_was_never_seen_to_save_or_load() -> None:
    flash = FlashState()
    flash.replied(QUESTION, OriginOffset(offset=10), 0.0)
    assert not flash.known
    assert flash.held(QUESTION) is None


def test_what_was_read_before_it_was_set_is_what_flash_memory_holds() -> None:
    flash = saved()
    flash.sent(SetOriginOffset(offset=20), is_known=True)
    flash.replied(QUESTION, OriginOffset(offset=20), 0.0)
    assert flash.held(QUESTION) == OriginOffset(offset=10)


def test_what_was_set_before_it_was_read_is_not_known() -> None:
    flash = FlashState()
    flash.powered_on(certain=True)
    flash.sent(SetOriginOffset(offset=20), is_known=True)
    flash.replied(QUESTION, OriginOffset(offset=20), 0.0)
    assert flash.known
    assert flash.held(QUESTION) is None


@pytest.mark.parametrize(
    ("command", "is_known"),
    [(RunProgram(), True), (EraseFlash(store="settings"), True), (SetOriginOffset(offset=1), False)],
)
def test_what_may_change_settings_unseen_ends_all_knowledge(
    command: RorzeCommand[Ack], is_known: bool
) -> None:
    flash = saved()
    flash.sent(command, is_known=is_known)
    assert not flash.known
    assert flash.held(QUESTION) is None


@pytest.mark.parametrize("certain", [True, False])
def test_saving_without_a_reply_or_an_uncertain_loss_of_power_leaves_it_open(certain: bool) -> None:
    switched_on, saving = saved(), saved()
    switched_on.powered_on(certain=certain)
    saving.done(SaveSettings(), certain=certain)
    for flash in (switched_on, saving):
        assert flash.known is certain
        assert flash.held(QUESTION) is None


def test_it_keeps_what_fis_keeps_and_nothing_else() -> None:
    flash = saved()
    flash.replied(GetPosition(), GetPosition().read_reply("+000000050"), 0.0)
    assert flash.held(GetPosition()) is None
    of_documents = {it.question.code[:2] for setting in SETTINGS.values() for it in setting.items.values()}
    kept = {code[:2] for code in COMMANDS if KEPT.fullmatch(code[:2])}
    assert kept == of_documents - {"3I", "CO"} | {"SP"}


def test_what_changes_without_its_command_is_never_said_to_be_in_flash_memory() -> None:
    flash = saved()
    question = GetPositionIndex()
    flash.replied(question, question.read_reply("0003"), 0.0)
    assert flash.held(question) is None
