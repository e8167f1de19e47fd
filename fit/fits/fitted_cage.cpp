// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/fitted_cage.h"

#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <array>
#include <functional>
#include <utility>

namespace subvol::internal {

FittedCage::FittedCage(VolumeMesh control, const Tuning& tuning) : cage(std::move(control)) {
  const SparseMap unknowns = identity_map(cage.num_vertices());
  level_ = make_fit_level(cage, unknowns, limit_map(cage), FitOptions{.tuning = tuning}, 0, true);
  limit_ = refine_sheets(level_.mesh, limit_refinements(level_.mesh));
}

VolumeMesh FittedCage::mesh() const {
  VolumeMesh mesh = level_.mesh;
  mesh.positions = nodes();
  return mesh;
}

std::vector<double> FittedCage::of_children(std::span<const double> values) const {
  std::vector<double> all;
  all.reserve(kChildren * values.size());
  for (const double value : values) all.insert(all.end(), kChildren, value);
  return all;
}

std::vector<double> FittedCage::sums_of_parts(std::span<const double> values) const {
  std::vector<double> sums(values.size() / kChildren, 0);
  for (std::size_t i = 0; i < values.size(); ++i) sums[i / kChildren] += values[i];
  return sums;
}

std::vector<Index> FittedCage::groups_of_parts(std::span<const Index> groups) const {
  const MeshTopology coarse(cage), fine(level_.mesh);
  // The vertices of the mesh are those of the cage, then one for each of its edges, and then one for each face.
  const std::size_t first = cage.num_vertices() + coarse.num_edges(), last = first + coarse.num_faces();
  std::vector<Index> of_parts(fine.num_faces(), 0);
  for (std::size_t f = 0; f < of_parts.size(); ++f) {
    std::size_t parent = last;
    bool is_inside = false;  // of a cell
    for (const Index v : fine.face(static_cast<Index>(f))) {
      const auto vertex = static_cast<std::size_t>(v);
      is_inside = is_inside || vertex >= last;
      if (vertex >= first && vertex < last) parent = vertex;
    }
    if (!is_inside && parent < last) of_parts[f] = groups[parent - first];
  }
  return of_parts;
}

QualityCaps FittedCage::caps_of_parts(const QualityCaps& caps) const {
  QualityCaps of_parts{{}, caps.vertices};
  const std::vector<CreaseEdge>&fine = level_.mesh.tags.creases, &coarse = cage.tags.creases;
  for (std::size_t i = 0; i < fine.size(); ++i) {
    const CreaseEdge& parent = coarse[level_.parent_creases[i]];
    const auto cap =
        std::ranges::lower_bound(caps.edges, std::array<Index, 2>{parent.v0, parent.v1}, std::less{}, &EdgeCap::ends);
    if (cap == caps.edges.end() || cap->ends != std::array<Index, 2>{parent.v0, parent.v1}) continue;
    of_parts.edges.push_back({{fine[i].v0, fine[i].v1}, cap->cap, cap->angle});
  }
  std::ranges::sort(of_parts.edges, std::less{}, &EdgeCap::ends);
  return of_parts;
}

}  // namespace subvol::internal
