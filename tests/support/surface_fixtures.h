// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/triangle_mesh.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <map>
#include <random>
#include <utility>

namespace subvol::test {

/// The unit cube's surface with n x n squares on each side, each square in two triangles, as if by reflection in the
/// coordinate planes: the mesh is its own mirror image in x, y and z for even n. Outward. `round`: pushed to the
/// sphere.
inline TriangleMesh cube_surface(int n, bool round) {
  TriangleMesh mesh;
  std::map<std::array<int, 3>, Index> numbers;
  const auto vertex = [&](const std::array<int, 3>& at) {
    const auto [it, added] = numbers.try_emplace(at, static_cast<Index>(mesh.positions.size()));
    if (added) {
      const Vec3 p(2.0 * at[0] / n - 1, 2.0 * at[1] / n - 1, 2.0 * at[2] / n - 1);
      mesh.positions.push_back(round ? Vec3(p.normalized()) : p);
    }
    return it->second;
  };
  for (int side = 0; side < 6; ++side)
    for (int i = 0; i < n; ++i)
      for (int j = 0; j < n; ++j) {
        const auto corner = [&](int di, int dj) {
          std::array<int, 3> at{};
          at[side % 3] = side < 3 ? n : 0;
          at[(side + 1) % 3] = i + di;
          at[(side + 2) % 3] = j + dj;
          return vertex(at);
        };
        const Index a = corner(0, 0), b = corner(1, 0), c = corner(1, 1), d = corner(0, 1);
        const bool falling = (2 * i < n) != (2 * j < n);
        std::array<std::array<Index, 3>, 2> pair{{{a, b, c}, {a, c, d}}};
        if (falling) pair = {{{a, b, d}, {b, c, d}}};
        for (auto t : pair) {
          if (side >= 3) std::swap(t[1], t[2]);
          mesh.triangles.push_back(t);
        }
      }
  return mesh;
}

class RandomPoints {
 public:
  explicit RandomPoints(unsigned seed) : generator_(seed) {}
  double number(double low = -1, double high = 1) {
    return std::uniform_real_distribution<double>(low, high)(generator_);
  }
  Vec3 point(double size = 1) { return size * Vec3(number(), number(), number()); }
  std::vector<Vec3> points(std::size_t n, double size = 1) {
    std::vector<Vec3> result(n);
    for (Vec3& p : result) p = point(size);
    return result;
  }

 private:
  std::mt19937 generator_;
};

inline TriangleMesh triangle_soup(std::size_t n, double size, unsigned seed) {
  RandomPoints random(seed);
  TriangleMesh mesh;
  for (std::size_t t = 0; t < n; ++t) {
    const Vec3 center = random.point();
    for (int k = 0; k < 3; ++k) mesh.positions.push_back(center + random.point(size));
    const auto v = static_cast<Index>(3 * t);
    mesh.triangles.push_back({v, v + 1, v + 2});
  }
  return mesh;
}

/// A square plate from z = 0 to 3 with a round hole in its middle, whose two rims have chamfers of some width.
inline TriangleMesh plate_with_chamfered_hole(double width) {
  constexpr Index kSides = 64, kRings = 6;
  constexpr double kHalf = 5, kHeight = 3, kRadius = 2.5;
  TriangleMesh mesh;
  const auto add_ring = [&](double z, const auto& radius) {
    for (Index i = 0; i < kSides; ++i) {
      const double angle = 2 * std::acos(-1.0) * i / kSides, x = std::cos(angle), y = std::sin(angle);
      const double r = radius(std::max(std::abs(x), std::abs(y)));
      mesh.positions.emplace_back(r * x, r * y, z);
    }
  };
  const auto square = [](double largest) { return kHalf / largest; };
  const auto circle = [](double radius) { return [radius](double) { return radius; }; };
  add_ring(kHeight, square);
  add_ring(kHeight, circle(kRadius + width));
  add_ring(kHeight - width, circle(kRadius));
  add_ring(width, circle(kRadius));
  add_ring(0, circle(kRadius + width));
  add_ring(0, square);
  for (Index ring = 0; ring < kRings; ++ring)
    for (Index i = 0; i < kSides; ++i) {
      const Index a = ring * kSides, b = (ring + 1) % kRings * kSides, j = (i + 1) % kSides;
      mesh.triangles.push_back({a + i, b + j, b + i});
      mesh.triangles.push_back({a + i, a + j, b + j});
    }
  return mesh;
}

/// The regular icosahedron: its vertices lie at distance 2 from five others.
inline TriangleMesh icosahedron_surface() {
  const double golden = (1 + std::sqrt(5.0)) / 2;
  TriangleMesh mesh;
  for (int axis = 0; axis < 3; ++axis)
    for (const double a : {-1.0, 1.0})
      for (const double b : {-golden, golden}) {
        Vec3& p = mesh.positions.emplace_back(Vec3::Zero());
        p[(axis + 1) % 3] = a;
        p[(axis + 2) % 3] = b;
      }
  const auto is_edge = [&](Index i, Index j) { return (mesh.positions[i] - mesh.positions[j]).norm() < 2.1; };
  for (Index i = 0; i < 12; ++i)
    for (Index j = i + 1; j < 12; ++j)
      for (Index k = j + 1; k < 12; ++k) {
        if (!is_edge(i, j) || !is_edge(j, k) || !is_edge(k, i)) continue;
        const Vec3 &x = mesh.positions[i], &y = mesh.positions[j], &z = mesh.positions[k];
        const bool is_outward = (y - x).cross(z - x).dot(x) > 0;
        mesh.triangles.push_back(is_outward ? std::array{i, j, k} : std::array{i, k, j});
      }
  return mesh;
}

}  // namespace subvol::test
