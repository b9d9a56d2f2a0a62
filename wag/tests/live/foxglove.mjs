// Connects to a socket for Foxglove with Foxglove's own client, subscribes to every channel,
// tries to be more than a spectator, and prints what it saw as JSON.
// Arguments: address, topics to wait for.
import { createRequire } from "node:module";

const require = createRequire(process.env.WAG_NODE_MODULES + "/");
const { FoxgloveClient } = require("@foxglove/ws-protocol");
const WebSocket = require("ws");

const [url, ...awaited] = process.argv.slice(2);
const seen = { server: null, channels: {}, messages: {}, counts: {}, statuses: [] };
// The client's messages are the same in this later version of the protocol, which is the only one
// that the server speaks.
const client = new FoxgloveClient({ ws: new WebSocket(url, ["foxglove.sdk.v1"]) });
const subscribed = new Map();

client.on("error", (error) => {
  console.error(`cannot connect to ${url}: ${error.message ?? error}`);
  process.exit(1);
});
client.on("serverInfo", (info) => {
  seen.server = { name: info.name, capabilities: info.capabilities };
});
client.on("status", (status) => seen.statuses.push(status.message));
client.on("advertise", (channels) => {
  for (const { id, topic, encoding, schemaName, schema, schemaEncoding } of channels) {
    seen.channels[topic] = { encoding, schemaName, schemaEncoding, title: JSON.parse(schema).title };
    subscribed.set(client.subscribe(id), topic);
  }
  const stop = client.advertise({ topic: "/stop", encoding: "json", schemaName: "" });
  client.sendMessage(stop, new TextEncoder().encode("{}"));
  client.setParameters([{ name: "speed", value: 1 }]);
});
client.on("message", ({ subscriptionId, timestamp, data }) => {
  const topic = subscribed.get(subscriptionId);
  const message = JSON.parse(new TextDecoder().decode(data));
  seen.counts[topic] = (seen.counts[topic] ?? 0) + 1;
  if (Object.keys(seen.messages).length === 0) {
    console.error("it tells");
  }
  if (!(topic in seen.messages)) {
    seen.messages[topic] = { timestamp: timestamp.toString(), message };
  }
  if (awaited.every((topic) => topic in seen.messages)) {
    console.log(JSON.stringify(seen));
    process.exit(0);
  }
});
setTimeout(() => {
  console.log(JSON.stringify(seen));
  process.exit(2);
}, 30_000);
