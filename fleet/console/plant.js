// The console of a plant: gateways, alarms and bodies of all, and one stop. What a gateway shows in detail
// stands in its own console, one tap away.

const WORDS = {
  en: {
    plant: "Plant", stopAll: "STOP ALL", signOut: "Sign out", gateways: "Gateways", alarms: "Alarms",
    bodies: "Bodies and robots", search: "Search", address: "Address", name: "Name", state: "State",
    position: "Position (pulses)", note: "Software stops do not replace a hardware stop.",
    online: "online", unheard: "not heard for {age}", never: "never heard", conflict: "two gateways have this name", lines: "lines: {lines}",
    moving: "moving", still: "stands still", offline: "does not answer", old: "as of {age} ago",
    confirmed: "Every controller of every gateway reports standstill.",
    stopping: "Stopping everything …", failed: "Nobody knows whether the stop was sent: {why}. Use the hardware stops.",
    summary: "{online} of {all} gateways online, {alarms} alarms", noAlarms: "None stands.",
    shown: "{shown} of {all}", serversAway: "; the servers of the plant are away, stops work nevertheless",
    away: "The plant process does not answer: what stands here is old.", openConsole: "console",
  },
  ja: {
    plant: "プラント", stopAll: "全停止", signOut: "サインアウト", gateways: "ゲートウェイ", alarms: "アラーム",
    bodies: "ボディとロボット", search: "検索", address: "アドレス", name: "名前", state: "状態",
    position: "位置（パルス）", note: "ソフトウェア停止はハードウェア停止の代わりになりません。",
    online: "接続中", unheard: "{age}応答なし", never: "応答なし", conflict: "同じ名前のゲートウェイが2台あります", lines: "回線: {lines}",
    moving: "動作中", still: "停止中", offline: "応答なし", old: "{age}前の値",
    confirmed: "すべてのゲートウェイの全コントローラが停止を報告しました。",
    stopping: "全停止中 …", failed: "停止指令が届いたか不明です: {why}。ハードウェア停止を使用してください。",
    summary: "ゲートウェイ {all}台中{online}台接続、アラーム{alarms}件", noAlarms: "発生していません。",
    shown: "{all}件中{shown}件", serversAway: "（プラントのサーバに届きません。停止は可能です）",
    away: "プラントのプロセスが応答しません。表示は古いものです。", openConsole: "コンソール",
  },
};
const SHOWN = 200; // rows of a search; more are counted
const GATEWAYS_MS = 2000, BODIES_MS = 10000;

let language = localStorage.getItem("language") ?? (navigator.language.startsWith("ja") ? "ja" : "en");
let gateways = [], alarms = [], things = [], servers = true, away = false;

const at = (id) => document.getElementById(id);
const say = (word, facts = {}) => WORDS[language][word].replace(/\{(\w+)\}/g, (_, name) => facts[name] ?? "");

function age(seconds) {
  const units = language === "ja" ? ["秒", "分", "時間"] : [" s", " min", " h"];
  if (seconds < 120) return `${Math.round(seconds)}${units[0]}`;
  return seconds < 7200 ? `${Math.round(seconds / 60)}${units[1]}` : `${Math.round(seconds / 3600)}${units[2]}`;
}

function made(tag, text = "", properties = {}) {
  return Object.assign(document.createElement(tag), { textContent: text, ...properties });
}

async function read(path) {
  const answer = await fetch(path, { headers: { "Accept-Language": language } });
  if (answer.status === 401) location.assign("sign-in");
  if (!answer.ok) throw new Error(`${path}: ${answer.status}`);
  return answer.json();
}

// what is shown

function showWords() {
  document.documentElement.lang = language;
  for (const it of document.querySelectorAll("[data-word]")) it.textContent = say(it.dataset.word);
  at("language").textContent = language === "ja" ? "English" : "日本語";
  at("language").lang = language === "ja" ? "en" : "ja";
}

function showSummary() {
  const online = gateways.filter((it) => it.state === "online").length;
  const told = say("summary", { online, all: gateways.length, alarms: alarms.length });
  at("summary").textContent = away ? say("away") : told + (servers ? "" : say("serversAway"));
  document.title = `${say("plant")}: ${at("summary").textContent}`;
}

