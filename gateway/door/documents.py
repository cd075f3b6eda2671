"""Documents and their tags: a change of what somebody has read is refused where it is otherwise now."""

from collections.abc import Callable
from hashlib import sha256
from typing import Any, Final

from pydantic import BaseModel

from gateway.core.operation import Expectation
from gateway.core.records import SentBack

NOT_TAGGED: Final = {"steps", "flash", "last"}
"""What a change took, what flash memory is known to hold, what was done last: no change expects that."""


def tag_of(document: BaseModel) -> str:
    """The tag of what a document says: the same for the same, and for nothing else."""
    return sha256(document.model_dump_json(exclude=NOT_TAGGED).encode()).hexdigest()[:32]


def expectation(change: object, require_tag: Callable[[str], None] | None = None) -> Expectation | None:
    """What refuses a present state that the sender of a change does not know; None where any will do.

    `require_tag` refuses the tag of another document than was read. What is sent back as it was read, though
    no change can set it, is not to contradict the present.
    """
    told = change if isinstance(change, SentBack) and change.compared_whole and change.told else None
    if require_tag is None and told is None:
        return None

    def require(present: Any) -> None:
        if require_tag is not None:
            require_tag(tag_of(present))
        if told is not None:
            told.require_unchanged(present)

    return require
