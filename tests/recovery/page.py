"""The stories as a page: `python -m tests.recovery.page > docs/recovery.md`."""

import sys

from gateway.core.next_calls import ACKNOWLEDGE
from gateway.fics.calls import HOME as HOME_ROBOT
from gateway.fics.calls import RESET
from gateway.rorze.calls import CLEAR_STATUS
from gateway.rorze.calls import HOME as HOME_BODY
from tests.recovery.stories import CLEAR, DISK, END, HOME, PANEL, STORIES, Story

HEAD = f"""\
# Back to work

What breaks, what the console tells, and the taps that lead back to the next good move. Each is a story that
is played in the tests, and that you can play: start the demo (`make serve`, or `motion-gateway demo`), open
`#/system`, and press a button under *Break something*. In the demo *{PANEL}* stands for what a person does
at the machine.

> A software stop does not replace a hardware stop. Before somebody reaches into the machine its power is off.

The same without a browser: `GET /demo/faults` lists the kinds (`ems`, `limit`, `power`, `cable`, `driver`,
`dead`, `disk`), their targets and the faults that stand. `POST /demo/faults` begins one, and
`DELETE /demo/faults` ends all. No other gateway than the demo has these three; there they are 404.

    curl -X POST http://127.0.0.1:8420/demo/faults -H 'content-type: application/json' \\
         -d '{{"kind": "ems", "target": "line1.3F"}}'
    curl http://127.0.0.1:8420/alarms
    curl -X DELETE http://127.0.0.1:8420/demo/faults
"""
_LABELS = {CLEAR: CLEAR_STATUS, "/errors/reset": RESET, "/power-cycle/acknowledge": ACKNOWLEDGE}


def label_of(story: Story, tap: str) -> str:
    """The name of the button in the console."""
    if tap == END:
        return PANEL
    home = HOME_BODY if story.target.startswith("line") else HOME_ROBOT
    return (home if tap == HOME else _LABELS[tap]).en.removesuffix(".")


def page() -> str:
    """Write all stories."""
    return "\n".join([HEAD, *map(_section, (*STORIES, DISK))])


def _section(story: Story) -> str:
    steps = [f"{number}. {_step(story, tap)}" for number, tap in enumerate(story.taps, 1)]
    return "\n".join(
        [
            f"## {story.title}\n",
            f"{story.broken} In the demo: `{story.kind}`, `{story.target}`.\n",
            f"The console tells: *{story.told.rstrip('.')}* (`{story.cause}`).\n",
            *steps,
            f"\n{story.why}\n",
        ]
    )


def _step(story: Story, tap: str) -> str:
    name = f"*{label_of(story, tap)}*"
    return f"{story.hand}; in the demo press {name}." if tap == END else f"Press {name}."


if __name__ == "__main__":
    sys.stdout.write(page())
