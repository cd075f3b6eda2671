"""The report of a commissioning, for programs (JSON) and for people (Markdown)."""

from collections.abc import Iterator
from typing import Any

from pydantic import BaseModel, Field

from commissioning.assumptions import BY_SLUG
from commissioning.conversation import Frame
from commissioning.findings import Result

NO_MOTION = (
    "Do not run motion on this line: no setting of the gateway is right for what contradicts it. Do what is "
    "said behind it, and repeat this. Where that changes nothing, send the report to the maker of the "
    "controller and to whoever maintains the gateway."
)
LEFT = "It is still otherwise than it was, and these commands set it back; `--allow settings` sends them: "
_MARKS = {Result.AGREES: "agrees", Result.DIFFERS: "**differs**", Result.CANNOT_TELL: "cannot tell"}


class Setting(BaseModel):
    """A setting of the line, as it is and as it should be."""

    key: str
    """Below the line's table, such as `stop_mode` or `bodies.3F.power_comment`."""
    now: Any
    proposed: Any = None
    """The value that makes the gateway right; null if the present one is."""


class Outcome(BaseModel):
    """The result of one assumption."""

    assumption: str
    result: Result
    setting: Setting | None = None
    """The setting that holds the assumption; null if no setting does."""
    needed: str | None = None
    """The needs of a trial that could not tell."""
    seen: str
    """The observation, in a sentence."""


class Measured(BaseModel):
    """Times of the replies to numbered questions, in seconds."""

    replies_s: list[float] = Field(default_factory=list)
    copies_s: list[float] = Field(default_factory=list)
    """Times from a reply to each of its copies."""


class Report(BaseModel):
    """All that was said and found on a line."""

    version: str
    """The version of the gateway."""
    line: str
    protocol: str
    address: str
    started_at: str
    ended_at: str
    allowed: list[str] = Field(default_factory=list)
    controllers: dict[str, str] = Field(default_factory=dict)
    """Versions and serial numbers that controllers tell, by body or robot."""
    table: dict[str, Any] = Field(default_factory=dict)
    """The line's table of the configuration."""
    left: list[str] = Field(default_factory=list)
    """Commands that have yet to set back what a trial has set, each with its body or robot."""
    lost: str | None = None
    """Why the port has gone before the end, if it has."""
    measured: Measured = Field(default_factory=Measured)
    results: list[Outcome]
    frames: list[Frame]

    def is_right(self) -> bool:
        """Tell whether nothing differs or contradicts, and nothing is left set."""
        return not self.left and not any(
            outcome.result in (Result.DIFFERS, Result.CONTRADICTS) for outcome in self.results
        )

    def changes(self) -> dict[str, Any]:
        """The proposed values, by key."""
        settings = (outcome.setting for outcome in self.results if outcome.setting is not None)
        return {setting.key: setting.proposed for setting in settings if setting.proposed is not None}

    def markdown(self) -> str:
        """Write it for people."""
        return "\n".join(self._rows()) + "\n"

    def _rows(self) -> Iterator[str]:
        yield f"# Line {self.line}: what was assumed, and what is so"
        yield ""
        yield f"{self.address}, {self.started_at} to {self.ended_at}, motion-gateway {self.version}."
        yield f"Allowed besides questions: {', '.join(self.allowed) or 'nothing'}."
        for name, told in self.controllers.items():
            yield f"- {name}: {told}"
        yield ""
        if self.lost is not None:
            yield from (f"**It was broken off**: {self.lost}", "")
        if any(outcome.result is Result.CONTRADICTS for outcome in self.results):
            yield from (f"**{NO_MOTION}**", "")
        if self.left:
            yield from (f"**{LEFT}**{'; '.join(self.left)}", "")
        yield "| assumption | result | what was seen | what to do |"
        yield "|---|---|---|---|"
        for outcome in self.results:
            mark = _MARKS.get(outcome.result, "**contradicts the gateway**")
            what = f"`{outcome.assumption}`: {BY_SLUG[outcome.assumption].assumed}"
            yield f"| {what} | {mark} | {outcome.seen} | {next_step(outcome)} |"
        yield ""
        yield f"## All {len(self.frames)} frames"
        yield ""
        yield "```"
        yield from (f"{frame.at} {frame.dir} {frame.data}" for frame in self.frames)
        yield "```"


def next_step(outcome: Outcome) -> str:
    """The next step after a result, in words; empty where it agrees."""
    row = BY_SLUG[outcome.assumption]
    if (setting := outcome.setting) is not None and setting.proposed is not None:
        return f"Set `{setting.key}` from `{setting.now}` to `{setting.proposed}`. {row.false}"
    if outcome.result is Result.CANNOT_TELL:
        return outcome.needed or ""
    if outcome.result is Result.AGREES:
        return ""
    contradicts = outcome.result is Result.CONTRADICTS
    return f"{row.false} {'Do not run motion.' if contradicts else 'Nothing has to be changed.'}"
