// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/high_order_mesh.h"
#include "tests/support/sample_meshes.h"

#include <random>

namespace subvol::test {

inline constexpr CellKind kAllKinds[] = {CellKind::tet, CellKind::prism, CellKind::hex};
inline constexpr Basis kBothBases[] = {Basis::fourier, Basis::legendre};

/// Random points in the unit cube, folded into the canonical cell.
class PointSource {
 public:
  explicit PointSource(unsigned seed) : random_(seed) {}

  double number() { return uniform_(random_); }
  Vec3 vector() { return Vec3(number(), number(), number()); }
  Vec3 inside(CellKind kind) {
    while (true) {
      Vec3 p = vector();
      if (kind == CellKind::hex || (kind == CellKind::prism && p[0] + p[1] <= 1) ||
          (kind == CellKind::tet && p.sum() <= 1))
        return p;
    }
  }
  std::mt19937& random() { return random_; }

 private:
  std::mt19937 random_;
  std::uniform_real_distribution<double> uniform_{0.0, 1.0};
};

/// One canonical cell.
inline VolumeMesh single_cell(CellKind kind) {
  VolumeMesh mesh;
  const auto vertices = canonical_vertices(kind);
  mesh.positions.assign(vertices.begin(), vertices.end());
  std::vector<Index> corners(vertices.size());
  for (std::size_t i = 0; i < corners.size(); ++i) corners[i] = static_cast<Index>(i);
  mesh.add_cell(kind, corners);
  return mesh;
}

/// Gives the vertices other numbers.
inline VolumeMesh renumbered(const VolumeMesh& mesh, std::mt19937& random) {
  std::vector<Index> number(mesh.num_vertices());
  for (std::size_t i = 0; i < number.size(); ++i) number[i] = static_cast<Index>(i);
  std::shuffle(number.begin(), number.end(), random);
  VolumeMesh result = mesh;
  for (std::size_t v = 0; v < number.size(); ++v) result.positions[number[v]] = mesh.positions[v];
  for (Index& v : result.cell_vertices) v = number[v];
  return result;
}

/// Random coefficients for every node.
inline HighOrderMesh random_mesh(const ElementSpace& space, PointSource& source) {
  std::vector<Vec3> coefficients(space.num_nodes());
  for (Vec3& x : coefficients) x = source.vector();
  return {space, std::move(coefficients)};
}

}  // namespace subvol::test
