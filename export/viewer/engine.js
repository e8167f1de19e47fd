// SPDX-License-Identifier: GPL-3.0-or-later
// Answers questions about one mesh; runs in a worker, or in the page where there are no workers.
import { KINDS } from "./cells.js";
import { NO_VALUE } from "./colors.js";
import { decode } from "./data.js";
import { open_mesh } from "./mesh.js";
import { build_section } from "./section.js";
import { build_surface } from "./surface.js";
import { cell_value, outer_layers, visible_cells } from "./visible.js";

/// Above this number of shown cells, only the outer layers of shrunk cells are drawn: the gaps show no more.
const MOST_SHRUNK_CELLS = 100000,
  SHRUNK_LAYERS = 2;
/// More sides than this (3 GB of arrays would follow) are not drawn.
const MOST_SIDES = 3000000;
const BINS = 48;

export class Engine {
  async open(data) {
    this.mesh = await open_mesh(data);
    const { mesh } = this;
    const counts = {};
    for (const kind of mesh.kinds) counts[KINDS[kind].name] = (counts[KINDS[kind].name] ?? 0) + 1;
    let most_layers = 0;
    for (const layer of mesh.layers) if (layer > most_layers) most_layers = layer;
    return {
      counts,
      edge_length: mean_edge(mesh),
      num_cells: mesh.num_cells,
      num_layers: most_layers,
      has_inside: most_layers > 0 && !is_flat(mesh),
      num_inverted: mesh.inverted.length,
      num_undecided: mesh.undecided.length,
      box: box_of(mesh.points),
      marks: marks(mesh, mesh.inverted),
      fields: mesh.fields.map((field) => this.summary(field)),
    };
  }

  /// Name, range and histogram of a field, by cells.
  summary(field) {
    const { mesh } = this,
      value = cell_value(mesh, field),
      { name, label, map, on, worst, names } = field;
    let low = Infinity,
      high = -Infinity;
    for (const x of field.values) {
      if (x < low) low = x;
      if (x > high) high = x;
    }
    if (low > high) low = high = 0;
    if (low > 0 && low < high / 50 && field.map === "scale") low = 0; // a scale from zero reads better
    const histogram = new Array(BINS).fill(0),
      from = field.map === "quality" ? Math.min(0, low) : low;
    const to = field.map === "quality" ? 1 : high;
    for (let c = 0; c < mesh.num_cells; ++c) {
      const x = value(c);
      if (!Number.isNaN(x))
        ++histogram[Math.max(0, Math.min(BINS - 1, Math.floor(((x - from) / (to - from || 1)) * BINS)))];
    }
    const regions = field.map === "regions" ? count_regions(field.values) : null;
    return { name, label, map, on, worst, names, low, high, from, to, histogram, regions };
  }

  /// The values of a field as the shader takes them: regions as places in their list.
  drawn(name) {
    const field = this.mesh.fields.find((one) => one.name === name);
    if (!field) return null;
    if (!field.drawn) {
      const places = field.map === "regions" && new Map(count_regions(field.values).map(([number], i) => [number, i]));
      field.drawn = field.values.map((x) => (Number.isNaN(x) ? NO_VALUE : places ? places.get(x) : x));
    }
    return { on: field.on, values: field.drawn };
  }

  /// Geometry to draw for a wish (see visible.js), with {field, flat_cut, shrunk} besides. The surface is left out if
  /// it is that of the last answer.
  show(wish) {
    const { mesh } = this,
      field = this.drawn(wish.field),
      key = JSON.stringify({ ...wish, flat_cut: null });
    if (wish.flat_cut && key === this.last_key) {
      const section = build_section(mesh, this.last_shown, wish.flat_cut, field);
      return { section, num_shown: this.last_num_shown, is_same: true };
    }
    const shown = visible_cells(mesh, wish);
    let num_shown = 0;
    for (const one of shown) num_shown += one;
    const drawn = wish.shrunk && num_shown > MOST_SHRUNK_CELLS ? outer_layers(mesh, shown, SHRUNK_LAYERS) : shown;
    const surface = build_surface(mesh, drawn, { field, all_sides: wish.shrunk, max_sides: MOST_SIDES });
    Object.assign(this, { last_key: surface ? key : null, last_shown: shown, last_num_shown: num_shown });
    const section = wish.flat_cut ? build_section(mesh, shown, wish.flat_cut, field) : null;
    return { surface, section, num_shown, too_many: !surface };
  }

