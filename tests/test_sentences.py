"""Docstrings and descriptions are sentences of the whiteboard; `RULES` lists what a pattern can hold.

A folder that breaks a rule stands in `sentences_left.txt` with the number of its offences. The number only
falls: one more fails, and one fewer fails until it is lowered, by `python -m tests.test_sentences`. With the
names of folders or files as arguments that prints their offences.
"""

import ast
import re
import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PRODUCT = ["gateway", "api", "app", "protocols", "transports", "simulator"]
PACKAGES = [*PRODUCT, "bridges", "fleet", "commissioning", "recordings", "packaging", "benchmarks", "tests"]
DIVIDED = ("gateway", "protocols", "tests")
"""Packages whose folders are counted each on its own."""


@dataclass(frozen=True)
class Rule:
    """A pattern that no text of its `kinds` matches: `now` does, `better` says it well."""

    name: str
    pattern: str
    now: str
    better: str
    kinds: tuple[str, ...] = ("definition", "attribute", "description")
    """Docstrings of a `definition` (module, class, function) or `attribute`, or a field's `description`."""


RULES = (
    Rule(
        "no sentence begins with a clause that stands for a noun",
        r"(?:\A|(?<=[.!?])\s+)(?:What|Who|Whom|Whose|Which|Whether|Whatever|Whoever|Those|Of|The same"
        r"|So (?:many|long|often)|How (?:many|much|long|often|far|late|near|soon))\b",
        now="What was given up last, until a later reply has its name: of that a copy may come.",
        better="The last exchange that timed out. Its reply may still arrive.",
    ),
    Rule(
        "a person, a client or a part is called by its name",
        r"(?i)\b(?:whoever|whom|nobody|somebody|anybody|no one|someone|anyone|those who)\b",
        now="Somebody has asked for it: it is an alarm only where alarms latch.",
        better="Caused by a user's request; raises an alarm only with `latch`.",
    ),
    Rule(
        "a number says what it counts",
        r"(?i)\bso (?:many|long|often|much)\b(?! as| that)",
        now="So many questions wait at the line, that it has no rest.",
        better="Questions in flight: enough to keep the line busy, few enough not to delay other readers.",
    ),
    Rule(
        "an attribute or a field is a noun with its unit, understood alone",
        r"\A(?:How|So|By|It|They|As|That|Told|When|Where|After|Since|Until|From|To|In|At|On|For|With|Without"
        r"|Between|Its|None|Null|Left out|Such)\b",
        now="In `counted_in`, as last read.",
        better="Position as last read, in `counted_in`.",
        kinds=("attribute", "description"),
    ),
)
VARIABLE = "a variable is called by what it holds"
"""The rule that no name is `it`: of a variable, a parameter or a loop."""

RULE_NAMES = [*(rule.name for rule in RULES), VARIABLE]
LEFT = Path(__file__).with_name("sentences_left.txt")
"""A line for each folder with offences: its name and its offences by rule, in the order of `RULE_NAMES`."""


@dataclass(frozen=True)
class Offence:
    """A place that breaks a rule."""

    rule: str
    folder: str
    place: str
    text: str


def sentences(tree: ast.Module) -> Iterator[tuple[str, int, str]]:
    """The docstrings and descriptions of a module: their kind, line and text."""
    for node in ast.walk(tree):
        if isinstance(node, ast.keyword) and node.arg in ("description", "__doc__") and text_of(node.value):
            yield "description", node.value.lineno, text_of(node.value)
        body = getattr(node, "body", None)
        for before, statement in pairwise([None, *body]) if isinstance(body, list) else ():
            if isinstance(statement, ast.Expr) and text_of(statement.value):
                kind = "attribute" if isinstance(before, ast.Assign | ast.AnnAssign) else "definition"
                yield kind, statement.lineno, text_of(statement.value)


def text_of(node: ast.expr) -> str:
    """The text that an expression is; empty for anything else."""
    return node.value.strip() if isinstance(node, ast.Constant) and isinstance(node.value, str) else ""


def broken(kind: str, text: str) -> list[str]:
    """The names of the rules that a docstring breaks."""
    return [rule.name for rule in RULES if kind in rule.kinds and re.search(rule.pattern, text)]


