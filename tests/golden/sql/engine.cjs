// Answers SQL statements, one JSON string per line, with one JSON object per line. Arguments: NODE_MODULES, duckdb or
// clickhouse.
const {createRequire} = require("node:module");
const {createInterface} = require("node:readline");
const load = createRequire(`${process.argv[2]}/`);

const engines = {
  async duckdb() {
    const connection = await (await load("@duckdb/node-api").DuckDBInstance.create()).connect();
    const plain = value => typeof value === "bigint" ? {integer: String(value)} : value;
    return async sql => {
      const rows = (await connection.runAndReadAll(sql)).getRows();
      return JSON.stringify({rows: rows.map(row => row.map(plain))});
    };
  },
  async clickhouse() {
    const session = new (load("chdb").Session)();
    process.on("exit", () => session.cleanup());
    return async sql => `{"rows": ${session.query(sql, "JSONCompactEachRow").trim().split("\n").filter(Boolean)
      .reduce((rows, row) => rows + (rows === "[" ? "" : ",") + row, "[")}]}`;
  },
};

engines[process.argv[3]]().then(async ask => {
  for await (const line of createInterface({input: process.stdin})) {
    let answer;
    try {
      answer = await ask(JSON.parse(line));
    } catch (error) {
      answer = JSON.stringify({error: String(error)});
    }
    process.stdout.write(answer + "\n");
  }
  process.exit(0);
});
