"""Whether a line says back what is written to it, as an adapter with local echo or a looped plug does.

Its bytes cannot be trusted then: each echo stands where a reply is awaited. No clock and no port: frames and
bytes are given.
"""

from collections import deque

from protocols.lines import Lines

ECHOES = 8
"""So many frames that came back one after the other as they were written are no replies."""
UNDER_WAY = 4
"""An echo may come when so many further frames have been written; when more have, there was none."""
LONGEST = 512
"""Bytes of the longest frame that is looked for."""
PAUSE_S = (0.25, 1.0)
"""First and longest pause after a frame on a line that echoes; it doubles in between. Stops do not wait."""
ECHOING = (
    "what is written comes back as it was; turn off the local echo of the adapter, or look whether sending "
    "and receiving wires are joined"
)


class Echo:
    """Compares what comes with what was written last."""

    def __init__(self) -> None:
        self.found = False
        """Whether the line echoes."""
        self._lines = Lines(LONGEST)
        self._written: deque[bytes] = deque()
        """The latest frames that have not come back."""
        self._in_a_row = 0
        self._pause_s = PAUSE_S[0]

    def written(self, frame: bytes) -> None:
        """Note a frame that no reply can equal. Where several in a row do not come back, the echo is over."""
        if len(self._written) > UNDER_WAY:
            self._written.popleft()
            self._in_a_row, self.found, self._pause_s = 0, False, PAUSE_S[0]
        self._written.append(frame.strip())

    def heard(self, data: bytes) -> None:
        """Look for what was written; echoes keep its order."""
        for line in map(bytes.strip, self._lines.feed(data)):
            if line not in self._written:
                continue
            missed = self._written.index(line)
            for _ in range(missed + 1):
                self._written.popleft()
            self._in_a_row = 1 if missed else self._in_a_row + 1
            self.found = self.found or self._in_a_row >= ECHOES

    def next_pause_s(self) -> float:
        """How long nothing but stops may follow the frame written now."""
        pause_s, self._pause_s = self._pause_s, min(2 * self._pause_s, PAUSE_S[1])
        return pause_s
