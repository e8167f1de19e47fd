// SPDX-License-Identifier: GPL-3.0-or-later
// Opens pages of the viewer in headless Chromium, light and dark, wide and as on a phone:
//   node viewer_view.mjs PAGE.html ... [--pictures FOLDER]
// Each must draw something that every control changes, fit the screen, ask nothing of the network and say nothing on
// the console. Exit status 0: all do; 77: the program was built without the viewer.
import { mkdirSync, readFileSync, writeFileSync } from "node:fs";
import { basename, join } from "node:path";
import { fail, show, skip } from "./browser.mjs";

const LEAST_SHARE = 0.02;
const words = process.argv.slice(2), at = words.indexOf("--pictures");
const pictures = at < 0 ? null : words.splice(at, 2)[1];
if (words.length === 0) fail("usage: viewer_view.mjs PAGE.html ... [--pictures FOLDER]");

const harness = `<!doctype html><link rel="icon" href="data:,"><style>body { margin: 0 } iframe { border: 0 }</style>
<script>
const errors = [];
/// Number of the picture, the share of it that is drawn, and the number of colors.
function look(viewer) {
  viewer.viewer.draw_now();
  const copy = document.createElement("canvas"), { canvas } = viewer.viewer;
  copy.width = 160;
  copy.height = 120;
  const paper = copy.getContext("2d", { willReadFrequently: true });
  paper.drawImage(canvas, 0, 0, 160, 120);
  const { data } = paper.getImageData(0, 0, 160, 120), colors = new Set();
  let number = 0, drawn = 0;
  for (let i = 0; i < data.length; i += 4) {
    const color = (data[i] << 16) | (data[i + 1] << 8) | data[i + 2];
    number = (Math.imul(number, 31) + color) >>> 0;
    if (data[i] !== data[0] || data[i + 1] !== data[1] || data[i + 2] !== data[2]) ++drawn;
    colors.add(color);
  }
  return { number, share: drawn / (160 * 120), colors: colors.size };
}

async function visit(width) {
  const frame = document.createElement("iframe"), answer = { changes: {} };
  frame.width = width;
  frame.height = 800;
  frame.src = "/page.html";
  const loaded = new Promise((resolve) => (frame.onload = resolve));
  document.body.append(frame);
  await loaded;
  const inside = frame.contentWindow;
  inside.addEventListener("error", (event) => errors.push(String(event.message)));
  inside.addEventListener("unhandledrejection", (event) => errors.push(String(event.reason)));
  const viewer = await inside.subvolViewer;
  if (viewer.error) throw viewer.error;
  const { info } = viewer.viewer.model;
  answer.first = look(viewer);
  answer.picture = viewer.picture().toDataURL("image/png");
  const { shown } = viewer.viewer.data;
  const begin = () => viewer.set({ shown, cut: { on: false }, peel: 0, shrink: 1, edges: true, faces: true,
    filter: { on: false }, limit: false, target: false });
  const key = (name, options = {}) => inside.document.querySelector("canvas").dispatchEvent(
    new inside.KeyboardEvent("keydown", { key: name, bubbles: true, cancelable: true, ...options }));
  const tries = {
    "a cut": async () => viewer.set({ cut: { on: true, axis: "y" } }),
    "a cut of whole cells": async () => viewer.set({ cut: { on: true, axis: "x", flat: false } }),
    "no edges": async () => viewer.set({ edges: false }),
    "the key of the edges": async () => key("e"),
    "a wireframe": async () => viewer.set({ faces: false }),
    "the arrow key": async () => key("ArrowLeft"),
    "another field": async () => viewer.set({ field: "edge_length" }),
  };
  if (info.has_inside) {
    tries["shrunk cells"] = async () => viewer.set({ shrink: 0.6 });
    tries["a filter"] = async () => {
      const { low, high } = viewer.viewer.field;
      await viewer.set({ filter: { on: true, low, high: low + (high - low) * 0.5 } });
    };
  }
  if (info.num_layers > 1) tries["a peeled layer"] = async () => viewer.set({ peel: 1 });
  if (viewer.viewer.target) tries["the target"] = async () => viewer.set({ target: true });
  if ("limit" in viewer.viewer.model.parts) tries["the limit surface"] = async () => viewer.set({ limit: true });
  const num_models = viewer.viewer.models.length;
  if (num_models > 1) tries["the slider"] = async () => viewer.set({ shown: num_models, wipe: 0.5 });
  if (viewer.viewer.worst.length > 0) tries["a flight to the worst cell"] = async () => {
    inside.document.querySelector(".worst button").click();
    await new Promise((resolve) => setTimeout(resolve, 700));
  };
  for (const [name, attempt] of Object.entries(tries)) {
    await begin();
    const before = look(viewer);
    await attempt();
    await new Promise((resolve) => setTimeout(resolve, 60));
    const after = look(viewer);
    answer.changes[name] = { is_other: before.number !== after.number, share: after.share };
  }
  await begin();
  viewer.viewer.camera.home();
  await viewer.set({ measuring: true, target: false });
  viewer.viewer.draw_now();
  const canvas = viewer.viewer.canvas;
  let hits = 0;  // two places where there is something
  for (let y = 0.3; y < 0.8 && hits < 2; y += 0.05)
    for (let x = 0.2; x < 0.8 && hits < 2; x += 0.1) {
      const hit = viewer.viewer.pick(x * canvas.clientWidth, y * canvas.clientHeight);
      if (!hit) continue;
      viewer.viewer.measure(hit.point);
      ++hits;
    }
  viewer.viewer.draw_now();
  answer.label = inside.document.querySelector(".label")?.textContent ?? "";
  const page = inside.document, root = page.documentElement;
  answer.width = root.scrollWidth;
  const asked = inside.performance.getEntriesByType("resource").map(({ name }) => name);
  answer.asked = asked.filter((name) => !/^(data|blob):/.test(name)).length;
  const controls = page.querySelectorAll(".subvol-viewer input, .subvol-viewer select, .subvol-viewer button");
  answer.unnamed = [...controls].filter(
    (control) => !(control.labels?.length > 0) && !control.textContent && !control.getAttribute("aria-label")).length;
  answer.frames = viewer.frames(5);
  frame.remove();
  return answer;
}

async function run() {
  const answer = { errors };
  try {
    for (const width of [1200, 390]) answer[width] = await visit(width);
  } catch (error) {
    errors.push(String(error.stack ?? error));
  }
  await fetch("/answer", { method: "POST", body: JSON.stringify(answer) });
}
addEventListener("load", run);
</script><body></body>`;

