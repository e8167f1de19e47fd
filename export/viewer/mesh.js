// SPDX-License-Identifier: GPL-3.0-or-later
// A mesh in memory: its cells, who their neighbors are, and the points of their curved faces.
import { FACE_EDGES, KINDS } from "./cells.js";
import { decode } from "./data.js";

/// Decodes a mesh of the page. Points are numbered [vertices][inside edges][inside faces]; straight cells have vertices
/// only. A face of a cell is a "side", numbered cell by cell.
export async function open_mesh(data) {
  const mesh = {
    name: data.name,
    intervals: data.intervals,
    num_vertices: data.num_vertices,
    num_edges: data.num_edges,
    points: await decode(data.points),
    corners: await decode(data.corners),
    cell_edges: await decode(data.edges),
    cell_faces: await decode(data.faces),
    inverted: (await decode(data.inverted)) ?? new Uint32Array(0),
    undecided: (await decode(data.undecided)) ?? new Uint32Array(0),
    fields: [],
  };
  const kinds = await decode(data.kinds);
  mesh.num_cells = data.num_cells;
  mesh.kinds = new Uint8Array(data.num_cells);
  if (kinds) mesh.kinds.set(kinds);
  else mesh.kinds.fill(data.kind);
  mesh.first_corner = offsets(mesh.kinds, (kind) => kind.corners);
  mesh.first_side = offsets(mesh.kinds, (kind) => kind.faces.length);
  mesh.first_edge = offsets(mesh.kinds, (kind) => kind.edges.length);
  for (const field of data.fields) mesh.fields.push({ ...field, values: await decode(field.values) });
  mesh.neighbors = find_neighbors(mesh);
  mesh.layers = find_layers(mesh);
  mesh.centers = find_centers(mesh);
  add_measures(mesh);
  if (mesh.intervals > 1) mesh.first_face_point = find_face_points(mesh);
  return mesh;
}

function offsets(kinds, size) {
  const sizes = KINDS.map(size),
    result = new Uint32Array(kinds.length + 1);
  for (let c = 0; c < kinds.length; ++c) result[c + 1] = result[c] + sizes[kinds[c]];
  return result;
}

/// The cell on the other side of each side, or -1. Sides with the same corners are found by a hash of these.
function find_neighbors(mesh) {
  const { kinds, corners, first_corner, first_side, num_cells } = mesh,
    num_sides = first_side[num_cells];
  const neighbors = new Int32Array(num_sides).fill(-1);
  let size = 1024;
  while (size < num_sides) size *= 2;
  const heads = new Int32Array(size).fill(-1),
    next = new Int32Array(num_sides),
    owners = new Uint32Array(num_sides);
  const low = new Uint32Array(num_sides),
    middle = new Uint32Array(num_sides),
    high = new Uint32Array(num_sides);
  for (let c = 0; c < num_cells; ++c) {
    const kind = KINDS[kinds[c]],
      base = first_corner[c];
    if (kind.flat) continue;
    for (let f = 0; f < kind.faces.length; ++f) {
      const face = kind.faces[f],
        side = first_side[c] + f;
      // The smallest corner, the largest, and the sum of all tell faces of one mesh apart.
      let least = 0xffffffff,
        most = 0,
        sum = face.length;
      for (const k of face) {
        const v = corners[base + k];
        if (v < least) least = v;
        if (v > most) most = v;
        sum = (sum + v) >>> 0;
      }
      const slot = (Math.imul(least, 73856093) ^ Math.imul(most, 19349663) ^ Math.imul(sum, 83492791)) & (size - 1);
      let before = -1,
        other = heads[slot];
      while (
        other >= 0 &&
        !(
          low[other] === least &&
          high[other] === most &&
          middle[other] === sum &&
          same_corners(mesh, owners[other], other, c, side)
        )
      ) {
        before = other;
        other = next[other];
      }
      if (other >= 0) {
        // take it out: a side has one neighbor
        if (before < 0) heads[slot] = next[other];
        else next[before] = next[other];
        neighbors[side] = owners[other];
        neighbors[other] = c;
      } else {
        ((low[side] = least), (high[side] = most), (middle[side] = sum), (owners[side] = c));
        next[side] = heads[slot];
        heads[slot] = side;
      }
    }
  }
  return neighbors;
}

