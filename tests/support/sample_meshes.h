// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/mesh/mesh_topology.h"
#include "subvol/mesh/volume_mesh.h"

#include <Eigen/Dense>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <random>
#include <vector>

namespace subvol::test {

/// Cubes of a lattice that `keep(i, j, k)` selects, unit spacing, one vertex per used lattice point.
template <class Keep>
VolumeMesh voxels(int nx, int ny, int nz, Keep&& keep) {
  VolumeMesh mesh;
  std::map<std::array<int, 3>, Index> numbers;
  const auto vertex = [&](int i, int j, int k) {
    const auto [it, added] = numbers.try_emplace({k, j, i}, static_cast<Index>(mesh.positions.size()));
    if (added) mesh.positions.emplace_back(i, j, k);
    return it->second;
  };
  for (int k = 0; k < nz; ++k)
    for (int j = 0; j < ny; ++j)
      for (int i = 0; i < nx; ++i)
        if (keep(i, j, k))
          mesh.add_cell(CellKind::hex,
                        std::array<Index, 8>{vertex(i, j, k), vertex(i + 1, j, k), vertex(i + 1, j + 1, k),
                                             vertex(i, j + 1, k), vertex(i, j, k + 1), vertex(i + 1, j, k + 1),
                                             vertex(i + 1, j + 1, k + 1), vertex(i, j + 1, k + 1)});
  return mesh;
}

/// n prisms round the axis z from 0 to 1, of radius 1; the axis's two vertices are the first or the last.
inline VolumeMesh prisms_round_axis(Index n, bool axis_first) {
  VolumeMesh mesh;
  const Index axis = axis_first ? 0 : 2 * n, rim = axis_first ? 2 : 0;
  mesh.positions.resize(2 * n + 2);
  mesh.positions[axis] = {0, 0, 0};
  mesh.positions[axis + 1] = {0, 0, 1};
  for (Index i = 0; i < n; ++i) {
    const double angle = 2 * M_PI * i / n;
    for (const Index z : {0, 1}) mesh.positions[rim + z * n + i] = {std::cos(angle), std::sin(angle), double(z)};
    const Index a = rim + i, b = rim + (i + 1) % n;
    mesh.add_cell(CellKind::prism, std::array<Index, 6>{axis, a, b, axis + 1, a + n, b + n});
  }
  return mesh;
}

inline VolumeMesh lattice(int nx, int ny, int nz) {
  return voxels(nx, ny, nz, [](int, int, int) { return true; });
}

/// A lattice of n^3 cubes, each cut into six pyramids around its center.
inline VolumeMesh pyramid_lattice(int n) {
  const VolumeMesh cubes = lattice(n, n, n);
  VolumeMesh mesh;
  mesh.positions = cubes.positions;
  const CellTopology& hex = cell_topology(CellKind::hex);
  for (std::size_t c = 0; c < cubes.num_cells(); ++c) {
    const auto v = cubes.cell(c);
    const auto apex = static_cast<Index>(mesh.positions.size());
    mesh.positions.push_back(0.5 * (cubes.positions[v[0]] + cubes.positions[v[6]]));
    for (const auto& face : hex.faces)  // outward, so backwards from the apex
      mesh.add_cell(CellKind::pyramid, std::array<Index, 5>{v[face[0]], v[face[3]], v[face[2]], v[face[1]], apex});
  }
  return mesh;
}

/// A cube with a pyramid on its top, whose front has a tet beside it, and a prism beside the cube: every kind.
inline VolumeMesh mixed_cells_with_pyramid() {
  VolumeMesh mesh = lattice(1, 1, 1);
  mesh.positions.emplace_back(0.5, 0.5, 1.8);
  mesh.positions.emplace_back(2.0, 0.5, 0.0);
  mesh.positions.emplace_back(2.0, 0.5, 1.0);
  mesh.add_cell(CellKind::pyramid, std::array<Index, 5>{4, 5, 6, 7, 8});
  mesh.add_cell(CellKind::prism, std::array<Index, 6>{1, 9, 2, 5, 10, 6});
  mesh.add_cell(CellKind::tet, std::array<Index, 4>{5, 10, 6, 8});
  return mesh;
}

/// One hex whose top is turned and moved: inverted in its middle, though its corners are positive.
inline VolumeMesh hex_inverted_inside() {
  VolumeMesh mesh = lattice(1, 1, 1);
  const double c = std::cos(3.0), s = std::sin(3.0);
  for (Vec3& p : mesh.positions) {
    if (p.z() < 0.5) continue;
    const double x = p.x() - 0.5, y = p.y() - 0.5;
    p.x() = 0.5 + c * x - s * y + (x * y > 0 ? 0.4 : -0.4);
    p.y() = 0.5 + s * x + c * y;
  }
  return mesh;
}

/// An L of 3 columns, extruded to `height` layers: one crease of 270 degrees with 3 cells around it.
inline VolumeMesh l_shape(int height) {
  return voxels(2, 2, height, [](int i, int j, int) { return i == 0 || j == 0; });
}

/// `sectors` hexes around the z axis, filling `angle_degrees`, extruded to `height` layers; axis vertices are 0, 1, ..
inline VolumeMesh fan(int sectors, double angle_degrees, int height) {
  VolumeMesh mesh;
  const double step = angle_degrees / sectors * std::acos(-1.0) / 180;
  const int layer = 1 + 2 * sectors + 1;  // axis, then rays 0..sectors, with the far corner of each sector between
  for (int k = 0; k <= height; ++k) {
    mesh.positions.emplace_back(0, 0, k);
    for (int i = 0; i <= 2 * sectors; ++i) {
      const double angle = step * i / 2, radius = i % 2 ? std::sqrt(2.0) : 1.0;
      mesh.positions.emplace_back(radius * std::cos(angle), radius * std::sin(angle), k);
    }
  }
  for (int k = 0; k < height; ++k)
    for (int s = 0; s < sectors; ++s) {
      const Index base = layer * k, ray = base + 1 + 2 * s;
      mesh.add_cell(CellKind::hex, std::array<Index, 8>{base, ray, ray + 1, ray + 2, base + layer, ray + layer,
                                                        ray + 1 + layer, ray + 2 + layer});
    }
  return mesh;
}

/// A cube of unit side on each of whose x faces stands a prism, with a tet on the second prism: every kind, conforming.
inline VolumeMesh mixed_cells() {
  VolumeMesh mesh = lattice(1, 1, 1);
  // Cube corners by (x, y, z): 0 000, 1 100, 2 110, 3 010, 4 001, 5 101, 6 111, 7 011.
  mesh.positions.emplace_back(2.0, 0.5, 0.0);
  mesh.positions.emplace_back(2.0, 0.5, 1.0);
  mesh.positions.emplace_back(-1.0, 0.5, 0.0);
  mesh.positions.emplace_back(-1.0, 0.5, 1.0);
  mesh.positions.emplace_back(1.3, 0.5, 2.0);
  mesh.add_cell(CellKind::prism, std::array<Index, 6>{1, 8, 2, 5, 9, 6});
  mesh.add_cell(CellKind::prism, std::array<Index, 6>{3, 10, 0, 7, 11, 4});
  mesh.add_cell(CellKind::tet, std::array<Index, 4>{5, 9, 6, 12});
  return mesh;
}

/// Random, reproducible displacement of every vertex.
inline void jitter(VolumeMesh& mesh, double amount, unsigned seed = 7) {
  std::mt19937 random(seed);
  std::uniform_real_distribution<double> uniform(-amount, amount);
  for (Vec3& p : mesh.positions)
    for (int d = 0; d < 3; ++d) p[d] += uniform(random);
}

/// Tags every boundary edge whose faces' normals turn by more than `angle_degrees`.
inline void tag_creases(VolumeMesh& mesh, double angle_degrees, double sharpness = kInfiniteSharpness) {
  const MeshTopology topology(mesh);
  std::map<std::array<Index, 2>, std::vector<Vec3>> normals;
  for (Index f : topology.boundary_faces()) {
    const auto face = topology.face(f);
    Vec3 normal = Vec3::Zero();
    for (std::size_t i = 0; i < face.size(); ++i)
      normal += mesh.positions[face[i]].cross(mesh.positions[face[(i + 1) % face.size()]]);
    for (std::size_t i = 0; i < face.size(); ++i) {
      const Index a = face[i], b = face[(i + 1) % face.size()];
      normals[{std::min(a, b), std::max(a, b)}].push_back(normal.normalized());
    }
  }
  mesh.tags = {};
  for (const auto& [edge, pair] : normals)
    if (pair[0].dot(pair[1]) < std::cos(angle_degrees * std::acos(-1.0) / 180))
      mesh.tags.creases.push_back({edge[0], edge[1], sharpness});
}

/// Smallest scaled Jacobian at the corners of a cell.
inline double min_scaled_jacobian(const VolumeMesh& mesh, std::size_t c) {
  const CellTopology& topology = cell_topology(mesh.kinds[c]);
  const auto cell = mesh.cell(c);
  double least = 1;
  for (int i = 0; i < topology.num_trivalent; ++i) {
    Mat3 jacobian;
    for (int j = 0; j < 3; ++j)
      jacobian.col(j) = (mesh.positions[cell[topology.corner_neighbors[i][j]]] - mesh.positions[cell[i]]).normalized();
    least = std::min(least, jacobian.determinant());
  }
  return least;
}

inline std::size_t count_inverted(const VolumeMesh& mesh) {
  std::size_t count = 0;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) count += min_scaled_jacobian(mesh, c) <= 0;
  return count;
}

}  // namespace subvol::test
