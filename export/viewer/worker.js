// SPDX-License-Identifier: GPL-3.0-or-later
import { Engine, buffers_of } from "./engine.js";

const engine = new Engine();
self.onmessage = async ({ data: { id, name, argument } }) => {
  try {
    const answer = await engine[name](argument);
    self.postMessage({ id, answer }, buffers_of(answer));
  } catch (error) {
    self.postMessage({ id, error: String(error?.message ?? error) });
  }
};
