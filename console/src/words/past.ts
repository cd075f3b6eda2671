/** The words of the plant as it was. */

const en = {
  title: "As it was",
  when: "Time",
  span: "Span",
  spans: { 600: "10 min", 3600: "1 h", 28800: "8 h", 86400: "24 h", 2592000: "30 days" } as Record<string, string>,
  by: (seconds: number) => `${seconds > 0 ? "+" : "−"}${Math.abs(seconds)} s`,
  known: (time: string) => `The journal goes back to ${time}.`,
  nothing: "Nothing had moved by then.",
  unreached: "did not answer",
  moving: "moved",
  standing: "stood still",
  noAlarms: "No alarm stood.",
  wire: (line: string) => `On the line ${line}, a second around it`,
  noWire: "The line's memory does not go back so far, or nothing went over it.",
};

const ja: typeof en = {
  title: "過去の状態",
  when: "時刻",
  span: "範囲",
  spans: { 600: "10分", 3600: "1時間", 28800: "8時間", 86400: "24時間", 2592000: "30日" },
  by: (seconds) => `${seconds > 0 ? "+" : "−"}${Math.abs(seconds)}秒`,
  known: (time) => `記録は${time}からあります。`,
  nothing: "この時刻までに動いたものはありません。",
  unreached: "応答なし",
  moving: "動作中",
  standing: "静止",
  noAlarms: "発生中のアラームはありませんでした。",
  wire: (line) => `回線${line}の前後1秒`,
  noWire: "回線の記録がここまで残っていないか、通信がありませんでした。",
};

export const past = { en, ja };
