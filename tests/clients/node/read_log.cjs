// Reads a run log with @mcap/core, every CRC checked, and prints what it found.
//
//     read_log.cjs NODE_MODULES RUN.mcap FROM_NS TO_NS
//
// Prints one JSON object: messages per topic after the log's statistics, the
// status that the metadata record `run_end` gives, the last message of each topic
// as JSON, and the same for /step and /fields in a range of time. A log without
// a summary is streamed instead, up to where it ends. Exits with 1 and a message
// at the first thing that is not MCAP as it should be.

const { createRequire } = require("node:module");
const fs = require("node:fs/promises");
const path = require("node:path");

const [modules, log, fromNs, toNs] = process.argv.slice(2);
const from = createRequire(path.join(modules, "here.cjs"));
const { McapIndexedReader, McapStreamReader } = from("@mcap/core");
const { FileHandleReadable } = from("@mcap/nodejs");
const { loadDecompressHandlers, protobufFromBinaryDescriptor } = from("@mcap/support");

// A message as JSON; a binary one by the names of its fields, bytes as numbers.
function text({ encoding, name, data }, message) {
  if (encoding !== "protobuf") {
    return new TextDecoder().decode(message);
  }
  const type = protobufFromBinaryDescriptor(data).lookupType(name);
  return JSON.stringify(type.toObject(type.decode(message), { longs: Number, bytes: Array }));
}

async function take(messages, channels, schemas, found) {
  for await (const message of messages) {
    const { topic, schemaId } = channels.get(message.channelId);
    const entry = (found[topic] ??= { count: 0 });
    entry.count += 1;
    entry.last = text(schemas.get(schemaId), message.data);
  }
  return found;
}

async function indexed(file, decompressHandlers) {
  const readable = new FileHandleReadable(file);
  const reader = await McapIndexedReader.Initialize({ readable, decompressHandlers });
  const { channelsById: channels, schemasById: schemas } = reader;
  const counts = {};
  for (const [id, channel] of channels) {
    counts[channel.topic] = Number(reader.statistics.channelMessageCounts.get(id) ?? 0n);
  }
  const metadata = {};
  for await (const record of reader.readMetadata()) {
    metadata[record.name] = Object.fromEntries(record.metadata);
  }
  const attachments = [];
  for await (const attachment of reader.readAttachments({ validateCrcs: true })) {
    attachments.push(attachment.name);
  }
  const topics = ["/step", "/fields"];
  const range = { topics, startTime: BigInt(fromNs), endTime: BigInt(toNs) - 1n };
  return {
    counts,
    attachments,
    status: metadata.run_end?.status ?? null,
    all: await take(reader.readMessages({ validateCrcs: true }), channels, schemas, {}),
    slice: await take(reader.readMessages({ ...range, validateCrcs: true }), channels, schemas, {}),
  };
}

async function streamed(file, decompressHandlers) {
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  const [channels, schemas] = [new Map(), new Map()];
  const all = {};
  let status = null;
  for await (const bytes of file.createReadStream({ start: 0 })) {
    reader.append(bytes);
    for (let record; (record = reader.nextRecord()); ) {
      if (record.type === "Schema") {
        schemas.set(record.id, record);
      } else if (record.type === "Channel") {
        channels.set(record.id, record);
      } else if (record.type === "Message") {
        await take([record], channels, schemas, all);
      } else if (record.type === "Metadata" && record.name === "run_end") {
        status = record.metadata.get("status");
      }
    }
  }
  return { streamed: true, done: reader.done(), status, all };
}

async function main() {
  const decompressHandlers = await loadDecompressHandlers();
  const file = await fs.open(log);
  let found;
  try {
    found = await indexed(file, decompressHandlers);
  } catch (error) {
    // It says this of a log that was cut off; anything else is worse.
    if (!/not a valid MCAP|expected MCAP|magic|Footer/i.test(error.message)) {
      throw error;
    }
    found = { ...(await streamed(file, decompressHandlers)), refused: error.message };
  }
  console.log(JSON.stringify(found));
}

main().catch((error) => {
  console.error(`read_log: ${error.message}`);
  process.exitCode = 1;
});
