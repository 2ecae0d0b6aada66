import {readFileSync} from "node:fs";
// Reads an MCAP file with @mcap/core, sequentially and by its indexes, all checksums included.
//   NODE_PATH=MODULES node read_mcap.mjs FILE   > {"library", "schemas", "channels", "statistics", …}
import {open} from "node:fs/promises";
import {createRequire} from "node:module";

// NODE_PATH is for require() alone.
const {McapIndexedReader, McapStreamReader} = createRequire(import.meta.url)("@mcap/core");
const path = process.argv[2];

const stream = new McapStreamReader({validateCrcs: true, includeChunks: true});
stream.append(readFileSync(path));
const kinds = {};
for (let record = stream.nextRecord(); record; record = stream.nextRecord())
  kinds[record.type] = (kinds[record.type] ?? 0) + 1;
if (!stream.done()) throw new Error("the file ends too early");

const file = await open(path);
const readable = {
  size: async () => BigInt((await file.stat()).size),
  read: async (offset, size) => {
    const bytes = new Uint8Array(Number(size));
    await file.read(bytes, 0, Number(size), Number(offset));
    return bytes;
  },
};
const reader = await McapIndexedReader.Initialize({readable});
const text = new TextDecoder("utf-8", {fatal: true});
const messages = [];
for await (const message of reader.readMessages({validateCrcs: true})) {
  messages.push({
    topic: reader.channelsById.get(message.channelId).topic,
    sequence: message.sequence,
    log: String(message.logTime),
    publish: String(message.publishTime),
    data: text.decode(message.data),
  });
}
// The later half by time, which leaves out the chunks before.
const middle = (reader.statistics.messageStartTime + reader.statistics.messageEndTime) / 2n;
let later = 0;
for await (const _ of reader.readMessages({startTime: middle})) later += 1;
const plain = value =>
  JSON.parse(
    JSON.stringify(value, (_, v) => (typeof v === "bigint" ? String(v) : v instanceof Map ? Object.fromEntries(v) : v)),
  );
const chunks = reader.chunkIndexes.map(chunk =>
  plain({
    first: chunk.messageStartTime,
    last: chunk.messageEndTime,
    size: chunk.uncompressedSize,
    channels: chunk.messageIndexOffsets,
  }),
);
process.stdout.write(
  JSON.stringify({
    library: reader.header.library,
    kinds,
    statistics: plain(reader.statistics),
    schemas: [...reader.schemasById.values()].map(s => ({
      id: s.id,
      name: s.name,
      encoding: s.encoding,
      data: text.decode(s.data),
    })),
    channels: [...reader.channelsById.values()].map(c => ({
      id: c.id,
      topic: c.topic,
      schema: c.schemaId,
      encoding: c.messageEncoding,
    })),
    chunks,
    later: {from: String(middle), count: later},
    messages,
  }),
);
await file.close();
