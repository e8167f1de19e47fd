// SPDX-License-Identifier: GPL-3.0-or-later
// Asks an engine in a worker, or in the page where workers are not allowed.
import { Engine } from "./engine.js";

/* global WORKER_SOURCE -- the bundled worker.js, put here by build.mjs */

/// Returns ask(name, argument), a promise of the engine's answer.
export function connect() {
  let worker;
  try {
    worker = new Worker(URL.createObjectURL(new Blob([WORKER_SOURCE], { type: "text/javascript" })));
  } catch {
    const engine = new Engine();
    return async (name, argument) => engine[name](argument);
  }
  const waiting = new Map();
  let last = 0;
  worker.onmessage = ({ data: { id, answer, error } }) => {
    const { resolve, reject } = waiting.get(id);
    waiting.delete(id);
    if (error) reject(new Error(error));
    else resolve(answer);
  };
  return (name, argument) =>
    new Promise((resolve, reject) => {
      waiting.set(++last, { resolve, reject });
      worker.postMessage({ id: last, name, argument });
    });
}
