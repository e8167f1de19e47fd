// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/surface/label_grid.h"
#include "subvol/surface/triangle_mesh.h"
#include "tests/support/surface_fixtures.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>
#include <vector>

namespace subvol::test {

/// A box from `low` to `high` with n x n squares on each side, outward.
inline TriangleMesh box_surface(const Vec3& low, const Vec3& high, int n = 2) {
  TriangleMesh mesh = cube_surface(n, false);
  for (Vec3& p : mesh.positions) p = low + (high - low).cwiseProduct((p + Vec3::Ones()) / 2);
  return mesh;
}

/// A ball of n x n squares on each of six sides, outward.
inline TriangleMesh ball_surface(const Vec3& center, double radius, int n) {
  TriangleMesh mesh = cube_surface(n, true);
  for (Vec3& p : mesh.positions) p = center + radius * p;
  return mesh;
}

inline TriangleMesh turned(TriangleMesh mesh) {
  for (auto& t : mesh.triangles) std::swap(t[1], t[2]);
  return mesh;
}

inline TriangleMesh together(TriangleMesh a, const TriangleMesh& b) {
  const auto first = static_cast<Index>(a.positions.size());
  a.positions.insert(a.positions.end(), b.positions.begin(), b.positions.end());
  for (const auto& [i, j, k] : b.triangles) a.triangles.push_back({first + i, first + j, first + k});
  return a;
}

/// Slabs of a unit cube between equally spaced heights, each plane between two of them there once.
inline TriangleMesh slabs_surface(int count) {
  TriangleMesh mesh;
  for (int k = 0; k <= count; ++k)
    for (int i = 0; i < 4; ++i)
      mesh.positions.push_back(Vec3(i == 1 || i == 2, i >= 2, static_cast<double>(k) / count));
  for (int k = 0; k <= count; ++k) {
    const Index a = 4 * k;
    mesh.triangles.push_back(k == 0 ? std::array<Index, 3>{a, a + 2, a + 1} : std::array<Index, 3>{a, a + 1, a + 2});
    mesh.triangles.push_back(k == 0 ? std::array<Index, 3>{a, a + 3, a + 2} : std::array<Index, 3>{a, a + 2, a + 3});
    for (int i = 0; i < 4 && k < count; ++i) {
      const Index b = a + (i + 1) % 4;
      mesh.triangles.push_back({a + i, b, b + 4});
      mesh.triangles.push_back({a + i, b + 4, a + i + 4});
    }
  }
  return mesh;
}

/// The lower and the upper part of a unit cube, cut by a plane that rises by `rise` along x.
inline TriangleMesh tilted_cut_surface(double rise) {
  TriangleMesh mesh = slabs_surface(2);
  for (Vec3& p : mesh.positions)
    if (p.z() == 0.5) p.z() += rise * (p.x() - 0.5);
  return mesh;
}

/// A cylinder around the z axis from 0 to `height`, in layers between the radii; each wall and each ring of the caps is
/// there once. n: number of parts around.
inline TriangleMesh layered_cylinder(const std::vector<double>& radii, double height, int n) {
  TriangleMesh mesh;
  const auto rows = static_cast<int>(std::ceil(height * n / (2 * std::numbers::pi * radii.back())));
  const auto quad = [&](Index a, Index b, Index c, Index d) {
    mesh.triangles.push_back({a, b, c});
    mesh.triangles.push_back({a, c, d});
  };
  std::vector<Index> first;  // of each wall
  for (const double r : radii) {
    first.push_back(static_cast<Index>(mesh.positions.size()));
    for (int k = 0; k <= rows; ++k)
      for (int i = 0; i < n; ++i) {
        const double angle = 2 * std::numbers::pi * i / n;
        mesh.positions.push_back({r * std::cos(angle), r * std::sin(angle), height * k / rows});
      }
    for (int k = 0; k < rows; ++k)
      for (int i = 0; i < n; ++i) {
        const Index a = first.back() + k * n + i, b = first.back() + k * n + (i + 1) % n;
        quad(a, b, b + n, a + n);
      }
  }
  for (const int k : {0, rows}) {
    const auto center = static_cast<Index>(mesh.positions.size());
    mesh.positions.push_back({0, 0, height * k / rows});
    for (int i = 0; i < n; ++i) {
      mesh.triangles.push_back({center, first[0] + k * n + i, first[0] + k * n + (i + 1) % n});
      for (std::size_t layer = 0; layer + 1 < radii.size(); ++layer)
        quad(first[layer] + k * n + i, first[layer + 1] + k * n + i, first[layer + 1] + k * n + (i + 1) % n,
             first[layer] + k * n + (i + 1) % n);
    }
  }
  return mesh;
}

/// A skull-like phantom in a cube of n voxels a side: a shell (1), tissue inside it (2) and two organs in that (3, 4).
struct Phantom {
  int n;
  struct Ellipsoid {
    Vec3 center, axes;  ///< in parts of the cube's side
    /// About the distance from its surface, in the same unit; negative inside.
    double distance(const Vec3& p) const {
      const Vec3 q = (p - center).cwiseQuotient(axes);
      return (q.norm() - 1) * q.norm() / std::max(1e-9, q.cwiseQuotient(axes).norm());
    }
    double volume() const { return 4 * std::numbers::pi / 3 * axes.prod(); }
  };
  /// The outside of the shell, its inside, and the two organs.
  std::array<Ellipsoid, 4> shapes{{{{0.5, 0.5, 0.5}, {0.36, 0.42, 0.38}},
                                   {{0.5, 0.49, 0.5}, {0.31, 0.37, 0.33}},
                                   {{0.38, 0.45, 0.52}, {0.1, 0.18, 0.13}},
                                   {{0.63, 0.56, 0.45}, {0.11, 0.14, 0.16}}}};

  LabelGrid grid() const {
    LabelGrid grid;
    grid.counts = {n, n, n};
    for (int k = 0; k < n; ++k)
      for (int j = 0; j < n; ++j)
        for (int i = 0; i < n; ++i) {
          const Vec3 p = Vec3(i + 0.5, j + 0.5, k + 0.5) / n;
          int label = 0;
          for (int s = 0; s < 4; ++s)
            if (shapes[static_cast<std::size_t>(s)].distance(p) < 0) label = s + 1;
          grid.labels.push_back(label);
        }
    return grid;
  }
  /// Distance of a point, in voxels as the grid's, from the surface of a shape.
  double distance(const Vec3& p, int shape) const {
    return n * std::abs(shapes[static_cast<std::size_t>(shape)].distance((p + Vec3::Constant(0.5)) / n));
  }
};

}  // namespace subvol::test
