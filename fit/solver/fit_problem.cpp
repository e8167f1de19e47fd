// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/solver/fit_problem.h"

#include "subvol/fit/solver/vector_math.h"

#include <utility>

namespace subvol::internal {

FitProblem::FitProblem(SparseMap node_map, SparseMap sample_map, std::unique_ptr<VolumeTerm> volume_energy,
                       std::unique_ptr<SurfaceTerm> surface_energy, double volume_weight)
    : nodes(std::move(node_map)),
      nodes_transposed(transposed(nodes)),
      samples(std::move(sample_map)),
      samples_transposed(transposed(samples)),
      volume(std::move(volume_energy)),
      surface(std::move(surface_energy)),
      lambda(volume_weight) {}

void FitProblem::apply_nodes(std::span<const Vec3> x, std::span<Vec3> out) const {
  nodes.apply(x, out);
  if (!fixed_nodes.empty()) add_scaled(1, fixed_nodes, out);
}

void FitProblem::apply_samples(std::span<const Vec3> x, std::span<Vec3> out) const {
  multiply_samples(x, out);
  if (!fixed_samples.empty()) add_scaled(1, fixed_samples, out);
}

void FitProblem::multiply_samples(std::span<const Vec3> d, std::span<Vec3> out) const {
  tables ? tables->apply(d, out) : samples.apply(d, out);
}

void FitProblem::pull_back_samples(std::span<const Vec3> g, std::span<Vec3> out) const {
  tables ? tables->apply_transposed(g, out) : samples_transposed.apply(g, out);
}

}  // namespace subvol::internal