def variables(tree: ast.Module) -> Iterator[int]:
    """The lines that give a variable or a parameter the name `it`."""
    for node in ast.walk(tree):
        if isinstance(node, ast.arg) and node.arg == "it":
            yield node.lineno
        if isinstance(node, ast.Name) and node.id == "it" and isinstance(node.ctx, ast.Store):
            yield node.lineno


@cache
def offences() -> list[Offence]:
    """All offences of all packages."""
    return [
        offence
        for package in PACKAGES
        for file in sorted((ROOT / package).rglob("*.py"))
        for offence in of(file)
    ]


def of(file: Path) -> Iterator[Offence]:
    """The offences of one file."""
    path = file.relative_to(ROOT)
    divided = path.parts[0] in DIVIDED and len(path.parts) > 2
    folder = "/".join(path.parts[: 2 if divided else 1])
    tree = ast.parse(file.read_text("utf-8"))
    for kind, line, text in sentences(tree):
        for rule in broken(kind, text):
            yield Offence(rule, folder, f"{path}:{line}", text.partition("\n")[0])
    for line in variables(tree):
        yield Offence(VARIABLE, folder, f"{path}:{line}", "it")


@cache
def present() -> dict[str, list[int]]:
    """The offences of each folder that has any, by rule."""
    found = Counter((offence.folder, offence.rule) for offence in offences())
    return {
        folder: [found[folder, rule] for rule in RULE_NAMES]
        for folder in sorted({folder for folder, _ in found})
    }


@cache
def allowed() -> dict[str, list[int]]:
    """The offences that `sentences_left.txt` allows."""
    rows = (line.split() for line in LEFT.read_text("utf-8").splitlines())
    return {folder: [int(number) for number in numbers] for folder, *numbers in rows}


def too_many(offence: Offence) -> bool:
    """True for an offence of a folder that has more of its rule than are allowed."""
    rule = RULE_NAMES.index(offence.rule)
    most = allowed().get(offence.folder, [0] * len(RULE_NAMES))[rule]
    return present()[offence.folder][rule] > most


@pytest.mark.parametrize("rule", RULES, ids=lambda rule: rule.name)
def test_a_rule_tells_the_sentence_from_the_better_one(rule: Rule) -> None:
    assert rule.name in broken(rule.kinds[-1], rule.now)
    assert broken(rule.kinds[-1], rule.better) == []


@pytest.mark.parametrize("source", ["it = 1", "def f(it): ...", "[it for it in ()]", "f = lambda it: 1"])
def test_a_variable_called_it_is_seen(source: str) -> None:
    assert list(variables(ast.parse(source))) == [1]


def test_docstrings_of_modules_classes_functions_and_attributes_and_descriptions_are_read() -> None:
    tree = ast.parse(
        '"""M"""\nA = 1\n"""A"""\nclass C:\n """C"""\n a: int = F(description="D" "E")\n """B"""\n'
        ' async def f():\n  """F"""'
    )
    assert sorted((text, kind) for kind, _, text in sentences(tree)) == [
        ("A", "attribute"),
        ("B", "attribute"),
        ("C", "definition"),
        ("DE", "description"),
        ("F", "definition"),
        ("M", "definition"),
    ]


def test_no_folder_breaks_a_rule_more_often_than_it_did() -> None:
    assert [offence for offence in offences() if too_many(offence)] == []


def test_the_offences_allowed_are_those_that_are_left() -> None:
    assert present() == allowed(), "there are fewer: python -m tests.test_sentences lowers the numbers"


def lines(wanted: list[Offence]) -> str:
    """The offences as text, one a line."""
    return "\n".join(f"{offence.place} {offence.rule}: {offence.text}" for offence in wanted)


if __name__ == "__main__":
    if places := tuple(sys.argv[1:]):
        sys.exit(lines([offence for offence in offences() if offence.place.startswith(places)]))
    if more := [offence for offence in offences() if too_many(offence)]:
        sys.exit(lines(more))
    rows = (f"{folder:22}{''.join(f'{number:6}' for number in row)}" for folder, row in present().items())
    LEFT.write_text("\n".join(rows) + "\n")
