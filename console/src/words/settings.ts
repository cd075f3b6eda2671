/** The settings of a body in words: a name and one sentence, in English and Japanese (RC-420 manual 13 to 18). */

import type { Language } from "./index.svelte.ts";

type About = readonly [en: string, enHelp: string, ja: string, jaHelp: string];

const ABOUT: Record<string, About> = {
  origin_offset: ["Origin offset", "Pulses from the CW edge of the origin sensor to the origin.", "原点オフセット", "原点センサの CW 側エッジから原点までのパルス数です。"],
  overrun_factor: ["Overrun of the origin sensor", "How many origin offsets homing runs past the sensor.", "原点センサ行き過ぎ量", "原点復帰でセンサを行き過ぎる量（原点オフセットの倍数）です。"],
  homing_retries: ["Homing retries", "How often a failed origin search is tried again.", "原点復帰リトライ回数", "失敗した原点サーチをやり直す回数です。"],
  stall_sensor_interval: ["STALL sensor interval", "Period of the dogs of the STALL sensor.", "脱調センサ間隔", "脱調センサのドグの周期です。"],
  stall_sensor_detection: ["STALL sensor detection", "Whether a missing dog ends a move with a STALL error.", "脱調センサ検出", "ドグが来ないとき脱調エラーで停止するかどうかです。"],
  start_speed_pps: ["Start speed", "Speed at which ramps begin.", "起動速度", "加減速が始まる速度です。"],
  maximum_speed_pps: ["Maximum speed", "Top speed of moves with the standard ramps.", "最高速度", "標準の加減速での最高速度です。"],
  acceleration_pps_s: ["Acceleration", "How fast the speed rises and falls.", "加速度", "速度が上下する割合です。"],
  rising_percent: ["S-share at the beginning", "Part of a ramp in which the acceleration rises.", "立ち上がり S 字率", "加速度が増えていく区間の割合です。"],
  falling_percent: ["S-share at the end", "Part of a ramp in which the acceleration falls.", "立ち下がり S 字率", "加速度が減っていく区間の割合です。"],
  encoder_multiplier: ["Encoder multiplier", "Edges counted for each line of the encoder.", "エンコーダ逓倍", "エンコーダ1本あたりに数えるエッジ数です。"],
  encoder_ratio: ["Encoder ratio", "Motor pulses for each encoder count.", "エンコーダ比", "エンコーダ1カウントあたりのモータパルス数です。"],
  encoder_stall_threshold: ["Encoder STALL threshold", "Difference of motor and encoder that is a step-out.", "脱調しきい値", "脱調とみなすモータとエンコーダの差です。"],
  encoder_stall_detection: ["Encoder STALL detection", "Whether a step-out ends a move with an error.", "エンコーダ脱調検出", "脱調したときエラーで停止するかどうかです。"],
  adjustment: ["Adjustment to the encoder", "Corrects the place by the encoder after a move.", "エンコーダ補正", "動作後、エンコーダで位置を補正します。"],
  adjustment_limit: ["Adjustment limit", "A larger adjustment is a STALL error.", "補正の上限", "これより大きい補正は脱調エラーです。"],
  adjustment_speed_pps: ["Adjustment speed", "0 is the start speed of speed set 30.", "補正速度", "0 は速度セット 30 の起動速度です。"],
  adjustment_delay_ms: ["Wait before adjustment", "Time between a move and its adjustment.", "補正までの待ち", "動作から補正までの時間です。"],
  operating_mode: ["Operating mode", "Stepping motor, stepping motor with encoder, or servo drive.", "動作モード", "ステッピング、エンコーダ付き、サーボのいずれかです。"],
  pulse_format: ["Pulse output", "Pulse and direction, or one line each for CW and CCW.", "パルス出力方式", "パルス＋方向、または CW／CCW の2線です。"],
  soft_limits: ["Soft limits", "Moves that would end outside are refused.", "ソフトリミット", "範囲外で終わる動作を拒否します。"],
  input_logic: ["Logic of inputs", "Normally open or closed, for each input.", "入力の論理", "入力ごとの A 接点／B 接点です。"],
  sensor_logic: ["Logic of sensors", "Normally open or closed, for sensors and the CLR output.", "センサの論理", "センサと CLR 出力の A 接点／B 接点です。"],
  noise_filters: ["Noise filters", "Equal samples, one each ms, that make a change of level.", "ノイズフィルタ", "変化とみなす連続一致回数（1 ms ごと）です。"],
  outputs: ["Outputs", "The general outputs as they are now.", "出力", "汎用出力の今の状態です。"],
  error_outputs: ["Error outputs", "Outputs that report errors.", "エラー出力", "エラーを知らせる出力です。"],
  interrupt_edges: ["Interrupt edges", "The edge of an input that interrupts.", "割り込みエッジ", "割り込みを起こす入力エッジです。"],
  interrupt_ranges: ["Interrupt ranges", "Where an interrupt is heeded.", "割り込み範囲", "割り込みが有効な範囲です。"],
  interrupt_records: ["Interrupt records", "Stored positions that take a value at an interrupt.", "割り込み記録", "割り込み時の値を入れる位置番号です。"],
  interrupt_pulses: ["Interrupt pulses", "The pulse that an interrupt gives on an output.", "割り込みパルス", "割り込み時に出力するパルスです。"],
  clear_pulse_ms: ["CLR pulse", "Length of the CLR signal; 0 gives none.", "CLR パルス", "CLR 信号の長さです。0 は出力なしです。"],
  robot_type: ["Robot type", "What kind of robot this body is a part of.", "ロボット形式", "このボディが属するロボットの形式です。"],
  driven_axis: ["Driven axis", "The axis of the robot that this body drives.", "駆動軸", "このボディが動かすロボットの軸です。"],
  arm_length_um: ["Arm length", "From the base to the elbow, and to the wrist.", "アーム長", "根元から肘、肘から手首までの長さです。"],
  finger_length_um: ["Finger length", "From the wrist to the end of the finger.", "フィンガ長", "手首からフィンガ先端までの長さです。"],
  pulses_per_turn: ["Pulses per turn", "Of each axis of the robot.", "1回転のパルス数", "ロボットの各軸の値です。"],
  position_index: ["Position index", "The number in the table of positions that stepping goes on from.", "位置番号", "位置テーブルを順に進む現在の番号です。"],
  comments: ["Comments", "Notes of up to 40 characters that the controller keeps.", "コメント", "コントローラが保持する 40 文字までのメモです。"],
  autostart: ["Autostart", "Whether the user program starts at power-on.", "自動起動", "電源投入時にプログラムを開始するかどうかです。"],
  // of a unit of a robot (C-HOST manual 2)
  smooth_acceleration: ["S-curve", "Speed rises and falls smoothly; of all axes of the unit.", "S 字加減速", "速度をなめらかに変えます。ユニットの全軸に共通です。"],
  speed_percent: ["Speed", "Per cent of the maximum speed, 0.1-100; 100 after power-on.", "速度", "最高速度に対する百分率、0.1～100。電源投入後は 100 です。"],
  maximum_speed: ["Maximum speed", "The speed that is 100 %.", "最高速度", "100 % にあたる速度です。"],
  acceleration_time_ms: ["Acceleration time", "In ms, 1-9999.", "加速時間", "ms、1～9999。"],
  deceleration_time_ms: ["Deceleration time", "In ms, 1-9999; a software stop takes so long.", "減速時間", "ms、1～9999。ソフトウェア停止にもこの時間がかかります。"],
  upper_soft_limit: ["Upper soft limit", "Moves that would end beyond it are refused.", "ソフトリミット上限", "これを超えて終わる動作を拒否します。"],
  lower_soft_limit: ["Lower soft limit", "Moves that would end below it are refused.", "ソフトリミット下限", "これを下回って終わる動作を拒否します。"],
  homing_type: ["Homing type", "0 to 5: with which sensors the axis finds its origin.", "原点復帰タイプ", "0～5。どのセンサで原点を見つけるかです。"],
  homing_offset: ["Homing offset", "From the origin found to the place that counts as 0.", "原点オフセット", "見つけた原点から 0 とする位置までの量です。"],
  homing_speed: ["Homing speed", "The speed of the search for the sensor.", "原点復帰速度", "センサを探す速度です。"],
  index_search_speed: ["Index search speed", "The slow speed of the last search.", "インデックス検索速度", "最後に探すときの低速です。"],
};

/** Its name and a sentence of help; the name of the interface where there is none. */
export function aboutSetting(name: string, language: Language): { title: string; help: string } {
  const found = ABOUT[name] ?? ABOUT[name.replace(/^motor_/, "")];
  if (!found) return { title: name, help: "" };
  const [en, enHelp, ja, jaHelp] = found;
  return language === "ja" ? { title: ja, help: jaHelp } : { title: en, help: enHelp };
}
