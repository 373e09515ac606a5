// Prints every message of an .mcap file: [topic, log time, values in the order of their definition], one JSON array a line.
// Usage: node read.cjs FOLDER_WITH_NODE_MODULES FILE. Numbers as the hexadecimal digits of a big-endian float64, NaN as "nan".
const { createRequire } = require("module");
const { open } = require("fs/promises");
const [modules, path] = process.argv.slice(2);
const from = createRequire(`${modules}/`);
const { McapIndexedReader } = from("@mcap/core");
const { MessageReader } = from("@foxglove/rosmsg2-serialization");
const { parse } = from("@foxglove/rosmsg");
const { decompress } = from("fzstd");

function hex(number) {
  if (Number.isNaN(number)) return "nan";
  const bytes = Buffer.alloc(8);
  bytes.writeDoubleBE(number);
  return bytes.toString("hex");
}

function flatten(value, into) {
  if (typeof value === "number") into.push(hex(value));
  else if (typeof value === "bigint") into.push(hex(Number(value)));
  else if (typeof value === "boolean") into.push(hex(value ? 1 : 0));
  else if (typeof value === "string") into.push(`"${value}`);
  else for (const inner of Array.isArray(value) || ArrayBuffer.isView(value) ? value : Object.values(value)) flatten(inner, into);
  return into;
}

async function main() {
  const file = await open(path);
  const readable = {
    size: async () => BigInt((await file.stat()).size),
    read: async (offset, length) => {
      const { buffer } = await file.read(Buffer.alloc(Number(length)), 0, Number(length), Number(offset));
      return new Uint8Array(buffer);
    },
  };
  const decompressHandlers = { zstd: (data, size) => decompress(data, new Uint8Array(Number(size))) };
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const decoders = new Map();
  const lines = [];
  for await (const message of reader.readMessages({ validateCrcs: true })) {
    const channel = reader.channelsById.get(message.channelId);
    if (!decoders.has(channel.id)) {
      const text = new TextDecoder().decode(reader.schemasById.get(channel.schemaId).data);
      decoders.set(channel.id, new MessageReader(parse(text, { ros2: true })));
    }
    const values = flatten(decoders.get(channel.id).readMessage(message.data), []);
    lines.push(JSON.stringify([channel.topic, String(message.logTime), ...values]));
  }
  process.stdout.write(lines.join("\n") + "\n");
  await file.close();
}

main();
