// SPDX-License-Identifier: GPL-3.0-or-later
// Which cells are shown.
import { KINDS } from "./cells.js";
import { face_points, side_points } from "./mesh.js";

/// Returns one byte per cell, 1 where it is shown.
/// wish  {peel: layers taken off, cut: {normal, offset} or null: cells whose center lies beyond it are hidden,
///       range: {field, low, high} or null: cells with a value outside are hidden, hidden_regions: numbers,
///       around: {cell, rings} or null}
export function visible_cells(mesh, wish) {
  const shown = new Uint8Array(mesh.num_cells).fill(1),
    { layers, centers } = mesh;
  if (wish.peel > 0) for (let c = 0; c < shown.length; ++c) if (layers[c] <= wish.peel) shown[c] = 0;
  if (wish.cut) {
    const [x, y, z] = wish.cut.normal,
      d = wish.cut.offset;
    for (let c = 0; c < shown.length; ++c)
      if (x * centers[3 * c] + y * centers[3 * c + 1] + z * centers[3 * c + 2] > d) shown[c] = 0;
  }
  const filtered = wish.range && mesh.fields.find((field) => field.name === wish.range.field);
  if (filtered) {
    const { low, high } = wish.range,
      value = cell_value(mesh, filtered);
    for (let c = 0; c < shown.length; ++c) {
      const x = value(c);
      if (!(x >= low && x <= high)) shown[c] = 0;
    }
  }
  const regions = wish.hidden_regions?.length > 0 && mesh.fields.find((field) => field.map === "regions");
  if (regions) {
    const hidden = new Set(wish.hidden_regions);
    for (let c = 0; c < shown.length; ++c) if (hidden.has(regions.values[c])) shown[c] = 0;
  }
  if (wish.around) {
    const near = cells_around(mesh, wish.around.cell, wish.around.rings);
    for (let c = 0; c < shown.length; ++c) shown[c] &= near[c];
  }
  return shown;
}

/// A function that returns a cell's value of a field; if it belongs to points, the worst of all points of the cell.
export function cell_value(mesh, field) {
  if (field.on === "cells") return (c) => field.values[c];
  field.of_cells ??= worst_of_points(mesh, field);
  return (c) => field.of_cells[c];
}

function worst_of_points(mesh, { values, worst }) {
  const { kinds, corners, first_corner, num_cells, intervals: n } = mesh,
    result = new Float32Array(num_cells).fill(NaN);
  const grid = new Uint32Array(face_points(4, n));
  const add = (c, point) => {
    const x = values[point];
    if (!Number.isNaN(x) && !(worst === "high" ? x <= result[c] : x >= result[c])) result[c] = x;
  };
  for (let c = 0; c < num_cells; ++c) {
    if (n === 1) for (let k = first_corner[c]; k < first_corner[c + 1]; ++k) add(c, corners[k]);
    else
      KINDS[kinds[c]].faces.forEach((_, f) => {
        const size = side_points(mesh, c, f, grid);
        for (let k = 0; k < size; ++k) add(c, grid[k]);
      });
  }
  return result;
}

/// Cells that so many steps from cell to cell over common vertices reach.
function cells_around(mesh, cell, rings) {
  const { corners, first_corner, num_cells } = mesh,
    near = new Uint8Array(num_cells);
  const touched = new Uint8Array(mesh.num_vertices);
  near[cell] = 1;
  for (let ring = 0; ring < rings; ++ring) {
    for (let c = 0; c < num_cells; ++c)
      if (near[c]) for (let k = first_corner[c]; k < first_corner[c + 1]; ++k) touched[corners[k]] = 1;
    for (let c = 0; c < num_cells; ++c)
      for (let k = first_corner[c]; !near[c] && k < first_corner[c + 1]; ++k) near[c] = touched[corners[k]];
  }
  return near;
}

/// Of shown cells, those that are at most so many faces away from a hidden one or from the outside.
export function outer_layers(mesh, shown, layers) {
  const { neighbors, first_side, num_cells } = mesh,
    outer = new Uint8Array(num_cells);
  for (let layer = 1; layer <= layers; ++layer)
    for (let c = 0; c < num_cells; ++c) {
      if (!shown[c] || outer[c]) continue;
      for (let side = first_side[c]; side < first_side[c + 1]; ++side) {
        const d = neighbors[side];
        if (layer === 1 ? d < 0 || !shown[d] : d >= 0 && outer[d] === layer - 1) {
          outer[c] = layer;
          break;
        }
      }
    }
  return outer;
}
