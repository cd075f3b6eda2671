"""The causes of alarms: those of lines and of the gateway itself, and those of every family."""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from datetime import datetime
from functools import partial
from typing import Final

from gateway.core.alarms import Cause, Facts, Kind, past, words
from gateway.core.family import AnyLine, Family
from gateway.core.line_state import LineState
from gateway.core.next_calls import ALARMS, LINE_STATE, READY, get, post
from gateway.core.rights import Right

AUDIT = get("/audit", "See who did what.", "誰が何を行ったかを確認します。")
EVENTS = get("/events", "See what has happened.", "発生した事象を確認します。")

SECURITY = get(
    "/security",
    "See who was let in and who was refused.",
    "サインインと拒否の記録を確認します。",
    Right.ADMIN,
)

KEYS = get("/access/keys", "See which keys end soon.", "期限の近いキーを確認します。", Right.ADMIN)

RELOAD = post("/system/reload", Right.ADMIN, "Read the configuration again.", "設定を再読み込みします。")

LINE_DOWN = "line.down"
CONFIGURED_ANEW = "it is configured anew"
"""Why a line is closed that somebody has changed, at rest: nobody needs to look at it."""
UNUSABLE = (LineState.DOWN, LineState.SILENT)


def _facts_of_burst(burst: Facts) -> Facts:
    address = burst["address"]
    return {**burst, "whence": address or "an unknown address", "whence_ja": address or "不明なアドレス"}


def _facts_of_crash(crash: Facts) -> Facts:
    """What was under way, by its motor, and the time as people write it."""
    seen_at = crash["last_seen_at"]
    return {
        "last_seen": seen_at and f"{datetime.fromisoformat(seen_at):%Y-%m-%d %H:%M:%S} UTC",
        "moves": [f"{it} ({move})" for move, it in zip(crash["moves"], crash["targets"], strict=True)],
        "commands": crash["commands"],
    }


