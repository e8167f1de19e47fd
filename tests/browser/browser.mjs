// SPDX-License-Identifier: GPL-3.0-or-later
// Shows a page in headless Chromium and waits for what it sends back.
import { spawn, spawnSync } from "node:child_process";
import { createServer } from "node:http";
import { mkdtempSync, readFileSync, rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";

const SECONDS_TO_START = 60, SECONDS_IN_ALL = 180;
const TYPES = { html: "text/html; charset=utf-8", js: "text/javascript", png: "image/png", glb: "model/gltf-binary" };

/// Ends as a test that cannot run here, with the status of tests/support/skipping.h.
export function skip(why) {
  console.log(`SKIPPED: ${why}`);
  process.exit(77);
}

export function fail(why) {
  console.error(why);
  process.exit(1);
}

/// The first of the browsers that is there.
export function browser() {
  for (const name of [process.env.SUBVOL_CHROMIUM, "chromium", "chromium-browser", "google-chrome"])
    if (name && spawnSync(name, ["--version"]).status === 0) return name;
  skip("no Chromium; apt-get install chromium");
}

/// Serves `files` (path -> text, Buffer, or a function of the path that returns one or null), opens `page` and returns
/// {answer, complaints}: the JSON that the page posts to /answer, and what the browser's console was told meanwhile.
/// flags: of the browser, as --window-size=800,600.
export async function show(page, files, flags = []) {
  const name = browser(), profile = mkdtempSync(join(tmpdir(), "subvol-browser-"));
  let asked = false, give;
  const answered = new Promise((resolve) => (give = resolve));
  const server = createServer((request, response) => {
    asked = true;
    const path = new URL(request.url, "http://localhost").pathname;
    if (request.method === "POST") {
      const parts = [];
      request.on("data", (part) => parts.push(part));
      request.on("end", () => (response.end(), give(JSON.parse(Buffer.concat(parts)))));
      return;
    }
    let content = null;
    for (const [prefix, value] of Object.entries(files))
      if (typeof value === "function" ? path.startsWith(prefix) : path === prefix)
        content = typeof value === "function" ? value(path.slice(prefix.length)) : value;
    response.writeHead(content === null ? 404 : 200, { "content-type": TYPES[path.split(".").pop()] ?? TYPES.html });
    response.end(content ?? "");
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const child = spawn(name, ["--headless", "--no-sandbox", "--disable-dev-shm-usage", "--no-first-run",
    "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--hide-scrollbars", "--enable-logging=stderr",
    `--user-data-dir=${profile}`, ...flags, `http://127.0.0.1:${server.address().port}${page}`],
    { stdio: ["ignore", "ignore", "pipe"], detached: true });
  let log = "";
  child.stderr.on("data", (text) => (log += text));
  const late = (seconds, what) => new Promise((resolve) => setTimeout(() => resolve(what), 1000 * seconds).unref());
  const started = late(SECONDS_TO_START, null).then(() => (asked ? new Promise(() => {}) : "never asked"));
  const answer = await Promise.race([answered, started, late(SECONDS_IN_ALL, "no answer")]);
  process.kill(-child.pid, "SIGKILL");  // and the processes it has started
  const has_ended = () => child.exitCode !== null || child.signalCode !== null;
  await new Promise((resolve) => (has_ended() ? resolve() : child.on("exit", resolve)));
  server.closeAllConnections();
  server.close();
  rmSync(profile, { recursive: true, force: true, maxRetries: 20, retryDelay: 100 });
  if (answer === "never asked") skip(`${name} does not start here:\n${log}`);
  if (answer === "no answer") fail(`the page has not answered after ${SECONDS_IN_ALL} s\n${log}`);
  return { answer, complaints: log.split("\n").filter((line) => line.includes(":CONSOLE")) };
}

/// Bytes of a file below a folder, for `files` of `show`.
export function folder(root) {
  return (path) => {
    try {
      return path.includes("..") ? null : readFileSync(join(root, path));
    } catch {
      return null;
    }
  };
}