for (const file of words) {
  const page = readFileSync(file);
  if (!page.includes("subvol-viewer")) skip("the program was built without the viewer: no node, three or esbuild then");
  for (const [scheme, flag] of [["light", 1], ["dark", 0]]) {
    const { answer, complaints } = await show("/", { "/": harness, "/page.html": page },
      ["--window-size=1280,900", `--blink-settings=preferredColorScheme=${flag}`]);
    const wrong = [...answer.errors, ...complaints];
    for (const width of [1200, 390]) {
      const found = answer[width];
      if (!found) continue;
      if (found.width > width) wrong.push(`${found.width} pixels wide on a screen of ${width}`);
      if (!(found.first.share > LEAST_SHARE) || found.first.colors < 10)
        wrong.push(`${width}: ${100 * found.first.share} % drawn in ${found.first.colors} colors`);
      for (const [name, { is_other, share }] of Object.entries(found.changes))
        if (!is_other || share === 0) wrong.push(`${width}: ${name} does not change the picture, or nothing is left`);
      if (!/^[\d.e+-]+ /.test(found.label)) wrong.push(`${width}: measured "${found.label}"`);
      if (found.asked > 0) wrong.push(`${found.asked} requests for more than the page`);
      if (found.unnamed > 0) wrong.push(`${found.unnamed} controls without a name`);
      console.log(`${basename(file)}, ${scheme}, ${width} pixels: ${(100 * found.first.share).toFixed(1)} % drawn, ` +
        `${Object.keys(found.changes).length} controls, ${Math.max(...found.frames).toFixed(0)} ms a frame`);
      if (pictures) {
        mkdirSync(pictures, { recursive: true });
        writeFileSync(join(pictures, `${basename(file, ".html")}_${scheme}_${width}.png`),
          Buffer.from(found.picture.split(",")[1], "base64"));
      }
    }
    if (wrong.length > 0) fail(`${file}, ${scheme}:\n  ${wrong.join("\n  ")}`);
  }
}
