// SPDX-License-Identifier: GPL-3.0-or-later
// Draws the pictures of the docs with the viewer, in headless Chromium:
//   node docs/pictures.mjs BUILD_FOLDER OUT_FOLDER [NAME ...]
// Commands run in a folder with the files of subvol_samples.
import { execFileSync } from "node:child_process";
import { mkdirSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join, resolve } from "node:path";
import { browser, show } from "../tests/browser/browser.mjs";

const SCALE = 2; // pixels per unit of length: lines and letters stay readable where a page shows pictures smaller
const half = (axis, position = 0.5, more = {}) => ({ cut: { on: true, axis, position, ...more } });

/// name -> {commands, size of a panel, panels}. A panel: {view: arguments of `subvol view`; set: state of the viewer;
/// turn: radians about the vertical axis and the horizontal one; zoom; legend: true draws the scale of colors}.
const starfish = { turn: [0.3, 0.55], zoom: 1.38 };
const PICTURES = {
  overview: {
    commands: [["fit", "starfish.off", "-o", "starfish.mesh"]],
    size: [250, 190],
    panels: [
      { view: ["starfish.off"], set: { edges: false, field: "" }, ...starfish },
      { view: ["starfish.mesh"], set: { field: "" }, ...starfish },
      { view: ["starfish.mesh"], set: half("z", 0.42), ...starfish },
    ],
  },
  rod: {
    commands: [["fit", "rod.obj", "-o", "rod.mesh"]],
    size: [700, 260],
    panels: [{ view: ["rod.mesh"], set: half("z", 0.8), turn: [0.2, 0.35], zoom: 1.8, legend: true }],
  },
  cage: {
    commands: [
      ["fit", "torus_target.off", "--template", "torus_template.mesh", "--levels", "2", "-o", "cage:torus_cage.mesh", "-o",
        "torus.mesh"],
    ],
    size: [240, 170],
    panels: [
      { view: ["torus_template.mesh"], set: { field: "" }, turn: [0.3, 0.5], zoom: 1.45 },
      { view: ["torus_cage.mesh", "--limit"], set: { field: "" }, turn: [0.3, 0.5], zoom: 1.45 },
      { view: ["torus.mesh"], set: half("z", 0.55), turn: [0.3, 0.5], zoom: 1.45 },
    ],
  },
  shells: {
    commands: [
      ["shell", "bracket_target.off", "--thickness", "4%", "--layers", "2", "--side", "both", "-o", "layers.mesh"],
      ["shell", "bowl.obj", "--thickness", "4%", "--layers", "2", "--side", "both", "-o", "bowl.mesh"],
    ],
    size: [360, 230],
    panels: [
      { view: ["layers.mesh"], set: { field: "", ...half("y", 0.53) }, turn: [0.3, 0], zoom: 1.3 },
      { view: ["bowl.mesh"], set: { field: "", ...half("y", 0.53) }, turn: [0.2, 0.25], zoom: 1.45 },
    ],
  },
  task_cage: {
    commands: [
      ["fit", "bracket_target.off", "--template", "bracket_template.mesh", "--levels", "2", "--crease-angle", "40", "-o",
        "cage:bracket_cage.mesh", "-o", "bracket.mesh"],
    ],
    size: [360, 230],
    panels: [
      { view: ["bracket_cage.mesh", "--limit"], set: { field: "" }, turn: [0.3, 0], zoom: 1.1 },
      { view: ["bracket.mesh"], set: half("y", 0.45), turn: [0.3, 0], zoom: 1.1, legend: true },
    ],
  },
  task_curve: {
    commands: [
      ["template", "split", "ball_template.mesh", "--into", "tets", "-o", "tets.mesh"],
      ["optimize", "tets.mesh", "--order", "3", "--target", "ball_target.off", "--tolerance", "0.1", "-o", "curved.vtu"],
    ],
    size: [240, 180],
    panels: [
      { view: ["tets.mesh"], set: { field: "" }, zoom: 1.1 },
      { view: ["curved.vtu"], set: { field: "" }, zoom: 1.1 },
      { view: ["curved.vtu"], set: half("x", 0.5), turn: [0.4, 0.2], zoom: 1.1 },
    ],
  },
  task_scan: {
    commands: [
      ["fit", "torus_points.xyz", "--template", "torus_template.mesh", "--levels", "2", "-o", "scan.mesh"],
    ],
    size: [360, 210],
    panels: [
      { view: ["scan.mesh"], set: { field: "" }, turn: [0.3, 0.5], zoom: 1.45 },
      { view: ["scan.mesh"], set: half("z", 0.55), turn: [0.3, 0.5], zoom: 1.45 },
    ],
  },
  task_repair: {
    commands: [["optimize", "tangled.mesh", "-o", "repaired.mesh"]],
    size: [360, 230],
    panels: [
      { view: ["tangled.mesh"], set: half("y", 0.5, { flat: false }), turn: [0.3, 0.1], zoom: 1.25, legend: true },
      { view: ["repaired.mesh"], set: half("y", 0.5, { flat: false }), turn: [0.3, 0.1], zoom: 1.25, legend: true },
    ],
  },
  task_shell: {
    commands: [
      ["shell", "bowl.obj", "--thickness", "4%", "--layers", "2", "--side", "outward", "-o", "mold.mesh", "-o", "mold.vtu"],
    ],
    size: [360, 230],
    panels: [
      { view: ["mold.vtu"], set: { field: "thickness" }, turn: [0.2, 0.25], zoom: 1.45, legend: true },
      { view: ["mold.mesh"], set: half("y", 0.53), turn: [0.2, 0.25], zoom: 1.45, legend: true },
    ],
  },
  template_refine: {
    commands: [
      ["template", "grid", "--box", "0", "0", "0", "4", "4", "4", "--counts", "4", "4", "4", "-o", "block.mesh"],
      ["template", "refine", "block.mesh", "--box", "2.9", "0", "2.9", "4", "1.1", "4", "-o", "corner.mesh"],
      ["template", "refine", "block.mesh", "--box", "0", "0", "2.9", "4", "4", "4", "-o", "side.mesh"],
    ],
    size: [360, 230],
    panels: [
      { view: ["corner.mesh"], set: { field: "" }, turn: [0.1, 0.1], zoom: 1.05 },
      { view: ["side.mesh"], set: { field: "", ...half("x", 0.6) }, turn: [0.1, 0.1], zoom: 1.05 },
    ],
  },
};

