// SPDX-License-Identifier: GPL-3.0-or-later
#pragma once

#include "subvol/fit/elements/point_tables.h"
#include "subvol/fit/energies/surface_term.h"
#include "subvol/fit/energies/volume_term.h"
#include "subvol/subdivision/sparse_map.h"

#include <memory>
#include <optional>
#include <span>
#include <vector>

namespace subvol::internal {

/// The function that a stage minimizes over its degrees of freedom x (control vertices or coefficients), in the
/// target's unit:
///
///   E(x) = E_S(N x + z0) + lambda E_W(M x + y0)                                Paper: Eqs. 1, 10
///
/// M maps the degrees of freedom to the nodes of the finite element mesh, N to the samples of its boundary; gradients
/// and Hessians are pulled back by the transposes. E_S uses the correspondences of the last `SurfaceTerm::assign`.
/// Fixed nodes have no entries in M and their positions in y0; fixed samples likewise in N and z0.
struct FitProblem {
  FitProblem(SparseMap node_map, SparseMap sample_map, std::unique_ptr<VolumeTerm> volume_energy,
             std::unique_ptr<SurfaceTerm> surface_energy, double volume_weight);

  /// out = M x + y0.
  void apply_nodes(std::span<const Vec3> x, std::span<Vec3> out) const;
  /// out = N x + z0.
  void apply_samples(std::span<const Vec3> x, std::span<Vec3> out) const;
  /// out = N d, the change of the samples for a change d of x; out = N^T g, a gradient over the samples pulled back.
  void multiply_samples(std::span<const Vec3> d, std::span<Vec3> out) const;
  void pull_back_samples(std::span<const Vec3> g, std::span<Vec3> out) const;

  SparseMap nodes, nodes_transposed;      ///< M, M^T
  std::vector<Vec3> fixed_nodes;          ///< y0, one per node; empty: no node is fixed
  SparseMap samples, samples_transposed;  ///< N, N^T
  std::optional<PointTables> tables;      ///< N as tables for products with N and N^T; none: `samples` is used
  std::vector<Vec3> fixed_samples;        ///< z0, one per sample; empty: no sample is fixed
  /// For each degree of freedom the projector on the directions in which it may move, for example in a plane; empty:
  /// all move freely. Newton's method alone keeps to them.
  std::vector<Mat3> projectors;
  std::unique_ptr<VolumeTerm> volume;
  std::unique_ptr<SurfaceTerm> surface;  ///< null: no surface term; N then has no rows
  double lambda;                         ///< > 0
};

}  // namespace subvol::internal
