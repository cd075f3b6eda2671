// Decodes payloads of Sparkplug B, one in hexadecimal a line, by a library of others: JSON, one a line.
const { get } = require("../../peers/node_modules/sparkplug-payload");
const payloads = get("spBv1.0");
const plain = (_key, value) => (typeof value === "bigint" || value?.constructor?.name === "Long" ? Number(value.toSigned?.() ?? value) : value);
for (const line of require("node:fs").readFileSync(0, "utf8").split("\n")) {
  if (line) console.log(JSON.stringify(payloads.decodePayload(Buffer.from(line, "hex")), plain));
}
