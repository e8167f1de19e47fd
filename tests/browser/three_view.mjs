// SPDX-License-Identifier: GPL-3.0-or-later
// Loads .glb files with three.js in headless Chromium:
//   node three_view.mjs NODE_MODULES FILE.glb ... [--pictures FOLDER]
// Each must be there as a picture: no error, vertices' box on the screen where pixels are drawn, several colors; an
// animation must change it and end where it began to be. Exit status 0: all are.
import { existsSync, mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { basename, dirname, join } from "node:path";
import { fileURLToPath } from "node:url";
import { fail, folder, show, skip } from "./browser.mjs";

const LEAST_SHARE = 0.03, LEAST_HUES = 1, MOST_PIXELS_OFF = 3;
const words = process.argv.slice(2), at = words.indexOf("--pictures");
const pictures = at < 0 ? null : words.splice(at, 2)[1];
const [modules, ...files] = words;
const three = join(modules, "three");
if (!existsSync(three)) skip(`no three.js; npm install --prefix ${dirname(modules)} three`);
if (files.length === 0) fail("usage: three_view.mjs NODE_MODULES FILE.glb ... [--pictures FOLDER]");

const page = readFileSync(join(dirname(fileURLToPath(import.meta.url)), "three_page.html"));
for (const file of files) {
  const served = { "/": page, "/model.glb": readFileSync(file), "/three/": folder(three) };
  const { answer, complaints } = await show("/", served, ["--window-size=800,600"]);
  const wrong = [...answer.errors, ...complaints];
  if (answer.seen) {
    const { share, hues, box, sum } = answer.seen;
    const is_plain = !("color_map" in answer.extras);
    if (!(share > LEAST_SHARE)) wrong.push(`only ${100 * share} % of the picture is drawn`);
    if (!is_plain && hues < LEAST_HUES) wrong.push(`${hues} hues, expected ${LEAST_HUES}`);
    if (!box.every((edge, k) => Math.abs(edge - answer.projected[k]) <= MOST_PIXELS_OFF))
      wrong.push(`drawn in ${box}, vertices are in ${answer.projected}`);
    if (answer.steps.length > 0 && (new Set(answer.steps).size < 3 || answer.steps.at(-1) !== sum))
      wrong.push(`the animation does not go from one shape to another and end as the model: ${answer.steps}, ${sum}`);
    console.log(`${basename(file)}: ${(100 * share).toFixed(1)} % drawn, ${hues} hues, ` +
      `nodes ${answer.names.join(" ")}` + (answer.steps.length > 0 ? ", animated" : ""));
    if (pictures) {
      mkdirSync(pictures, { recursive: true });
      const picture = join(pictures, basename(file, ".glb") + ".png");
      writeFileSync(picture, Buffer.from(answer.picture.split(",")[1], "base64"));
    }
  }
  if (wrong.length > 0) fail(`${file}:\n  ${wrong.join("\n  ")}`);
}
