// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/basis.h"
#include "subvol/fit/elements/quadrature.h"
#include "subvol/fit/elements/shape_functions.h"
#include "tests/support/element_fixtures.h"

#include <catch2/catch.hpp>

#include <cmath>

using namespace subvol;
using namespace subvol::internal;
using namespace subvol::test;

namespace {

struct Line {
  std::array<double, kMaxOrder + 1> values, derivatives;
};
Line line_at(Basis basis, double x) {
  Line line;
  line_functions(basis, kMaxOrder, x, line.values.data(), line.derivatives.data());
  return line;
}
Line kernels_at(Basis basis, double x) {
  Line line;
  mode_kernels(basis, kMaxOrder, x, line.values.data(), line.derivatives.data());
  return line;
}

constexpr double kStep = 1e-5;  // central differences: step^2 times the third derivative of mode 15
constexpr double kDifference = 1e-4;

/// Every mode of a kind at an order, with all variants of its triangle faces.
std::vector<LocalMode> all_modes(CellKind kind, int order) {
  std::vector<LocalMode> modes;
  const CellTopology& topology = cell_topology(kind);
  for (int v = 0; v < topology.num_vertices; ++v) modes.push_back(vertex_mode(kind, v));
  for (int e = 0; e < topology.num_edges; ++e)
    for_each_mode(EntityShape::edge, order, [&](ModeIndex m) {
      modes.push_back(edge_mode(kind, topology.edges[e][0], topology.edges[e][1], m.i).mode);
    });
  for (int f = 0; f < topology.num_faces; ++f) {
    const auto& face = topology.faces[f];
    if (topology.face_sizes[f] == 4)
      for_each_mode(EntityShape::quad, order,
                    [&](ModeIndex m) { modes.push_back(quad_mode(kind, face[0], face[1], face[3], m.i, m.j).mode); });
    else
      for (int apex = 0; apex < 3; ++apex)
        for_each_mode(EntityShape::triangle, order, [&](ModeIndex m) {
          modes.push_back(triangle_mode(kind, face[(apex + 1) % 3], face[(apex + 2) % 3], face[apex], m.i, m.j).mode);
        });
  }
  for_each_mode(entity_shape(kind), order, [&](ModeIndex m) { modes.push_back(cell_mode(kind, m)); });
  return modes;
}

}  // namespace

TEST_CASE("modes of a line have their closed forms, vanish at the ends and have their parity", "[basis]") {
  for (const Basis basis : kBothBases) {
    INFO(to_string(basis));
    for (const double x : {0.0, 1.0})
      for (int i = 2; i <= kMaxOrder; ++i) CHECK(line_at(basis, x).values[i] == 0);
    for (const double x : {0.0, 0.03, 0.25, 0.4, 0.5, 0.7, 1.0}) {
      const Line here = line_at(basis, x), there = line_at(basis, 1 - x);
      CHECK(here.values[0] == 1 - x);
      CHECK(here.values[1] == x);
      for (int i = 1; i < kMaxOrder; ++i) {
        CHECK(there.values[i + 1] == Approx(mode_parity(i) * here.values[i + 1]).margin(1e-15));
        CHECK(there.derivatives[i + 1] == Approx(-mode_parity(i) * here.derivatives[i + 1]).margin(1e-13));
        if (basis == Basis::fourier)
          CHECK(here.values[i + 1] == Approx(std::sqrt(2.0) * std::sin(i * M_PI * x) / (i * M_PI)).margin(1e-15));
      }
    }
  }
  const double x = 0.3;
  const Line legendre = line_at(Basis::legendre, x);
  CHECK(legendre.values[2] == Approx(std::sqrt(3.0) * x * (1 - x)));
  CHECK(legendre.values[3] == Approx(std::sqrt(5.0) * x * (1 - x) * (1 - 2 * x)));
  CHECK(legendre.derivatives[2] == Approx(std::sqrt(3.0) * (1 - 2 * x)));
}

TEST_CASE("derivatives of line modes are orthonormal", "[basis]") {
  const LineRule rule = gauss_rule(40);
  for (const Basis basis : kBothBases)
    for (int i = 1; i < kMaxOrder; ++i)
      for (int j = 1; j <= i; ++j) {
        double sum = 0;
        for (std::size_t q = 0; q < rule.points.size(); ++q) {
          const Line line = line_at(basis, rule.points[q]);
          sum += rule.weights[q] * line.derivatives[i + 1] * line.derivatives[j + 1];
        }
        CHECK(sum == Approx(i == j ? 1 : 0).margin(1e-12));
      }
}

