// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/shell/shell_check.h"

#include "subvol/base/sort_unique.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/self_intersection.h"

#include <algorithm>
#include <numeric>

namespace subvol {

using namespace internal;
namespace {

std::vector<int> sheets_to_check(const ShellLayers& layers, CheckedSheets which) {
  if (which == CheckedSheets::outer) return {0, layers.num_sheets() - 1};
  std::vector<int> sheets(layers.num_sheets());
  std::iota(sheets.begin(), sheets.end(), 0);
  return sheets;
}

/// Lowers the shares around strands that were held back, so that neighbors differ by at most a quarter.
void grade(const ShellLayers& layers, std::vector<double>& shares) {
  constexpr double kMostNeighborShareStep = 0.25;  // of the whole way
  const SurfaceTopology& topology = layers.topology;
  const std::size_t num_columns = layers.num_columns();
  for (int sweep = 0; sweep < static_cast<int>(1 / kMostNeighborShareStep); ++sweep)
    for (const Index h : topology.edge_corners) {
      const Index a = topology.corner_vertices[h], b = topology.corner_vertices[topology.next(h)];
      for (const std::size_t side : {std::size_t{0}, num_columns}) {
        double &s = shares[side + a], &t = shares[side + b];
        s = std::min(s, t + kMostNeighborShareStep);
        t = std::min(t, s + kMostNeighborShareStep);
      }
    }
}

}  // namespace

ShellCheck::ShellCheck(const ShellLayers& layers, const VolumeMesh& cells, CheckedSheets sheets, bool surface_moves)
    : layers_(layers),
      cells_(cells),
      polygons_(sheet_polygons(layers, sheets_to_check(layers, sheets))),
      surface_moves_(surface_moves) {}

ShellFailures ShellCheck::failures(std::span<const Vec3> positions, const std::function<bool()>& cancelled) const {
  ShellFailures result;
  result.certificate = certify(positions, cells_);
  PolygonMesh polygons = polygons_;
  polygons.positions.assign(positions.begin(), positions.end());
  std::vector<Index> polygon;
  const SelfIntersections found = self_intersections(fan_triangles(polygons, &polygon), cancelled);
  result.is_complete = found.is_complete;
  for (const auto& [t, s] : found.pairs) result.intersecting.push_back({polygon[t], polygon[s]});
  for (const Index t : found.degenerate) result.intersecting.push_back({polygon[t], polygon[t]});
  auto& pairs = result.intersecting;
  sort_unique(pairs);
  return result;
}

std::vector<Index> ShellCheck::strands(const ShellFailures& failures) const {
  std::vector<Index> result;
  const auto add = [&](std::span<const Index> vertices) {
    for (const Index v : vertices) {
      const Index strand = layers_.strand(v), column = static_cast<Index>(v % layers_.num_columns());
      if (strand != kNoIndex)
        result.push_back(strand);
      else if (surface_moves_)
        result.insert(result.end(), {column, static_cast<Index>(column + layers_.num_columns())});
    }
  };
  for (const Index c : failures.certificate.not_certified) add(cells_.cell(c));
  for (const auto& pair : failures.intersecting)
    for (const Index f : pair) add(polygons_.face(f));
  sort_unique(result);
  return result;
}

NodeStrands vertex_strands(const ShellLayers& layers) {
  NodeStrands nodes;
  const auto num_columns = static_cast<Index>(layers.num_columns());
  for (Index v = 0; v < layers.num_sheets() * num_columns; ++v) {
    const Index strand = layers.strand(v), column = v % num_columns;
    if (strand != kNoIndex)
      nodes.strands.push_back(strand);
    else
      nodes.strands.insert(nodes.strands.end(), {column, num_columns + column});
    nodes.offsets.push_back(nodes.strands.size());
  }
  return nodes;
}

std::vector<Vec3> advance(const ShellLayers& layers, const NodeStrands& nodes, const FailingStrands& failing,
                          std::span<const Vec3> safe, std::span<const Vec3> wanted, const std::function<bool()>& ended,
                          std::vector<double>* shares_out) {
  constexpr double kAdvanceShrinkFactor = 0.7;  // of a share
  constexpr double kLeastAdvanceShare = 0.05;   // below, a share is 0, so that few shrinkings decide
  std::vector<double> shares(layers.num_strands(), 1.0);
  std::vector<Vec3> state(wanted.begin(), wanted.end());
  for (;;) {
    bool moved = false;
    const std::vector<Index> held = failing(state);
    if (ended && ended()) {
      shares.assign(shares.size(), 0);
      state.assign(safe.begin(), safe.end());
      break;
    }
    for (const Index strand : held) {
      double& share = shares[strand];
      moved = moved || share > 0;
      share = kAdvanceShrinkFactor * share < kLeastAdvanceShare ? 0 : kAdvanceShrinkFactor * share;
    }
    if (!moved) break;  // valid, or the safe state was not valid
    grade(layers, shares);
    for (std::size_t i = 0; i < state.size(); ++i) {
      double share = 1;
      for (const Index strand : nodes.of_node(i)) share = std::min(share, shares[strand]);
      state[i] = safe[i] + share * (wanted[i] - safe[i]);
    }
  }
  if (shares_out) *shares_out = std::move(shares);
  return state;
}

std::vector<Vec3> advance(const ShellLayers& layers, const ShellCheck& check, std::span<const Vec3> safe,
                          std::span<const Vec3> wanted, const std::function<bool()>& ended,
                          std::vector<double>* shares) {
  const auto failing = [&](std::span<const Vec3> positions) { return check.strands(check.failures(positions, ended)); };
  return advance(layers, vertex_strands(layers), failing, safe, wanted, ended, shares);
}

}  // namespace subvol
