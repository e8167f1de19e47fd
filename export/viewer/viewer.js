// SPDX-License-Identifier: GPL-3.0-or-later
// What is shown of the meshes of a page, and how: the state, the drawing, and what follows from a change of either.
import { Color, LineSegments, Mesh, Points, Scene, Vector2, Vector3, WebGLRenderer } from "three";
import { MAPS } from "./colors.js";
import { Camera } from "./camera.js";
import { Model } from "./model.js";
import {
  color,
  geometry_of,
  ghost_material,
  line_material,
  map_texture,
  mark_material,
  shared_uniforms,
} from "./materials.js";
import { first_hit, side_of } from "./pick.js";

const AXES = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };
const WORST = 20;
const MOST_MARKS = 500; // of inverted cells, unless they are asked for: more hide the mesh
const SLOW_MS = 60; // a frame that takes longer is drawn without edges while the view moves
const REST_MS = 180; // after this time without a move, it is drawn whole
const MOMENT_MS = 700; // of one mesh of a timeline that is played
const MEASURE_COLOR = "#0b6bcb";

/// What is shown at first.
function first_state() {
  return {
    shown: 0,
    wipe: 0.5,
    limit: false,
    field: "",
    map: "viridis",
    low: 0,
    high: 1,
    edges: true,
    faces: true, // false: a wireframe
    shrink: 1,
    peel: 0,
    cut: { on: false, axis: "x", normal: [1, 0, 0], position: 0.5, flipped: false, flat: true },
    filter: { on: false, low: 0, high: 1 },
    ghost: true,
    hidden_regions: [],
    around: false,
    target: false,
    target_opacity: 0.5,
    marks: true,
    measuring: false,
  };
}

export class Viewer {
  /// canvas: to draw on. data: of the page. on: {changed(), labels(list), is_active()}.
  constructor(canvas, data, on) {
    Object.assign(this, { canvas, data, on, state: first_state(), models: [], measured: [], chosen: null });
    this.renderer = new WebGLRenderer({
      canvas,
      antialias: true,
      preserveDrawingBuffer: true,
      powerPreference: "high-performance",
    });
    this.renderer.autoClear = false;
    this.shared = shared_uniforms();
    this.scene = new Scene();
    this.overlay = new Scene();
    this.camera = new Camera(canvas, {
      changed: () => this.moved(),
      clicked: (...where) => this.click(...where),
      is_active: on.is_active,
    });
    new ResizeObserver(() => this.resize()).observe(canvas.parentElement);
  }

  get model() {
    return this.models[Math.max(0, Math.min(this.models.length - 1, this.state.shown))];
  }
  get is_comparing() {
    return this.state.shown === 2 && this.models.length === 2;
  }
  get field() {
    return this.model.info.fields.find((field) => field.name === this.state.field);
  }

  async open() {
    for (const [i, mesh] of this.data.meshes.entries()) {
      const model = new Model(this.shared);
      const limit = i === this.data.limit_of ? this.data.limit : null;
      this.models.push(await model.open(mesh, limit, this.data.cage));
      this.scene.add(model.group);
    }
    if (this.data.target) await this.open_target();
    this.measure_extent();
    this.state.shown = this.data.shown ?? 0;
    this.state.limit = this.data.limit_of === this.state.shown && this.data.shows_limit;
    this.state.marks = this.models.every(({ info }) => info.num_inverted <= MOST_MARKS);
    this.state.target = Boolean(this.data.shows_target);
    this.use_field(this.data.field ?? this.model.info.fields[0]?.name ?? "");
    this.resize();
    this.camera.home();
    await this.update();
  }

  async open_target() {
    const { positions, index } = await this.models[0].ask("surface", this.data.target);
    const geometry = geometry_of([["position", positions, 3]], index);
    geometry.computeVertexNormals();
    this.target = new Mesh(geometry, ghost_material(this.shared, color("#6f8fb8"), { smooth: true }));
    this.target.frustumCulled = false;
    this.target.renderOrder = 6;
    this.scene.add(this.target);
  }

  measure_extent() {
    const low = new Vector3(Infinity, Infinity, Infinity),
      high = low.clone().negate();
    for (const { info } of this.models) {
      low.min(new Vector3(...info.box.low));
      high.max(new Vector3(...info.box.high));
    }
    this.middle = low.clone().add(high).multiplyScalar(0.5);
    this.radius = low.distanceTo(high) / 2 || 1;
    this.box = { low, high };
    this.camera.surround(this.middle, this.radius);
  }

