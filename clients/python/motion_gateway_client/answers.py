"""The gateway's answers."""

from typing import Any, NamedTuple


class Answer(NamedTuple):
    """Everything that the gateway answers to a request, a refusal too."""

    status: int
    content: Any
    """JSON, or text."""
    replayed: bool
    """True if it is the first answer again, to a request that was repeated with its idempotency key."""

    @property
    def is_success(self) -> bool:
        """Tell whether it is no refusal."""
        return 200 <= self.status < 300
