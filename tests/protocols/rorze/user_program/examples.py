"""Instructions as a program may have them, written by chance: every form of every operation, and commands."""

from hypothesis import strategies as st

from protocols.rorze.commands import COMMANDS
from protocols.rorze.user_program.operands import BANKS, Bank

INDEXES = st.sampled_from(["IX", "IY"])


def bank(name: Bank) -> st.SearchStrategy[str]:
    places = st.integers(0, BANKS[name][1]).map(str)
    return (places | INDEXES).map(lambda place: f"{name}{place}")


def number(first: int, last: int) -> st.SearchStrategy[str]:
    return st.integers(first, last).map(str)


DATA, COUNTERS, TIMERS, FLAGS, OUTPUTS = bank("D"), bank("C"), bank("T"), bank("M"), bank("OD")
PORTS = bank("ID") | bank("SN") | OUTPUTS | FLAGS
SWITCHES = PORTS | TIMERS | COUNTERS | st.just("MT")
BITS = number(0, 31) | st.integers(0, 31).map(lambda bit: f"H{bit:X}")
LEVELS = st.sampled_from("01")
NUMBERS = number(-999_999_999, 999_999_999) | st.integers(0, 0xFFFFFFFF).map(lambda bits: f"H{bits:X}")
MASKS = number(0, 999_999_999) | st.integers(0, 0xFFFFFFFF).map(lambda bits: f"H{bits:X}")
COUNTS = number(0, 50)
SMALL = number(0, 199)
LABELS = st.sampled_from([f"*L{place}" for place in range(5)])
PLACES = LABELS | st.integers(-9, 9).map(lambda distance: f"{distance:+d}")
MESSAGES = st.text("0123456789ABCxyz=!;,:.[]<>*@", min_size=1, max_size=16)


def joined(code: str, *operands: st.SearchStrategy[str]) -> st.SearchStrategy[str]:
    return st.tuples(*operands).map(lambda texts: code + ",".join(texts))


def either(*codes: str) -> st.SearchStrategy[str]:
    return st.sampled_from(codes)


OPERATIONS = st.one_of(
    joined("LD", DATA, NUMBERS | DATA | COUNTERS | INDEXES | st.just("RX")),
    joined("LD", DATA, PORTS, BITS),
    joined("LD", FLAGS | OUTPUTS, DATA, BITS),
    joined("LD", INDEXES, SMALL | DATA | st.just("RX")),
    joined("TMS", TIMERS, COUNTS | DATA),
    joined("CTS", COUNTERS, COUNTS | DATA),
    *(joined(code, FLAGS | OUTPUTS) for code in ("SET", "RST")),
    joined("BST", DATA, BITS, LEVELS),
    *(joined(code, DATA | COUNTERS | INDEXES) for code in ("INC", "DEC")),
    *(joined(code, DATA, NUMBERS | DATA | st.just("RX")) for code in ("ADD", "SUB", "MUL", "DIV")),
    *(joined(code, INDEXES, SMALL | DATA | st.just("RX")) for code in ("ADD", "SUB", "MUL", "DIV")),
    *(joined(code, DATA, MASKS | DATA) for code in ("AND", "OR")),
    *(joined(code, FLAGS, SWITCHES) for code in ("AND", "OR")),
    *(joined(code, PLACES) for code in ("JMP", "JMG", "JER")),
    joined("JER", either("1", "2", "6", "7"), PLACES),
    joined("CAL", LABELS),
    *(joined(code, SWITCHES, PLACES) for code in ("JON", "JOF")),
    joined("JBT", DATA, BITS, LEVELS, PLACES),
    st.tuples(
        DATA | COUNTERS | TIMERS | either("RX", "PP"), either("<", ">", "="), NUMBERS | DATA, PLACES
    ).map(lambda parts: f"JCP{parts[0]}{parts[1]}{parts[2]},{parts[3]}"),
    joined("WAT", COUNTS),
    *(joined(code, DATA) for code in ("RSL", "RSR")),
    joined("SDC", MESSAGES),
    joined("SDD", DATA | TIMERS | COUNTERS),
    joined("SDDH", DATA | TIMERS | COUNTERS),
    either("RET", "EED", "END"),
).filter(lambda text: len(text) <= 32)
"""Operations within the ranges."""

EXAMPLES = [
    text.replace(" ", "")[3:]
    for row in COMMANDS.values()
    if row.program
    for text in row.example[::2]
    if text.startswith("&3F")
]
"""Examples of the manual for the commands that a program may have."""

COMMAND_TEXTS = st.sampled_from(EXAMPLES) | st.one_of(
    *(joined(code, DATA) for code in ("6PS", "1+M", "1-M", "1AM", "2AM", "COS", "OHS", "9CD", "EAS", "PBS")),
    joined("3PSP[0]", DATA).map(lambda text: text.replace("]", "],", 1)),
    joined("COS", DATA, LEVELS),
    DATA.map(lambda memory: f"3PDP[{memory}]"),
    st.tuples(DATA, DATA).map(lambda parts: f"1+MA[{parts[0]}],{parts[1]}"),
)

INSTRUCTIONS = OPERATIONS | LABELS | COMMAND_TEXTS
