/** The words of a controller that may be another one. */

const en = {
  title: "Another controller?",
  compare: "Compare with last night",
  restore: "Restore last night's backup",
  positions: "Leave its positions as they are",
  kinds: {
    settings: "settings",
    "speed-sets": "speeds",
    patterns: "patterns",
    positions: "positions",
    memories: "memories",
    program: "program",
    variables: "variables",
  } as Record<string, string>,
  count: (count: number, kind: string) => `${count} ${count === 1 ? kind.replace(/s$/, "") : kind}`,
  differs: (counts: string) => `It differs from last night's backup in ${counts}.`,
  takes: (time: string, baud: number | null) => `A restore takes ${time}${baud ? ` at ${baud} baud` : ""}.`,
  faster: (baud: number) => `At ${baud} baud it takes less than half of that: set the link master, and the line in the configuration.`,
  left: (time: string) => `${time} left`,
  minutes: (minutes: number, seconds: number) => (minutes ? `${minutes} min ${seconds} s` : `${seconds} s`),
  verified: "It holds last night's backup: all was read back.",
};

const ja: typeof en = {
  title: "別のコントローラですか？",
  compare: "昨夜のバックアップと比較",
  restore: "昨夜のバックアップを復元",
  positions: "位置テーブルは変更しない",
  kinds: {
    settings: "設定",
    "speed-sets": "速度",
    patterns: "パターン",
    positions: "位置",
    memories: "メモリ",
    program: "プログラム",
    variables: "変数",
  },
  count: (count, kind) => `${kind}${count}件`,
  differs: (counts) => `昨夜のバックアップとの相違点：${counts}`,
  takes: (time, baud) => `復元には${baud ? `${baud} baudで` : ""}${time}かかります。`,
  faster: (baud) => `${baud} baudなら半分以下の時間で済みます。リンクマスタと構成ファイルの回線の速度を変更してください。`,
  left: (time) => `残り${time}`,
  minutes: (minutes, seconds) => (minutes ? `${minutes}分${seconds}秒` : `${seconds}秒`),
  verified: "昨夜のバックアップと一致します（読み戻して確認済み）。",
};

export const swap = { en, ja };