  /// The whole boundary, to be drawn as a ghost.
  boundary() {
    return build_surface(this.mesh, new Uint8Array(this.mesh.num_cells).fill(1), {});
  }

  /// Decodes a surface of the page: {positions, index, lines, values}.
  async surface(data) {
    const values = await decode(data.values);
    return {
      positions: await decode(data.points),
      index: await decode(data.triangles),
      lines: await decode(data.wires),
      values: values?.map((x) => (Number.isNaN(x) ? NO_VALUE : x)) ?? null,
    };
  }

  /// The cells with the lowest or highest values of a field: [{cell, value}].
  worst({ field: name, count }) {
    const { mesh } = this,
      field = mesh.fields.find((one) => one.name === name);
    if (!field) return [];
    const value = cell_value(mesh, field),
      sign = field.worst === "high" ? -1 : 1,
      kept = [];
    for (let c = 0; c < mesh.num_cells; ++c) {
      const x = value(c);
      if (Number.isNaN(x) || (kept.length === count && sign * x >= sign * kept[count - 1].value)) continue;
      let at = kept.length;
      while (at > 0 && sign * kept[at - 1].value > sign * x) --at;
      kept.splice(at, 0, { cell: c, value: x });
      if (kept.length > count) kept.pop();
    }
    return kept;
  }

  /// What is known about one cell, and its own surface.
  cell({ cell }) {
    const { mesh } = this;
    if (!(cell >= 0 && cell < mesh.num_cells)) return null;
    const only = new Uint8Array(mesh.num_cells);
    only[cell] = 1;
    const values = mesh.fields.map((field) => ({ label: field.label, value: cell_value(mesh, field)(cell) }));
    const surface = build_surface(mesh, only, {});
    return {
      cell,
      kind: KINDS[mesh.kinds[cell]].name,
      values,
      surface,
      is_inverted: mesh.inverted.includes(cell),
      is_undecided: mesh.undecided.includes(cell),
      center: [...mesh.centers.subarray(3 * cell, 3 * cell + 3)],
      box: box_of(surface.positions),
    };
  }
}

function is_flat(mesh) {
  return mesh.kinds.every((kind) => KINDS[kind].flat);
}

/// Mean length of edges, of a sample of the cells.
function mean_edge({ kinds, corners, first_corner, points, num_cells }) {
  const stride = Math.max(1, Math.floor(num_cells / 2000));
  let sum = 0,
    count = 0;
  for (let c = 0; c < num_cells; c += stride)
    for (const [a, b] of KINDS[kinds[c]].edges) {
      const p = 3 * corners[first_corner[c] + a],
        q = 3 * corners[first_corner[c] + b];
      sum += Math.hypot(points[p] - points[q], points[p + 1] - points[q + 1], points[p + 2] - points[q + 2]);
      ++count;
    }
  return count > 0 ? sum / count : 0;
}

function count_regions(values) {
  const counts = new Map();
  for (const value of values) counts.set(value, (counts.get(value) ?? 0) + 1);
  return [...counts].sort((a, b) => a[0] - b[0]);
}

function marks(mesh, cells) {
  const positions = new Float32Array(3 * cells.length);
  cells.forEach((c, i) => positions.set(mesh.centers.subarray(3 * c, 3 * c + 3), 3 * i));
  return positions;
}

function box_of(points) {
  const low = [Infinity, Infinity, Infinity],
    high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < points.length; ++i) {
    const k = i % 3;
    if (points[i] < low[k]) low[k] = points[i];
    if (points[i] > high[k]) high[k] = points[i];
  }
  return { low, high };
}

/// The buffers of an answer, to be handed over without a copy.
export function buffers_of(answer, found = []) {
  if (ArrayBuffer.isView(answer)) found.push(answer.buffer);
  else if (answer && typeof answer === "object") for (const part of Object.values(answer)) buffers_of(part, found);
  return found;
}