function showGateways() {
  const alarmed = new Set(alarms.map((it) => it.gateway));
  at("gatewayCount").textContent = gateways.length;
  at("gateways").replaceChildren(...gateways.map((it) => {
    const heard = it.state === "online" && !it.conflict;
    const row = made("li", "", { className: heard ? (alarmed.has(it.name) ? "alarmed" : "") : "unheard" });
    const name = made("p");
    name.append(made("b", it.name), " ", made("a", say("openConsole"), { href: heard ? `gateways/${it.name}/` : it.url, target: "_blank", rel: "noreferrer" }));
    const told = it.conflict ? say("conflict") : heard ? say("online") : it.heard_age_s === null ? say("never") : say("unheard", { age: age(it.heard_age_s) });
    row.append(name, made("p", told), made("small", `${say("lines", { lines: it.lines.join(", ") })} · ${it.version ?? ""}`));
    return row;
  }));
}

function showAlarms() {
  at("alarmCount").textContent = alarms.length;
  const rows = alarms.slice(0, SHOWN).map((it) => {
    const row = made("li");
    const words = (it.ended_at && it.when_over ? it.when_over : it)[language];
    row.append(made("p", `${it.gateway} · ${new Date(it.raised_at).toLocaleString(language)}`));
    row.append(made("b", words.happened), made("p", words.motor), made("p", words.remedy));
    return row;
  });
  at("alarms").replaceChildren(...(rows.length ? rows : [made("li", say("noAlarms"))]));
}

function stateOf(thing) {
  if (thing.unheard) return say("old", { age: age(thing.heard_age_s) });
  if (!thing.online) return say("offline");
  return say(thing.moving ? "moving" : "still");
}

function showThings() {
  const words = at("search").value.toLowerCase().split(/\s+/).filter(Boolean);
  const found = things.filter((it) => words.every((word) => it.text.includes(word)));
  at("bodyCount").textContent = say("shown", { shown: Math.min(found.length, SHOWN), all: things.length });
  at("bodies").replaceChildren(...found.slice(0, SHOWN).map((it) => {
    const row = made("tr", "", { className: it.unheard ? "unheard" : "" });
    const known = it.unheard ? it.last_known : it;
    row.append(
      made("td", it.address), made("td", it.name ?? ""), made("td", stateOf(it), { className: "age" }),
      made("td", known.position === undefined || known.position === null ? "" : `${known.position}`, { className: "number" }),
    );
    return row;
  }));
}

// what is asked

async function refreshGateways() {
  try {
    const told = await read("gateways");
    [gateways, servers, away] = [told.gateways, told.servers.followed, false];
    gateways.sort((one, other) => one.name.localeCompare(other.name, "en", { numeric: true }));
  } catch {
    away = true;
  }
  showGateways();
  showSummary();
}

async function refreshAlarms() {
  alarms = (await read("alarms?standing=true&limit=1000")).alarms;
  showAlarms();
  showSummary();
}

async function refreshThings() {
  const [bodies, robots] = await Promise.all([read("bodies"), read("robots")]);
  things = [...bodies.bodies, ...robots.robots].map((it) => {
    const address = it.body_id ?? it.robot_id;
    return { ...it, address, text: `${address} ${it.name ?? ""}`.toLowerCase() };
  });
  showThings();
}

function again(work, milliseconds) {
  const next = () => work().catch((error) => console.warn(error)).finally(() => setTimeout(next, milliseconds));
  next();
}

function followAlarms() {
  const stream = new EventSource("events/stream?types=alarm.raised,alarm.reset");
  for (const type of ["alarm.raised", "alarm.reset"]) stream.addEventListener(type, () => void refreshAlarms());
}

// the stop

async function stopAll() {
  const place = at("stopped");
  place.hidden = false;
  place.className = "open";
  place.replaceChildren(made("p", say("stopping")));
  try {
    const answer = await fetch("stop", { method: "POST" });
    const told = await answer.json();
    const open = (told.gateways ?? []).filter((it) => it.state !== "confirmed");
    if (answer.ok) {
      place.className = "";
      place.replaceChildren(made("p", say("confirmed")));
    } else {
      const sentences = [told.detail, told.remedy, ...open.map((it) => `${it.gateway}: ${it.detail}`)];
      place.replaceChildren(...sentences.map((it) => made("p", it)));
    }
  } catch (error) {
    place.replaceChildren(made("p", say("failed", { why: error.message })));
  }
}

at("stop").addEventListener("click", stopAll);
at("search").addEventListener("input", showThings);
at("language").addEventListener("click", () => {
  language = language === "ja" ? "en" : "ja";
  localStorage.setItem("language", language);
  for (const show of [showWords, showGateways, showAlarms, showThings, showSummary]) show();
});
showWords();
again(refreshGateways, GATEWAYS_MS);
again(refreshThings, BODIES_MS);
again(refreshAlarms, BODIES_MS);
followAlarms();
