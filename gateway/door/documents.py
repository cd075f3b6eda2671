"""Documents and their tags: a change is refused if the document is no longer as its sender has read it."""

from collections.abc import Callable
from hashlib import sha256
from typing import Any, Final

from pydantic import BaseModel

from gateway.core.operation import Expectation
from gateway.core.records import SentBack

NOT_TAGGED: Final = {"steps", "flash", "last"}
"""Fields without a part in the tag: a change's steps, what flash memory is known to hold, the last action."""


def tag_of(document: BaseModel) -> str:
    """The tag of what a document says: the same for the same, and for nothing else."""
    return sha256(document.model_dump_json(exclude=NOT_TAGGED).encode()).hexdigest()[:32]


def expectation(change: object, require_tag: Callable[[str], None] | None = None) -> Expectation | None:
    """The check that refuses a present state unknown to the sender of a change; None where any state will do.

    `require_tag` refuses the tag of another document than was read. Fields that are sent back as they were
    read, though no change can set them, must not contradict the present.
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
