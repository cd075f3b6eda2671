"""Soft limits in user coordinates (C-HOST manual 2-33, 2-34)."""

from protocols.fics.axis_settings import CoordinateSetting, SetCoordinates
from protocols.fics.row import Query


class GetUpperSoftLimits(
    Query[SetCoordinates], code="SLP", blocked="abc", example=("SLP", "SLP 500,250.5,100")
):
    """+ソフトリミットの問い合わせ: get the upper soft limits."""


class SetUpperSoftLimits(CoordinateSetting, code="SLP", example=("SLP 500,,100", "SLP")):
    """+ソフトリミットの設定: set the upper soft limits; never below the lower ones."""


class GetLowerSoftLimits(
    Query[SetCoordinates], code="SLM", blocked="abc", example=("SLM", "SLM -500,-250.5,0")
):
    """-ソフトリミットの問い合わせ: get the lower soft limits."""


class SetLowerSoftLimits(CoordinateSetting, code="SLM", example=("SLM -500,,0", "SLM")):
    """-ソフトリミットの設定: set the lower soft limits; never above the upper ones."""
