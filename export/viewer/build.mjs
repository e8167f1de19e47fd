// SPDX-License-Identifier: GPL-3.0-or-later
// Bundles the viewer and three.js into one script, and writes that as a C++ source: node build.mjs MODULES OUT.cpp
// MODULES: the folder of npm that holds esbuild and three.
import { createRequire } from "node:module";
import { writeFileSync } from "node:fs";
import { dirname, join, resolve } from "node:path";
import { fileURLToPath } from "node:url";

const [modules, out] = process.argv.slice(2).map((path) => resolve(path));
const esbuild = createRequire(join(modules, "of_modules.js"))("esbuild");
const here = dirname(fileURLToPath(import.meta.url));

async function bundle(entry, define) {
  const result = await esbuild.build({
    entryPoints: [join(here, entry)],
    bundle: true,
    minify: true,
    write: false,
    format: "iife",
    target: "es2021",
    charset: "ascii",
    legalComments: "inline",
    nodePaths: [modules],
    loader: { ".css": "text" },
    define,
    logLevel: "error",
  });
  return result.outputFiles[0].text;
}

const worker = await bundle("worker.js", {});
// The script stands inside an element of HTML: nothing in it may end that element.
const script = (await bundle("main.js", { WORKER_SOURCE: JSON.stringify(worker) }))
  .replace(/<\/(script)/gi, "<\\/$1")
  .replace(/<!--/g, "<\\!--");

const PIECE = 8000; // characters of one literal
const literals = [];
for (let i = 0; i < script.length; i += PIECE) literals.push(`R"subvol(${script.slice(i, i + PIECE)})subvol"`);
writeFileSync(
  out,
  `// Made by export/viewer/build.mjs.
#include "export/viewer_script.h"

namespace subvol::internal {

std::string_view viewer_script() {
  static constexpr char kScript[] =
${literals.join("\n")};
  return {kScript, sizeof kScript - 1};
}

}  // namespace subvol::internal
`
);
console.log(`${out}: ${script.length} characters`);
