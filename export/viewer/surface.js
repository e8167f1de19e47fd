// SPDX-License-Identifier: GPL-3.0-or-later
// The faces between shown cells and what is not shown, as arrays to draw.
import { KINDS } from "./cells.js";
import { NO_VALUE } from "./colors.js";
import { border, face_points, for_each_triangle, side_points } from "./mesh.js";

/// Grids of faces by number of corners, for one number of intervals.
function patterns(n) {
  return [3, 4].reduce((result, size) => {
    const triangles = [];
    for_each_triangle(size, n, (...corners) => triangles.push(...corners));
    const borders = Array.from({ length: size }, (_, k) => border(size, n, k));
    result[size] = { num_points: face_points(size, n), triangles, borders };
    return result;
  }, []);
}

/// Builds the surface of the shown cells.
///
/// field      to color by, {on, values}, or null.
/// all_sides  true: every side of every shown cell, with `centers` to shrink the cells toward.
/// returns    {positions, normals (curved cells only), centers, index, lines (index of segments), values, side_cells,
///            side_triangles (first of each side, and the end)}; null if there are more than max_sides sides.
export function build_surface(mesh, shown, { field = null, all_sides = false, max_sides = Infinity }) {
  const { kinds, neighbors, first_side, num_cells, intervals: n } = mesh,
    pattern = patterns(n);
  const is_drawn = (c, side) => {
    if (all_sides) return true;
    const other = neighbors[side];
    return other < 0 || !shown[other];
  };
  let num_sides = 0,
    num_points = 0,
    num_triangles = 0,
    num_lines = 0;
  for (let c = 0; c < num_cells; ++c) {
    if (!shown[c]) continue;
    const { faces } = KINDS[kinds[c]];
    for (let f = 0; f < faces.length; ++f) {
      if (!is_drawn(c, first_side[c] + f)) continue;
      ++num_sides;
      num_points += pattern[faces[f].length].num_points;
      num_triangles += pattern[faces[f].length].triangles.length / 3;
      num_lines += faces[f].length * n;
    }
  }
  if (num_sides > max_sides) return null;

  const positions = new Float32Array(3 * num_points),
    normals = n > 1 ? new Float32Array(3 * num_points) : null;
  const centers = all_sides ? new Float32Array(3 * num_points) : null,
    values = new Float32Array(num_points);
  const index = new Uint32Array(3 * num_triangles),
    lines = new Uint32Array(2 * num_lines);
  const side_cells = new Uint32Array(num_sides),
    side_triangles = new Uint32Array(num_sides + 1);
  const grid = new Uint32Array(pattern[4].num_points),
    { points, corners, first_corner } = mesh;
  let side_count = 0,
    point = 0,
    corner = 0,
    line = 0;
  for (let c = 0; c < num_cells; ++c) {
    if (!shown[c]) continue;
    const { faces, flat } = KINDS[kinds[c]];
    for (let f = 0; f < faces.length; ++f) {
      if (!is_drawn(c, first_side[c] + f)) continue;
      const face = faces[f],
        { triangles, borders } = pattern[face.length],
        size = side_points(mesh, c, f, grid);
      for (let k = 0; k < size; ++k) {
        const from = 3 * grid[k],
          to = 3 * (point + k);
        ((positions[to] = points[from]),
          (positions[to + 1] = points[from + 1]),
          (positions[to + 2] = points[from + 2]));
        values[point + k] = !field ? NO_VALUE : field.on === "cells" ? field.values[c] : field.values[grid[k]];
        if (centers) centers.set(mesh.centers.subarray(3 * c, 3 * c + 3), to);
      }
      for (let k = 0; k < triangles.length; ++k) index[corner++] = point + triangles[k];
      if (normals) add_normals(positions, normals, point, size, triangles);
      for (let k = 0; k < face.length; ++k) {
        // The faces on both sides of an edge have it in opposite directions: one of them draws it.
        const a = corners[first_corner[c] + face[k]],
          b = corners[first_corner[c] + face[(k + 1) % face.length]];
        if (a > b && !flat) continue;
        for (let t = 0; t < n; ++t) {
          lines[line++] = point + borders[k][t];
          lines[line++] = point + borders[k][t + 1];
        }
      }
      point += size;
      side_cells[side_count++] = c;
      side_triangles[side_count] = corner / 3;
    }
  }
  return { positions, normals, centers, index, lines: lines.slice(0, line), values, side_cells, side_triangles };
}

/// Adds unit normals of one face: sums of those of the triangles around its points, by area.
function add_normals(positions, normals, first, size, triangles) {
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 3 * (first + triangles[t]),
      b = 3 * (first + triangles[t + 1]),
      c = 3 * (first + triangles[t + 2]);
    const ux = positions[b] - positions[a],
      uy = positions[b + 1] - positions[a + 1],
      uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a],
      vy = positions[c + 1] - positions[a + 1],
      vz = positions[c + 2] - positions[a + 2];
    const x = uy * vz - uz * vy,
      y = uz * vx - ux * vz,
      z = ux * vy - uy * vx;
    for (const p of [a, b, c]) ((normals[p] += x), (normals[p + 1] += y), (normals[p + 2] += z));
  }
  for (let p = 3 * first; p < 3 * (first + size); p += 3) {
    const length = Math.hypot(normals[p], normals[p + 1], normals[p + 2]) || 1;
    ((normals[p] /= length), (normals[p + 1] /= length), (normals[p + 2] /= length));
  }
}
