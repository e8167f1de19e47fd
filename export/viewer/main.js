// SPDX-License-Identifier: GPL-3.0-or-later
// Puts the viewer into every element of the page that has its data: <div class="subvol-viewer"> with a script of JSON.
import { INVERTED, MAPS } from "./colors.js";
import { button, digits, make } from "./dom.js";
import { draw_legend } from "./histogram.js";
import { Panel, summary } from "./panel.js";
import style from "./style.css";
import { Viewer } from "./viewer.js";

const LEGEND_TEXT = 13; // pixels of the page

async function start(root) {
  const data = JSON.parse(root.querySelector("script[type='application/json']").textContent);
  const is_part = root.classList.contains("part"),
    is_whole_window = !is_part && window.parent === window;
  root.tabIndex = -1;
  const canvas = make("canvas", {
    tabIndex: 0,
    role: "img",
    "aria-label": `${data.title}: the mesh in three dimensions. Arrow keys turn it; h lists all keys.`,
  });
  const line = make("p"),
    bad = make("p", { class: "bad" }),
    wait = make("div", { class: "wait", role: "status" }, "Opening the mesh …");
  const title = make("div", { class: "title" }, make(is_part ? "h2" : "h1", {}, data.title), line, bad);
  title.setAttribute("aria-live", "polite");
  const scale = make("div", { class: "legend" }),
    labels = make("div"),
    tools = make("div", { class: "tools", role: "toolbar", "aria-label": "Tools" });
  const divider = make("div", {
    class: "divider",
    role: "slider",
    tabIndex: 0,
    "aria-label": "Between before and after",
    "aria-valuemin": "0",
    "aria-valuemax": "100",
  });
  const sides = [make("span", { class: "side" }), make("span", { class: "side" })];
  const stage = make(
    "div",
    { class: "stage" },
    canvas,
    ...sides,
    divider,
    labels,
    title,
    make("div", { class: "foot" }, tools, scale),
    wait
  );
  root.append(stage);

  let panel,
    viewer,
    is_dark = false;
  try {
    viewer = new Viewer(canvas, data, {
      changed: () => panel && viewer.models.length > 0 && refresh(),
      labels: (list) =>
        labels.replaceChildren(
          ...list.map(({ x, y, text }) => {
            const label = make("span", { class: "label" }, text);
            label.style.left = `${x}px`;
            label.style.top = `${y}px`;
            return label;
          })
        ),
      is_active: () => is_whole_window || root.contains(document.activeElement),
    });
  } catch (error) {
    wait.textContent = "This browser cannot draw in three dimensions (WebGL is missing or switched off).";
    throw error;
  }

  const preferred = matchMedia("(prefers-color-scheme: dark)");
  const use_theme = (dark) => {
    is_dark = dark;
    root.classList.toggle("dark", dark);
    viewer.theme(dark);
    if (viewer.models.length > 0) refresh();
  };
  preferred.addEventListener("change", () => use_theme(preferred.matches));

  const picture = () => {
    viewer.draw_now();
    const copy = make("canvas", { width: canvas.width, height: canvas.height }),
      paper = copy.getContext("2d"),
      ratio = viewer.renderer.getPixelRatio();
    paper.drawImage(canvas, 0, 0);
    const text = LEGEND_TEXT * ratio,
      ink = getComputedStyle(root).color;
    if (viewer.field)
      draw_legend(paper, viewer.field, viewer.state, {
        x: text,
        y: copy.height - 3 * text,
        width: 12 * text,
        ink,
        text,
      });
    return copy;
  };
  const save = () =>
    picture().toBlob((blob) => {
      const link = make("a", {
        href: URL.createObjectURL(blob),
        download: `${data.title.replace(/[^\w.-]+/g, "_")}.png`,
      });
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    });
  panel = new Panel(viewer);
  root.append(panel.element);
  const toggle_panel = () => {
    root.classList.toggle("closed");
    refresh();
  };
  const measure = () => {
    viewer.measured = [];
    viewer.draw_measure();
    viewer.set({ measuring: !viewer.state.measuring });
  };
  const buttons = {
    panel: button("Controls", "Show or hide the controls", toggle_panel),
    home: button("Fit", "The whole mesh (0)", () => viewer.camera.home()),
    cut: button("Cut", "Cut with a plane (c)", () => viewer.set({ cut: { on: !viewer.state.cut.on } })),
    measure: button("Measure", "Click two points to measure between them (m)", measure),
    picture: button("Picture", "Save a picture (s)", save),
    theme: button("Dark", "Dark or light (d)", () => use_theme(!is_dark)),
  };
  tools.append(...Object.values(buttons));

  function refresh() {
    const { state, field, models } = viewer;
    panel.show();
    line.textContent =
      state.measuring && viewer.measured.length < 2 ? "Click two points to measure between them." : summary(viewer);
    const { num_inverted, num_undecided } = viewer.model.info;
    bad.textContent =
      num_inverted > 0
        ? `${num_inverted.toLocaleString("en")} inverted`
        : num_undecided > 0
          ? `${num_undecided.toLocaleString("en")} not proved to be valid`
          : "";
    root.classList.toggle("measuring", state.measuring);
    buttons.cut.setAttribute("aria-pressed", state.cut.on);
    buttons.measure.setAttribute("aria-pressed", state.measuring);
    buttons.panel.setAttribute("aria-expanded", !root.classList.contains("closed"));
    buttons.theme.textContent = is_dark ? "Light" : "Dark";
    scale.hidden = !field || Boolean(field.regions);
    if (!scale.hidden) {
      const bar = make("i");
      const inverted = field.map === "quality" && field.low <= 0 ? `${INVERTED} 0 10%, ` : "";
      const stops = MAPS[state.map].map((one, i) => (inverted && i === 0 ? `${one} 10%` : one));
      bar.style.background = `linear-gradient(90deg, ${inverted}${stops.join(", ")})`;
      scale.replaceChildren(
        make("span", {}, field.label + (field.unit ? `, ${field.unit}` : "")),
        bar,
        make(
          "div",
          {},
          make("span", {}, inverted ? "≤ 0 inverted" : digits(state.low)),
          make("span", {}, digits(state.high))
        )
      );
    }
    const comparing = viewer.is_comparing;
    divider.hidden = !comparing;
    sides.forEach((side, i) => {
      side.hidden = !comparing;
      side.textContent = models[i]?.name ?? "";
    });
    if (comparing) {
      divider.style.left = `${100 * state.wipe}%`;
      divider.setAttribute("aria-valuenow", Math.round(100 * state.wipe));
      sides[0].style.right = `${100 - 100 * state.wipe}%`;
      sides[1].style.left = `${100 * state.wipe}%`;
    }
  }

  const wipe = (x) => viewer.set({ wipe: Math.max(0, Math.min(1, x)) });
  divider.addEventListener("pointerdown", (event) => divider.setPointerCapture(event.pointerId));
  divider.addEventListener("pointermove", (event) => {
    const box = stage.getBoundingClientRect();
    if (event.buttons) wipe((event.clientX - box.left) / box.width);
  });
  divider.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: -0.02, ArrowRight: 0.02 }[event.key];
    if (!step) return;
    event.preventDefault();
    event.stopPropagation();
    wipe(viewer.state.wipe + step);
  });

  const keys = {
    e: () => viewer.set({ edges: !viewer.state.edges }),
    w: () => viewer.set({ faces: !viewer.state.faces }),
    c: () => buttons.cut.click(),
    m: measure,
    s: save,
    "[": () => viewer.set({ cut: { on: true, position: Math.max(0, viewer.state.cut.position - 0.02) } }),
    "]": () => viewer.set({ cut: { on: true, position: Math.min(1, viewer.state.cut.position + 0.02) } }),
    p: () => viewer.set({ peel: Math.min(viewer.state.peel + 1, Math.max(0, viewer.model.info.num_layers - 1)) }),
    P: () => viewer.set({ peel: Math.max(0, viewer.state.peel - 1) }),
    f: () => viewer.set({ filter: { on: !viewer.state.filter.on } }),
    n: () => panel.next_worst(1),
    N: () => panel.next_worst(-1),
    t: () => viewer.play(!viewer.is_playing),
    ",": () => viewer.step(-1),
    ".": () => viewer.step(1),
    g: () => viewer.set({ target: !viewer.state.target }),
    l: () => viewer.set({ limit: !viewer.state.limit }),
    d: () => use_theme(!is_dark),
    Escape: () => (viewer.state.measuring ? measure() : viewer.choose(null)),
  };
  keys.h = keys["?"] = () => {
    root.classList.remove("closed");
    const list = panel.sections.keys;
    list.open = !list.open;
    if (list.open) list.scrollIntoView({ block: "nearest" });
  };
  root.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || /^(INPUT|SELECT|TEXTAREA)$/.test(event.target.tagName))
      return;
    if (event.target !== canvas && (event.key === "Enter" || event.key === " " || event.key === "Tab")) return;
    if (!viewer.models.length) return;
    if (keys[event.key]) keys[event.key]();
    else if (!viewer.camera.key(event)) return;
    event.preventDefault();
  });
  if (matchMedia("(max-width: 700px)").matches) root.classList.add("closed");

  use_theme(preferred.matches);
  await viewer.open();
  wait.remove();
  refresh();
  if (is_whole_window) canvas.focus();
  return { viewer, picture, set: (change) => viewer.set(change), frames: (count) => viewer.frames(count), use_theme };
}

document.head.append(make("style", {}, style));
/// For scripts and tests: a promise of {viewer, set(change), frames(count), picture()} of the first viewer of the page.
globalThis.subvolViewer = Promise.all(
  [...document.querySelectorAll(".subvol-viewer")].map((root) =>
    start(root).catch((error) => {
      const wait = root.querySelector(".wait") ?? root.appendChild(make("div", { class: "wait" }));
      if (wait.textContent.startsWith("Opening")) wait.textContent = `The mesh cannot be shown: ${error.message}`;
      return { error };
    })
  )
).then(([first]) => first);
