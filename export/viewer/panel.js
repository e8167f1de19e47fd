// SPDX-License-Identifier: GPL-3.0-or-later
// The controls beside the picture. They show the viewer's state, and change it.
import { MAPS, region_color } from "./colors.js";
import { button, check, choice, digits, make, number, section, slider } from "./dom.js";
import { draw_histogram } from "./histogram.js";

const KEYS = [
  ["drag; arrow keys", "turn"],
  ["right drag, Shift + drag; Shift + arrows", "move"],
  ["wheel; + and -", "zoom"],
  ["two fingers", "move, zoom and roll"],
  ["click", "tell about a cell"],
  ["double click", "turn about that point"],
  ["0", "the whole mesh"],
  ["x, y, z", "look along an axis, again: from the other side"],
  ["e", "edges on or off"],
  ["w", "wireframe on or off"],
  ["c", "cut on or off"],
  ["[ and ]", "move the cut"],
  ["p, Shift + p", "peel a layer, put it back"],
  ["f", "filter on or off"],
  ["n, Shift + n", "next and previous of the worst cells"],
  ["m", "measure: click two points"],
  ["t", "play the moments of a timeline"],
  [", and .", "previous and next moment"],
  ["g", "target on or off"],
  ["l", "limit surface or cells"],
  ["s", "save a picture"],
  ["d", "dark or light"],
  ["h or ?", "this list"],
  ["Escape", "close, choose nothing"],
];

export class Panel {
  constructor(viewer) {
    this.viewer = viewer;
    const set = (change) => viewer.set(change);
    this.parts = {
      field: choice("Color by", [], (field) => set({ field })),
      map: choice(
        "Colors",
        Object.keys(MAPS).map((name) => [name, name]),
        (map) => set({ map })
      ),
      low: number("From", (low) => set({ low })),
      high: number("To", (high) => set({ high })),
      filter: check("Show only cells with values", (on) => set({ filter: { on } })),
      filter_low: slider(
        "at least",
        { min: 0, max: 1, step: 0.005 },
        (low) => set({ filter: { on: true, low: this.from_share(low) } }),
        (x) => digits(this.from_share(x))
      ),
      filter_high: slider(
        "at most",
        { min: 0, max: 1, step: 0.005 },
        (high) => set({ filter: { on: true, high: this.from_share(high) } }),
        (x) => digits(this.from_share(x))
      ),
      cut: check("Cut with a plane", (on) => set({ cut: { on } })),
      axis: choice(
        "Across",
        [
          ["x", "x"],
          ["y", "y"],
          ["z", "z"],
          ["view", "the line of sight"],
        ],
        (axis) => set({ cut: { axis, on: true } })
      ),
      position: slider(
        "Position",
        { min: 0, max: 1, step: 0.002 },
        (position) => set({ cut: { position, on: true } }),
        (x) => `${Math.round(100 * x)} %`
      ),
      flipped: check("Show the other half", (flipped) => set({ cut: { flipped, on: true } })),
      whole: check("Keep cells whole", (whole) => set({ cut: { flat: !whole, on: true } })),
      peel: slider("Peel layers", { min: 0, max: 1, step: 1 }, (peel) => set({ peel })),
      ghost: check("Ghost of what is hidden", (ghost) => set({ ghost })),
      edges: check("Edges of the cells", (edges) => set({ edges })),
      wireframe: check("Wireframe: edges alone", (wireframe) => set({ faces: !wireframe })),
      shrink: slider(
        "Size of cells",
        { min: 0.3, max: 1, step: 0.01 },
        (shrink) => set({ shrink }),
        (x) => `${Math.round(100 * x)} %`
      ),
      limit: check("Limit surface with its cage", (limit) => set({ limit })),
      marks: check("Mark inverted cells", (marks) => set({ marks })),
      target: check("Target as a ghost", (target) => set({ target })),
      target_opacity: slider(
        "Density",
        { min: 0.05, max: 1, step: 0.05 },
        (target_opacity) => set({ target: true, target_opacity }),
        (x) => `${Math.round(100 * x)} %`
      ),
      around: check("Only the cells around it", (around) => set({ around })),
    };
    const { parts } = this;
    this.histogram = make("canvas", {
      class: "histogram",
      role: "img",
      "aria-label": "Number of cells by value, over the color scale",
    });
    this.regions = make("div", { class: "regions" });
    this.worst = make("ol", { class: "worst" });
    this.facts = make("dl", { class: "facts" });
    this.cell = section("Cell", true, this.facts, parts.around);
    this.shown = choice("Mesh", [], (shown) => set({ shown: Number(shown) }));
    this.moment = slider(
      "Moment",
      { min: 0, max: 1, step: 1 },
      (shown) => set({ shown }),
      (shown) => viewer.models[shown]?.name ?? ""
    );
    this.play = button("Play", "Show the moments one after another (t)", () => viewer.play(!viewer.is_playing));
    this.ends = make("div", { class: "ends" }, make("span"), make("span"));
    this.sections = {
      shown: make("div", { class: "first" }, this.shown, this.moment, this.play),
      color: section(
        "Color and filter",
        true,
        parts.field,
        this.histogram,
        this.ends,
        this.regions,
        parts.filter,
        parts.filter_low,
        parts.filter_high,
        make("details", { class: "inner" }, make("summary", {}, "Scale"), parts.map, parts.low, parts.high)
      ),
      cell: this.cell,
      inside: section(
        "Inside",
        true,
        parts.cut,
        parts.axis,
        parts.position,
        parts.flipped,
        parts.whole,
        parts.peel,
        parts.ghost
      ),
      display: section(
        "Display",
        true,
        parts.limit,
        parts.edges,
        parts.wireframe,
        parts.shrink,
        parts.marks,
        parts.target,
        parts.target_opacity
      ),
      worst: section("Worst cells", true, this.worst),
      keys: section(
        "Mouse, fingers and keys",
        false,
        make(
          "table",
          { class: "keys" },
          ...KEYS.map(([key, what]) => make("tr", {}, make("th", { scope: "row" }, key), make("td", {}, what)))
        )
      ),
    };
    this.element = make("div", { class: "panel" }, ...Object.values(this.sections));
  }

