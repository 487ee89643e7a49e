// usage: node pack.mjs FOLDER OUTPUT: FOLDER/blockfactory.js and .wasm as one classic script, since a page of the file
// system may not fetch them.
import { readFileSync, writeFileSync } from "node:fs";
import { gzipSync } from "node:zlib";

const [folder, output] = process.argv.slice(2);
const script = readFileSync(`${folder}/blockfactory.js`, "utf8");
const wasm = gzipSync(readFileSync(`${folder}/blockfactory.wasm`), { level: 9 }).toString("base64");
writeFileSync(output, `var blockfactory = { engine: ${JSON.stringify({ script, wasm })} };\n`);
