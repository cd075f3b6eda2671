"""File descriptors: each connection takes one, and lines, logs and stops need theirs."""

import logging
import resource

log = logging.getLogger(__name__)

KEPT_BACK = 192
"""Descriptors that are not for the connections within the limit: lines, files, and connections that stop."""


def connections_possible(wanted: int) -> int:
    """Raise the limit of open files for the `wanted` connections; give how many are possible."""
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    needed = wanted + KEPT_BACK
    if soft != resource.RLIM_INFINITY and soft < needed:
        soft = needed if hard == resource.RLIM_INFINITY else min(needed, hard)
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    if soft == resource.RLIM_INFINITY or soft >= needed:
        return wanted
    possible = max(1, soft - KEPT_BACK)
    log.warning(
        "The operating system allows %d open files (ulimit -n): connections are limited to %d, not %d.",
        *(soft, possible, wanted),
    )
    return possible
