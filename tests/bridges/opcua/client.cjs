// node-opcua-client as a far end: a line of JSON on stdin is a command, a line of JSON on stdout its answer.
"use strict";
const readline = require("node:readline");
const opcua = require("node-opcua-client");
const { OPCUACertificateManager } = require("node-opcua-certificate-manager");

const [folder, certificateFile, privateKeyFile] = process.argv.slice(2);
let client, session, subscription, own;
const events = [];
const values = [];

const plain = (value) => {
  if (value instanceof Date) return value.toISOString();
  if (Buffer.isBuffer(value)) return value.toString("latin1");
  if (value instanceof opcua.NodeId) return value.toString();
  if (value && value.constructor && value.constructor.name === "LocalizedText") return { text: value.text, locale: value.locale };
  if (value instanceof opcua.StatusCode) return value.name;
  if (Array.isArray(value) || ArrayBuffer.isView(value)) return Array.from(value, plain);
  if (value && typeof value === "object" && value.toJSON) return value.toJSON();
  return value;
};
const told = (data) => ({
  value: data.value ? plain(data.value.value) : null,
  status: data.statusCode.name,
  source: data.sourceTimestamp ? data.sourceTimestamp.toISOString() : null,
});
const id = (name) => (/^[ins]s?=/.test(name) && !name.startsWith("s=") ? name : `ns=${own};${name.startsWith("s=") ? name : `s=${name}`}`);

const commands = {
  async connect({ url, user, password, policy = "Basic256Sha256", mode = "SignAndEncrypt", locales, reconnects = 0 }) {
    const manager = new OPCUACertificateManager({ rootFolder: folder, automaticallyAcceptUnknownCertificate: true });
    await manager.initialize();
    client = opcua.OPCUAClient.create({
      applicationUri: "urn:test:client",
      applicationName: "client",
      certificateFile,
      privateKeyFile,
      clientCertificateManager: manager,
      securityMode: opcua.MessageSecurityMode[mode],
      securityPolicy: opcua.SecurityPolicy[policy],
      endpointMustExist: false,
      requestedSessionTimeout: 60000,
      localeIds: locales,
      connectionStrategy: { maxRetry: reconnects, initialDelay: 100, maxDelay: 500 },
    });
    await client.connect(url);
    const identity = user === undefined ? { type: opcua.UserTokenType.Anonymous } : { type: opcua.UserTokenType.UserName, userName: user, password };
    session = await client.createSession(identity);
    const namespaces = (await session.read({ nodeId: "i=2255", attributeId: opcua.AttributeIds.Value })).value.value;
    own = namespaces.indexOf("urn:motion-gateway");
    return namespaces;
  },
  async read({ nodes, maxAge = 0 }) {
    const data = await session.read(nodes.map((it) => ({ nodeId: id(it), attributeId: opcua.AttributeIds.Value })), maxAge);
    return data.map(told);
  },
  async write({ node, type, value }) {
    return (await session.write({ nodeId: id(node), attributeId: opcua.AttributeIds.Value, value: { value: { dataType: opcua.DataType[type], value } } })).name;
  },
  async browse({ node }) {
    const found = await session.browse({ nodeId: id(node), referenceTypeId: "HierarchicalReferences", browseDirection: opcua.BrowseDirection.Forward, includeSubtypes: true, nodeClassMask: 0, resultMask: 63 });
    return found.references.map((it) => ({ name: it.browseName.name, node: it.nodeId.toString(), type: it.typeDefinition ? it.typeDefinition.toString() : null, reference: it.referenceTypeId.toString() }));
  },
  async call({ object, method, inputs = [] }) {
    const result = await session.call({ objectId: id(object), methodId: id(method), inputArguments: inputs.map(([type, value]) => ({ dataType: opcua.DataType[type], value })) });
    return { status: result.statusCode.name, outputs: (result.outputArguments || []).map((it) => plain(it.value)), inputs: (result.inputArgumentResults || []).map((it) => it.name) };
  },
  async subscribe({ interval = 100 }) {
    subscription = await session.createSubscription2({ requestedPublishingInterval: interval, requestedLifetimeCount: 1000, requestedMaxKeepAliveCount: 20, maxNotificationsPerPublish: 0, publishingEnabled: true, priority: 1 });
    return subscription.subscriptionId;
  },
  async monitor({ nodes, sampling = 100 }) {
    const group = opcua.ClientMonitoredItemGroup.create(subscription, nodes.map((it) => ({ nodeId: id(it), attributeId: opcua.AttributeIds.Value })), { samplingInterval: sampling, queueSize: 10, discardOldest: true }, opcua.TimestampsToReturn.Both);
    group.on("changed", (item, data, index) => values.push({ node: nodes[index], ...told(data), at: Date.now() }));
    await new Promise((resolve) => group.on("initialized", resolve));
  },
  async watch({ fields, type = "i=2041" }) {
    const own_ = (name) => (name.startsWith("+") ? `${own}:${name.slice(1)}` : name);
    const filter = opcua.constructEventFilter(fields.map(own_), type === "i=2041" ? undefined : opcua.ofType(id(type)));
    filter.selectClauses.push(new opcua.SimpleAttributeOperand({ typeDefinitionId: "i=2782", browsePath: [], attributeId: opcua.AttributeIds.NodeId }));
    const item = await subscription.monitor({ nodeId: "i=2253", attributeId: opcua.AttributeIds.EventNotifier }, { samplingInterval: 0, queueSize: 1000, discardOldest: true, filter }, opcua.TimestampsToReturn.Both);
    item.on("changed", (found) => events.push(Object.fromEntries([...fields, "ConditionId"].map((name, at) => [name.replace("+", ""), plain(found[at].value)]))));
    return item.statusCode.name;
  },
  async refresh({ subscription: number }) {
    const result = await session.call({ objectId: "i=2782", methodId: "i=3875", inputArguments: [{ dataType: opcua.DataType.UInt32, value: number ?? subscription.subscriptionId }] });
    return result.statusCode.name;
  },
  async events() { return events.splice(0); },
  async values() { return values.splice(0); },
  async endpoints({ url }) {
    const it = opcua.OPCUAClient.create({ endpointMustExist: false, connectionStrategy: { maxRetry: 0 }, certificateFile, privateKeyFile, applicationUri: "urn:test:client" });
    await it.connect(url);
    const found = await it.getEndpoints();
    await it.disconnect();
    return found.map((one) => ({ policy: one.securityPolicyUri.split("#")[1], mode: opcua.MessageSecurityMode[one.securityMode], tokens: one.userIdentityTokens.map((token) => opcua.UserTokenType[token.tokenType]) }));
  },
  async close() {
    if (session) await session.close().catch(() => {});
    if (client) await client.disconnect();
    session = client = undefined;
  },
};

readline.createInterface({ input: process.stdin }).on("line", async (line) => {
  const { number, command, ...given } = JSON.parse(line);
  let answer;
  try {
    answer = { number, answer: (await commands[command](given)) ?? null };
  } catch (error) {
    answer = { number, error: error.message };
  }
  process.stdout.write(`${JSON.stringify(answer)}\n`);
}).on("close", () => process.exit(0));
