// SPDX-License-Identifier: GPL-3.0-or-later
// The section of cells with a plane.
import { Earcut } from "three/src/extras/Earcut.js";
import { KINDS } from "./cells.js";
import { NO_VALUE } from "./colors.js";
import { face_points, for_each_triangle, side_points } from "./mesh.js";

/// Cuts the shown cells with the plane normal . x = offset. The triangles of a cell's faces meet the plane in segments,
/// which form closed loops: the outline of its section.
/// returns  {positions, values (per point), index, triangle_cells, lines (positions of segments)}
export function build_section(mesh, shown, { normal, offset }, field) {
  const { kinds, points, corners, first_corner, num_cells, intervals: n } = mesh,
    num_points = points.length / 3;
  const [nx, ny, nz] = normal,
    height = (p) => nx * points[3 * p] + ny * points[3 * p + 1] + nz * points[3 * p + 2] - offset;
  const drop = [nx, ny, nz].map(Math.abs).reduce((best, x, k, all) => (x > all[best] ? k : best), 0);
  const [u, v] = [0, 1, 2].filter((k) => k !== drop); // coordinates that tell points of the plane apart
  const pieces = [3, 4].reduce((result, size) => ({ ...result, [size]: pieces_of(size, n) }), {});
  const grid = new Uint32Array(face_points(4, n)),
    positions = [],
    values = [],
    index = [],
    triangle_cells = [],
    lines = [];
  const on_points = field?.on === "points";

  /// The point where the plane meets an edge, and its value.
  const meet = (p, q) => {
    const hp = height(p),
      t = hp / (hp - height(q)),
      at = [0, 1, 2].map((i) => points[3 * p + i] + t * (points[3 * q + i] - points[3 * p + i]));
    at.push(on_points ? field.values[p] + t * (field.values[q] - field.values[p]) : 0);
    return at;
  };

  for (let c = 0; c < num_cells; ++c) {
    if (!shown[c] || KINDS[kinds[c]].flat) continue;
    if (n === 1) {
      let below = false,
        above = false;
      for (let k = first_corner[c]; k < first_corner[c + 1]; ++k) {
        if (height(corners[k]) > 0) above = true;
        else below = true;
      }
      if (!below || !above) continue;
    }
    const met = new Map(); // by edge: its point, and the edges that its two segments lead to
    for (let f = 0; f < KINDS[kinds[c]].faces.length; ++f) {
      const size = KINDS[kinds[c]].faces[f].length;
      side_points(mesh, c, f, grid);
      for (const three of pieces[size].flatMap((piece) => triangles_of(piece, grid))) {
        const ends = [];
        for (let k = 0; k < 3; ++k) {
          const a = three[k],
            b = three[(k + 1) % 3],
            p = Math.min(a, b),
            q = Math.max(a, b);
          if (height(p) > 0 === height(q) > 0) continue;
          const key = p * num_points + q;
          if (!met.has(key)) met.set(key, { at: meet(p, q), next: [] });
          ends.push(key);
        }
        if (ends.length !== 2) continue;
        met.get(ends[0]).next.push(ends[1]);
        met.get(ends[1]).next.push(ends[0]);
      }
    }
    const own = field && !on_points ? field.values[c] : NO_VALUE;
    for (const loop of loops_of(met)) {
      const first = positions.length / 3;
      for (const [k, { at }] of loop.entries()) {
        const next = loop[(k + 1) % loop.length].at;
        positions.push(at[0], at[1], at[2]);
        values.push(on_points ? at[3] : own);
        lines.push(at[0], at[1], at[2], next[0], next[1], next[2]);
      }
      const corners_of_ears = Earcut.triangulate(
        loop.flatMap(({ at }) => [at[u], at[v]]),
        [],
        2
      );
      for (const k of corners_of_ears) index.push(first + k);
      for (let k = 0; k < corners_of_ears.length; k += 3) triangle_cells.push(c);
    }
  }
  return {
    positions: Float32Array.from(positions),
    values: Float32Array.from(values),
    index: Uint32Array.from(index),
    triangle_cells: Uint32Array.from(triangle_cells),
    lines: Float32Array.from(lines),
  };
}

/// The triangles and quads of a face's grid, by place in the grid.
function pieces_of(size, n) {
  const triangles = [];
  for_each_triangle(size, n, (...three) => triangles.push(three));
  if (size === 3) return triangles;
  return triangles.flatMap(([a, b, c], k) => (k % 2 === 0 ? [[a, b, c, triangles[k + 1][2]]] : []));
}

/// Triangles of a piece, as points. A quad is cut at its point of the lowest number: the cells on both sides of a
/// warped face must cut it in the same way, because there would be holes between their sections otherwise.
function triangles_of(piece, grid) {
  const [a, b, c, d] = piece.map((place) => grid[place]);
  if (piece.length === 3) return [[a, b, c]];
  return Math.min(a, c) < Math.min(b, d)
    ? [
        [a, b, c],
        [a, c, d],
      ]
    : [
        [b, c, d],
        [b, d, a],
      ];
}

/// The loops of points with two neighbors each.
function loops_of(met) {
  const loops = [];
  for (const [start, first] of met) {
    if (first.seen) continue;
    const loop = [];
    for (let key = start; key !== undefined; key = met.get(key).next.find((next) => !met.get(next).seen)) {
      met.get(key).seen = true;
      loop.push(met.get(key));
    }
    if (loop.length > 2) loops.push(loop);
  }
  return loops;
}