function same_corners(mesh, c, side_c, d, side_d) {
  const face_c = KINDS[mesh.kinds[c]].faces[side_c - mesh.first_side[c]];
  const face_d = KINDS[mesh.kinds[d]].faces[side_d - mesh.first_side[d]];
  if (face_c.length !== face_d.length) return false;
  return face_c.every((k) =>
    face_d.some((l) => mesh.corners[mesh.first_corner[c] + k] === mesh.corners[mesh.first_corner[d] + l])
  );
}

/// Number of faces to cross from the outside: 1 for cells with a face on the boundary. 0: cells that no way leads to.
function find_layers(mesh) {
  const { neighbors, first_side, num_cells } = mesh,
    layers = new Uint16Array(num_cells);
  let front = [];
  for (let c = 0; c < num_cells; ++c)
    for (let side = first_side[c]; side < first_side[c + 1]; ++side)
      if (neighbors[side] < 0) {
        layers[c] = 1;
        front.push(c);
        break;
      }
  for (let layer = 2; front.length > 0 && layer < 65535; ++layer) {
    const reached = [];
    for (const c of front)
      for (let side = first_side[c]; side < first_side[c + 1]; ++side) {
        const d = neighbors[side];
        if (d < 0 || layers[d] > 0) continue;
        layers[d] = layer;
        reached.push(d);
      }
    front = reached;
  }
  return layers;
}

function find_centers(mesh) {
  const { points, corners, first_corner, num_cells } = mesh,
    centers = new Float32Array(3 * num_cells);
  for (let c = 0; c < num_cells; ++c) {
    const begin = first_corner[c],
      end = first_corner[c + 1];
    let x = 0,
      y = 0,
      z = 0;
    for (let k = begin; k < end; ++k) {
      const p = 3 * corners[k];
      ((x += points[p]), (y += points[p + 1]), (z += points[p + 2]));
    }
    ((centers[3 * c] = x / (end - begin)),
      (centers[3 * c + 1] = y / (end - begin)),
      (centers[3 * c + 2] = z / (end - begin)));
  }
  return centers;
}

/// Adds fields that need no more than the corners: the layer, the longest edge over the shortest, the length of edges.
function add_measures(mesh) {
  const { kinds, corners, first_corner, points, num_cells } = mesh;
  const ratio = new Float32Array(num_cells),
    length = new Float32Array(num_cells);
  for (let c = 0; c < num_cells; ++c) {
    let least = Infinity,
      most = 0,
      sum = 0;
    const { edges } = KINDS[kinds[c]];
    for (const [a, b] of edges) {
      const p = 3 * corners[first_corner[c] + a],
        q = 3 * corners[first_corner[c] + b];
      const one = Math.hypot(points[p] - points[q], points[p + 1] - points[q + 1], points[p + 2] - points[q + 2]);
      least = Math.min(least, one);
      most = Math.max(most, one);
      sum += one;
    }
    ratio[c] = least > 0 ? most / least : NaN;
    length[c] = sum / edges.length;
  }
  const add = (name, label, worst, values) =>
    mesh.fields.push({ name, label, on: "cells", map: "scale", worst, names: {}, values });
  add("edge_ratio", "Longest by shortest edge", "high", ratio);
  add("edge_length", "Mean length of edges", "low", length);
  if (mesh.layers.some((layer) => layer > 1))
    add("layer", "Layer from the boundary", "high", Float32Array.from(mesh.layers));
}

/// First of the points inside each face of a curved mesh.
function find_face_points(mesh) {
  const { kinds, cell_faces, first_side, num_cells, intervals: n } = mesh;
  let num_faces = 0;
  for (const f of cell_faces) num_faces = Math.max(num_faces, f + 1);
  const first = new Uint32Array(num_faces + 1),
    inside = [0, 0, 0, ((n - 1) * (n - 2)) / 2, (n - 1) * (n - 1)];
  for (let c = 0; c < num_cells; ++c)
    KINDS[kinds[c]].faces.forEach((face, f) => (first[cell_faces[first_side[c] + f] + 1] = inside[face.length]));
  first[0] = mesh.num_vertices + mesh.num_edges * (n - 1);
  for (let f = 0; f < num_faces; ++f) first[f + 1] += first[f];
  return first;
}

/// Number of points of a face with so many corners.
export function face_points(num_corners, n) {
  return num_corners === 4 ? (n + 1) * (n + 1) : ((n + 1) * (n + 2)) / 2;
}