/// name -> {commands, size, page: a file that they write}. The page is drawn as a reader sees it who prefers dark colors.
const DARK_PAGES = {
  report_dark: {
    commands: [
      ["fit", "rod.obj", "-o", "rod.mesh", "--report", "rod.json"],
      ["report", "rod.json", "--no-viewer", "-o", "rod.html"],
    ],
    size: [1000, 1165],
    page: "rod.html",
  },
};

const [build, out, ...wanted] = process.argv.slice(2);
if (!build || !out) {
  console.error("usage: pictures.mjs BUILD_FOLDER OUT_FOLDER [NAME ...]");
  process.exit(2);
}
const subvol = resolve(build, "subvol"), folder = mkdtempSync(join(tmpdir(), "subvol-pictures-"));
execFileSync(resolve(build, "subvol_samples"), [folder]);
const run = (words) => execFileSync(subvol, words, { cwd: folder, stdio: ["ignore", "ignore", "inherit"] });
const done = new Set();
const is_wanted = (name) => wanted.length === 0 || wanted.includes(name);
/// Runs commands that have not run yet.
function run_new(commands) {
  for (const words of commands) {
    const key = words.join(" ");
    if (!done.has(key)) run([...words, "--force", ...(words[0] === "report" ? [] : ["--quiet"])]);
    done.add(key);
  }
}
mkdirSync(out, { recursive: true });

/// A page that opens the pages of the panels one after another and sends their pictures.
const harness = ({ size: [width, height], panels }) => `<!doctype html><link rel="icon" href="data:,">
<style>body { margin: 0 } iframe { border: 0; display: block }</style><body><script>
const panels = ${JSON.stringify(panels)}, all = document.createElement("canvas"), scale = ${SCALE};
all.width = ${width} * scale * panels.length;
all.height = ${height} * scale;
async function run() {
  const paper = all.getContext("2d");
  for (const [i, { set, turn = [0, 0], zoom = 1, legend }] of panels.entries()) {
    const frame = document.createElement("iframe");
    frame.width = ${width};
    frame.height = ${height};
    frame.src = "/" + i + ".html";
    const loaded = new Promise((resolve) => (frame.onload = resolve));
    document.body.replaceChildren(frame);
    await loaded;
    const page = await frame.contentWindow.subvolViewer;
    if (page.error) throw page.error;
    const { viewer } = page;
    page.use_theme(false);
    viewer.camera.home();
    viewer.camera.rotate(...turn);
    viewer.camera.distance /= zoom;
    await page.set({ marks: false, ...set });
    viewer.draw_now();
    paper.drawImage(legend ? page.picture() : viewer.canvas, i * ${width} * scale, 0);
  }
  return all.toDataURL("image/png");
}
run().catch((error) => "error: " + error.stack).then((answer) =>
  fetch("/answer", { method: "POST", body: JSON.stringify(answer) }));
</script></body>`;

for (const [name, picture] of Object.entries(PICTURES)) {
  if (!is_wanted(name)) continue;
  run_new(picture.commands);
  const files = { "/": harness(picture) };
  picture.panels.forEach(({ view }, i) => {
    run(["view", ...view, "-o", `${i}.html`, "--force"]);
    files[`/${i}.html`] = readFileSync(join(folder, `${i}.html`));
  });
  const { answer } = await show("/", files, [`--force-device-scale-factor=${SCALE}`, "--window-size=1600,1000"]);
  if (!answer.startsWith("data:image/png")) throw new Error(`${name}: ${answer}`);
  writeFileSync(join(out, `${name}.png`), Buffer.from(answer.split(",")[1], "base64"));
  console.log(`${name}.png`);
}
for (const [name, { commands, size, page }] of Object.entries(DARK_PAGES)) {
  if (!is_wanted(name)) continue;
  run_new(commands);
  execFileSync(browser(), ["--headless", "--no-sandbox", "--hide-scrollbars", "--blink-settings=preferredColorScheme=0",
    `--window-size=${size.join(",")}`, `--screenshot=${resolve(out, name)}.png`, `file://${join(folder, page)}`],
    { stdio: "ignore" });
  console.log(`${name}.png`);
}
rmSync(folder, { recursive: true });
