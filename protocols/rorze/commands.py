"""The whole command table: every row of the RC-420 and of the RC-400, by code and by name."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType, ModuleType
from typing import Any, Final

from protocols.rorze import (
    encoder,
    flash,
    input_logic,
    inputs_outputs,
    interpolation,
    link_master,
    modes,
    moves,
    origin,
    patterns,
    position,
    position_table,
    programs,
    speeds,
    stall_sensor,
    status,
    stops,
)
from protocols.rorze.row import RorzeCommand

Row = type[RorzeCommand[Any]]

CHAPTERS: Final = (
    origin,
    moves,
    position_table,
    stops,
    position,
    status,
    inputs_outputs,
    input_logic,
    modes,
    flash,
    interpolation,
    speeds,
    encoder,
    stall_sensor,
    patterns,
    programs,
    link_master,
)
"""Chapters in the order of the manual; the link master's commands last."""


def _rows(chapter: ModuleType) -> Iterator[Row]:
    for item in vars(chapter).values():
        is_row = isinstance(item, type) and issubclass(item, RorzeCommand) and bool(item.code)
        if is_row and item.__module__ == chapter.__name__:
            yield item


COMMANDS: Final[Mapping[str, Row]] = MappingProxyType(
    {row.code: row for chapter in CHAPTERS for row in _rows(chapter)}
)
BY_NAME: Final[Mapping[str, Row]] = MappingProxyType({row.name(): row for row in COMMANDS.values()})
