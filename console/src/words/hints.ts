/** What the tables of commands say of parameters, and the gateway of what it has not got, in Japanese. */

export const hints: Readonly<Record<string, string>> = {
  "Micrometres, between -1,000,000,000 and +1,000,000,000.": "マイクロメートル、-1,000,000,000～+1,000,000,000。",
  "Number of the set; left out: the standard set, 30.": "速度パラメータの組の番号。省略時は標準の30番。",
  "In mm, pulse or degree as each axis is set up. One value per axis in the order of the unit's axes; null leaves an axis as it is.":
    "各軸の設定に従い mm、パルスまたは度。ユニットの軸の順に1軸1値、null の軸は変更しません。",
  "Acceleration pattern; left out, number 30.": "加減速パターン。省略時は30番。",
  "Interrupt input, 8 or 9.": "割り込み入力、8 または 9。",
  "Axis 0-9, of which 0-2 are used.": "軸 0～9（使用するのは 0～2）。",
  "Pulses to move, or the table entry that holds them; `endless` runs until stopped.":
    "移動パルス数、またはそれを格納した位置テーブルの番号。endless は停止するまで動き続けます。",
  "0 off, 1 on.": "0 はオフ、1 はオン。",
  "Interpolation path 0-63.": "補間経路 0～63。",
  "Pulses.": "パルス数。",
  "Up to 13 letters, digits and underscores, without the `*`.": "英数字と下線、13文字以内。* は付けません。",
  "Address 0 to 6038.": "アドレス 0～6038。",
  "In mm/s, kpps or rpm as each axis is set up. One value per axis in the order of the unit's axes; null leaves an axis as it is.":
    "各軸の設定に従い mm/s、kpps または rpm。ユニットの軸の順に1軸1値、null の軸は変更しません。",
  "In milliseconds, 1-9999. One value per axis in the order of the unit's axes; null leaves an axis as it is.":
    "ミリ秒、1～9999。ユニットの軸の順に1軸1値、null の軸は変更しません。",
  "Angle between finger and X axis in thousandths of a degree.": "フィンガとX軸のなす角度（1/1000度）。",
  "X Y Z .. for a user axis, A B C .. for a motor axis, @ for theta.": "ユーザ軸は X Y Z …、モータ軸は A B C …、θは @。",
  "Number of the first position, 1-1999; left out, 1.": "先頭の位置番号、1～1999。省略時は 1。",
  "Number of the channel of eight bits, from 1.": "8ビットのチャンネルの番号、1 から。",
  "Position to move to, or the table entry that holds it. Encoder mode counts its own.":
    "移動先の位置、またはそれを格納した位置テーブルの番号。エンコーダモードではカウントです。",
  "What the output reports: `ems`, `limit` (CW or CCW), `stall`, or `any` of them.":
    "出力が知らせる内容: ems、limit（CW または CCW）、stall、またはそのいずれか（any）。",
  "Value to record in the position table; give this or `pulsed`.": "位置テーブルに記録する値。これか pulsed のどちらかを指定します。",
  "A one-shot pulse on an output; give this or `recorded`.": "出力のワンショットパルス。これか recorded のどちらかを指定します。",
  "General input, 0-9; left out, all.": "汎用入力 0～9。省略時はすべて。",
  "First position, below `upper`; encoder counts in encoder mode.": "先頭の位置（upper より小さい値、エンコーダモードではカウント）。",
  "Last position, in pulses or encoder counts.": "末尾の位置（パルスまたはエンコーダカウント）。",
  "Contact A is normally open, contact B normally closed.": "A接点は常開、B接点は常閉。",
  "Micrometres; 1 at first.": "マイクロメートル。初期値は 1。",
  "Via point 0-15.": "通過点 0～15。",
  "Percent of the acceleration or deceleration time; 50 at first.": "加速または減速時間に対する百分率。初期値は 50。",
  "Number of the change, 0 to 15.": "速度変更の番号、0～15。",
  "1 to 1,000,000 pps.": "1～1,000,000 pps。",
  "Data memory D0-D199, counter C0-C29 or timer T0-T29 (0.1 s).": "データメモリ D0～D199、カウンタ C0～C29、タイマ T0～T29（0.1秒）。",
  "Percent of the maximum speed, 0.1-100. One value per axis in the order of the unit's axes; null leaves an axis as it is.":
    "最高速度に対する百分率、0.1～100。ユニットの軸の順に1軸1値、null の軸は変更しません。",
  "How many, 1-1999; left out, all.": "個数、1～1999。省略時はすべて。",
  "Number of the variable, 0-99.": "変数の番号、0～99。",
  "Origin offsets to overrun, initially 2.": "オーバーランする原点オフセット数。初期値は 2。",
  "Further attempts, initially 0.": "再試行回数。初期値は 0。",
  "In pulses, initially 10.": "パルス数。初期値は 10。",
  "Position number, initially 0.": "位置番号。初期値は 0。",
  "Position or amount; left out, the present position is stored.": "位置または量。省略時は現在位置を格納します。",
  "In pulses per second.": "パルス毎秒。",
  "Number of the set; left out: that of the move's deceleration phase.": "速度パラメータの組の番号。省略時はその移動の減速区間の組。",
  "Encoder counts; `position` takes the present position over, divided by the PBS ratio.":
    "エンコーダカウント。position は現在位置を PBS の比で割った値を設定します。",
  "Pulses; `encoder` takes the encoder count over, multiplied by the PBS ratio.":
    "パルス数。encoder はエンコーダカウントに PBS の比を掛けた値を設定します。",
  "The bit to read; left out, all of them.": "読み出すビット。省略時はすべて。",
  "User comment 1-7; left out, the version.": "ユーザコメント 1～7。省略時はバージョン。",
  "Up to 40 printable ASCII characters but > and &; no @ first, no space first or last.":
    "印字可能な ASCII 文字、40文字以内（> と & を除く）。先頭に @、先頭と末尾に空白は使えません。",
  "General output, 0-15.": "汎用出力 0～15。",
  "General output, 0-15; give it together with `state`.": "汎用出力 0～15。state と一緒に指定します。",
  "State the output takes on an error, 0 or 1.": "エラー時の出力の状態、0 または 1。",
  "Position number that takes the value, 0-2047; with `recorded`.": "値を格納する位置番号、0～2047。recorded と一緒に指定します。",
  "General output that gives the pulse, 0-7.": "パルスを出す汎用出力 0～7。",
  "State during the pulse, 0 or 1.": "パルス中の状態、0 または 1。",
  "Length of the pulse in ms, 1-30000.": "パルスの長さ（ms）、1～30000。",
  "0 STALL, 1 ORG, 2 CW limit, 3 CCW limit, 4 INP, 5 EMS; left out, all.":
    "0 STALL、1 ORG、2 CWリミット、3 CCWリミット、4 INP、5 EMS。省略時はすべて。",
  "General output, 0-15, or `clear` for the CLR signal in mode 2; left out, all.":
    "汎用出力 0～15、またはモード2の CLR 信号は clear。省略時はすべて。",
  "General output, 0-15, or `clear` for the CLR signal in mode 2; with `on`.":
    "汎用出力 0～15、またはモード2の CLR 信号は clear。on と一緒に指定します。",
  "State of that output, 0 or 1.": "その出力の状態、0 または 1。",
  "All outputs at once, bit 0 is D0; instead of `bit` and `on`.": "全出力を一度に（ビット0 が D0）。bit と on の代わりに指定します。",
  "What the output reports: `ems`, `limit` (CW or CCW), `stall`, or `any` of them. Left out, all causes.":
    "出力が知らせる内容: ems、limit（CW または CCW）、stall、またはそのいずれか（any）。省略時はすべての要因。",
  "0-7 general inputs, 8 unused, 9 STALL, 10 ORG, 11 CW limit, 12 CCW limit, 13 INP, 14 EMS.":
    "0～7 汎用入力、8 未使用、9 STALL、10 ORG、11 CWリミット、12 CCWリミット、13 INP、14 EMS。",
  "0-7 general inputs, 8 unused, 9 STALL, 10 ORG, 11 CW limit, 12 CCW limit, 13 INP, 14 EMS; left out, all.":
    "0～7 汎用入力、8 未使用、9 STALL、10 ORG、11 CWリミット、12 CCWリミット、13 INP、14 EMS。省略時はすべて。",
  "Equal samples, one each ms, that make a change of level, 1-99; 1 filters nothing.":
    "レベルの変化とみなすまでに一致すべきサンプル数（1 ms ごと）、1～99。1 はフィルタなし。",
  "General input, 0-9; with `contact`.": "汎用入力 0～9。contact と一緒に指定します。",
  "All inputs, bit 0 is D0; a 1 is normally closed. Instead of `bit` and `contact`.":
    "全入力（ビット0 が D0）、1 は常閉。bit と contact の代わりに指定します。",
  "0 STALL, 1 ORG, 2 CW limit, 3 CCW limit, 4 INP, 5 EMS, 6 the CLR output; left out, all.":
    "0 STALL、1 ORG、2 CWリミット、3 CCWリミット、4 INP、5 EMS、6 CLR出力。省略時はすべて。",
  "0 STALL, 1 ORG, 2 CW limit, 3 CCW limit, 4 INP, 5 EMS, 6 the CLR output; with `contact`.":
    "0 STALL、1 ORG、2 CWリミット、3 CCWリミット、4 INP、5 EMS、6 CLR出力。contact と一緒に指定します。",
  "Bits: 0 STALL, 1 ORG, 2 CW limit, 3 CCW limit, 4 INP, 5 EMS, 6 the CLR output; a 1 is normally closed. Instead of `bit` and `contact`.":
    "ビット: 0 STALL、1 ORG、2 CWリミット、3 CCWリミット、4 INP、5 EMS、6 CLR出力。1 は常閉。bit と contact の代わりに指定します。",
  "Stepping motor, stepping motor with encoder, or servo drive.": "ステッピングモータ、エンコーダ付きステッピングモータ、またはサーボドライブ。",
  "1P, pulse and direction, or 2P, CW and CCW pulses.": "1P はパルスと方向、2P は CW と CCW のパルス。",
  "What event messages carry; empty for nothing.": "イベントメッセージの内容。空なら何も送りません。",
  "Position table, power-on settings, or user program.": "位置テーブル、電源投入時設定、またはユーザプログラム。",
  "Radius of the rounded corner in micrometres; 0 at the end of the path.": "角を丸める半径（マイクロメートル）。経路の終端では 0。",
  "`center`: the third joint is over the origin of coordinates.": "center は第3関節が座標原点の上にある状態。",
  "From axis 2 to the centre of the turn, in micrometres.": "軸2 から回転中心まで（マイクロメートル）。",
  "Three independent axes (such as RR730), or two with belts (such as RR701, the default).":
    "独立3軸（RR730 など）、またはベルト式2軸（RR701 など、初期値）。",
  "1 to 9,999,999.99 with up to eight decimals; 1 at first.": "1～9,999,999.99、小数点以下8桁まで。初期値は 1。",
  "1 to 1,000,000 pps; 50,000 at first.": "1～1,000,000 pps。初期値は 50,000。",
  "1 to 30,000 pps; 50 at first.": "1～30,000 pps。初期値は 50。",
  "1 to 10,000,000 pps/s; 100,000 at first.": "1～10,000,000 pps/s。初期値は 100,000。",
  "Edges counted per encoder line: two or four.": "エンコーダ1線あたりに数えるエッジ: 2 または 4。",
  "Motor pulses per encoder count, 1.00-99999.99, at most two decimals.":
    "エンコーダ1カウントあたりのモータパルス数、1.00～99999.99、小数点以下2桁まで。",
  "Difference between motor and encoder that is a step-out, in motor pulses, 0-3000.":
    "脱調とみなすモータとエンコーダの差（モータパルス）、0～3000。",
  "Most pulses an adjustment may take, 1-65535; beyond it is a STALL error.": "補正に使える最大パルス数、1～65535。超えると STALL エラー。",
  "In pps, 0-50000; 0 is the start speed (OL) of speed parameter set 30.": "pps、0～50000。0 は速度パラメータ30番の起動速度（OL）。",
  "Wait between the end of a move and the adjustment, in units of 10 ms, 0-999.": "移動終了から補正までの待ち時間（10 ms 単位）、0～999。",
  "Period of the dogs, from ON edge to ON edge, in pulses, 100-65535; checked every half of it.":
    "ドグの周期（オンエッジからオンエッジまでのパルス数）、100～65535。半周期ごとに確認します。",
  "Pulses after the start at which the change begins.": "変更を始める、起動からのパルス数。",
  "Pulses after the start at which the change is done.": "変更を終える、起動からのパルス数。",
  "Speed after the change, 1 to 1,000,000 pps.": "変更後の速度、1～1,000,000 pps。",
  "Speed parameter set of the acceleration, 0 to 29.": "加速に使う速度パラメータの組、0～29。",
  "Speed parameter set of the deceleration, 0 to 29.": "減速に使う速度パラメータの組、0～29。",
  "Ask for the 32 bits; left out, for the decimal value.": "32ビットで読み出します。省略時は10進値。",
  "A decimal value.": "10進値。",
  "32 bits, for a data memory only.": "32ビット。データメモリのみ。",
  "What a moving motor does first; left out, it moves on.": "移動中のモータがまず行うこと。省略時は動き続けます。",
  "An instruction of up to 32 characters without spaces, or `*` and a label of up to 13.":
    "空白のない32文字以内の命令、または * と13文字以内のラベル。",
  "1: a frame from body 7D tells the end of every move; 0: none does.": "1: 移動の終了をボディ 7D のフレームで知らせます。0: 知らせません。",
  "Virtual body number, 80 to 9E hexadecimal.": "仮想ボディ番号、16進の 80～9E。",
  "Body numbers, 00 to 77 hexadecimal, in the order of the replies.": "ボディ番号、16進の 00～77。応答の順に並べます。",
  "Number of the unit, from 1.": "ユニットの番号、1 から。",
  "2: most commands are silent; 3: every command is answered.": "2: 多くのコマンドに応答しません。3: すべてのコマンドに応答します。",
  "In the smallest amounts the axis displays; 1-255 in either direction.": "軸の表示の最小単位で、各方向に 1～255。",
  "0 encoder Z phase, 1 no Z phase, 2 and 3 the same without turning back at the sensor, 4 and 5 the same with the limit sensor for the origin sensor, 6 fast with Z phase. One value per axis in the order of the unit's axes; null leaves an axis as it is.":
    "0 エンコーダZ相あり、1 Z相なし、2 と 3 は同じでセンサでの折り返しなし、4 と 5 は同じで原点センサの代わりにリミットセンサ、6 高速でZ相あり。ユニットの軸の順に1軸1値、null の軸は変更しません。",
  "Number of the position, 1-1999; it has to be set.": "位置の番号、1～1999。設定済みであることが必要です。",
  "0: constant acceleration, 1: S-curve.": "0: 等加速度、1: S字。",
  "In pulses per second, 0-9999. One value per axis in the order of the unit's axes; null leaves an axis as it is.":
    "パルス毎秒、0～9999。ユニットの軸の順に1軸1値、null の軸は変更しません。",
  "Bit of the channel, 0-7.": "チャンネルのビット、0～7。",
  "Three capital letters or digits.": "英大文字または数字、3文字。",
  "Up to four numbers; null leaves one out.": "数値4個まで。null は省略を表します。",
  "Only in the operating mode servo.": "動作モードがサーボのときだけの設定です。",
  "Only in the operating mode encoder.": "動作モードがエンコーダ付きのときだけの設定です。",
  "Only in the operating mode stepping or servo.": "動作モードがステッピングかサーボのときだけの設定です。",
  "Only in the operating mode stepping or encoder or servo.": "動作モードがステッピング、エンコーダ付き、サーボのときだけの設定です。",
  "How far it goes was only known when it was done.": "どこまで動くかは、終わるまで分かりませんでした。",
  "Settings of the body may have changed since the move began.": "動作の開始後に、ボディの設定が変わった可能性があります。",
  "nobody on it answers; check the cable, the power of the RC-400 and of its bodies, and whether the baud rate is that of the RC-400's rotary switch (position 2: 9600)": "どのボディも応答しません。ケーブル、RC-400 とボディの電源、RC-400 のロータリスイッチと通信速度の一致（位置 2 は 9600）を確認してください",
  "what comes back is no reply; check whether the baud rate is that of the RC-400's rotary switch (position 2: 9600), then the cable": "受信した内容が応答になっていません。RC-400 のロータリスイッチと通信速度の一致（位置 2 は 9600）、次にケーブルを確認してください",
  "the RC-400 answers, and none of its bodies does; check their power, their cable and the body numbers on their rotary switches": "RC-400 は応答しますが、ボディはどれも応答しません。ボディの電源、ケーブル、ロータリスイッチのボディ番号を確認してください",
  "the robot does not answer; check the cable, its power, the baud rate, the terminator, and its communication mode": "ロボットが応答しません。ケーブル、電源、通信速度、ターミネータ、通信モードを確認してください",
  "the robot answers, but not MOD: it moves in mode 2, or its C-HOST is Ver.2, which has no other mode (C-HOST manual 1-7); stop it, or configure mode = 2": "ロボットは応答しますが、MOD に応答しません。モード 2 で動作中か、ほかのモードのない C-HOST Ver.2 です（C-HOST マニュアル 1-7）。停止するか、mode = 2 を設定してください",
  "what comes back is no answer; check the baud rate and the terminator, then the cable": "受信した内容が応答になっていません。通信速度とターミネータ、次にケーブルを確認してください",
};
