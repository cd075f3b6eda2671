"""Addresses of bodies, groups and robots: accepted in upper and lower case, and answered in one form."""

from collections.abc import Collection
from itertools import islice

from gateway.core.errors import InvalidRequest, NotFound
from gateway.core.parts import numbered_address, spelled
from protocols.wording import as_given

MOST_LISTED = 32
"""Addresses listed in a sentence: as many as a line is likely to have bodies."""


def fits(name: str, address: str) -> bool:
    """Say whether a name, `3F`, `line1.3F` or `r1`, fits an address."""
    written = numbered_address(name)
    return address in (name, written) or ("." not in written and address.endswith(f".{written}"))


def canonical_address(text: str) -> str:
    """Write any address as it is answered: `3F`, `arm.3F`, `r1` or `r1/units/1`.

    :raises InvalidRequest: it is neither a body's nor a robot's.
    """
    if (address := spelled(text)) is not None:
        return address
    raise InvalidRequest(
        f"{text!r} is no address of a body or robot.", "Give addresses such as 3F, line.3F, r1 or r1/units/1."
    )


def there_are(names: Collection[str]) -> str:
    """List what there is, and of very many how many more."""
    listed = [*islice(names, MOST_LISTED), *_more(len(names) - MOST_LISTED)]
    return f"there {'is' if len(names) == 1 else 'are'} {', '.join(listed) or 'none'}"


def none_such(what: str, given: str, there: Collection[str], remedy: str) -> NotFound:
    """Say that there is no such thing, and what there is."""
    given = as_given(given)
    return NotFound(f"There is no {what} {given}; {there_are(there)}; nothing was sent.", remedy).reservedly(
        f"There is no {what} {given}; nothing was sent.", remedy
    )


def _more(left: int) -> list[str]:
    return [f"and {left} more"] if left > 0 else []
