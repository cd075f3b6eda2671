"""The stories as pages: `python -m tests.recovery.page` writes docs/recovery.md and docs/ja/recovery.md."""

from collections.abc import Mapping
from pathlib import Path
from typing import Final

from gateway.core.alarms import words_of
from gateway.core.next_calls import ACKNOWLEDGE, NextCall
from gateway.fics.calls import HOME as HOME_ROBOT
from gateway.fics.calls import RESET
from gateway.rorze.alarms import CLEAR_STATUS
from gateway.rorze.alarms import HOME as HOME_BODY
from gateway.texts import text
from tests.recovery.japanese import JAPANESE
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
    return PANEL if tap == END else _call_of(story, tap).en.removesuffix(".")


def _call_of(story: Story, tap: str) -> NextCall:
    home = HOME_BODY if story.target.startswith("line") else HOME_ROBOT
    return home if tap == HOME else _LABELS[tap]


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
    if _is_home_of_robot(story, tap):
        return "Open its page, and press *Home*."
    return f"{story.hand}; in the demo press {name}." if tap == END else f"Press {name}."


def _is_home_of_robot(story: Story, tap: str) -> bool:
    """Its alarm is that of all units, and offers no homing of one."""
    return tap == HOME and not story.target.startswith("line")


JAPANESE_HEAD: Final = """\
# 復旧の手順

何が起きるか、画面に何が表示されるか、次の正常な動作までに何をするかを示します。どの手順もテストで再生されており、自分でも試せます。デモを起動し
（`make serve`、または `motion-gateway demo`）、`#/system` を開いて「故障を起こす」のボタンを押してください。
デモでは、現場での操作の代わりに「すべての故障を終了」を押します。

> ソフトウェア停止は、ハードウェアの停止の代わりにはなりません。機械に手を入れる前に、電源を切ってください。
"""
JAPANESE_PANEL: Final = "すべての故障を終了"


class _Known(dict[str, str]):
    """Values that a story gives to a sentence of an alarm; those that only the event knows are left out."""

    def __missing__(self, key: str) -> str:
        return "…"


def japanese_page() -> str:
    """Write all stories in Japanese."""
    return "\n".join([JAPANESE_HEAD, *map(_japanese_section, (*STORIES, DISK))])


def _japanese_section(story: Story) -> str:
    told = JAPANESE[story.id]
    known = _Known(address=story.target, lost=text("phrases.power-loss.certain.lost").ja)
    happened = words_of(story.cause).ja.happened.format_map(known)
    steps = [f"{number}. {_japanese_step(story, tap)}" for number, tap in enumerate(story.taps, 1)]
    return "\n".join(
        [
            f"## {told.title}\n",
            f"{told.broken}デモでは：`{story.kind}`、`{story.target}`。\n",
            f"画面の表示：「{happened.rstrip('。')}」（`{story.cause}`）\n",
            *steps,
            f"\n{told.why}\n",
        ]
    )


def _japanese_step(story: Story, tap: str) -> str:
    if tap == END:
        return f"{JAPANESE[story.id].hand}（デモでは「{JAPANESE_PANEL}」を押します）。"
    if _is_home_of_robot(story, tap):
        return "ロボットの画面で「原点復帰」を押します。"
    return f"「{_call_of(story, tap).ja.rstrip('。')}」を押します。"


DOCS: Final = Path(__file__).parents[2] / "docs"
PAGES: Final[Mapping[Path, str]] = {
    DOCS / "recovery.md": page(),
    DOCS / "ja" / "recovery.md": japanese_page(),
}

if __name__ == "__main__":
    for file, content in PAGES.items():
        file.write_text(content, "utf-8")