TEST_CASE("derivatives of line modes and kernels are differences in the limit", "[basis]") {
  for (const Basis basis : kBothBases)
    for (const double x : {0.001, 0.02, 0.1, 0.2, 0.37, 0.499, 0.501, 0.8, 0.999}) {
      const Line line = line_at(basis, x), above = line_at(basis, x + kStep), below = line_at(basis, x - kStep);
      const Line kernel = kernels_at(basis, x);
      const Line kernel_above = kernels_at(basis, x + kStep), kernel_below = kernels_at(basis, x - kStep);
      for (int i = 0; i <= kMaxOrder; ++i)
        CHECK((above.values[i] - below.values[i]) / (2 * kStep) == Approx(line.derivatives[i]).margin(kDifference));
      for (int i = 0; i + 1 < kMaxOrder; ++i) {
        const double scale = std::max(1.0, std::abs(kernel.derivatives[i]));
        CHECK((kernel_above.values[i] - kernel_below.values[i]) / (2 * kStep) / scale ==
              Approx(kernel.derivatives[i] / scale).margin(kDifference));
        CHECK(kernel.values[i] * x * (1 - x) == Approx(line.values[i + 2]).margin(1e-14));
      }
    }
}

TEST_CASE("kernels are smooth up to the ends", "[basis]") {
  for (const Basis basis : kBothBases) {
    const Line end = kernels_at(basis, 0), near = kernels_at(basis, 1e-13), slope = line_at(basis, 0);
    for (int i = 0; i + 1 < kMaxOrder; ++i) {
      CHECK(end.values[i] == Approx(slope.derivatives[i + 2]));
      CHECK(near.values[i] == Approx(end.values[i]).epsilon(1e-9));
      CHECK(near.derivatives[i] == Approx(end.derivatives[i]).epsilon(1e-9));
    }
  }
}

TEST_CASE("vertex functions are linear and sum to one; modes vanish at vertices and on what they do not belong to",
          "[basis]") {
  PointSource source(3);
  for (const Basis basis : kBothBases)
    for (const CellKind kind : kAllKinds) {
      const CellTopology& topology = cell_topology(kind);
      const auto corners = canonical_vertices(kind);
      ShapeFunctions shapes(kind, basis, 6);
      for (int v = 0; v < topology.num_vertices; ++v) {
        shapes.set_point(corners[v]);
        for (int other = 0; other < topology.num_vertices; ++other)
          CHECK(shapes.value(vertex_mode(kind, other)) == (v == other ? 1 : 0));
        for (const LocalMode& mode : all_modes(kind, 6))
          if (mode.i + mode.j + mode.k > 3) CHECK(shapes.value(mode) == 0);
      }
      const Vec3 p = source.inside(kind);
      shapes.set_point(p);
      double sum = 0;
      for (int v = 0; v < topology.num_vertices; ++v) sum += shapes.value(vertex_mode(kind, v));
      CHECK(sum == Approx(1));
      // On every face: functions of the cell, and of vertices and edges that are not of the face, are zero.
      for (int f = 0; f < topology.num_faces; ++f) {
        const auto& face = topology.faces[f];
        const Vec3 &a = corners[face[0]], &b = corners[face[1]], &d = corners[face[topology.face_sizes[f] - 1]];
        shapes.set_point(a + 0.3 * (b - a) + 0.4 * (d - a));
        for_each_mode(entity_shape(kind), 6,
                      [&](ModeIndex m) { CHECK(std::abs(shapes.value(cell_mode(kind, m))) < 1e-15); });
        const auto of_face = [&](int v) { return std::find(face.begin(), face.end(), v) != face.end(); };
        for (int v = 0; v < topology.num_vertices; ++v)
          if (!of_face(v)) CHECK(std::abs(shapes.value(vertex_mode(kind, v))) < 1e-15);
        for (int e = 0; e < topology.num_edges; ++e) {
          const auto [v, w] = topology.edges[e];
          if (of_face(v) && of_face(w)) continue;
          for (int i = 1; i < 6; ++i) CHECK(std::abs(shapes.value(edge_mode(kind, v, w, i).mode)) < 1e-15);
        }
      }
    }
}

TEST_CASE("gradients of shape functions are differences in the limit", "[basis]") {
  PointSource source(11);
  for (const Basis basis : kBothBases)
    for (const CellKind kind : kAllKinds) {
      const std::vector<LocalMode> modes = all_modes(kind, 8);
      ShapeFunctions shapes(kind, basis, 8);
      for (int repeat = 0; repeat < 3; ++repeat) {
        const Vec3 p = 0.05 * Vec3::Ones() + 0.8 * source.inside(kind);
        for (const LocalMode& mode : modes) {
          Vec3 gradient, difference;
          shapes.set_point(p);
          shapes.value(mode, gradient);
          for (int d = 0; d < 3; ++d) {
            shapes.set_point(p + kStep * Vec3::Unit(d));
            difference[d] = shapes.value(mode);
            shapes.set_point(p - kStep * Vec3::Unit(d));
            difference[d] = (difference[d] - shapes.value(mode)) / (2 * kStep);
          }
          CHECK((difference - gradient).norm() < 1e-6);
        }
      }
    }
}