LINES: Final[Sequence[Kind[AnyLine]]] = (
    Kind(
        LINE_DOWN,
        words(
            "Line {address} cannot be used: {reason}.",
            "Motors on it go on with what they were told last. Stops are sent while its port is open, "
            "and may not arrive.",
            "Use the hardware stop if something must not move on. Then check port, cable and power.",
        ),
        words(
            "回線{address}を使用できません: {reason}。",
            "この回線のモータは最後に指示された動作を続けます。停止指令はポートが開いていれば送信しますが、"
            "届かない可能性があります。",
            "危険がある場合は非常停止回路を使用してください。その後、ポート、ケーブル、電源を確認してください。",
        ),
        "RC-420 manual 10.2; C-HOST manual 1-1",
        (LINE_STATE,),
        lambda line: line.state in UNUSABLE,
        applies=lambda event: event["reason"] != CONFIGURED_ANEW,
        over=past(
            words(
                "Line {address} could not be used: {reason}. It can be used again.",
                "Motors on it went on with what they were told last, and a stop may not have arrived.",
                "Look at where they stand. Check port, cable and power, so that it does not come again.",
            ),
            words(
                "回線{address}を使用できませんでした: {reason}。現在は復旧しています。",
                "この回線のモータは最後に指示された動作を続けました。停止指令は届かなかった可能性があります。",
                "位置を確認してください。再発しないよう、ポート、ケーブル、電源を確認してください。",
            ),
        ),
    ),
    Kind(
        "line.order.violated",
        words(
            "On line {address} the reply to {late} came after that to {before}, which was sent later.",
            "Nothing moved because of this. A reply that comes as late again may be taken for another's.",
            "See what stands between the port and the controllers, and how long it may hold a reply back.",
        ),
        words(
            "回線{address}で、{late}の応答が、後から送信した{before}の応答より遅れて届きました。",
            "これによるモータの動作はありません。再び遅れた応答は、別の指令への応答と取り違える可能性があります。",
            "ポートとコントローラの間の機器と、その応答の遅れを確認してください。",
        ),
        "RC-420 manual 17.1; C-HOST manual 1-1",
        (LINE_STATE,),
    ),
)
GATEWAY: Final[Sequence[Kind[str]]] = (
    Kind(
        "gateway.journal.trouble",
        words(
            "The journal cannot be written: {reason}.",
            "Moves under way go on. Nothing with an effect is sent; stops and reads are.",
            "Make room on the disk, or mend it. Where the file is not trusted any more, restart the gateway.",
        ),
        words(
            "ジャーナルに書き込めません: {reason}",
            "実行中の動作は続きます。停止と読み出し以外は送信しません。",
            "ディスクの空きを作るか、修復してください。ファイルが信頼できない場合はゲートウェイを再起動してください。",
        ),
        next=(READY,),
        lasts=lambda _why: True,
        over=past(
            words(
                "The journal could not be written: {reason}. It is written again.",
                "Moves under way went on. Nothing with an effect was sent; stops and reads were.",
                "See that there is room on the disk.",
            ),
            words(
                "ジャーナルに書き込めませんでした: {reason}。現在は書き込めます。",
                "実行中の動作は続きました。停止と読み出し以外は送信しませんでした。",
                "ディスクの空きを確認してください。",
            ),
        ),
    ),
    Kind(
        "gateway.journal.set_aside",
        words(
            "The journal was broken; it is now {file}, and a new one was begun.",
            "What was under way when the last life ended is not known.",
            "Look at every motor before it is moved. Keep the file: it shows what broke it.",
        ),
        words(
            "ジャーナルが破損していたため{file}として保存し、新しいジャーナルを開始しました。",
            "前回終了時に実行中だった動作は分かりません。",
            "動かす前に各モータの状態を確認してください。原因調査のためファイルを保管してください。",
        ),
        next=(EVENTS,),
    ),
    Kind(
        "gateway.crashed",
        words(
            "The gateway did not end as it should; it was last seen at {last_seen}. "
            "Moves under way: {moves}. Commands under way: {commands}.",
            "Motors went on with what they were told last. Moves under way are followed to their ends, or "
            "are `unknown`.",
            "Look at these motors and their moves, and at the log of that time.",
        ),
        words(
            "ゲートウェイが異常終了しました（最終確認 {last_seen}）。実行中の移動: {moves}、"
            "コマンド: {commands}",
            "モータは最後に指示された動作を続けました。実行中の移動は終了まで追跡するか、結果不明として記録します。",
            "これらのモータと移動、その時刻のログを確認してください。",
        ),
        next=(EVENTS, AUDIT),
        facts=_facts_of_crash,
    ),
    Kind(
        "gateway.held_up",
        words(
            "The gateway was suspended or held up for {seconds} s.",
            "Motors went on with what they were told last. What waited to be sent is not sent any more.",
            "Send again what is still wanted. Find out what holds the computer up, such as its power saving.",
        ),
        words(
            "ゲートウェイが{seconds}秒間停止していました。",
            "モータは最後に指示された動作を続けました。送信待ちの指令は取り消しました。",
            "必要な指令を再送信してください。省電力機能など、停止した原因を調べてください。",
        ),
        next=(ALARMS, EVENTS),
        applies=lambda data: bool(data["cancelled"]),
        event="gateway.loop.held",
    ),
    Kind(
        "gateway.reload_failed",
        words(
            "The configuration was not taken: {reason}",
            "Motors go on as before. Lines are served as the configuration before has them.",
            "Correct the file, then read it again.",
        ),
        words(
            "設定ファイルを読み込めませんでした: {reason}",
            "モータの動作は変わりません。以前の設定のまま動作を続けます。",
            "ファイルを修正し、もう一度読み込んでください。",
        ),
        next=(RELOAD,),
    ),
    Kind(
        "gateway.security.trouble",
        words(
            "The security log cannot be written: {reason}.",
            "No motor is concerned. Sign-ins and changes go on, and wait to be written down.",
            "Make room on the disk, or mend it; the gateway tries again every few seconds.",
        ),
        words(
            "セキュリティログに書き込めません: {reason}",
            "モータへの影響はありません。サインインと変更は続き、記録は書き込みを待っています。",
            "ディスクの空きを作るか、修復してください。数秒ごとに自動で再試行します。",
        ),
        next=(SECURITY,),
        lasts=lambda _why: True,
        latches=False,
        over=past(
            words(
                "The security log could not be written: {reason}. It is written again.",
                "No motor was concerned. Sign-ins and changes went on, and were written down later.",
                "See that there is room on the disk.",
            ),
            words(
                "セキュリティログに書き込めませんでした: {reason}。現在は書き込めます。",
                "モータへの影響はありませんでした。サインインと変更は続き、後から記録しました。",
                "ディスクの空きを確認してください。",
            ),
        ),
    ),
    Kind(
        "gateway.refusals.burst",
        words(
            "{refusals} requests or sign-ins were refused within {seconds} s, the last from {whence}.",
            "No motor is concerned: nothing was sent for them.",
            "See in the security log who asks, and end the key or the client that does.",
        ),
        words(
            "{seconds}秒間に{refusals}件の要求またはサインインを拒否しました（最後は{whence_ja}から）。",
            "モータへの影響はありません。何も送信していません。",
            "セキュリティログで要求元を確認し、該当するキーまたはクライアントを止めてください。",
        ),
        next=(SECURITY,),
        facts=_facts_of_burst,
        lasts=lambda _why: True,
        latches=False,
        over=past(
            words(
                "{refusals} requests or sign-ins were refused within {seconds} s, the last from {whence}; "
                "that is over.",
                "No motor was concerned: nothing was sent for them.",
                "See in the security log who asked.",
            ),
            words(
                "{seconds}秒間に{refusals}件の要求またはサインインを拒否しました（最後は{whence_ja}から）。"
                "現在は収まっています。",
                "モータへの影響はありませんでした。何も送信していません。",
                "セキュリティログで要求元を確認してください。",
            ),
        ),
    ),
    Kind(
        "gateway.key.ends_soon",
        words(
            "The key {name} ends at {expires_at}.",
            "No motor is concerned. From then on requests with the key are refused.",
            "Make a new one in its place: motion-gateway keys rotate {name}.",
        ),
        words(
            "キー{name}は{expires_at}に期限が切れます。",
            "モータへの影響はありません。期限後はこのキーの要求を拒否します。",
            "新しいキーを作成してください: motion-gateway keys rotate {name}",
        ),
        next=(KEYS,),
        latches=False,
    ),
)
"""Those that last do so while there is a reason. What is refused keeps nothing from moving: whoever is
refused could cause that."""


def _reason(trouble: Callable[[], str | None] | None, _: str) -> str | None:
    return None if trouble is None else trouble()


def causes_of(
    families: Collection[Family],
    ports: Mapping[str, AnyLine],
    troubles: Mapping[str, Callable[[], str | None]],
    *,
    latch: bool,
) -> Iterator[Cause]:
    """All causes that a plant knows.

    With `latch` the stops, too, that somebody has asked for; and what is held has an alarm of its own then.
    """
    for kind in LINES:
        yield kind.among(ports.get)
    for trouble in GATEWAY:
        yield trouble.among(partial(_reason, troubles.get(trouble.name)))
    for family in families:
        for cause in family.causes():
            if latch:
                yield replace(cause, is_told=lambda _: False)
            elif not cause.wanted:
                yield cause
