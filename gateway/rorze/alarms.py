"""What goes wrong with bodies, in words for a technician (RC-420 manual 10.2, 13.8)."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import Final, NamedTuple

from gateway.core.alarms import Cause, Facts, Kind, causes_of_moves, past, stopped, words
from gateway.core.next_calls import ACKNOWLEDGE, LINE_STATE, STOP, NextCall
from gateway.core.power_alarms import facts_of_power_loss
from gateway.core.restore_alarms import causes_of_restores
from gateway.rorze.bodies import Body
from gateway.rorze.calls import (
    CLEAR_COMMENT,
    CLEAR_ENCODER_STALL,
    CLEAR_STALL_SENSOR,
    CLEAR_STATUS,
    GROUP,
    HOME,
    MOVE,
    POSITION,
    READ_COMMENT,
    STATUS,
    TABLE_UPLOAD,
    UPLOAD,
)
from gateway.rorze.line import Line
from protocols.rorze.status import CONTROLLER_STATUS_BITS


class _Bit(NamedTuple):
    en: str
    ja: str
    motor_en: str
    motor_ja: str
    remedy_en: str
    remedy_ja: str
    past_en: str
    past_ja: str
    manual: str
    next: tuple[NextCall, ...]


STOPPED = "The motor has stopped, or stops."
STOPPED_JA = "モータは停止した、または停止します。"

ERROR_BITS: Final[Mapping[str, _Bit]] = {
    "limit_error": _Bit(
        "A limit sensor of {address} was reached.",
        "{address}がリミットセンサに達しました。",
        f"{STOPPED} While the sensor is on it takes moves away from the limit only.",
        f"{STOPPED_JA}センサがONの間は、リミットから離れる方向にだけ移動できます。エラー自体は移動を妨げません。",
        "See why it went so far, clear the error, and move it off the limit.",
        "原因を確認し、エラーを解除してから、リミットから離れる方向へ動かしてください。",
        "See why it went so far.",
        "リミットに達した原因を確認してください。",
        "RC-420 manual 13.8.2, 13.9.2",
        (STATUS, CLEAR_STATUS),
    ),
    "ems_error": _Bit(
        "The EMS input of {address} was on.",
        "{address}のEMS入力がONになりました。",
        f"{STOPPED} While the input is on it takes no moves; once it is off it takes them, cleared or not.",
        f"{STOPPED_JA}EMS入力がONの間は移動できません。OFFに戻ると、エラーが残っていても移動できます。",
        "See why the EMS input came on, release it, then clear the error.",
        "EMS入力がONになった原因を確認し、解除してからエラーをクリアしてください。",
        "See why the EMS input came on.",
        "EMS入力がONになった原因を確認してください。",
        "RC-420 manual 13.8.2, 13.9.2",
        (STATUS, CLEAR_STATUS),
    ),
    "initialisation_error": _Bit(
        "{address} could not read its settings from flash memory when it was switched on.",
        "{address}は電源投入時にフラッシュメモリの設定を正しく読み出せませんでした。",
        "The motor did nothing because of this. It takes moves, by settings that are not those it had.",
        "これによるモータの動作はありません。移動はできますが、保存した設定では動きません。",
        "Check its settings, write them to flash memory again, then clear the error.",
        "設定を確認してフラッシュメモリに書き直し、エラーをクリアしてください。",
        "Check its settings before it is moved.",
        "動かす前に設定を確認してください。",
        "RC-420 manual 13.8.2",
        (STATUS, CLEAR_STATUS),
    ),
    "range_error": _Bit(
        "{address} was to leave the range in which it may move.",
        "{address}が移動可能範囲を超えようとしました。",
        f"{STOPPED} It takes moves within its range, cleared or not.",
        f"{STOPPED_JA}範囲内であれば、エラーが残っていても移動できます。",
        "Check the position that was asked for and the range (EPS), then clear the error.",
        "指定した位置と移動範囲(EPS)を確認し、エラーをクリアしてください。",
        "Check the position that was asked for and the range (EPS).",
        "指定した位置と移動範囲(EPS)を確認してください。",
        "RC-420 manual 13.8.2",
        (STATUS, POSITION, CLEAR_STATUS),
    ),
    "stall_error": _Bit(
        "{address} has lost steps (STALL).",
        "{address}が脱調しました(STALL)。",
        f"{STOPPED} It takes no moves but an origin search before the STALL is cleared.",
        f"{STOPPED_JA}脱調を解除するまで、原点サーチ以外の移動はできません。",
        "See what holds the motor. Reset the finder of the STALL that has told it, or home the body; its "
        "position is not to be believed before that.",
        "モータの負荷を確認し、脱調検出をリセットするか、原点サーチを行ってください。それまで位置は信頼できません。",
        "See what held the motor. Its position is not to be believed before it is homed.",
        "モータの負荷を確認してください。原点サーチを行うまで位置は信頼できません。",
        "RC-420 manual 13.6, 13.7",
        (STATUS, CLEAR_STALL_SENSOR, CLEAR_ENCODER_STALL, HOME),
    ),
}
"""The errors of the controller status that stay until they are cleared (9CD)."""


def _shows(mask: int, body: Body) -> bool:
    return bool((body.status_bits or 0) & mask)


def _tells(name: str, data: Facts) -> bool:
    return name in data["status"]


def _facts_of_upload(record: Facts) -> Facts:
    return {**_facts_of_table_upload(record), "stored": record["stored"]}


def _facts_of_table_upload(record: Facts) -> Facts:
    error = record["error"] or {}
    return {
        "upload_id": record["id"],
        "request_id": record["request_id"],
        "detail": error.get("detail", ""),
        "remedy": error.get("remedy") or "Upload it again.",
    }


BODIES: Final[Sequence[Kind[Body]]] = (
    Kind(
        "body.offline",
        words(
            "{address} does not answer any more.",
            "A move under way goes on in the controller to its end, if that has power; nobody sees it.",
            "Check its power, its cable and its rotary switch.",
        ),
        words(
            "{address}が応答しません。",
            "コントローラに電源が入っていれば、実行中の移動は終わりまで続きます。状態は確認できません。",
            "電源、ケーブル、ロータリスイッチを確認してください。",
        ),
        "RC-420 manual 10.2",
        (LINE_STATE, STOP),
        lambda body: not body.online,
        is_told=lambda body: body.number in body.line.unasked,
        over=past(
            words(
                "{address} did not answer for a while; it answers again.",
                "A move that was under way then went on in the controller to its end, if that had power.",
                "Look at where it stands before it is moved.",
            ),
            words(
                "{address}は一時応答しませんでしたが、応答が復旧しました。",
                "当時実行中だった移動は、電源が入っていれば終わりまで続きました。",
                "動かす前に位置を確認してください。",
            ),
        ),
        disproved=lambda body: body.number in body.line.answered_late,
    ),
    Kind(
        "body.power_cycled",
        words(
            "{address} {lost}: {why}.",
            "{so} motor has stopped. "
            "Its position, its position table and its settings are those of power-on.",
            "See that its settings are right, then home it, or acknowledge the power cycle.",
        ),
        words(
            "{address}の電源が{lost_ja}。",
            "{so_ja}モータは停止しました。位置、位置テーブル、設定は電源投入時の値です。",
            "設定を確認し、原点サーチを行うか、電源再投入を確認済みにしてください。",
        ),
        "RC-420 manual 5.4.2",
        (STATUS, HOME, ACKNOWLEDGE),
        lambda body: body.power.cycled,
        facts=facts_of_power_loss,
        over=past(
            words(
                "{address} {had_lost}; that was acknowledged, or it was homed since.",
                "{so} motor had stopped, and its position table and settings were those of power-on.",
                "See that its settings are right, if that was not done.",
            ),
            words(
                "{address}の電源が{had_lost_ja}が、確認済みにするか原点復帰を行いました。",
                "{so_ja}モータは停止し、位置テーブルと設定は電源投入時の値になりました。",
                "未確認の場合は設定を確認してください。",
            ),
        ),
    ),
    Kind(
        "body.stop.unconfirmed",
        words(
            "A stop of {address} was not confirmed in time. {detail}",
            "The motor may still move. The stop is repeated until its controller reports standstill.",
            "Use the hardware stop. Nobody knows by software whether it stands.",
        ),
        words(
            "{address}の停止を時間内に確認できませんでした。",
            "モータはまだ動いている可能性があります。停止が確認されるまで停止指令を繰り返します。",
            "非常停止回路を使用してください。ソフトウェアでは停止を確認できません。",
        ),
        "RC-420 manual 5.4.1, 14.6",
        (STATUS, STOP, LINE_STATE),
        lambda body: body.being_stopped,
        is_told=lambda body: body.line.tells_of_stops,
        over=past(
            words(
                "A stop of {address} was not confirmed in time; it was confirmed later. {detail}",
                "The motor moved, or may have moved, until the controller reported standstill.",
                "Find out why the stop was told so late.",
            ),
            words(
                "{address}の停止を時間内に確認できませんでしたが、その後確認しました。",
                "コントローラが停止を報告するまで、モータが動いていた可能性があります。",
                "確認が遅れた原因を調べてください。",
            ),
        ),
        disproved=lambda body: body.stop_was_proved,
    ),
    stopped("body", "RC-420 manual 5.4.1", (STATUS, POSITION), lambda body: body.being_stopped),
    Kind(
        "body.motion.foreign",
        words(
            "{address} moves, and the gateway has not started that.",
            "The motor moves by a user program, another host or a terminal.",
            "Stop it if it must not move, and find out who moves it.",
        ),
        words(
            "{address}が、ゲートウェイからの指令なしに動いています。",
            "ユーザープログラム、他のホスト、または端末によってモータが動いています。",
            "動いてはならない場合は停止し、何が動かしているかを調べてください。",
        ),
        "RC-420 manual 13.8.2, 13.8.4",
        (STATUS, STOP),
        lambda body: body.moving is True and body.move is None,
        over=past(
            words(
                "{address} moved, and the gateway had not started that.",
                "The motor was moved by a user program, another host or a terminal; that is over.",
                "Find out who moved it.",
            ),
            words(
                "{address}が、ゲートウェイからの指令なしに動きました。",
                "ユーザープログラム、他のホスト、または端末によるモータの動作でした。動作は終わっています。",
                "何が動かしたかを調べてください。",
            ),
        ),
    ),
    Kind(
        "body.power_mark.missing",
        words(
            "{detail}",
            "The motor did nothing because of this. A short loss of power may lead it to a wrong place.",
            "Clear the comment, or name another in the configuration (power_comment).",
        ),
        words(
            "{address}のユーザーコメント{comment}に電源断検出用の印を書き込めません。",
            "これによるモータの動作はありません。短い電源断の後、誤った位置へ移動する可能性があります。",
            "コメントを消去するか、設定のpower_commentで別の番号を指定してください。",
        ),
        "RC-420 manual 14 (9VS)",
        (READ_COMMENT, CLEAR_COMMENT),
        lambda body: body.power.taken,
        over=past(
            words(
                "The user comment {comment} of {address} was taken, so that no mark of its "
                "power could be written; it is free again.",
                "The motor did nothing because of this.",
                "Nothing needs to be done.",
            ),
            words(
                "{address}のユーザーコメント{comment}に電源断検出用の印を書き込めませんでしたが、書き込めるようになりました。",
                "これによるモータの動作はありません。",
                "対応は不要です。",
            ),
        ),
    ),
    Kind(
        "body.program.upload.failed",
        words(
            "The upload of a user program to {address} has failed. {detail}",
            "The motor did nothing because of this. {stored}",
            "{remedy}",
        ),
        words(
            "{address}へのユーザープログラムの書き込みに失敗しました。",
            "これによるモータの動作はありません。途中までのプログラムが残っている可能性があります。",
            "原因を取り除き、もう一度書き込んでください。それまでプログラムを実行しないでください。",
        ),
        "RC-420 manual 14.U, 15.2.6",
        (UPLOAD,),
        facts=_facts_of_upload,
    ),
    Kind(
        "body.position_upload.failed",
        words(
            "Not all positions were stored in {address}. {detail}",
            "The motor did nothing because of this. Some positions may be those that were sent, others not.",
            "{remedy}",
        ),
        words(
            "{address}への位置の書き込みに失敗しました。",
            "これによるモータの動作はありません。一部の位置だけが書き換えられている可能性があります。",
            "原因を取り除き、もう一度書き込んでください。それまで記憶した位置へ移動しないでください。",
        ),
        "RC-420 manual 13.4",
        (TABLE_UPLOAD,),
        facts=_facts_of_table_upload,
    ),
    Kind(
        "group.strangers",
        words(
            "{bodies} obeyed a command to group {address} and do not count among its members.",
            "They have done what the group was told: where that was a motion they have moved, too.",
            "See where they stand. The link master is told the members anew; see that no other host does.",
        ),
        words(
            "グループ{address}への指令に、構成に含まれない{bodies}が従いました。",
            "グループへの指令を実行しました。移動指令の場合は、これらのモータも動いています。",
            "位置を確認してください。構成はリンクマスタに再設定します。他のホストが変更していないか確認してください。",
        ),
        "RC-420 manual 12, 17.2",
        (GROUP, LINE_STATE),
    ),
    *(
        Kind(
            f"body.{name}",
            words(told.en, told.motor_en, told.remedy_en),
            words(told.ja, told.motor_ja, told.remedy_ja),
            told.manual,
            told.next,
            partial(_shows, 1 << CONTROLLER_STATUS_BITS.index(name)),
            partial(_tells, name),
            event="body.status.changed",
            over=past(
                words(told.en, "The motor had stopped. The error was cleared since.", told.past_en),
                words(told.ja, "モータは停止しました。その後、エラーは解除されました。", told.past_ja),
            ),
        )
        for name, told in ERROR_BITS.items()
    ),
)


STOPS_OF_LINE: Final = Kind[Line](
    "line.stops.unconfirmed",
    words(
        "Nobody on line {address} has answered for {silent_s} s; stops of {stops} bodies are not confirmed.",
        "Their motors may still move. The stops are repeated until each controller reports standstill.",
        "Use the hardware stop. Then check port, cable and power. A stop that is not confirmed even when the "
        "line answers again is an alarm of its own.",
    ),
    words(
        "回線{address}のどのコントローラも{silent_s}秒間応答せず、{stops}台の停止を確認できません。",
        "モータはまだ動いている可能性があります。停止が確認されるまで停止指令を繰り返します。",
        "非常停止回路を使用してください。その後、ポート、ケーブル、電源を確認してください。回線が復旧しても"
        "停止を確認できないものは、個別のアラームで知らせます。",
    ),
    "RC-420 manual 5.4.1, 10.2",
    (LINE_STATE,),
    lambda line: line.tells_of_stops,
    over=past(
        words(
            "Nobody on line {address} had answered for {silent_s} s; stops of {stops} "
            "bodies were not confirmed in time.",
            "Their motors may have moved until each controller reported standstill.",
            "Check port, cable and power. A stop that is not confirmed still is an alarm of its own.",
        ),
        words(
            "回線{address}のどのコントローラも{silent_s}秒間応答せず、{stops}台の停止を時間内に確認できませんでした。",
            "各コントローラが停止を報告するまで、モータが動いていた可能性があります。",
            "ポート、ケーブル、電源を確認してください。まだ確認できない停止は、個別のアラームで知らせます。",
        ),
    ),
)


def causes(find: Callable[[str], Body | None], find_line: Callable[[str], Line | None]) -> Iterator[Cause]:
    """The causes of bodies and their lines, found by their addresses; None: it is configured no more."""
    yield STOPS_OF_LINE.among(find_line)
    for kind in BODIES:
        yield kind.among(find)
    yield from causes_of_restores("body", "RC-420 manual 14, 18")
    yield from causes_of_restores("line", "RC-420 manual 14, 18")
    yield from causes_of_moves("body", "RC-420 manual 13.8.3", (MOVE, STATUS, POSITION))
