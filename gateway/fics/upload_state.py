"""The upload of a robot: while one is open it takes positions only, and no stop (C-HOST manual 1-7).

No I/O and no clock: the session notes what was written and answered, and asks whether POF 2 goes next.
"""

from typing import Any

from protocols.fics.link import FicsRefusal
from protocols.fics.positions import BeginPositionUpload, EndPositionUpload
from protocols.fics.row import BLOCK_ERRORS, UPLOAD_ERROR, Block, FicsCommand
from protocols.fics.system import HostMode

NO_UPLOAD = "E08"
"""The refusal of a position where no upload is open (C-HOST manual 2-12); that of POF 2 is an assumption."""
OF_AN_END_IN_VAIN = (NO_UPLOAD, BLOCK_ERRORS[Block.MOTION])
"""The refusals of the end of an upload where none is open, or the robot moves (C-HOST manual 1-7)."""


class UploadState:
    """The knowledge of the upload of one robot."""

    def __init__(self) -> None:
        self.is_open = False
        """True if one is open, as far as is known: its end was not sent, or not taken."""
        self.may_be_open = False
        """True if one is, or was ended in Ver.2, where no answer tells that it was heard."""
        self._begun = 0
        """The number of the frame that began the last one: only what was written later can prove its end."""
        self._ended_at_try: int | None = None
        """The try of the fence before which POF 2 was sent, or was not needed."""

    def doubt(self) -> None:
        """A command was refused as it is in an upload: POF 2 goes before whatever follows."""
        self.is_open = self.may_be_open = True

    def note_written(self, command: FicsCommand[Any], number: int, *, silent: bool) -> None:
        """Note a written frame by its number; a `silent` one gets no answer."""
        if isinstance(command, BeginPositionUpload):
            self._begun = number
            self.doubt()
        elif silent and isinstance(command, EndPositionUpload):
            self.is_open = False

    def note_outcome(self, command: FicsCommand[Any], number: int, outcome: object) -> bool:
        """Note an answer to a frame; tells whether only an open upload explains it.

        No upload is open if its end was taken, or anything else that an upload does not let through.
        """
        ends, begins = isinstance(command, EndPositionUpload), isinstance(command, BeginPositionUpload)
        if not isinstance(outcome, FicsRefusal):
            closed = (ends or not command.during_upload) and number > self._begun
        else:
            closed = (begins and outcome.error != UPLOAD_ERROR) or (ends and outcome.error == NO_UPLOAD)
        if closed:
            self.is_open = self.may_be_open = False
            return False
        doubtful = isinstance(outcome, FicsRefusal) and _only_an_upload_explains(command, outcome)
        if doubtful:
            self.doubt()
        return doubtful

    def begin_fence(self, *, in_doubt: bool) -> None:
        """A fence begins. Where nothing was `in_doubt`, an upload may be open only if its first try fails."""
        self._ended_at_try = None if in_doubt or self.is_open else 0

    def must_end_before(self, fence_try: int, mode: int) -> bool:
        """True if POF 2 goes before a try of the fence: once, where an upload may be open.

        In Ver.2 an upload of another host would be as silent.
        """
        due = (self.may_be_open or mode == HostMode.VER_2) and self._ended_at_try != fence_try
        if due:
            self._ended_at_try = fence_try
        return due


def _only_an_upload_explains(command: FicsCommand[Any], refusal: FicsRefusal) -> bool:
    """True if neither the teaching terminal nor motion refuses this command so (C-HOST manual 1-7)."""
    edited = Block.TERMINAL_EDITS in command.blocked
    return refusal.error == UPLOAD_ERROR and not command.during_upload and not edited
