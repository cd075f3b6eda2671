// npm mqtt as an MES has it: sees a motor, moves it, repeats the command, is refused, and hears of the end.
// Arguments: the broker's address, the root. Prints what it has seen as one line of JSON.
"use strict";
const mqtt = require("mqtt");

const [url, root] = process.argv.slice(2);
const answers = `answers/${crypto.randomUUID()}`;
const move = { kind: "relative", direction: "cw", distance: { value: 40, unit: "pulse" } };
const heard = [];
const waiting = [];

const client = mqtt.connect(url, { protocolVersion: 5, reconnectPeriod: 0 });
client.on("message", (topic, payload, { retain, properties }) => {
  const correlation = properties?.correlationData?.toString();
  heard.push({ topic, content: JSON.parse(payload), retain, correlation, contentType: properties?.contentType });
  for (const look of waiting.splice(0)) look();
});
const until = (which) =>
  new Promise((resolve) => {
    const look = () => {
      const found = heard.find(which);
      if (found) resolve(found);
      else waiting.push(look);
    };
    look();
  });
const command = async (path, content, correlationData, expiry = { messageExpiryInterval: 10 }) => {
  const place = heard.length;
  const properties = { responseTopic: answers, correlationData: Buffer.from(correlationData), ...expiry };
  await client.publishAsync(`${root}/cmd/mes/${path}`, JSON.stringify(content), { qos: 1, properties });
  const isIt = (it) => it.topic === answers && it.correlation === correlationData && heard.indexOf(it) >= place;
  return (await until(isIt)).content;
};

client.on("connect", async () => {
  await client.subscribeAsync([`${root}/bodies/+/state`, `${root}/events/bodies/+/body.move.succeeded`, answers], { qos: 1 });
  const state = await until((it) => it.topic === `${root}/bodies/line1.3F/state`);
  const key = crypto.randomUUID();
  const first = await command("bodies/3F/moves?wait=20", move, key);
  const again = await command("bodies/3F/moves?wait=20", move, key);
  const refused = await command("bodies/3F/moves", move, crypto.randomUUID(), {});
  const ended = await until((it) => it.topic.endsWith("/body.move.succeeded") && it.content.correlationid === first.body.id);
  console.log(JSON.stringify({ state, first, again, refused, ended }));
  await client.endAsync();
});
