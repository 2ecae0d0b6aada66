// Prints the rows of a Parquet file as JSON. Arguments: HYPARQUET FILE.
import {readFileSync} from "node:fs";
import {pathToFileURL} from "node:url";

const [library, file] = process.argv.slice(2);
const {parquetMetadata, parquetReadObjects} = await import(pathToFileURL(`${library}/src/index.js`));
const bytes = readFileSync(file);
const buffer = bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.byteLength);
const metadata = parquetMetadata(buffer);
const rows = await parquetReadObjects({file: buffer});
const text = JSON.stringify(
  {columns: metadata.schema.slice(1).map(c => [c.name, c.type]), groups: metadata.row_groups.length, rows},
  (_, value) => (typeof value === "bigint" ? {integer: String(value)} : value),
);
process.stdout.write(text);
