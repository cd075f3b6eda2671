"""The thirty commands that only programs know, a row each: operands, room (RC-420 manual 15.1, 16, 20)."""

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Final

from protocols.rorze.user_program.operands import (
    BIT,
    BITS,
    COUNT,
    COUNTER,
    DATA,
    ERROR_BIT,
    FLAG,
    INDEX,
    INDEX_NUMBER,
    INPUT,
    LABELLED,
    LEVEL,
    MASK,
    MESSAGE,
    NUMBER,
    OUTPUT,
    PLACE,
    POSITION,
    RESULT,
    SENSOR,
    SIGN,
    SWITCH,
    TIMER,
    OperandKind,
)


@dataclass(frozen=True, slots=True)
class OperandForm:
    """One choice of operands, and the steps an operation so written takes."""

    kinds: tuple[OperandKind, ...]
    steps: int


@dataclass(frozen=True, slots=True)
class OperationRow:
    """A row of table 20."""

    code: str
    ja: str
    en: str
    forms: tuple[OperandForm, ...]
    jumps: bool
    """True if the operation only chooses the next address."""
    separator: str

    def split(self, text: str) -> list[tuple[int, str]]:
        """The operands of an operation as written, each with its place in the text."""
        if not text:
            return []
        ends = [match.span() for match in re.finditer(self.separator, text)] if self.separator else []
        starts = [0, *(after for _, after in ends)]
        stops = [*(before for before, _ in ends), len(text)]
        return [(start, text[start:stop]) for start, stop in zip(starts, stops, strict=True)]


COMMA, AROUND_SIGNS, UNDIVIDED = ",", ",|(?<=[<>=])|(?=[<>=])", ""


def _row(
    code: str,
    ja: str,
    en: str,
    steps: int,
    *forms: Sequence[OperandKind] | OperandForm,
    jumps: bool = False,
    separator: str = COMMA,
) -> OperationRow:
    made = [form if isinstance(form, OperandForm) else OperandForm(tuple(form), steps) for form in forms]
    return OperationRow(code, ja, en, tuple(made), jumps, separator)


_ARITHMETIC = ((DATA, NUMBER | DATA | RESULT), (INDEX, INDEX_NUMBER | DATA | RESULT))
_LOGIC = ((DATA, MASK | DATA | RESULT), (FLAG, SWITCH))

# Pages are stronger than the table where both are there. AND, CTS, DEC, JBT, MUL and OR are without a page:
# their operands are those of the table and of their sister commands.
_ROWS = (
    _row(
        "LD",
        "ロード",
        "load a memory",
        2,
        # The table does not name RX; it is read as the others of its form are.
        OperandForm((DATA, NUMBER | DATA | COUNTER | RESULT), 3),
        (DATA, INDEX),
        (DATA, INPUT | OUTPUT | SENSOR | FLAG, BIT),
        (FLAG | OUTPUT, DATA, BIT),
        (INDEX, INDEX_NUMBER | DATA | RESULT),
    ),
    _row("TMS", "タイマーセット", "set a timer, in 0.1 s, and let it count down", 3, (TIMER, COUNT | DATA)),
    _row("CTS", "カウンターセット", "set a counter", 3, (COUNTER, COUNT | DATA)),
    _row("SET", "セット", "turn a flag or output on", 2, (FLAG | OUTPUT,)),
    _row("RST", "リセット", "turn a flag or output off", 2, (FLAG | OUTPUT,)),
    _row("BST", "ビットセット", "write one bit of a data memory", 2, (DATA, BIT, LEVEL)),
    _row("INC", "インクリメント", "add 1, up to the largest value", 1, (DATA | COUNTER | INDEX,)),
    _row("DEC", "デクリメント", "subtract 1, down to the smallest value", 1, (DATA | COUNTER | INDEX,)),
    _row("ADD", "アド", "add", 3, *_ARITHMETIC),
    _row("SUB", "サブ", "subtract", 3, *_ARITHMETIC),
    _row("MUL", "マルチ", "multiply", 3, *_ARITHMETIC),
    _row("DIV", "デビジョン", "divide, without a remainder", 3, *_ARITHMETIC),
    _row("AND", "アンド", "and, bit by bit", 3, *_LOGIC),
    _row("OR", "オア", "or, bit by bit", 3, *_LOGIC),
    _row("JMP", "ジャンプ", "jump", 3, (PLACE,), jumps=True),
    _row("CAL", "コール", "call a subroutine", 3, (LABELLED,)),
    _row("RET", "リターン", "return from a subroutine", 1, ()),
    _row(
        "JCP",
        "ジャンプコンペア",
        "jump if a comparison holds",
        5,
        (DATA | COUNTER | TIMER | RESULT | POSITION, SIGN, NUMBER | DATA | COUNTER | TIMER, PLACE),
        jumps=True,
        separator=AROUND_SIGNS,
    ),
    _row("JMG", "ジャンプメッセージ", "jump if a message waits to be sent", 3, (PLACE,), jumps=True),
    _row("JON", "ジャンプON", "jump if on", 3, (SWITCH, PLACE), jumps=True),
    _row("JOF", "ジャンプOFF", "jump if off", 3, (SWITCH, PLACE), jumps=True),
    _row("JBT", "ジャンプビット", "jump if a bit is as given", 4, (DATA, BIT, LEVEL, PLACE), jumps=True),
    _row("JER", "ジャンプエラー", "jump if there is an error", 3, (PLACE,), (ERROR_BIT, PLACE), jumps=True),
    _row("EED", "エラーエンド", "end the program if there is an error", 1, ()),
    _row("WAT", "ウェイト", "wait, in 0.1 s", 2, (COUNT,)),
    _row("RSL", "ローテイトシフト・レフト", "rotate left by one bit", 2, (DATA,)),
    _row("RSR", "ローテイトシフト・ライト", "rotate right by one bit", 2, (DATA,)),
    _row("SDC", "SENDキャラクタ", "send a message", 3, (MESSAGE,), separator=UNDIVIDED),
    _row("SDD", "SENDデータ", "send what a memory holds", 2, (DATA | TIMER | COUNTER | BITS,)),
    _row("END", "エンド", "end the program", 1, ()),
)

OPERATIONS: Final[Mapping[str, OperationRow]] = MappingProxyType({row.code: row for row in _ROWS})
