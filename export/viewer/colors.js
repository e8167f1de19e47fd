// SPDX-License-Identifier: GPL-3.0-or-later
// Color maps, as lists of sRGB colors at equal steps.

/// Stands for "no value here" on the way to the shader, which tells it by its size.
export const NO_VALUE = 1e38;

/// The color of values of quality at 0 and below: it is in none of the maps.
export const INVERTED = "#d55e00";

export const MAPS = {
  viridis: ["#440154", "#472d7b", "#3b528b", "#2c728e", "#21918c", "#28ae80", "#5ec962", "#addc30", "#fde725"],
  magma: ["#1d1147", "#51127c", "#832681", "#b73779", "#e75263", "#fc8961", "#fec488", "#fcfdbf"],
  "blue to red": ["#3b4cc0", "#7b9ff9", "#c0d4f5", "#f2cbb7", "#ee8468", "#b40426"],
  gray: ["#303030", "#f0f0f0"],
};

const REGION_COLORS = [
  "#4e79a7",
  "#f28e2b",
  "#59a14f",
  "#e15759",
  "#76b7b2",
  "#edc948",
  "#b07aa1",
  "#ff9da7",
  "#9c755f",
  "#86bcb6",
  "#d37295",
  "#a0cbe8",
];
export const region_color = (place) => REGION_COLORS[place % REGION_COLORS.length];

/// Red, green, blue from 0 to 255 of a color like #d55e00.
export const rgb = (text) => [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16));

/// Color of a map at t in [0, 1].
export function at(stops, t) {
  const x = Math.max(0, Math.min(1, t)) * (stops.length - 1),
    k = Math.min(Math.floor(x), stops.length - 2);
  const low = rgb(stops[k]),
    high = rgb(stops[k + 1]);
  return low.map((c, i) => Math.round(c + (x - k) * (high[i] - c)));
}
