// SPDX-License-Identifier: GPL-3.0-or-later
// One mesh as three.js draws it: an engine that builds its geometry, and the objects made of that.
import { Group, LineSegments, Mesh, Points } from "three";
import {
  color_uniforms,
  color,
  geometry_of,
  ghost_material,
  line_material,
  mark_material,
  surface_material,
} from "./materials.js";
import { connect } from "./connect.js";
import { INVERTED } from "./colors.js";

/// Size of marks in pixels: many must be small, or they hide one another.
const mark_pixels = (count) => (count <= 50 ? 12 : count <= 500 ? 8 : 4);
export const CAGE_COLOR = "#c2410c",
  CHOSEN_COLOR = "#ff2e88";

export class Model {
  constructor(shared) {
    this.shared = shared;
    this.colors = color_uniforms();
    this.edge_length = { value: 1 };
    this.group = new Group();
    this.ask = connect();
    this.parts = {};
  }

  /// data: the mesh of the page. limit, cage: its limit surface and the cage of that in the page, or null.
  async open(data, limit, cage) {
    this.name = data.name;
    this.info = await this.ask("open", data);
    this.edge_length.value = this.info.edge_length;
    if (this.info.num_inverted > 0) {
      const marks = new Points(
        geometry_of([["position", this.info.marks, 3]]),
        mark_material(color(INVERTED), mark_pixels(this.info.num_inverted) * devicePixelRatio)
      );
      this.put("marks", marks, 9);
    }
    if (limit) await this.open_limit(limit, cage);
    return this;
  }

  put(name, object, order = 0) {
    const old = this.parts[name];
    if (old) {
      this.group.remove(old);
      old.geometry.dispose();
      old.material.dispose();
    }
    this.parts[name] = object;
    if (!object) return;
    object.frustumCulled = false;
    object.renderOrder = order;
    this.group.add(object);
  }

  async open_limit(limit, cage) {
    const { positions, index, lines, values } = await this.ask("surface", limit);
    const geometry = geometry_of(
      [
        ["position", positions, 3],
        ["value", values ?? new Float32Array(positions.length / 3).fill(1e38), 1],
      ],
      index
    );
    geometry.computeVertexNormals();
    this.put("limit", new Mesh(geometry, surface_material(this.shared, this.colors, { smooth: true })));
    const wires = geometry_of([["position", positions, 3]], lines);
    this.put("limit_lines", new LineSegments(wires, line_material(this.shared, { length: this.edge_length })), 1);
    const edges = await this.ask("surface", cage),
      cage_lines = geometry_of([["position", edges.positions, 3]], edges.lines);
    this.put(
      "cage",
      new LineSegments(cage_lines, line_material(this.shared, { tint: color(CAGE_COLOR), uncut: true, strength: 1 })),
      2
    );
  }

  /// Asks the engine for what the wish says, and draws that from then on.
  async show(wish) {
    const { shared, colors, edge_length: length } = this,
      { surface, section, num_shown, too_many, is_same } = await this.ask("show", wish);
    this.num_shown = num_shown;
    this.too_many = too_many ?? false;
    if (!is_same) {
      this.surface = surface;
      if (surface) {
        const { positions, normals, centers, values, index, lines } = surface,
          shrunk = centers !== null;
        const arrays = [
          ["position", positions, 3],
          ["normal", normals, 3],
          ["center", centers, 3],
          ["value", values, 1],
        ];
        const options = {
          smooth: normals !== null,
          shrunk,
          closed: this.info.has_inside && this.info.num_inverted === 0,
        };
        this.put("cells", new Mesh(geometry_of(arrays, index), surface_material(shared, colors, options)));
        const on_lines = geometry_of(
          [
            ["position", positions, 3],
            ["center", centers, 3],
          ],
          lines
        );
        this.put("lines", new LineSegments(on_lines, line_material(shared, { length, shrunk })), 1);
      } else {
        this.put("cells", null);
        this.put("lines", null);
      }
    }
    this.section = section;
    if (section) {
      const arrays = [
        ["position", section.positions, 3],
        ["value", section.values, 1],
      ];
      this.put(
        "section",
        new Mesh(geometry_of(arrays, section.index), surface_material(shared, colors, { section: true }))
      );
      const lines = geometry_of([["position", section.lines, 3]]);
      this.put("section_lines", new LineSegments(lines, line_material(shared, { length, uncut: true })), 1);
    } else {
      this.put("section", null);
      this.put("section_lines", null);
    }
  }

  /// Makes the ghost of the boundary when it is first wanted.
  async need_ghost(tint) {
    if (this.parts.ghost || this.ghost_asked) return;
    this.ghost_asked = true;
    const { positions, normals, index } = await this.ask("boundary");
    const arrays = [
      ["position", positions, 3],
      ["normal", normals, 3],
    ];
    this.put(
      "ghost",
      new Mesh(geometry_of(arrays, index), ghost_material(this.shared, tint, { smooth: normals !== null })),
      5
    );
  }

  /// Marks one cell, or none.
  async choose(cell) {
    const found = cell === null ? null : await this.ask("cell", { cell });
    this.chosen = found;
    if (!found) {
      this.put("chosen", null);
      return null;
    }
    const { positions, lines } = found.surface;
    const outline = geometry_of([["position", positions, 3]], lines);
    this.put(
      "chosen",
      new LineSegments(
        outline,
        line_material(this.shared, { tint: color(CHOSEN_COLOR), uncut: true, through: true, strength: 1 })
      ),
      10
    );
    return found;
  }

  /// Which of its objects are seen.
  reveal({ limit, edges, faces, ghost, marks }) {
    const seen = {
      cells: !limit && faces,
      lines: !limit && edges,
      section: !limit && faces,
      section_lines: !limit && edges,
      ghost: ghost && !limit,
      marks: marks && !limit,
      limit: limit && faces,
      limit_lines: limit && edges,
      cage: limit,
      chosen: !limit,
    };
    for (const [name, object] of Object.entries(this.parts)) if (object) object.visible = seen[name];
  }
}
