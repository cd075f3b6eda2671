"""What every kind of refusal is called in Japanese, and what became of the motor."""

from collections.abc import Mapping
from typing import Final

from gateway.core.errors import Moved

MOTOR: Final[Mapping[Moved, str]] = {
    "no": "この要求でモータは動いていません。",
    "yes": "この要求でモータが動きました。",
    "unknown": "この要求でモータが動いたかどうかは分かりません。",
}

STOP_ONE: Final = "既定のモード（減速停止）で停止するには、本文なしで POST {path} を送信してください。"
STOP_ALL: Final = "すべてを停止するには、本文なしで POST {path} を送信してください。"
"""How to stop, where a software stop was refused."""

TITLES: Final[Mapping[str, str]] = {
    "alarm-lasts": "アラームの原因が続いています",
    "ambiguous-address": "複数の回線に同じアドレスがあります",
    "arming-broken-off": "キャプチャは一部だけ設定されました",
    "bad-request": "要求を読み取れません",
    "body-busy": "ボディが使用中です",
    "body-offline": "ボディが応答しません",
    "cancelled": "送信前に取り消されました",
    "expired": "時間内に開始できませんでした",
    "garbled-reply": "応答が壊れていました",
    "gateway-error": "要求を実行できませんでした",
    "geometry-differs": "コントローラの機構設定が構成ファイルと異なります",
    "held-up": "ゲートウェイが一時停止していました",
    "invalid-request": "要求が正しくありません",
    "invalid-text": "テキストが正しくありません",
    "jog-out-of-reach": "JOGを制御できません",
    "jog-over": "JOGは終了しています",
    "journal-unavailable": "記録を書き込めません",
    "latched": "アラームがリセットされていません",
    "line-down": "回線が使用できません",
    "method-not-allowed": "このメソッドは使用できません",
    "move-failed": "移動が正常に終了しませんでした",
    "move-over": "移動は終了しています",
    "name-not-kept": "名前を保存できませんでした",
    "no-reply": "応答がありません",
    "not-allowed": "許可されていません",
    "not-done": "送信しましたが、実行されていません",
    "not-executed": "コマンドが途中で失われました",
    "not-found": "見つかりません",
    "not-homed": "原点復帰が完了していません",
    "not-proved": "ロボットの状態が確認できません",
    "not-read-back": "送信しましたが、読み返せませんでした",
    "not-sent": "送信していません",
    "partly-changed": "一部だけ変更されました",
    "partly-done": "一部だけ変更されました",
    "paths-differ": "コントローラごとに経路が異なります",
    "position-unknown": "位置が分かりません",
    "positions-differ": "保存された位置が送信したものと異なります",
    "power-cycled": "コントローラの電源が切れました",
    "precondition-failed": "読み取った後に変更されています",
    "preparation-outdated": "移動の準備が古くなりました",
    "program-differs": "保存されたプログラムが送信したものと異なります",
    "queue-full": "待っている要求が多すぎます",
    "request-entity-too-large": "要求が大きすぎます",
    "robot-busy": "ロボットが使用中です",
    "robot-offline": "ロボットが応答しません",
    "save-uncertain": "フラッシュメモリの内容が分かりません",
    "shutting-down": "ゲートウェイを終了しています",
    "speeds-not-restored": "速度が復元されていません",
    "storing-broken-off": "位置は一部だけ送信されました",
    "taken-otherwise": "送信しましたが、異なる値になりました",
    "unit-not-selected": "ユニットを確認できません",
    "unsupported-media-type": "内容の形式が正しくありません",
    "upload-broken-off": "位置の書き込みが中断されました",
}
"""By the last word of the problem's type; kinds with words of their own for each case are not here."""

REMEDIES: Final[Mapping[str, str]] = {
    "body-busy": "終了を待つか、停止してください。",
    "cancelled": "まだ必要であれば、もう一度送信してください。",
    "expired": "もう一度実行してください。",
    "held-up": "まだ必要であれば、もう一度送信してください。",
    "line-down": "原因を取り除くか、ケーブルを確認してください。ゲートウェイはポートの接続を続けて試みます。",
    "power-cycled": "設定を確認し、原点復帰を行うか、電源再投入を確認済みにしてください。",
    "queue-full": "待っている要求が減ってから、もう一度実行してください。",
    "robot-busy": "終了を待つか、停止してください。",
    "shutting-down": "ゲートウェイが戻ってから、もう一度送信してください。",
}
"""What helps, of the kinds for which that is the same each time; the English after it may say more."""
