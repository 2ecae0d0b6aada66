// Reads OTLP JSON lines with the message types that OpenTelemetry's own exporter was generated with.
//   NODE_PATH=MODULES node read_otlp.cjs FILE   > {"binary": bytes as protobuf, "lines": [TracesData, …]}
// Each line goes to protobuf and back and must come out the same: a name or a type that the format
// does not have is lost on that way.
const {deepStrictEqual} = require("node:assert");
const {readFileSync} = require("node:fs");
// Where protobufjs looks for it; without, it rounds 64-bit integers.
globalThis.Long = require("long");
const Request = require("@opentelemetry/otlp-transformer/build/src/generated/root.js").opentelemetry.proto.collector
  .trace.v1.ExportTraceServiceRequest;

const kIds = ["traceId", "spanId", "parentSpanId"];
// Ids are hexadecimal in this format, and base64 in protobuf's own JSON.
function recode(value, from, to) {
  if (Array.isArray(value)) return value.map(v => recode(v, from, to));
  if (value === null || typeof value !== "object") return value;
  return Object.fromEntries(
    Object.entries(value).map(([key, v]) => [
      key,
      kIds.includes(key) ? Buffer.from(v, from).toString(to) : recode(v, from, to),
    ]),
  );
}

let binary = 0;
const lines = readFileSync(process.argv[2], "utf8").split("\n");
deepStrictEqual(lines.pop(), "");
const read = lines.map(line => {
  const before = recode(JSON.parse(line), "hex", "base64");
  const bytes = Request.encode(Request.fromObject(before)).finish();
  binary += bytes.length;
  const after = Request.toObject(Request.decode(bytes), {longs: String, bytes: String, enums: Number});
  deepStrictEqual(JSON.parse(JSON.stringify(after)), before);
  return recode(after, "base64", "hex");
});
process.stdout.write(JSON.stringify({binary, lines: read}));