  from_share(x) {
    const { field } = this.viewer;
    return field ? field.from + x * (field.to - field.from) : x;
  }

  /// Shows the state.
  show() {
    const { viewer, parts, sections } = this,
      { state, field, model } = viewer,
      { info } = model;
    this.show_choice_of_meshes();

    fill_once(parts.field, [...info.fields.map(({ name, label }) => [name, label]), ["", "nothing"]]);
    parts.field.show(state.field);
    const is_scale = Boolean(field) && !field.regions;
    for (const part of [
      this.histogram,
      this.ends,
      parts.filter,
      parts.filter_low,
      parts.filter_high,
      parts.map.parentElement,
    ])
      part.hidden = !is_scale;
    this.regions.hidden = !field?.regions;
    if (is_scale) this.show_scale(field, state);
    if (field?.regions) this.show_regions(field, state);

    parts.cut.show(state.cut.on);
    parts.axis.show(state.cut.axis);
    parts.position.show(state.cut.position);
    parts.flipped.show(state.cut.flipped);
    parts.whole.show(!state.cut.flat);
    parts.peel.limit(Math.max(0, info.num_layers - 1));
    parts.peel.show(state.peel);
    parts.ghost.show(state.ghost);
    parts.edges.show(state.edges);
    parts.wireframe.show(!state.faces);
    parts.shrink.show(state.shrink);
    parts.limit.show(state.limit);
    parts.limit.hidden = !("limit" in model.parts);
    parts.marks.show(state.marks);
    parts.marks.hidden = info.num_inverted === 0;
    parts.target.show(state.target);
    parts.target_opacity.show(state.target_opacity);
    parts.target.hidden = parts.target_opacity.hidden = !viewer.target;
    for (const part of [parts.peel, parts.shrink, parts.whole]) part.hidden = !info.has_inside;
    sections.worst.hidden = !viewer.worst?.length || Boolean(field?.regions);
    this.show_worst(field);
    this.show_cell();
    parts.around.show(state.around);
  }

  /// Meshes of a timeline have a slider; of others, one is chosen, or two are compared.
  show_choice_of_meshes() {
    const { viewer } = this,
      { models, state } = viewer,
      is_timeline = viewer.data.is_timeline;
    this.sections.shown.hidden = models.length < 2;
    this.shown.hidden = is_timeline;
    this.moment.hidden = this.play.hidden = !is_timeline;
    if (is_timeline) {
      this.moment.limit(models.length - 1);
      this.moment.show(state.shown);
      this.play.textContent = viewer.is_playing ? "Stop" : "Play";
      return;
    }
    const shown = models.map((one, i) => [String(i), one.name]);
    if (models.length === 2) shown.push(["2", "Both, with a slider"]);
    fill_once(this.shown, shown);
    this.shown.show(String(state.shown));
  }

