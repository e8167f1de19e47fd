// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/fits/local_cells.h"

#include "subvol/mesh/mesh_topology.h"
#include "subvol/templates/refine.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace subvol {

namespace {

SizedMesh refined_at(const VolumeMesh& mesh, std::span<const double> sizes, std::span<const Fault> faults) {
  std::vector<char> chosen(mesh.num_cells(), 0);
  for (const Fault& fault : faults)
    for (const Index c : fault) chosen[c] = 1;
  LocalRefinement refinement = refine_locally(mesh, vertices_of(mesh, chosen), WarpedParts::kept);
  std::vector<int> parts(mesh.num_cells(), 0);
  for (const Index parent : refinement.parents) ++parts[parent];
  SizedMesh result{std::move(refinement.mesh), {}};
  for (const Index parent : refinement.parents)
    result.sizes.push_back((sizes.empty() ? 1 : sizes[parent]) / std::cbrt(parts[parent]));
  return result;
}

std::vector<Index> ascending(std::vector<Index> cells) {
  std::ranges::sort(cells);
  const auto repeated = std::ranges::unique(cells);
  cells.erase(repeated.begin(), repeated.end());
  return cells;
}

Vec3 center(const VolumeMesh& mesh, std::span<const Vec3> positions, std::size_t c) {
  Vec3 sum = Vec3::Zero();
  for (const Index v : mesh.cell(c)) sum += positions[v];
  return sum / static_cast<double>(mesh.cell(c).size());
}

}  // namespace

std::optional<SizedMesh> refined_at_faults(const VolumeMesh& mesh, std::span<const double> sizes,
                                           std::span<const Fault> faults, std::size_t most_cells) {
  while (!faults.empty()) {
    SizedMesh refined = refined_at(mesh, sizes, faults);
    if (refined.mesh.num_cells() == mesh.num_cells()) return std::nullopt;
    if (refined.mesh.num_cells() <= most_cells) return refined;
    faults = faults.first(faults.size() / 2);
  }
  return std::nullopt;
}

BoundaryCells::BoundaryCells(const VolumeMesh& mesh, std::span<const Vec3> positions)
    : cells_of_vertex_(mesh.num_vertices()) {
  const MeshTopology topology(mesh);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (const Index v : mesh.cell(c)) cells_of_vertex_[v].push_back(static_cast<Index>(c));
  std::vector<Vec3> sites;
  for (std::size_t v = 0; v < mesh.num_vertices(); ++v) {
    if (!topology.is_boundary_vertex(static_cast<Index>(v))) continue;
    vertices_.push_back(static_cast<Index>(v));
    sites.push_back(positions[v]);
  }
  if (!sites.empty()) tree_ = SiteTree(sites);
}

std::vector<Index> BoundaryCells::near(std::span<const Vec3> points) const {
  std::vector<Index> cells;
  if (vertices_.empty()) return cells;
  for (const Vec3& p : points) {
    const std::vector<Index>& around = cells_of_vertex_[vertices_[tree_.site(tree_.nearest(p).place)]];
    cells.insert(cells.end(), around.begin(), around.end());
  }
  return ascending(std::move(cells));
}

std::vector<Index> cells_at(const VolumeMesh& mesh, std::span<const Vec3> positions, const VolumeMesh& other,
                            std::span<const Index> cells_of_other) {
  if (mesh.num_cells() == 0) return {};
  std::vector<Vec3> centers;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) centers.push_back(center(mesh, positions, c));
  const SiteTree tree(centers);
  std::vector<Index> cells;
  for (const Index c : cells_of_other)
    cells.push_back(tree.site(tree.nearest(center(other, other.positions, c)).place));
  return ascending(std::move(cells));
}

std::vector<double> vertex_sizes(const VolumeMesh& mesh, std::span<const double> sizes) {
  if (sizes.empty()) return {};
  std::vector<double> sums(mesh.num_vertices(), 0);
  std::vector<int> counts(mesh.num_vertices(), 0);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    for (const Index v : mesh.cell(c)) {
      sums[v] += sizes[c];
      ++counts[v];
    }
  for (std::size_t v = 0; v < sums.size(); ++v) sums[v] = counts[v] > 0 ? sums[v] / counts[v] : 1;
  return sums;
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

}  // namespace subvol
