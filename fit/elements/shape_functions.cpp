// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/shape_functions.h"

#include <cassert>

namespace subvol {

namespace {

/// Gradients of the barycentric coordinates of tet and triangle in (u, v, w): l_0 = 1 - u - v (- w), l_1 = u, ..
Vec3 barycentric_gradient(CellKind kind, int vertex) {
  if (vertex > 0) return Vec3::Unit(vertex - 1);
  return kind == CellKind::tet ? Vec3(-1, -1, -1) : Vec3(-1, -1, 0);
}

/// The edge of a kind between two local vertices (prism: of its triangle); `forward` is true if it runs from a to b.
int find_edge(CellKind kind, int a, int b, bool& forward) {
  const CellTopology& topology = cell_topology(kind);
  for (int e = 0; e < topology.num_edges; ++e) {
    forward = topology.edges[e][0] == a && topology.edges[e][1] == b;
    if (forward || (topology.edges[e][0] == b && topology.edges[e][1] == a)) return e;
  }
  assert(false);
  return -1;
}

int sign_of(bool forward, int i) { return forward ? 1 : mode_parity(i); }

/// The axis along which two vertices of a hex differ; `forward` is true if it grows from a to b.
int axis_between(const Vec3& a, const Vec3& b, bool& forward) {
  int axis = 0;
  while (a[axis] == b[axis]) ++axis;
  forward = b[axis] > a[axis];
  return axis;
}

/// Puts phi_i along the axis from a to b into a hex's mode.
void set_axis_mode(SignedMode& signed_mode, const Vec3& a, const Vec3& b, int i) {
  bool forward;
  const int axis = axis_between(a, b, forward);
  (axis == 0   ? signed_mode.mode.i
   : axis == 1 ? signed_mode.mode.j
               : signed_mode.mode.k) = static_cast<std::uint8_t>(i + 1);
  signed_mode.sign *= sign_of(forward, i);
}

/// Puts phi_i from local vertex a to b (upright or along the triangle) into a prism's mode; its other factor stays.
void set_prism_mode(SignedMode& signed_mode, int a, int b, int i) {
  bool forward = b > a;
  if (a % 3 == b % 3) {
    signed_mode.mode.k = static_cast<std::uint8_t>(i + 1);
  } else {
    signed_mode.mode.edge = static_cast<std::int8_t>(find_edge(CellKind::prism, a % 3, b % 3, forward));
    signed_mode.mode.vertex = -1;
    signed_mode.mode.i = static_cast<std::uint8_t>(i);
  }
  signed_mode.sign *= sign_of(forward, i);
}

}  // namespace

std::span<const Vec3> canonical_vertices(CellKind kind) {
  static const std::array<Vec3, 4> tet = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0), Vec3(0, 0, 1)};
  static const std::array<Vec3, 6> prism = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(0, 1, 0),
                                            Vec3(0, 0, 1), Vec3(1, 0, 1), Vec3(0, 1, 1)};
  static const std::array<Vec3, 8> hex = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0),
                                          Vec3(0, 0, 1), Vec3(1, 0, 1), Vec3(1, 1, 1), Vec3(0, 1, 1)};
  static const std::array<Vec3, 5> pyramid = {Vec3(0, 0, 0), Vec3(1, 0, 0), Vec3(1, 1, 0), Vec3(0, 1, 0),
                                              Vec3(0, 0, 1)};
  switch (kind) {
    case CellKind::tet: return tet;
    case CellKind::prism: return prism;
    case CellKind::pyramid: return pyramid;
    case CellKind::hex: break;
  }
  return hex;
}

EntityShape entity_shape(CellKind kind) {
  constexpr EntityShape kShapesOfCellKinds[] = {EntityShape::tet, EntityShape::prism, EntityShape::hex,
                                                EntityShape::pyramid};
  return kShapesOfCellKinds[static_cast<std::size_t>(kind)];
}

int num_modes(EntityShape shape, int order) {
  const int n = order - 1;
  switch (shape) {
    case EntityShape::edge: return n;
    case EntityShape::triangle: return n * (n - 1) / 2;
    case EntityShape::quad: return n * n;
    case EntityShape::tet: return n * (n - 1) * (n - 2) / 6;
    case EntityShape::prism: return n * n * (n - 1) / 2;
    case EntityShape::pyramid: return 0;
    case EntityShape::hex: break;
  }
  return n * n * n;
}

LocalMode vertex_mode(CellKind kind, int vertex) {
  LocalMode mode;
  if (kind == CellKind::tet || kind == CellKind::pyramid) {
    mode.vertex = static_cast<std::int8_t>(vertex);
  } else if (kind == CellKind::prism) {
    mode.vertex = static_cast<std::int8_t>(vertex % 3);
    mode.k = static_cast<std::uint8_t>(vertex / 3);
  } else {
    const Vec3& at = canonical_vertices(kind)[vertex];
    mode.i = static_cast<std::uint8_t>(at[0]);
    mode.j = static_cast<std::uint8_t>(at[1]);
    mode.k = static_cast<std::uint8_t>(at[2]);
  }
  return mode;
}