  show_scale(field, state) {
    const style = getComputedStyle(this.element);
    draw_histogram(this.histogram, field, state, style.getPropertyValue("--soft"));
    this.ends.children[0].textContent = digits(field.from);
    this.ends.children[1].textContent = digits(field.to) + (field.unit ? ` ${field.unit}` : "");
    const { parts } = this,
      share = (x) => (x - field.from) / (field.to - field.from || 1);
    parts.filter.show(state.filter.on);
    parts.filter_low.show(share(state.filter.low));
    parts.filter_high.show(share(state.filter.high));
    parts.map.show(state.map);
    parts.low.show(state.low);
    parts.high.show(state.high);
  }

  show_regions(field, state) {
    const key = JSON.stringify([field.name, field.regions, state.hidden_regions]);
    if (this.regions.key === key) return;
    this.regions.key = key;
    this.regions.replaceChildren(
      ...field.regions.map(([region, count], place) => {
        const hidden = state.hidden_regions.includes(region);
        const row = check(`${field.names?.[region] ?? region}: ${count} cells`, (on) =>
          this.viewer.set({
            hidden_regions: on
              ? state.hidden_regions.filter((one) => one !== region)
              : [...state.hidden_regions, region],
          })
        );
        const swatch = make("i", { class: "swatch" });
        swatch.style.background = region_color(place);
        row.prepend(swatch);
        row.show(!hidden);
        return row;
      })
    );
  }

  show_worst(field) {
    const { viewer } = this;
    if (this.worst.of === viewer.worst) return;
    this.worst.of = viewer.worst;
    this.worst.replaceChildren(
      ...(viewer.worst ?? []).map(({ cell, value }) =>
        make(
          "li",
          {},
          button(`cell ${cell}: ${digits(value)}`, `Go to cell ${cell}`, () =>
            viewer.choose(cell, viewer.model, { fly: true })
          )
        )
      )
    );
    if (field) this.sections.worst.firstChild.textContent = field.worst === "high" ? "Highest values" : "Worst cells";
  }

  show_cell() {
    const { chosen, data } = this.viewer;
    this.cell.hidden = !chosen;
    if (!chosen) return;
    const place = chosen.center.map((x, k) => digits(x + data.origin[k])).join(", ");
    const rows = [
      ["number", String(chosen.cell)],
      ["kind", chosen.kind],
      ["center", place],
    ];
    for (const { label, value } of chosen.values) rows.push([label, digits(value)]);
    if (chosen.is_inverted) rows.push(["state", "inverted"]);
    else if (chosen.is_undecided) rows.push(["state", "not proved to be valid"]);
    this.facts.replaceChildren(...rows.flatMap(([name, value]) => [make("dt", {}, name), make("dd", {}, value)]));
  }

  /// Goes to the next of the worst cells.
  next_worst(step) {
    const { worst, chosen, model } = this.viewer;
    if (!worst?.length) return;
    const at = worst.findIndex(({ cell }) => cell === chosen?.cell);
    const next = at < 0 ? (step > 0 ? 0 : worst.length - 1) : (at + step + worst.length) % worst.length;
    this.viewer.choose(worst[next].cell, model, { fly: true });
  }
}

function fill_once(control, entries) {
  const key = JSON.stringify(entries);
  if (control.key !== key) control.fill(entries);
  control.key = key;
}

/// A line about a mesh: its cells, their least quality, those that are inverted.
export function summary(viewer) {
  const { info, num_shown, too_many } = viewer.model,
    counts = Object.entries(info.counts);
  const parts = counts.map(([name, count]) => `${count.toLocaleString("en")} ${plural(name, count)}`);
  const quality = info.fields.find((field) => field.map === "quality");
  if (quality) parts.push(`least ${quality.label[0].toLowerCase()}${quality.label.slice(1)} ${digits(quality.low)}`);
  if (too_many) parts.push("too many faces to draw them all: hide more cells");
  else if (num_shown !== undefined && num_shown < info.num_cells) parts.push(`${num_shown.toLocaleString("en")} shown`);
  return parts.join(", ");
}

function plural(name, count) {
  if (count === 1) return name;
  return name.endsWith("hedron") ? name.replace("hedron", "hedra") : `${name}s`;
}
