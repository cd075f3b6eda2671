"""The flash memory: code F (RC-420 manual 14, 18)."""

from typing import Annotated, Literal

from pydantic import Field

from protocols.rorze.notation import Word
from protocols.rorze.row import RorzeCommand
from protocols.table import Ack, Effect, Retry

FLASH_S = 1.5
"""Seconds until the reply when the flash memory is read, written or erased."""

Store = Annotated[
    Literal["positions", "settings", "program"], Word(positions="Posp", settings="Init", program="Upgm")
]


class FlashCommand(
    RorzeCommand[Ack],
    moving=False,
    program=False,
    errors=frozenset({0x50}),
    takes_s=FLASH_S,
    retry=Retry.CONDITIONAL,
    effect=Effect.MAINTENANCE,
):
    """Base of the commands to the flash memory."""


class EraseFlash(
    FlashCommand,
    code="FES",
    args="{store}",
    errors=frozenset({0x4A, 0x50}),
    example=("&3FFESPosp", ">&3FFES", "&3FFESInit", ">&3FFES", "&3FFESUpgm", ">&3FFES"),
):
    """フラッシュメモリ消去: erase positions, settings or the user program from flash memory.

    Takes about 1.5 s before the reply. The defaults hold from the next power-on (RC-420 manual 18).
    """

    store: Store = Field(description="Position table, power-on settings, or user program.")


class SaveSettings(FlashCommand, code="FIS", example=("&3FFIS", ">&3FFIS")):
    """初期化データ書込み: write the present settings to flash memory, to be loaded at power-on.

    Takes about 1.5 s before the reply.
    """


class LoadPositions(FlashCommand, code="FPD", example=("&3FFPD", ">&3FFPD")):
    """ポジションパルス読み込み: load the position table from flash memory; the present one is lost.

    Takes about 1.5 s before the reply.
    """


class SavePositions(FlashCommand, code="FPS", example=("&3FFPS", ">&3FFPS")):
    """ポジションパルス書込み: write the position table to flash memory.

    Takes about 1.5 s before the reply.
    """


# The pages of FUD and FUS are lost; their columns are those of FPD and FPS, 5A is that of UCS.
class LoadProgram(FlashCommand, code="FUD", errors=frozenset({0x50, 0x5A}), example=("&3FFUD", ">&3FFUD")):
    """ユーザープログラム読み込み: load the user program from flash memory; the present one is lost.

    Takes about 1.5 s before the reply.
    """


class SaveProgram(FlashCommand, code="FUS", example=("&3FFUS", ">&3FFUS")):
    """ユーザープログラム書込み: write the user program to flash memory.

    Takes about 1.5 s before the reply.
    """