SignedMode edge_mode(CellKind kind, int a, int b, int i) {
  SignedMode result{vertex_mode(kind, a)};
  if (kind == CellKind::hex) {
    set_axis_mode(result, canonical_vertices(kind)[a], canonical_vertices(kind)[b], i);
  } else if (kind == CellKind::prism) {
    set_prism_mode(result, a, b, i);
  } else {
    bool forward;
    result.mode = {.edge = static_cast<std::int8_t>(find_edge(kind, a, b, forward)), .i = static_cast<std::uint8_t>(i)};
    result.sign = sign_of(forward, i);
  }
  return result;
}

SignedMode quad_mode(CellKind kind, int a, int b, int d, int i, int j) {
  SignedMode result = edge_mode(kind, a, b, i);
  if (kind == CellKind::hex)
    set_axis_mode(result, canonical_vertices(kind)[a], canonical_vertices(kind)[d], j);
  else
    set_prism_mode(result, a, d, j);
  return result;
}

SignedMode triangle_mode(CellKind kind, int a, int b, int c, int i, int j) {
  SignedMode result = edge_mode(kind, a, b, i);
  result.mode.vertex = static_cast<std::int8_t>(kind == CellKind::prism ? c % 3 : c);
  result.mode.j = static_cast<std::uint8_t>(j);
  return result;
}

LocalMode cell_mode(CellKind kind, ModeIndex index) {
  LocalMode mode;
  mode.i = static_cast<std::uint8_t>(kind == CellKind::hex ? index.i + 1 : index.i);
  mode.j = static_cast<std::uint8_t>(kind == CellKind::hex ? index.j + 1 : index.j);
  mode.k = static_cast<std::uint8_t>(kind == CellKind::tet ? index.k : index.k + 1);
  if (kind != CellKind::hex) mode.edge = 0, mode.vertex = 2;
  return mode;
}

ShapeFunctions::ShapeFunctions(CellKind kind, Basis basis, int max_order)
    : kind_(kind), basis_(basis), max_order_(max_order) {
  assert(max_order >= 1 && max_order <= kMaxOrder);
}

void ShapeFunctions::set_axis(int axis, double x) {
  std::array<double, kMaxOrder + 1> values, derivatives;
  line_functions(basis_, max_order_, x, values.data(), derivatives.data());
  for (int i = 0; i <= max_order_; ++i) axes_[axis][i] = {values[i], derivatives[i] * Vec3::Unit(axis)};
}

void ShapeFunctions::set_pyramid_point(const Vec3& point) {
  const double below = 1 - point[2];  // height left to the apex
  const bool is_apex = !(below > 0);
  const double s = is_apex ? 0.5 : point[0] / below, t = is_apex ? 0.5 : point[1] / below;
  for (int v = 0; v < 4; ++v) {
    const bool far_u = v == 1 || v == 2, far_v = v >= 2;
    const double fu = far_u ? s : 1 - s, fv = far_v ? t : 1 - t;
    const double du = (far_u ? 1 : -1) * fv, dv = (far_v ? 1 : -1) * fu;
    vertices_[v][0] = {below * fu * fv, {du, dv, s * du + t * dv - fu * fv}};
  }
  vertices_[4][0] = {point[2], Vec3::UnitZ()};
}

void ShapeFunctions::set_point(const Vec3& point) {
  if (kind_ == CellKind::pyramid) return set_pyramid_point(point);
  if (kind_ == CellKind::hex) {
    for (int d = 0; d < 3; ++d) set_axis(d, point[d]);
    return;
  }
  const bool tet = kind_ == CellKind::tet;
  const int num_vertices = tet ? 4 : 3, num_edges = tet ? 6 : 3;
  if (!tet) set_axis(2, point[2]);

  std::array<Factor, 4> l;
  for (int c = 0; c < num_vertices; ++c) l[c] = {c > 0 ? point[c - 1] : 1.0, barycentric_gradient(kind_, c)};
  for (int c = 1; c < num_vertices; ++c) l[0].value -= point[c - 1];

  std::array<double, kMaxOrder> values, derivatives;
  for (int c = 0; c < num_vertices; ++c) {
    vertices_[c][0] = l[c];
    mode_kernels(basis_, max_order_, l[c].value, values.data(), derivatives.data());
    for (int j = 1; j < max_order_; ++j)
      vertices_[c][j] = product(l[c], {values[j - 1], derivatives[j - 1] * l[c].gradient});
  }
  for (int e = 0; e < num_edges; ++e) {
    const auto [a, b] = cell_topology(kind_).edges[e];
    const Vec3 slope = 0.5 * (l[b].gradient - l[a].gradient);
    const Factor ends = product(l[a], l[b]);
    mode_kernels(basis_, max_order_, 0.5 * (1 + l[b].value - l[a].value), values.data(), derivatives.data());
    for (int i = 1; i < max_order_; ++i) edges_[e][i] = product(ends, {values[i - 1], derivatives[i - 1] * slope});
  }
}

ShapeFunctions::Factor ShapeFunctions::evaluate(const LocalMode& mode) const {
  if (kind_ == CellKind::hex) return product(product(axes_[0][mode.i], axes_[1][mode.j]), axes_[2][mode.k]);
  Factor result{1, Vec3::Zero()};
  if (mode.edge >= 0) result = edges_[mode.edge][mode.i];
  if (mode.vertex >= 0) result = product(result, vertices_[mode.vertex][mode.j]);
  if (kind_ == CellKind::prism) return product(result, axes_[2][mode.k]);
  return mode.k > 0 ? product(result, vertices_[3][mode.k]) : result;
}

}  // namespace subvol