  /// Colors by a field, over its whole range. "": plain.
  use_field(name) {
    const { state } = this,
      field = this.model.info.fields.find((one) => one.name === name);
    state.field = field ? name : "";
    if (!field) return;
    state.low = field.map === "quality" ? 0 : field.low;
    state.high = field.map === "quality" ? 1 : field.high;
    Object.assign(state.filter, { on: false, low: field.from, high: field.to });
    this.worst = null;
  }

  /// Changes the state, and draws what follows from that.
  async set(change) {
    const { state } = this,
      { on, axis } = change.cut ?? {},
      starts_cut = (on && !state.cut.on) || (axis && axis !== state.cut.axis);
    if ("field" in change) this.use_field(change.field);
    for (const [name, value] of Object.entries(change)) {
      if (name === "field") continue;
      if (value && typeof value === "object" && !Array.isArray(value)) Object.assign(state[name], value);
      else state[name] = value;
    }
    if (axis) state.cut.normal = axis === "view" ? this.camera.axis(2).toArray() : AXES[axis];
    if (starts_cut && change.cut.flipped === undefined)
      // the half that hides the section is cut off
      state.cut.flipped = new Vector3(...state.cut.normal).dot(this.camera.axis(2)) < 0;
    await this.update();
  }

  /// Shows the next mesh of a timeline; step -1: the one before.
  async step(step) {
    const count = this.models.length;
    if (this.data.is_timeline) await this.set({ shown: Math.max(0, Math.min(count - 1, this.state.shown + step)) });
  }

  /// Shows the meshes of a timeline one after another, from the first one if the last is shown; false: stops.
  async play(on) {
    if (on === Boolean(this.is_playing) || !this.data.is_timeline) return;
    this.is_playing = on;
    const last = this.models.length - 1;
    if (on && this.state.shown >= last) await this.set({ shown: 0 });
    else this.on.changed();
    while (this.is_playing && this.state.shown < last) {
      await new Promise((resume) => setTimeout(resume, MOMENT_MS));
      if (this.is_playing) await this.step(1);
    }
    this.is_playing = false;
    this.on.changed();
  }

  /// The plane of the cut: {normal, offset}; what lies beyond it along the normal is cut off.
  plane() {
    const { cut } = this.state,
      normal = cut.normal.map((x) => (cut.flipped ? -x : x));
    let low = Infinity,
      high = -Infinity;
    for (let corner = 0; corner < 8; ++corner) {
      const height = normal.reduce(
        (sum, x, k) => sum + x * ((corner >> k) & 1 ? this.box.high : this.box.low).getComponent(k),
        0
      );
      low = Math.min(low, height);
      high = Math.max(high, height);
    }
    const share = cut.flipped ? 1 - cut.position : cut.position;
    return { normal, offset: low + share * (high - low) };
  }

  wish(model) {
    const { state } = this,
      plane = state.cut.on ? this.plane() : null,
      is_flat = state.cut.flat && state.shrink === 1;
    const has_field = model.info.fields.some((field) => field.name === state.field);
    return {
      field: has_field ? state.field : "",
      peel: state.peel,
      hidden_regions: state.hidden_regions,
      shrunk: state.shrink < 1,
      range:
        state.filter.on && has_field ? { field: state.field, low: state.filter.low, high: state.filter.high } : null,
      around: state.around && this.chosen && this.chosen.model === model ? { cell: this.chosen.cell, rings: 2 } : null,
      cut: plane && !is_flat ? plane : null,
      flat_cut: plane && is_flat ? plane : null,
    };
  }

  /// Draws the state. While geometry is being built, later changes wait, and only the last of them is built.
  async update() {
    this.uniforms();
    this.on.changed();
    this.draw();
    if (this.updating) {
      this.is_late = true;
      return this.updating;
    }
    this.updating = (async () => {
      do {
        this.is_late = false;
        const models = this.is_comparing ? this.models : [this.model];
        for (const model of models) {
          const wish = this.wish(model),
            key = JSON.stringify(wish);
          if (model.key === key) continue;
          await model.show(wish);
          model.key = key;
        }
        if (this.wants_ghost) for (const model of models) await model.need_ghost(color("#8d9aab"));
        const worst_key = `${this.state.shown} ${this.state.field}`;
        if (this.worst_key !== worst_key) {
          this.worst = await this.model.ask("worst", { field: this.state.field, count: WORST });
          this.worst_key = worst_key;
        }
      } while (this.is_late);
    })();
    try {
      await this.updating;
    } finally {
      this.updating = null;
    }
    this.uniforms();
    this.on.changed();
    this.is_moving = false;
    this.is_slow = this.timed_draw() > SLOW_MS;
  }

