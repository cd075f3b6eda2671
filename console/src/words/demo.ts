/** The words of the panel that only a demo has. */

const en = {
  title: "Break something",
  what: "Only this demo has it. Begin a fault, see what the console tells, and find the way back to work.",
  where: "Where",
  kinds: {
    ems: "Press the stop circuit",
    limit: "Limit sensor on",
    power: "Cut the power",
    cable: "Pull the cable",
    driver: "Driver error",
    dead: "Dead controller",
    disk: "Full disk",
  } as Record<string, string>,
  end: "End all faults",
  notThere: "This fault is no fault of what is chosen.",
  broken: "Broken now",
  running: "Time since the fault",
  took: "Back to work after",
  seconds: (value: string) => `${value} s`,
  alarms: "What it has caused",
};

const ja: typeof en = {
  title: "故障を起こす",
  what: "デモだけの機能です。故障を起こし、表示を確認して、復旧の手順を試してください。",
  where: "対象",
  kinds: {
    ems: "非常停止入力をON",
    limit: "リミットセンサをON",
    power: "電源を切る",
    cable: "ケーブルを抜く",
    driver: "ドライバエラー",
    dead: "コントローラ無応答",
    disk: "ディスク満杯",
  },
  end: "すべての故障を終了",
  notThere: "選択した対象では起こせない故障です。",
  broken: "発生中の故障",
  running: "故障からの経過時間",
  took: "復旧までの時間",
  seconds: (value) => `${value} 秒`,
  alarms: "発生したアラーム",
};

export const demo = { en, ja };