/// Writes the points of a side into `grid` row by row: quads at j (n + 1) + i, i from corner 0 to 1 and j from corner 0
/// to 3; triangles with rows that get shorter, i from corner 0 to 1 and j from corner 0 to 2. Returns their number.
export function side_points(mesh, c, f, grid) {
  const n = mesh.intervals,
    kind = mesh.kinds[c],
    face = KINDS[kind].faces[f],
    base = mesh.first_corner[c];
  const v = face.map((k) => mesh.corners[base + k]);
  if (n === 1) {
    if (v.length === 4) ((grid[0] = v[0]), (grid[1] = v[1]), (grid[2] = v[3]), (grid[3] = v[2]));
    else ((grid[0] = v[0]), (grid[1] = v[1]), (grid[2] = v[2]));
    return v.length;
  }
  const on_edge = (k, step) => {
    // of the edge from corner k to the next
    const p = v[k],
      q = v[(k + 1) % v.length];
    if (step === 0) return p;
    if (step === n) return q;
    const e = mesh.cell_edges[mesh.first_edge[c] + FACE_EDGES[kind][f][k]];
    return mesh.num_vertices + e * (n - 1) + (p < q ? step : n - step) - 1;
  };
  const inside = mesh.first_face_point[mesh.cell_faces[mesh.first_side[c] + f]];
  return v.length === 4 ? quad_points(v, n, on_edge, inside, grid) : triangle_points(v, n, on_edge, inside, grid);
}

/// Points inside a quad are numbered from its smallest vertex, first toward the smaller of that one's neighbors.
function quad_points(v, n, on_edge, inside, grid) {
  const m = v.indexOf(Math.min(...v)),
    next_first = v[(m + 1) % 4] < v[(m + 3) % 4];
  for (let j = 0; j <= n; ++j)
    for (let i = 0; i <= n; ++i) {
      let point;
      if (j === 0) point = on_edge(0, i);
      else if (i === n) point = on_edge(1, j);
      else if (j === n) point = on_edge(2, n - i);
      else if (i === 0) point = on_edge(3, n - j);
      else {
        const to_next = [i, j, n - i, n - j][m],
          to_last = [j, n - i, n - j, i][m];
        const [a, b] = next_first ? [to_next, to_last] : [to_last, to_next];
        point = inside + (b - 1) * (n - 1) + a - 1;
      }
      grid[j * (n + 1) + i] = point;
    }
  return (n + 1) * (n + 1);
}

/// Points inside a triangle are numbered by their steps toward the middle, then toward the largest of its vertices.
function triangle_points(v, n, on_edge, inside, grid) {
  const order = [0, 1, 2].sort((a, b) => v[a] - v[b]);
  let count = 0;
  for (let j = 0; j <= n; ++j)
    for (let i = 0; i + j <= n; ++i) {
      const steps = [n - i - j, i, j];
      let point;
      if (j === 0) point = on_edge(0, i);
      else if (i + j === n) point = on_edge(1, j);
      else if (i === 0) point = on_edge(2, n - j);
      else {
        const b = steps[order[1]],
          c = steps[order[2]];
        point = inside + (c - 1) * (n - 1) - ((c - 1) * c) / 2 + b - 1;
      }
      grid[count++] = point;
    }
  return count;
}

/// Calls f(a, b, c) for the triangles of a face's grid, by place in the grid.
export function for_each_triangle(num_corners, n, f) {
  if (num_corners === 4) {
    for (let j = 0; j < n; ++j)
      for (let i = 0; i < n; ++i) {
        const a = j * (n + 1) + i,
          b = a + 1,
          c = a + n + 2,
          d = a + n + 1;
        f(a, b, c);
        f(a, c, d);
      }
    return;
  }
  for (let j = 0, row = 0; j < n; row += n + 1 - j, ++j)
    for (let i = 0; i < n - j; ++i) {
      const a = row + i,
        up = row + n + 1 - j + i;
      f(a, a + 1, up);
      if (i + 1 < n - j) f(a + 1, up + 1, up);
    }
}

/// Places in a face's grid along its side from corner k to the next.
export function border(num_corners, n, k) {
  const places = [];
  for (let t = 0; t <= n; ++t) {
    let i, j;
    if (num_corners === 4)
      [i, j] = [
        [t, 0],
        [n, t],
        [n - t, n],
        [0, n - t],
      ][k];
    else
      [i, j] = [
        [t, 0],
        [n - t, t],
        [0, n - t],
      ][k];
    places.push(num_corners === 4 ? j * (n + 1) + i : j * (n + 1) - (j * (j - 1)) / 2 + i);
  }
  return places;
}