  get wants_ghost() {
    const { state } = this;
    return (
      state.ghost &&
      (state.filter.on || state.peel > 0 || state.hidden_regions.length > 0 || (state.around && this.chosen))
    );
  }

  uniforms() {
    const { state, shared } = this,
      flat_cut = state.cut.on && state.cut.flat && state.shrink === 1;
    shared.shrink.value = state.shrink;
    const { normal, offset } = this.plane();
    shared.plane.value.set(...normal, offset);
    shared.is_clipped.value = flat_cut || (state.cut.on && state.limit) ? 1 : 0;
    for (const model of this.models) {
      const field = model.info.fields.find((one) => one.name === state.field),
        { colors } = model;
      const regions = field?.regions?.length ?? 0,
        key = regions ? `regions ${regions}` : state.map;
      if (model.map_key !== key) {
        colors.map.value?.dispose();
        colors.map.value = map_texture(MAPS[state.map], regions);
        model.map_key = key;
      }
      if (regions) colors.range.value.set(-0.5, regions - 0.5);
      else colors.range.value.set(state.low, state.high);
      colors.shows_inverted.value = field?.map === "quality" ? 1 : 0;
    }
    if (this.target) {
      this.target.visible = state.target;
      this.target.material.uniforms.opacity.value = state.target_opacity;
    }
  }

  theme(is_dark) {
    this.background = new Color(is_dark ? "#14171b" : "#ffffff"); // three turns it into sRGB again
    this.shared.plain.value.copy(color(is_dark ? "#9aa7b8" : "#b8c4d4"));
    this.shared.ink.value.copy(color(is_dark ? "#05070a" : "#10151b"));
    this.draw();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = this.canvas.parentElement;
    if (width === 0 || height === 0) return;
    const { camera } = this,
      fits = camera.fitting(1);
    if (this.fits) camera.distance *= fits / this.fits; // the same share of the picture as before
    this.fits = fits;
    this.renderer.setPixelRatio(Math.min(2, devicePixelRatio));
    this.renderer.setSize(width, height, false);
    this.draw();
  }

