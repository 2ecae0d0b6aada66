// Runs SQL over a trace with Perfetto's own trace_processor, compiled to WebAssembly.
//   node trace_processor.mjs ASSETS TRACE   < {"name": "select ...", ...}   > {"name": [rows], ...}
// ASSETS: folder with trace_processor.wasm, engine_bundle.node.js and engine.mjs.
import {readFileSync} from "node:fs";
import {join, resolve} from "node:path";
import {pathToFileURL} from "node:url";
import vm from "node:vm";

const [assets, trace] = process.argv.slice(2);
const queries = JSON.parse(readFileSync(0, "utf8"));
console.warn = console.log = () => {}; // the engine chats; standard output carries the answer

// The glue was written for a browser's worker: it gets a scope, the wasm bytes, and hands out its bridge.
globalThis.self = globalThis;
globalThis.WorkerGlobalScope = class {};
globalThis.location = {href: `${pathToFileURL(resolve(assets)).href}/`};
globalThis.wasmBytes = new Uint8Array(readFileSync(join(assets, "trace_processor.wasm")));
let glue = readFileSync(join(assets, "engine_bundle.node.js"), "utf8");
for (const [from, to] of [
  ["this.useMemory64 = hasMemory64Support();", "this.useMemory64 = false;"],
  ["locateFile: (s) => s,", "locateFile: (s) => s, wasmBinary: globalThis.wasmBytes,"],
  ["new wasm_bridge_1.WasmBridge();", "(globalThis.bridge = new wasm_bridge_1.WasmBridge());"],
]) {
  if (!glue.includes(from)) throw new Error(`the glue has changed: no "${from}"`);
  glue = glue.replace(from, to);
}
vm.runInThisContext(glue);

const {EngineBase} = await import(pathToFileURL(resolve(assets, "engine.mjs")).href);
const channel = new MessageChannel();
class Engine extends EngineBase {
  mode = "WASM";
  id = "test";
  rpcSendRequestBytes(bytes) {
    channel.port2.postMessage(bytes);
  }
  [Symbol.dispose]() {}
}
const engine = new Engine();
channel.port2.onmessage = message => engine.onRpcResponseBytes(message.data);
while (globalThis.bridge.reqBufferAddr === 0) await new Promise(done => setTimeout(done, 10));
globalThis.bridge.initialize(channel.port1);

const bytes = new Uint8Array(readFileSync(trace));
const step = 32 << 20;
for (let at = 0; at < bytes.length; at += step) await engine.parse(bytes.slice(at, at + step));
await engine.notifyEof();

const answers = {};
for (const [name, sql] of Object.entries(queries)) {
  const result = await engine.query(sql);
  if (result.error()) throw new Error(`${name}: ${result.error()}`);
  answers[name] = [];
  for (const row = result.iter({}); row.valid(); row.next()) {
    const cells = result.columns().map(column => row.get(column));
    answers[name].push(cells.map(cell => (typeof cell === "bigint" ? Number(cell) : cell)));
  }
}
process.stdout.write(JSON.stringify(answers), () => process.exit(0));
