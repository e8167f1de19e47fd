// SPDX-License-Identifier: GPL-3.0-or-later
// The color scale with the numbers of cells above it, and handles for the range that is shown.
import { INVERTED, MAPS, at, region_color } from "./colors.js";

const HEIGHT = 64,
  BAR = 14;

/// Draws on a canvas as wide as it is on the page.
export function draw_histogram(canvas, field, state, ink) {
  const ratio = devicePixelRatio || 1,
    width = canvas.clientWidth || 280;
  canvas.width = width * ratio;
  canvas.height = HEIGHT * ratio;
  const paper = canvas.getContext("2d");
  paper.scale(ratio, ratio);
  paper.clearRect(0, 0, width, HEIGHT);
  const color_of = (x) => {
    if (field.map === "quality" && x <= 0) return INVERTED;
    return `rgb(${at(MAPS[state.map], (x - state.low) / (state.high - state.low || 1)).join(",")})`;
  };
  const { histogram, from, to } = field,
    most = Math.log1p(Math.max(1, ...histogram)),
    top = HEIGHT - BAR - 4;
  const step = width / histogram.length,
    value = (i) => from + ((i + 0.5) / histogram.length) * (to - from);
  histogram.forEach((count, i) => {
    const is_out = state.filter.on && (value(i) < state.filter.low || value(i) > state.filter.high);
    paper.globalAlpha = is_out ? 0.25 : 1;
    paper.fillStyle = ink;
    const height = (top * Math.log1p(count)) / most;
    paper.fillRect(i * step, top - height, Math.max(1, step - 1), height);
  });
  paper.globalAlpha = 1;
  for (let x = 0; x < width; ++x) {
    paper.fillStyle = color_of(from + ((x + 0.5) / width) * (to - from));
    paper.fillRect(x, HEIGHT - BAR, 1.5, BAR);
  }
}

/// Draws the legend for a picture: title, scale, ends.
export function draw_legend(paper, field, state, { x, y, width, ink, text }) {
  paper.fillStyle = ink;
  paper.font = `${text}px system-ui, sans-serif`;
  paper.textBaseline = "alphabetic";
  paper.fillText(field.label, x, y);
  if (field.regions) {
    field.regions.slice(0, 12).forEach((_, i) => {
      paper.fillStyle = region_color(i);
      paper.fillRect(x + i * text, y + 0.5 * text, 0.8 * text, 0.8 * text);
    });
    return;
  }
  for (let i = 0; i < width; ++i) {
    paper.fillStyle = `rgb(${at(MAPS[state.map], i / width).join(",")})`;
    paper.fillRect(x + i, y + 0.5 * text, 1.5, 0.7 * text);
  }
  paper.fillStyle = ink;
  paper.fillText(String(Number(state.low.toPrecision(4))), x, y + 2.3 * text);
  const high = String(Number(state.high.toPrecision(4)));
  paper.fillText(high, x + width - paper.measureText(high).width, y + 2.3 * text);
}
