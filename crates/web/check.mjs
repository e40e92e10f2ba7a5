// node check.mjs rodfit_web.wasm FIT.toml [FILE..]: prints the report of a fit as the page has it, then its estimates
// with all digits. Scenes and data are further arguments.
import { readFile } from "node:fs/promises";
import { basename } from "node:path";
import { load } from "./rodfit.js";

const [wasm, ...paths] = process.argv.slice(2);
if (!wasm || paths.length === 0) {
  console.error("usage: node check.mjs rodfit_web.wasm FIT.toml [FILE..]");
  process.exit(2);
}
const fit = await load(await readFile(wasm));
const files = new Map();
for (const path of paths) files.set(basename(path), await readFile(path));
const { solved, failed } = fit(files, basename(paths[0]));
if (failed !== undefined) {
  console.error(failed);
  process.exit(1);
}
console.log(solved.text);
for (const { name, value, std_error: error } of solved.report.parameters) {
  console.log(name, value, error);
}
