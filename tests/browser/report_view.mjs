// SPDX-License-Identifier: GPL-3.0-or-later
// Opens a report's page in headless Chromium, light and dark, wide and as on a phone: node report_view.mjs PAGE.html
// Exit status 0: no word on the console, nothing asked of the network, all pictures shown, nothing wider than the
// screen, dark where dark is preferred.
import { readFileSync } from "node:fs";
import { fail, show } from "./browser.mjs";

const [file] = process.argv.slice(2);
if (!file) fail("usage: report_view.mjs PAGE.html");
const harness = `<!doctype html><link rel="icon" href="data:,"><style>body { margin: 0 } iframe { border: 0 }</style>
<script>
async function look() {
  const answer = {};
  for (const width of [1200, 390]) {
    const frame = document.createElement("iframe");
    frame.width = width;
    frame.height = 800;
    frame.src = "/report.html";
    const loaded = new Promise((resolve) => (frame.onload = resolve));
    document.body.append(frame);
    await loaded;
    const page = frame.contentDocument, root = page.documentElement;
    answer[width] = {
      width: root.scrollWidth, height: root.scrollHeight, pictures: page.images.length,
      shown: [...page.images].filter((image) => image.naturalWidth > 0).length,
      plots: page.querySelectorAll("svg").length,
      background: frame.contentWindow.getComputedStyle(page.body).backgroundColor,
      asked: frame.contentWindow.performance.getEntriesByType("resource")
        .filter((entry) => !/^(data|blob):/.test(entry.name)).length };
    frame.remove();
  }
  await fetch("/answer", { method: "POST", body: JSON.stringify(answer) });
}
addEventListener("load", look);
</script><body></body>`;

const lightness = (color) => color.match(/\d+/g).slice(0, 3).reduce((sum, c) => sum + Number(c), 0) / (3 * 255);
for (const [scheme, flag] of [["light", 1], ["dark", 0]]) {
  const { answer, complaints } = await show("/", { "/": harness, "/report.html": readFileSync(file) },
    ["--window-size=1280,900", `--blink-settings=preferredColorScheme=${flag}`]);
  const wrong = [...complaints];
  for (const [wanted, found] of Object.entries(answer)) {
    if (found.width > Number(wanted)) wrong.push(`${found.width} pixels wide on a screen of ${wanted}`);
    if (found.shown < found.pictures || found.plots === 0)
      wrong.push(`${found.shown} of ${found.pictures} pictures, ${found.plots} plots`);
    if (found.asked > 0) wrong.push(`${found.asked} requests for more than the page`);
    if (lightness(found.background) > 0.5 !== (scheme === "light")) wrong.push(`background ${found.background}`);
    console.log(`${scheme}, ${wanted} pixels: ${found.height} high, ${found.shown} pictures, ${found.plots} plots, ` +
      found.background);
  }
  if (wrong.length > 0) fail(`${file}, ${scheme}:\n  ${wrong.join("\n  ")}`);
}
