// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/features/feature_curves.h"
#include "subvol/fit/features/feature_routing.h"
#include "subvol/fit/features/pads.h"
#include "subvol/fit/features/signed_features.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "tests/support/sample_meshes.h"
#include "tests/support/surface_fixtures.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

namespace subvol::test {

using namespace internal;

inline TriangleMesh surface_of(const VolumeMesh& mesh) {
  return triangulate(boundary_surface(mesh, MeshTopology(mesh)));
}

inline SignedFeatures features_of(const TriangleMesh& target) {
  return signed_features(target, feature_curves(target, 40));
}

/// A regular prism of n sides around the z axis, of circumradius 1 from z = -1 to 1, outward.
inline TriangleMesh prism_surface(int n, double turn = 0) {
  TriangleMesh mesh;
  for (int k = 0; k < 2; ++k)
    for (int i = 0; i < n; ++i) {
      const double angle = turn + 2 * std::numbers::pi * i / n;
      mesh.positions.emplace_back(std::cos(angle), std::sin(angle), 2 * k - 1);
    }
  for (Index i = 0; i < n; ++i) {
    const Index j = (i + 1) % n;
    mesh.triangles.push_back({i, j, n + j});
    mesh.triangles.push_back({i, n + j, n + i});
    if (i > 0 && j > 0) mesh.triangles.push_back({0, j, i});
    if (i > 0 && j > 0) mesh.triangles.push_back({n, n + i, n + j});
  }
  return mesh;
}

/// A regular tetrahedron around the origin, outward.
inline TriangleMesh tetrahedron_surface() {
  return {{{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}}, {{0, 1, 2}, {0, 2, 3}, {0, 3, 1}, {1, 3, 2}}};
}

/// A cubic lattice of n^3 cells in [-1, 1]^3.
inline VolumeMesh centered_lattice(int n) {
  VolumeMesh mesh = lattice(n, n, n);
  for (Vec3& p : mesh.positions) p = p * (2.0 / n) - Vec3::Ones();
  return mesh;
}

/// Moves the vertices of such a lattice along rays from the origin so that its boundary lies on a convex surface.
inline std::vector<Vec3> fitted_to(const TriangleMesh& convex, const VolumeMesh& mesh) {
  std::vector<Vec3> fitted;
  for (const Vec3& p : mesh.positions) {
    double outside = 0;
    for (const auto& [a, b, c] : convex.triangles) {
      const Vec3& x = convex.positions[a];
      const Vec3 n = (convex.positions[b] - x).cross(convex.positions[c] - x);
      outside = std::max(outside, n.dot(p) / n.dot(x));
    }
    fitted.push_back(outside > 0 ? Vec3(p * (p.lpNorm<Eigen::Infinity>() / outside)) : p);
  }
  return fitted;
}

/// A lattice that follows a convex target.
struct RoutedLattice {
  SignedFeatures features;
  VolumeMesh grid, fitted;
  FeatureRouting routing;
  RoutedLattice(const TriangleMesh& target, int n)
      : features(features_of(target)), grid(centered_lattice(n)), fitted(grid) {
    fitted.positions = fitted_to(target, grid);
    routing = route_features(fitted, features);
  }
  PatchedMesh patched(const TriangleMesh& target) const {
    return patched_mesh(grid, fitted.positions, routing, target);
  }
};

}  // namespace subvol::test
