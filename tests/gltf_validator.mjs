// SPDX-License-Identifier: GPL-3.0-or-later
// Validates glTF files: node gltf_validator.mjs FILE... with the npm package gltf-validator under SUBVOL_NODE_MODULES.
// Prints every message; exit status 0 without errors, warnings and remarks, 1 with any, 77 without the package.
import { readFileSync } from "node:fs";
import { createRequire } from "node:module";
import { resolve } from "node:path";

let validator;
try {
  const folder = process.env.SUBVOL_NODE_MODULES;
  validator = createRequire(resolve(folder, "package.json"))(resolve(folder, "gltf-validator"));
} catch {
  process.exit(77);
}
let clean = process.argv.length > 2;
for (const path of process.argv.slice(2)) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(path)));
  const { numErrors, numWarnings, numInfos, numHints, messages } = report.issues;
  for (const message of messages) console.error(`${path}: ${message.code} ${message.pointer}: ${message.message}`);
  if (numErrors + numWarnings + numInfos + numHints > 0) clean = false;
}
process.exit(clean ? 0 : 1);
