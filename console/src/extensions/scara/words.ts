/** The words of the pages of SCARA robots. */

const en = {
  turnSpeed: "Speed of turns",
  tapToGo: "Tap in the view to plan a way there. Nothing moves before Move.",
  noScara: (id: string) => `There is no SCARA robot ${id}.`,
  place: "Where the finger ends",
  angle: "Direction",
  view: "The arm from above",
  plan: "Plan",
  extend: "out",
  retract: "in",
  kinds: {
    line: "straight to a place",
    offset: "straight by an amount",
    extend: "extend",
    retract: "retract",
    rotate: "turn about a point",
    finger: "turn the finger",
    align: "align with a place",
    path: "along a stored path",
  },
  entries: {
    x: "X",
    y: "Y",
    angle: "Direction",
    radius: "Radius",
    distance: "Distance",
    path: "Path",
  },
  shortWays: "X and Y go in short ways, one after the other, while the key is held.",
};

const ja: typeof en = {
  turnSpeed: "回転速度",
  tapToGo: "図をタップすると経路を計画します。「移動」を押すまで動きません。",
  noScara: (id) => `スカラロボット ${id} はありません。`,
  place: "フィンガ先端の位置",
  angle: "向き",
  view: "上から見たアーム",
  plan: "計算だけ",
  extend: "伸",
  retract: "縮",
  kinds: {
    line: "指定位置へ直線",
    offset: "指定量だけ直線",
    extend: "伸ばす",
    retract: "縮める",
    rotate: "点を中心に回す",
    finger: "フィンガだけ回す",
    align: "位置の方向に向ける",
    path: "登録した経路",
  },
  entries: {
    x: "X",
    y: "Y",
    angle: "向き",
    radius: "半径",
    distance: "距離",
    path: "経路番号",
  },
  shortWays: "X と Y は、キーを押している間、短い動作を続けて行います。",
};

export const scaraWords = { en, ja };
