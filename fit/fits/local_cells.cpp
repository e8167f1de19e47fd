// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/local_cells.h"

#include "subvol/fit/elements/ideal_boxes.h"
#include "subvol/mesh/cell_topology.h"
#include "subvol/templates/refine.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <utility>

namespace subvol::internal {

namespace {

SizedMesh refined_at(const VolumeMesh& mesh, std::span<const double> sizes, std::span<const char> chosen) {
  LocalRefinement refinement = refine_locally(mesh, vertices_of(mesh, chosen), WarpedParts::kept);
  std::vector<int> parts(mesh.num_cells(), 0);
  for (const Index parent : refinement.parents) ++parts[parent];
  SizedMesh result{std::move(refinement.mesh), {}};
  for (const Index parent : refinement.parents)
    result.sizes.push_back((sizes.empty() ? 1 : sizes[parent]) / std::cbrt(parts[parent]));
  return result;
}

/// Marks the cells of the faults, in their order, each unless more than so many cells would be marked then. Returns
/// their number.
std::size_t choose(std::span<const Fault> faults, double most, std::vector<char>& chosen) {
  std::size_t count = 0;
  for (const Fault& fault : faults) {
    const auto added = static_cast<std::size_t>(std::ranges::count_if(fault, [&](Index c) { return !chosen[c]; }));
    if (static_cast<double>(count + added) > most) continue;
    for (const Index c : fault) chosen[c] = 1;
    count += added;
  }
  return count;
}

double sum_of_squared_sizes(const MeshTopology& topology, std::span<const double> sizes) {
  const auto& faces = topology.boundary_faces();
  if (sizes.empty()) return static_cast<double>(faces.size());
  double squares = 0;
  for (const Index f : faces) squares += std::pow(sizes[topology.face_cells(f)[0]], 2);
  return squares;
}

}  // namespace

Vec3 cell_center(const VolumeMesh& mesh, std::span<const Vec3> positions, std::size_t c) {
  Vec3 sum = Vec3::Zero();
  for (const Index v : mesh.cell(c)) sum += positions[v];
  return sum / static_cast<double>(mesh.cell(c).size());
}

std::optional<SizedMesh> refined_at_faults(const VolumeMesh& mesh, std::span<const double> sizes,
                                           std::span<const Fault> faults, std::size_t most_cells, SearchStop* stop) {
  // A row of cells that is cut adds about a hundred cells for each of its own, a block of them 26.
  constexpr double kLeastAdded = 26;
  constexpr double kRetryCutCellsShare = 0.7;  // share of the cells that is tried next
  const double room = static_cast<double>(most_cells) - static_cast<double>(mesh.num_cells());
  for (double most = room / kLeastAdded; most >= 1; most *= kRetryCutCellsShare) {
    std::vector<char> chosen(mesh.num_cells(), 0);
    most = std::min(most, static_cast<double>(choose(faults, most, chosen)));
    if (most < 1 || (stop && stop->is_stopped())) break;
    SizedMesh refined = refined_at(mesh, sizes, chosen);
    if (refined.mesh.num_cells() <= most_cells) return refined;
  }
  return std::nullopt;
}

std::vector<double> padded_sizes(const VolumeMesh& padded, std::span<const double> sizes) {
  if (sizes.empty()) return {};
  const MeshTopology topology(padded);
  std::vector<double> all(sizes.begin(), sizes.end());
  for (std::size_t c = sizes.size(); c < padded.num_cells(); ++c) {
    double size = 1;
    for (const Index f : topology.cell_faces(c))
      for (const Index other : topology.face_cells(f))
        if (other != kNoIndex && static_cast<std::size_t>(other) < c) size = std::min(size, all[other]);
    all.push_back(size);
  }
  return all;
}

std::vector<Index> cells_between_sizes(std::span<const double> sizes) {
  // A count of cuts this close to a whole number is whole. It is not exact: 22 parts of a cell were cut 0.94 times.
  constexpr double kTimesCutRounding = 0.01;
  std::vector<Index> cells;
  for (std::size_t c = 0; c < sizes.size(); ++c) {
    const double times_cut = -std::log(sizes[c]) / std::log(3);
    if (std::abs(times_cut - std::round(times_cut)) > kTimesCutRounding) cells.push_back(static_cast<Index>(c));
  }
  return cells;
}

void add_caps_between_sizes(const VolumeMesh& mesh, std::span<const double> sizes, QualityCaps& caps) {
  constexpr double kSizeChangeCap = 0.57;  // the goal at a cap is lower by 0.02
  std::vector<std::uint8_t> is_between(mesh.num_vertices(), 0);
  for (const Index c : cells_between_sizes(sizes)) {
    const auto cell = mesh.cell(c);
    for (const Index v : cell) is_between[v] = 1;
    const CellTopology& topology = cell_topology(mesh.kinds[c]);
    for (int e = 0; e < topology.num_edges; ++e) {
      const auto [low, high] = std::minmax(cell[topology.edges[e][0]], cell[topology.edges[e][1]]);
      caps.edges.push_back({{low, high}, kSizeChangeCap});
    }
  }
  for (std::size_t v = 0; v < is_between.size(); ++v)
    if (is_between[v]) caps.vertices.push_back({static_cast<Index>(v), kSizeChangeCap});
}

std::vector<Vec3> wanted_lengths(const MeshTopology& topology, std::span<const double> sizes, std::size_t num_cells,
                                 double area) {
  const double h = std::sqrt(area / sum_of_squared_sizes(topology, sizes));
  std::vector<Vec3> lengths(num_cells, Vec3::Constant(h));
  for (std::size_t c = 0; c < sizes.size(); ++c) lengths[c] *= sizes[c];
  return lengths;
}

void keep_flat_cells(const VolumeMesh& grid, const VolumeMesh& mesh, double share, std::span<Vec3> lengths) {
  double longest = 0;
  for (const Vec3& h : lengths) longest = std::max(longest, h.maxCoeff());
  std::size_t num_flat = 0;
  for (std::size_t c = 0; c < grid.num_cells(); ++c)
    num_flat += box_lengths(grid.kinds[c], grid.cell(c), grid.positions).minCoeff() < share * longest;
  if (2 * num_flat <= grid.num_cells()) return;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const Vec3 own = box_lengths(mesh.kinds[c], mesh.cell(c), mesh.positions);
    for (int k = 0; k < 3; ++k)
      if (own[k] > 0 && own[k] < share * lengths[c][k]) lengths[c][k] = own[k];
  }
}

}  // namespace subvol::internal
