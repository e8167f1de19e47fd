// SPDX-License-Identifier: GPL-3.0-or-later
// A camera that turns about a target, and the mouse, fingers and keys that move it.
import { PerspectiveCamera, Quaternion, Vector3 } from "three";

const ANGLE = 30; // of view, degrees
const TURN = 0.006; // radians per pixel
const KEY_TURN = Math.PI / 24;
const CLICK_PIXELS = 4; // a pointer that moves less has clicked
const FLIGHT_MS = 450;

/// Directions to look along: where the camera's right, up and back are.
const VIEWS = {
  x: [
    [0, 1, 0],
    [0, 0, 1],
    [1, 0, 0],
  ],
  y: [
    [-1, 0, 0],
    [0, 0, 1],
    [0, 1, 0],
  ],
  z: [
    [1, 0, 0],
    [0, 1, 0],
    [0, 0, 1],
  ],
};

export class Camera {
  /// canvas: gets the listeners. changed(): the view has moved. clicked(x, y, is_double): in pixels of the canvas.
  /// is_active(): true if the wheel belongs to the canvas and not to the page.
  constructor(canvas, { changed, clicked, is_active }) {
    Object.assign(this, { canvas, changed, clicked, is_active });
    this.camera = new PerspectiveCamera(ANGLE, 1, 0.01, 100);
    this.target = new Vector3();
    this.turn = new Quaternion();
    this.distance = 1;
    this.radius = 1;
    this.pointers = new Map();
    canvas.addEventListener("pointerdown", (event) => this.press(event));
    canvas.addEventListener("pointermove", (event) => this.move(event));
    for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => this.release(event));
    canvas.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    canvas.addEventListener("dblclick", (event) => clicked(event.offsetX, event.offsetY, true));
    canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  }

  get height() {
    return Math.max(1, this.canvas.clientHeight);
  }
  get width() {
    return Math.max(1, this.canvas.clientWidth);
  }
  /// Length of the model per pixel at the target.
  get unit() {
    return (2 * this.distance * Math.tan((ANGLE * Math.PI) / 360)) / this.height;
  }

  /// Sets what `home` shows: a ball.
  surround(center, radius) {
    this.middle = center.clone();
    this.radius = radius || 1;
  }

  home() {
    const direction = new Vector3(1.1, -1.9, 1.0).normalize(); // z is up, as in most meshes
    this.fly(this.middle, this.fitting(this.radius), looking(direction, new Vector3(0, 0, 1)), 0);
  }

  /// Distance at which a ball fills the canvas.
  fitting(radius) {
    const angle = (ANGLE * Math.PI) / 360,
      across = Math.atan(Math.tan(angle) * Math.min(1, this.width / this.height));
    return (1.04 * radius) / Math.sin(across);
  }

  /// Looks along an axis; again: from the other side.
  along(axis) {
    const [right, up, back] = VIEWS[axis].map((v) => new Vector3(...v)),
      turn = new Quaternion();
    turn.setFromRotationMatrix(basis(right, up, back));
    const other = new Quaternion().setFromRotationMatrix(basis(right.clone().negate(), up, back.clone().negate()));
    this.fly(this.middle, this.fitting(this.radius), this.turn.angleTo(turn) < 0.01 ? other : turn);
  }

  /// Moves there within FLIGHT_MS, or at once.
  fly(target, distance, turn = this.turn, milliseconds = FLIGHT_MS) {
    const from = { target: this.target.clone(), turn: this.turn.clone(), distance: this.distance };
    const to = { target: target.clone(), turn: turn.clone(), distance },
      start = performance.now();
    const flight = (this.flight = {});
    const still = matchMedia("(prefers-reduced-motion: reduce)").matches || milliseconds === 0;
    const step = (now) => {
      if (this.flight !== flight) return;
      const t = still ? 1 : Math.min(1, Math.max(0, (now - start) / milliseconds)),
        s = t * t * (3 - 2 * t);
      this.target.lerpVectors(from.target, to.target, s);
      this.turn.slerpQuaternions(from.turn, to.turn, s);
      this.distance = from.distance * (to.distance / from.distance) ** s;
      this.changed();
      if (t < 1) requestAnimationFrame(step);
    };
    step(start);
  }

  /// Right, up, and back of the camera.
  axis(k) {
    return new Vector3().setComponent(k, 1).applyQuaternion(this.turn);
  }

  rotate(dx, dy) {
    const about_up = new Quaternion().setFromAxisAngle(this.axis(1), -dx);
    const about_right = new Quaternion().setFromAxisAngle(this.axis(0), -dy);
    this.turn.premultiply(about_up).premultiply(about_right).normalize();
    this.stop();
  }
  roll(angle) {
    this.turn.premultiply(new Quaternion().setFromAxisAngle(this.axis(2), angle)).normalize();
    this.stop();
  }
  pan(dx, dy) {
    this.target.addScaledVector(this.axis(0), -dx * this.unit).addScaledVector(this.axis(1), dy * this.unit);
    this.stop();
  }
  /// Zooms by a factor about a place of the canvas, or its middle.
  zoom(factor, x = this.width / 2, y = this.height / 2) {
    const distance = Math.max(this.radius * 1e-4, Math.min(this.radius * 50, this.distance / factor));
    const share = 1 - distance / this.distance,
      dx = x - this.width / 2,
      dy = y - this.height / 2;
    this.target
      .addScaledVector(this.axis(0), dx * this.unit * share)
      .addScaledVector(this.axis(1), -dy * this.unit * share);
    this.distance = distance;
    this.stop();
  }
  stop() {
    this.flight = null;
    this.changed();
  }

  /// Sets three's camera up for drawing.
  place(middle, radius) {
    const { camera } = this;
    camera.aspect = this.width / this.height;
    camera.quaternion.copy(this.turn);
    camera.position.copy(this.target).addScaledVector(this.axis(2), this.distance);
    const depth = camera.position.clone().sub(middle).dot(this.axis(2));
    camera.far = Math.max(depth + 1.05 * radius, radius * 1e-2);
    camera.near = Math.max(depth - 1.05 * radius, camera.far * 2e-4);
    camera.updateProjectionMatrix();
    camera.updateMatrixWorld();
  }

  press(event) {
    this.canvas.focus({ preventScroll: true });
    this.canvas.setPointerCapture(event.pointerId);
    this.pointers.set(event.pointerId, { x: event.offsetX, y: event.offsetY });
    this.travel = this.pointers.size > 1 ? Infinity : 0;
    this.pressed_at = { x: event.offsetX, y: event.offsetY };
  }
  move(event) {
    const pointer = this.pointers.get(event.pointerId);
    if (!pointer) return;
    const before = this.grip(),
      dx = event.offsetX - pointer.x,
      dy = event.offsetY - pointer.y;
    this.travel += Math.abs(dx) + Math.abs(dy);
    Object.assign(pointer, { x: event.offsetX, y: event.offsetY });
    if (this.travel < CLICK_PIXELS) return;
    if (this.pointers.size === 2) {
      const after = this.grip();
      this.pan(after.x - before.x, after.y - before.y);
      if (before.span > 0) this.zoom(after.span / before.span, after.x, after.y);
      this.roll(Math.atan2(Math.sin(after.angle - before.angle), Math.cos(after.angle - before.angle)));
    } else if (event.shiftKey || event.buttons & 6) this.pan(dx, dy);
    else if (event.ctrlKey || event.metaKey) this.zoom(Math.exp(-0.01 * dy));
    else this.rotate(dx * TURN, dy * TURN);
  }
  release(event) {
    const was_click = this.pointers.delete(event.pointerId) && this.travel < CLICK_PIXELS && event.type === "pointerup";
    if (was_click && event.button === 0) this.clicked(this.pressed_at.x, this.pressed_at.y, false);
  }
  /// Middle, distance and angle of two fingers.
  grip() {
    const [a, b] = [...this.pointers.values()];
    if (!b) return { x: a.x, y: a.y, span: 0, angle: 0 };
    return {
      x: (a.x + b.x) / 2,
      y: (a.y + b.y) / 2,
      span: Math.hypot(a.x - b.x, a.y - b.y),
      angle: -Math.atan2(b.y - a.y, b.x - a.x),
    };
  }
  wheel(event) {
    if (!this.is_active() && !event.ctrlKey) return;
    event.preventDefault();
    const pixels = event.deltaY * [1, 16, 100][event.deltaMode];
    this.zoom(Math.exp(-0.0015 * Math.max(-300, Math.min(300, pixels))), event.offsetX, event.offsetY);
  }

  /// Does what a key means for the camera; true if it means something.
  key(event) {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (step && event.shiftKey) this.pan(-40 * step[0], -40 * step[1]);
    else if (step) this.rotate(-step[0] * KEY_TURN, -step[1] * KEY_TURN);
    else if (event.key === "+" || event.key === "=") this.zoom(1.2);
    else if (event.key === "-") this.zoom(1 / 1.2);
    else if (event.key === "0" || event.key === "Home") this.home();
    else if (["x", "y", "z"].includes(event.key.toLowerCase())) this.along(event.key.toLowerCase());
    else return false;
    return true;
  }
}

function basis(right, up, back) {
  return new PerspectiveCamera().matrix.makeBasis(right, up, back);
}

/// The turn of a camera that is seen in a direction from its target.
function looking(direction, up) {
  const right = up.clone().cross(direction).normalize();
  return new Quaternion().setFromRotationMatrix(basis(right, direction.clone().cross(right), direction));
}