  draw() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => {
      this.asked = false;
      this.draw_now();
    });
  }

  /// Draws after a move of the camera: at once, and whole as soon as it rests.
  moved() {
    if (this.is_slow) {
      this.is_moving = true;
      clearTimeout(this.rest);
      this.rest = setTimeout(() => {
        this.is_moving = false;
        this.draw();
      }, REST_MS);
    }
    this.draw();
  }

  /// Waits until the picture is drawn, and returns the milliseconds that took.
  timed_draw() {
    const gl = this.renderer.getContext(),
      pixel = new Uint8Array(4),
      start = performance.now();
    this.draw_now();
    gl.readPixels(0, 0, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    return performance.now() - start;
  }

  draw_now() {
    if (!this.middle || !this.background) return;
    const { renderer, state, camera } = this,
      ratio = renderer.getPixelRatio();
    camera.place(this.middle, this.radius * 1.2);
    this.shared.pixels.value = (camera.height * ratio) / (2 * Math.tan((camera.camera.fov * Math.PI) / 360));
    renderer.setScissorTest(false);
    renderer.setClearColor(this.background, 1);
    renderer.clear();
    const width = camera.width,
      left = Math.round(state.wipe * width);
    const passes = this.is_comparing
      ? [
          [this.models[0], 0, left],
          [this.models[1], left, width - left],
        ]
      : [[this.model, 0, width]];
    for (const [model, x, w] of passes) {
      if (w <= 0) continue;
      for (const other of this.models) other.group.visible = other === model;
      model.reveal({
        limit: state.limit && "limit" in model.parts,
        edges: !state.faces || (state.edges && !this.is_moving),
        faces: state.faces,
        ghost: this.wants_ghost && !this.is_moving,
        marks: state.marks,
      });
      renderer.setScissorTest(this.is_comparing);
      renderer.setScissor(x, 0, w, camera.height);
      renderer.render(this.scene, camera.camera);
    }
    renderer.setScissorTest(false);
    if (this.overlay.children.length > 0) renderer.render(this.overlay, camera.camera);
    this.on.labels(this.labels());
  }

  /// Draws frames that turn the model, and returns the milliseconds of each, with the time to finish.
  frames(count) {
    return Array.from({ length: count }, () => {
      this.camera.rotate(0.05, 0.01);
      return this.timed_draw();
    });
  }

  /// Where a place of the canvas meets what is shown: {point, cell or null, model} or null.
  pick(x, y) {
    const { state, camera } = this,
      at = new Vector2((2 * x) / camera.width - 1, 1 - (2 * y) / camera.height);
    camera.place(this.middle, this.radius * 1.2);
    const origin = camera.camera.position.clone(),
      direction = new Vector3(at.x, at.y, 0.5).unproject(camera.camera).sub(origin).normalize();
    const model = !this.is_comparing ? this.model : this.models[x < state.wipe * camera.width ? 0 : 1];
    const { plane, is_clipped } = this.shared,
      p = plane.value;
    const accept = is_clipped.value ? (a, b, c) => p.x * a + p.y * b + p.z * c <= p.w : () => true;
    const hits = [],
      meet = (arrays, test, cell_of) => {
        const hit = arrays && first_hit(arrays, state.shrink, origin.toArray(), direction.toArray(), test);
        if (hit) hits.push({ ...hit, cell: cell_of(hit.triangle), model });
      };
    if (state.limit && model.parts.limit) {
      const { attributes, index } = model.parts.limit.geometry;
      meet({ positions: attributes.position.array, index: index.array }, accept, () => null);
    } else {
      meet(
        model.surface,
        accept,
        (triangle) => model.surface.side_cells[side_of(model.surface.side_triangles, triangle)]
      );
      meet(
        model.section,
        () => true,
        (triangle) => model.section.triangle_cells[triangle]
      );
    }
    return hits.sort((a, b) => a.t - b.t)[0] ?? null;
  }

  click(x, y, is_double) {
    const hit = this.pick(x, y);
    if (is_double) {
      if (hit) this.camera.fly(new Vector3(...hit.point), this.camera.distance);
    } else if (this.state.measuring) {
      if (hit) this.measure(hit.point);
    } else this.choose(hit?.cell ?? null, hit?.model);
  }

  /// Marks a cell and tells about it. fly: goes there.
  async choose(cell, model = this.model, { fly = false } = {}) {
    for (const other of this.models) if (other !== model || cell === null) await other.choose(null);
    const found = cell === null ? null : await model.choose(cell);
    this.chosen = found && { ...found, model };
    if (found && fly) {
      const low = new Vector3(...found.box.low),
        high = new Vector3(...found.box.high);
      this.camera.fly(
        new Vector3(...found.center),
        this.camera.fitting(3 * Math.max(low.distanceTo(high), this.radius * 1e-3))
      );
    }
    await this.update();
  }

  measure(point) {
    if (this.measured.length === 2) this.measured = [];
    this.measured.push(new Vector3(...point));
    this.draw_measure();
  }
  draw_measure() {
    for (const child of [...this.overlay.children]) {
      this.overlay.remove(child);
      child.geometry.dispose();
    }
    if (this.measured.length > 0) {
      const positions = Float32Array.from(this.measured.flatMap((p) => p.toArray()));
      const parts = [
        new Points(
          geometry_of([["position", positions, 3]]),
          mark_material(color(MEASURE_COLOR), 12 * devicePixelRatio)
        ),
      ];
      if (this.measured.length === 2)
        parts.push(
          new LineSegments(
            geometry_of([["position", positions, 3]]),
            line_material(this.shared, { tint: color(MEASURE_COLOR), uncut: true, through: true, strength: 1 })
          )
        );
      for (const part of parts) {
        part.frustumCulled = false;
        this.overlay.add(part);
      }
    }
    this.draw();
  }

  /// Texts at places of the canvas: [{x, y, text}].
  labels() {
    if (this.measured.length < 2) return [];
    const [a, b] = this.measured,
      middle = a.clone().add(b).multiplyScalar(0.5).project(this.camera.camera);
    const length = a.distanceTo(b),
      d = b
        .clone()
        .sub(a)
        .toArray()
        .map((x) => Math.abs(x).toPrecision(3));
    return [
      {
        x: ((middle.x + 1) / 2) * this.camera.width,
        y: ((1 - middle.y) / 2) * this.camera.height,
        text: `${length.toPrecision(5)}  (dx ${d[0]}, dy ${d[1]}, dz ${d[2]})`,
      },
    ];
  }
}
