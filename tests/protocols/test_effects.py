"""The effect of each command is a column of its row: nothing is guessed from a code or from a retry class."""

import pytest

from protocols.fics.commands import ROWS
from protocols.rorze.commands import COMMANDS
from protocols.table import Effect, Retry

EVERY_ROW = [*COMMANDS.values(), *ROWS]


@pytest.mark.parametrize(
    ("effect", "codes"),
    [
        (Effect.READ, "9CD CLD 6PD 3ND URD ACD MPS VER ERR"),
        (Effect.SETTING, "CBS 6PS OHS 3+S H+S POS IOT UNT"),
        (Effect.CLEARING, "9CS QRS PRS CRS DRT"),
        (Effect.MOTION, "00M 1+M 2AM HFM HMM 5AS 5CS URG USG JOG ORG LMA"),
        (Effect.STOP, "5IS 5SS UES ASS AES"),
        (Effect.MAINTENANCE, "FPS FES FIS UCS UWS XVS MOD"),
    ],
)
def test_commands_do_what_their_pages_say(effect: Effect, codes: str) -> None:
    wanted = set(codes.split())
    found = [row for row in EVERY_ROW if row.code in wanted and row.effect is effect]
    assert {row.code for row in found} == wanted


def test_what_may_be_repeated_freely_is_a_read_a_setting_or_a_stop() -> None:
    odd = [row.code for row in EVERY_ROW if row.retry is Retry.READ and row.effect is not Effect.READ]
    odd += [row.code for row in EVERY_ROW if row.effect is Effect.STOP and row.retry is not Retry.STOP]
    odd += [row.code for row in EVERY_ROW if row.effect is Effect.MOTION and row.retry is Retry.SETTING]
    assert odd == []


def test_a_program_and_a_change_of_speed_start_no_move_of_their_own() -> None:
    motions = {row.code for row in EVERY_ROW if row.effect is Effect.MOTION}
    none = {"5AS", "5CS", "5DS", "URG", "USG"}
    assert {row.code for row in EVERY_ROW if row.starts_motion} == motions - none
