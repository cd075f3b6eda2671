"""Time that this process needed, without that for which the machine let it wait for a processor."""

import os
import threading
from functools import cache
from time import monotonic, process_time, thread_time


class Span:
    """A span of time that begins now.

    Where a thread has waited for a processor while another one worked, too much is subtracted; the processor
    time of the thread that asks is the least that it took.
    """

    def __init__(self) -> None:
        self._begun_at, self._waited_s = monotonic(), _waited_s()
        self._used_s, self._all_used_s = thread_time(), process_time()

    def ms(self) -> float:
        """Milliseconds until now."""
        return 1000 * max(self._unhindered_s(), self._own_s())

    def stretch(self) -> float:
        """Ratio of real time to the time that the process could run."""
        return 1000 * (monotonic() - self._begun_at) / max(self.ms(), 1.0)

    def worked_ms(self) -> float:
        """Milliseconds for which this thread worked, or waited for another one that kept the interpreter."""
        all_used_s = process_time() - self._all_used_s
        return 1000 * max(self._own_s(), min(all_used_s, self._unhindered_s()))

    def _own_s(self) -> float:
        return thread_time() - self._used_s

    def _unhindered_s(self) -> float:
        return monotonic() - self._begun_at - (_waited_s() - self._waited_s)


def _waited_s() -> float:
    """For how long the threads of this process were ready and no processor was free (Linux)."""
    return sum(_waited_ns(thread.native_id) for thread in threading.enumerate()) / 1e9


@cache
def _opened(thread: int | None) -> int:
    return os.open(f"/proc/self/task/{thread}/schedstat", os.O_RDONLY)


def _waited_ns(thread: int | None) -> int:
    try:
        return int(os.pread(_opened(thread), 64, 0).split()[1])
    except OSError:  # it has ended
        return 0
