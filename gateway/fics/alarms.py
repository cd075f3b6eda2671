"""What goes wrong with robots, in words for a technician (C-HOST manual 2-12 to 2-14)."""

from collections.abc import Callable, Iterator, Sequence
from typing import Final

from gateway.core.alarms import Cause, Kind, causes_of_moves, past, stopped, words
from gateway.core.next_calls import ACKNOWLEDGE, STOP
from gateway.core.power_alarms import facts_of_power_loss
from gateway.core.restore_alarms import causes_of_restores
from gateway.fics.calls import ERRORS, MOVE, RESET, ROBOT, STATUS
from gateway.fics.robot import Robot

ROBOTS: Final[Sequence[Kind[Robot]]] = (
    Kind(
        "robot.offline",
        words(
            "{address} does not answer any more.",
            "A move under way goes on in the robot to its end, if that has power; nobody sees it.",
            "Check its power and its cable.",
        ),
        words(
            "{address}が応答しません。",
            "電源が入っていれば、実行中の移動は終わりまで続きます。状態は確認できません。",
            "電源とケーブルを確認してください。",
        ),
        "C-HOST manual 1-1",
        (ROBOT, STOP),
        lambda robot: not robot.online,
        over=past(
            words(
                "{address} did not answer for a while; it answers again.",
                "A move that was under way then went on in the robot to its end, if that had power.",
                "Look at where it stands before it is moved.",
            ),
            words(
                "{address}は一時応答しませんでしたが、応答が復旧しました。",
                "当時実行中だった移動は、電源が入っていれば終わりまで続きました。",
                "動かす前に位置を確認してください。",
            ),
        ),
    ),
    Kind(
        "robot.power_cycled",
        words(
            "{address} {lost}.",
            "{so} motion under way has ended with the power. No axis is homed, and speeds the gateway "
            "does not know are 100 % again.",
            "See that its speeds are right, acknowledge the power cycle, then home it.",
        ),
        words(
            "{address}の電源が{lost_ja}。",
            "{so_ja}実行中の動作は電源とともに終了しました。原点復帰は未完了で、ゲートウェイが把握していない"
            "速度は100 %に戻っています。",
            "速度を確認し、電源再投入を確認済みにしてから、原点復帰を行ってください。",
        ),
        "C-HOST manual 1-1-1, 2-15",
        (ROBOT, ACKNOWLEDGE),
        lambda robot: robot.power.cycled,
        facts=facts_of_power_loss,
        over=past(
            words(
                "{address} {had_lost}; that was acknowledged since.",
                "{so} axes had stopped, none was homed, and speeds the gateway does not know "
                "were 100 % again.",
                "See that its speeds are right, and home it, if that was not done.",
            ),
            words(
                "{address}の電源が{had_lost_ja}が、確認済みです。",
                "{so_ja}全軸が停止し、原点復帰は未完了になり、"
                "ゲートウェイが把握していない速度は100 %に戻りました。",
                "未確認の場合は速度を確認し、原点復帰を行ってください。",
            ),
        ),
    ),
    Kind(
        "robot.error",
        words(
            "{address} reports error {code}: {en}",
            "The robot has stopped, or stops; it takes no moves while the error stands.",
            "{remedy_en}",
        ),
        words(
            "{address}がエラー{code}を報告しました。{ja}",
            "ロボットは停止した、または停止します。エラーを解除するまで移動できません。",
            "{remedy_ja}",
        ),
        "C-HOST manual 2-12 to 2-14",
        (ERRORS, RESET),
        lambda robot: robot.latched_error is not None,
        over=past(
            words(
                "{address} reported error {code}: {en} It was reset since.",
                "The robot had stopped.",
                "{remedy_en}",
            ),
            words(
                "{address}がエラー{code}を報告しました。{ja}その後リセットされました。",
                "ロボットは停止しました。",
                "{remedy_ja}",
            ),
        ),
    ),
    Kind(
        "robot.stop.unconfirmed",
        words(
            "A stop of {address} was not confirmed in time. {detail}",
            "Axes may still move. The stop is repeated until the robot reports standstill.",
            "Use the hardware stop. Nobody knows by software whether it stands.",
        ),
        words(
            "{address}の停止を時間内に確認できませんでした。",
            "軸はまだ動いている可能性があります。停止が確認されるまで停止指令を繰り返します。",
            "非常停止回路を使用してください。ソフトウェアでは停止を確認できません。",
        ),
        "C-HOST manual 2-7, 2-8",
        (ROBOT, STOP),
        lambda robot: robot.stops.unconfirmed is not None,
        over=past(
            words(
                "A stop of {address} was not confirmed in time; it was confirmed later. {detail}",
                "Axes moved, or may have moved, until the robot reported standstill.",
                "Find out why the stop was told so late.",
            ),
            words(
                "{address}の停止を時間内に確認できませんでしたが、その後確認しました。",
                "ロボットが停止を報告するまで、軸が動いていた可能性があります。",
                "確認が遅れた原因を調べてください。",
            ),
        ),
        disproved=lambda robot: robot.stops.was_proved,
    ),
    stopped("robot", "C-HOST manual 2-7, 2-8", (ROBOT,), lambda robot: robot.stops.unconfirmed is not None),
    Kind(
        "robot.motion.foreign",
        words(
            "{address} moves, and the gateway has not started that.",
            "Axes move by a program, a terminal or another host.",
            "Stop it if it must not move, and find out who moves it.",
        ),
        words(
            "{address}が、ゲートウェイからの指令なしに動いています。",
            "プログラム、ティーチングペンダント、または他のホストによって軸が動いています。",
            "動いてはならない場合は停止し、何が動かしているかを調べてください。",
        ),
        "C-HOST manual 2-10",
        (ROBOT, STOP),
        lambda robot: robot.moving is True and robot.motion.command is None,
        over=past(
            words(
                "{address} moved, and the gateway had not started that.",
                "Axes were moved by a program, a terminal or another host; that is over.",
                "Find out who moved it.",
            ),
            words(
                "{address}が、ゲートウェイからの指令なしに動きました。",
                "プログラム、ティーチングペンダント、または他のホストによる軸の動作でした。動作は終わっています。",
                "何が動かしたかを調べてください。",
            ),
        ),
    ),
    Kind(
        "robot.bits.mismatch",
        words(
            "The configured order of bits does not explain what unit {unit} of {address} shows. {detail}",
            "The motor did nothing because of this. Its status may be told wrongly.",
            "Compare the order of status_bits and sensor_bits with the robot, and correct the configuration.",
        ),
        words(
            "{address}のユニット{unit}の状態が、設定されたビット順と一致しません。",
            "これによるモータの動作はありません。状態が誤って表示される可能性があります。",
            "status_bitsとsensor_bitsの順をロボットと照合し、設定を修正してください。",
        ),
        "C-HOST manual 2-10, 2-11",
        (ROBOT,),
        lambda robot: bool(robot.bits.mismatches),
        over=past(
            words(
                "The configured order of bits did not explain what unit {unit} of {address} showed. {detail}",
                "The motor did nothing because of this. Its status may have been told wrongly.",
                "Compare the order of status_bits and sensor_bits with the robot, if that was not done.",
            ),
            words(
                "{address}のユニット{unit}の状態が、設定されたビット順と一致しませんでした。",
                "これによるモータの動作はありません。状態が誤って表示された可能性があります。",
                "未確認の場合は、status_bitsとsensor_bitsの順をロボットと照合してください。",
            ),
        ),
    ),
    Kind(
        "robot.unit.missing",
        words(
            "{address} has no unit {unit}, which the configuration names.",
            "Nothing moved because of this. The other units can be used; stops are confirmed by them.",
            "Take unit {unit} out of the configuration, or correct its number, and reload it.",
        ),
        words(
            "設定にあるユニット{unit}は{address}に存在しません。",
            "これによるモータの動作はありません。他のユニットは使用でき、停止は他のユニットで確認されます。",
            "設定からユニット{unit}を削除するか、番号を修正し、設定を再読み込みしてください。",
        ),
        "C-HOST manual 2-1, 2-12",
        (ROBOT,),
        lambda robot: bool(robot.selection.missing),
        over=past(
            words(
                "{address} had no unit {unit}, which the configuration named.",
                "Nothing moved because of this.",
                "Nothing needs to be done.",
            ),
            words(
                "設定にあるユニット{unit}は{address}に存在しませんでした。",
                "これによるモータの動作はありません。",
                "対応は不要です。",
            ),
        ),
    ),
    Kind(
        "robot.jog.not_stopped",
        words(
            "A JOG of axis {axis} of unit {unit} of {address} was ended, and the axis did not stop in time.",
            "The axis may still move. The whole robot is being stopped.",
            "Use the hardware stop if it moves on. Then find out why it did not take the end of the JOG.",
        ),
        words(
            "{address}のユニット{unit}、軸{axis}のJOGを終了しましたが、時間内に停止しませんでした。",
            "軸はまだ動いている可能性があります。ロボット全体を停止しています。",
            "動き続ける場合は非常停止回路を使用してください。その後、停止しなかった原因を調べてください。",
        ),
        "C-HOST manual 2-2",
        (ROBOT, STOP),
        lambda robot: robot.moving is True,
        over=past(
            words(
                "A JOG of axis {axis} of unit {unit} of {address} was ended, and the axis did "
                "not stop in time; it stood still later.",
                "The axis moved on, and the whole robot was stopped.",
                "Find out why it did not take the end of the JOG.",
            ),
            words(
                "{address}のユニット{unit}、軸{axis}のJOGを終了しましたが、時間内に停止せず、その後停止しました。",
                "軸が動き続けたため、ロボット全体を停止しました。",
                "停止しなかった原因を調べてください。",
            ),
        ),
    ),
    Kind(
        "robot.move.overdue",
        words(
            "Move {move_id} of {address} takes longer than its way and its speeds explain.",
            "The robot still moves, or waits in the middle of the move.",
            "See what holds it up. Stop it if it must not go on.",
        ),
        words(
            "{address}の移動{move_id}が、距離と速度から見込まれる時間を超えています。",
            "ロボットはまだ動いているか、移動の途中で待っています。",
            "原因を確認し、続けてはならない場合は停止してください。",
        ),
        "C-HOST manual 2-10",
        (ROBOT, STOP),
        lambda robot: robot.moving is True,
        over=past(
            words(
                "Move {move_id} of {address} took longer than its way and its speeds explain.",
                "The robot moved, or waited in the middle of the move; it stood still later.",
                "See what held it up.",
            ),
            words(
                "{address}の移動{move_id}が、距離と速度から見込まれる時間を超えました。",
                "ロボットは動いていたか、移動の途中で待っていました。その後停止しました。",
                "遅れた原因を確認してください。",
            ),
        ),
    ),
)


def causes(find: Callable[[str], Robot | None]) -> Iterator[Cause]:
    """The causes of robots, which are found by their ids; None for one that is configured no more."""
    for kind in ROBOTS:
        yield kind.among(find)
    yield from causes_of_restores("robot", "C-HOST manual 2-17")
    yield from causes_of_moves("robot", "C-HOST manual 2-12", (MOVE, STATUS, ERRORS))
