// SPDX-License-Identifier: GPL-3.0-or-later
// How surfaces, lines and marks are drawn.
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  DataTexture,
  DoubleSide,
  FrontSide,
  NearestFilter,
  LinearFilter,
  RGBAFormat,
  ShaderMaterial,
  Vector2,
  Vector4,
} from "three";
import { INVERTED, at, region_color, rgb } from "./colors.js";

/// Uniforms that all materials share: one change is seen by all.
export function shared_uniforms() {
  return {
    shrink: { value: 1 },
    plane: { value: new Vector4(0, 0, 0, 0) },
    is_clipped: { value: 0 },
    plain: { value: new Color("#b8c0cc") },
    inverted: { value: color(INVERTED) },
    ink: { value: color("#10151b") },
    pixels: { value: 1 },
  };
}

/// A color whose numbers are those of sRGB: the shaders compute with these.
export function color(text) {
  return new Color(...rgb(text).map((c) => c / 255));
}

const PLACE = `
  uniform float shrink;
  #ifdef SHRUNK
  attribute vec3 center;
  #endif
  varying vec3 place, view;
  void put() {
    place = position;
    #ifdef SHRUNK
    place = mix(center, position, shrink);
    #endif
    vec4 seen = modelViewMatrix * vec4(place, 1.0);
    view = seen.xyz;
    gl_Position = projectionMatrix * seen;
  }
`;
const CLIP = `
  uniform vec4 plane;
  uniform float is_clipped;
  varying vec3 place, view;
  void clip() {
    #ifndef UNCUT
    if (is_clipped > 0.5 && dot(plane.xyz, place) > plane.w) discard;
    #endif
  }
`;

const LIGHT = `
  vec3 facing() {
    #ifdef SMOOTH
    vec3 n = normalize(slope);
    return gl_FrontFacing ? n : -n;
    #else
    return normalize(cross(dFdx(view), dFdy(view)));
    #endif
  }
  float light(vec3 n) {
    return 0.5 + 0.46 * max(dot(n, vec3(-0.33, 0.53, 0.78)), 0.0) + 0.14 * max(dot(n, vec3(0.81, -0.33, 0.49)), 0.0);
  }
`;

/// Material of a surface. options: smooth (it has normals), shrunk (it has centers), closed (its back is never seen),
/// section (it is flat: evenly lit, and not cut).
export function surface_material(shared, own, { smooth = false, shrunk = false, closed = false, section = false } = {}) {
  return new ShaderMaterial({
    side: closed ? FrontSide : DoubleSide,
    polygonOffset: true,
    polygonOffsetFactor: 1,
    polygonOffsetUnits: 1,
    uniforms: { ...shared, ...own },
    defines: defines({ SMOOTH: smooth, SHRUNK: shrunk, UNCUT: section }),
    vertexShader: `attribute float value; varying float amount; varying vec3 slope; ${PLACE}
      void main() { put(); amount = value; slope = normalMatrix * normal; }`,
    fragmentShader: `varying float amount; varying vec3 slope; uniform sampler2D map; uniform vec2 range;
      uniform float shows_inverted; uniform vec3 plain, inverted; ${CLIP} ${LIGHT}
      void main() {
        clip();
        vec3 color = texture2D(map, vec2((amount - range.x) / max(range.y - range.x, 1e-30), 0.5)).rgb;
        if (shows_inverted > 0.5 && amount <= 0.0) color = inverted;
        if (amount > 1e30) color = plain;
        gl_FragColor = vec4(color * ${section ? "0.94" : "light(facing())"}, 1.0);
      }`,
  });
}

/// Material of a ghost: clear where it is seen from the front, denser toward its outline.
export function ghost_material(shared, tint, { smooth = false } = {}) {
  return new ShaderMaterial({
    side: DoubleSide,
    transparent: true,
    depthWrite: false,
    uniforms: { ...shared, tint: { value: tint }, opacity: { value: 0.5 } },
    defines: defines({ SMOOTH: smooth, UNCUT: true }),
    vertexShader: `varying vec3 slope; ${PLACE} void main() { put(); slope = normalMatrix * normal; }`,
    fragmentShader: `varying vec3 slope; uniform vec3 tint; uniform float opacity; ${CLIP} ${LIGHT}
      void main() {
        vec3 n = facing();
        float edge = 1.0 - abs(dot(n, normalize(view)));
        gl_FragColor = vec4(tint * light(n), opacity * (0.14 + 0.75 * edge * edge));
      }`,
  });
}

/// Material of edges, which fade where they would lie closer than a few pixels. through: drawn over everything.
export function line_material(
  shared,
  { tint = null, length = null, shrunk = false, uncut = false, through = false, strength = 0.8 } = {}
) {
  return new ShaderMaterial({
    transparent: true,
    depthWrite: false,
    depthTest: !through,
    uniforms: {
      ...shared,
      tint: tint ? { value: tint } : shared.ink,
      length: length ?? { value: 1e9 },
      strength: { value: strength },
    },
    defines: defines({ SHRUNK: shrunk, UNCUT: uncut }),
    vertexShader: `uniform float length, pixels; varying float seen; ${PLACE}
      void main() { put(); seen = clamp((length * pixels / max(-view.z, 1e-30) - 2.0) / 10.0, 0.0, 1.0); }`,
    fragmentShader: `uniform vec3 tint; uniform float strength; varying float seen; ${CLIP}
      void main() { clip(); if (seen <= 0.0) discard; gl_FragColor = vec4(tint, strength * seen); }`,
  });
}

/// Material of marks: discs of a fixed size that are seen through everything.
export function mark_material(tint, size) {
  return new ShaderMaterial({
    transparent: true,
    depthTest: false,
    depthWrite: false,
    uniforms: { tint: { value: tint }, size: { value: size } },
    vertexShader: `uniform float size;
      void main() { gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.0); gl_PointSize = size; }`,
    fragmentShader: `uniform vec3 tint;
      void main() {
        float r = length(gl_PointCoord - 0.5) * 2.0;
        if (r > 1.0) discard;
        gl_FragColor = vec4(r > 0.7 ? vec3(1.0) : tint, 0.95);
      }`,
  });
}

function defines(flags) {
  return Object.fromEntries(
    Object.entries(flags)
      .filter(([, on]) => on)
      .map(([name]) => [name, ""])
  );
}

/// What a surface is colored by: a texture, a range of values.
export function color_uniforms() {
  return { map: { value: null }, range: { value: new Vector2(0, 1) }, shows_inverted: { value: 0 } };
}

/// Texture of a color map, or of so many regions.
export function map_texture(stops, num_regions = 0) {
  const size = num_regions || 256,
    bytes = new Uint8Array(4 * size);
  for (let i = 0; i < size; ++i)
    bytes.set([...(num_regions ? rgb(region_color(i)) : at(stops, i / (size - 1))), 255], 4 * i);
  const texture = new DataTexture(bytes, size, 1, RGBAFormat);
  texture.minFilter = texture.magFilter = num_regions ? NearestFilter : LinearFilter;
  texture.needsUpdate = true;
  return texture;
}

/// Geometry of three.js from arrays by name; `index` is that of the triangles or segments.
export function geometry_of(arrays, index) {
  const geometry = new BufferGeometry();
  for (const [name, values, size] of arrays) if (values) geometry.setAttribute(name, new BufferAttribute(values, size));
  if (index) geometry.setIndex(new BufferAttribute(index, 1));
  return geometry;
}
