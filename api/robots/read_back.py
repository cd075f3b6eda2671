"""What was changed is read back: where that fails, the answer must not say that nothing was sent."""

from collections.abc import Iterator
from contextlib import contextmanager

from gateway.core.errors import GatewayError
from gateway.fics.errors import NotReadBack


@contextmanager
def reading_back(done: str) -> Iterator[None]:
    """Read back what was `done`, a clause such as "Output 1.0 was switched".

    :raises NotReadBack: it was not read.
    """
    try:
        yield
    except GatewayError as error:
        raise NotReadBack(done, error) from error
