// Answers SQL questions, one JSON string per line, with one JSON object per line. Argument: NODE_MODULES.
const {createRequire} = require("node:module");
const {createInterface} = require("node:readline");
const {DuckDBInstance} = createRequire(`${process.argv[2]}/`)("@duckdb/node-api");

const plain = value => typeof value === "bigint" ? {integer: String(value)} : value;

(async () => {
  const connection = await (await DuckDBInstance.create()).connect();
  for await (const line of createInterface({input: process.stdin})) {
    let answer;
    try {
      const reader = await connection.runAndReadAll(JSON.parse(line));
      answer = {rows: reader.getRows().map(row => row.map(plain))};
    } catch (error) {
      answer = {error: String(error)};
    }
    process.stdout.write(JSON.stringify(answer) + "\n");
  }
  process.exit(0);
})();
