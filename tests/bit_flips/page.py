"""The outcomes of all flips as a page: `python -m tests.bit_flips.page > docs/bit-flips.md`."""

import sys
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence

from tests.bit_flips.outcomes import Heard, Outcome, Row, Sent, rows

_HEAD = """\
# One flipped bit

Neither link has a checksum. This page shows what that comes to: of each command one example, and of its
reply, with each single bit flipped, the CR at the end too. `make documents` writes it,
and `make test` compares it.

A reply whose address, name, or repeated number was touched is credited in no case: the line is out of
step then, and a fence follows. What one bit turns into another valid frame nobody can tell from that
frame. So nothing is said of a move from its reply alone: how it ended is read from the controller's
state.

**The command.** *Nothing*: the far end hears no command, one that it refuses, or one without an end.
*Another body*, *another command*: that is done instead, and its reply is not credited. *Another value,
seen*: it is done with another value, and the reply shows it. **Another value**: it is done with another
value, or only its beginning is, and **the reply is that of what was meant**. *The same*: the bit means
nothing. *May move*: of all these, how many begin or change a motion that was not meant. A name that no
command of C-HOST has is counted as a macro's, as if each robot had one.

**The reply.** *Nothing*: it is not credited. *A refusal*: it reads as a refusal of the command. **Another
value**: it reads as another reply that the command may have, or its beginning does.
"""
_COLUMNS = "| Code | Name | {} | May move | {} |"
_SENT = (Sent.NOTHING, Sent.OTHER_TARGET, Sent.OTHER_COMMAND, Sent.SEEN, Sent.OTHER_VALUE, Sent.SAME)


def page() -> str:
    """Flip all bits, and write what became of them."""
    rorze, fics = rows()
    return "\n".join([_HEAD, *_family("RC-420 and RC-400", rorze), "", *_family("C-HOST, Ver.3", fics), ""])


def _family(title: str, its_rows: Iterable[Row]) -> Iterator[str]:
    told = [(row, list(row.sent()), list(row.heard())) for row in its_rows]
    sent = [outcome for _, of_command, _ in told for outcome in of_command]
    heard = [outcome for _, _, of_reply in told for outcome in of_reply]
    yield f"## {title}\n"
    yield f"Of {len(sent)} flips in commands: {_shares(sent, _SENT)}."
    yield f"Of {len(heard)} flips in replies: {_shares(heard, Heard)}.\n"
    yield _COLUMNS.format(" | ".join(_SENT), " | ".join(f"Reply: {kind}" for kind in Heard))
    yield "|" + "---|" * (3 + len(_SENT) + len(Heard))
    for row, of_command, of_reply in told:
        numbers = [
            *_numbers(of_command, _SENT),
            sum(outcome.moves for outcome in of_command),
            *_numbers(of_reply, Heard),
        ]
        yield f"| `{row.code}` | `{row.name}` | {' | '.join(map(str, numbers))} |"


def _numbers(outcomes: Iterable[Outcome], kinds: Iterable[Sent | Heard]) -> list[int]:
    counted = Counter(outcome.kind for outcome in outcomes)
    return [counted[kind] for kind in kinds]


def _shares(outcomes: Sequence[Outcome], kinds: Iterable[Sent | Heard]) -> str:
    numbers = zip(kinds, _numbers(outcomes, kinds), strict=True)
    return ", ".join(f"{kind} {number / len(outcomes):.2%}" for kind, number in numbers)


if __name__ == "__main__":
    sys.stdout.write(page())
