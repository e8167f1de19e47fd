// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/energies/boundary_folds.h"

#include "subvol/mesh/cell_topology.h"
#include "subvol/mesh/mesh_topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

namespace subvol::internal {

namespace {

constexpr double kFullTurn = 360;  // degrees
constexpr double kRadiansPerDegree = std::numbers::pi / 180;
constexpr double kLeastArm = 1e-12;  // of vectors that are divided by, in the unit of the nodes

/// Returns the wedge of a cell at one of its edges, from corner a to corner b, and the local faces before and after it.
std::pair<BoundaryFolds::Wedge, std::array<int, 2>> wedge_of(const CellTopology& cell, std::int8_t a, std::int8_t b) {
  BoundaryFolds::Wedge wedge{0, a, b, {}, {}};
  std::array<int, 2> faces{};
  for (int f = 0; f < cell.num_faces; ++f) {
    const int n = cell.face_sizes[f];
    for (int i = 0; i < n; ++i) {
      const std::int8_t from = cell.faces[f][i], to = cell.faces[f][(i + 1) % n];
      if (!(from == a && to == b) && !(from == b && to == a)) continue;
      const std::array<std::int8_t, 2> others{cell.faces[f][(i + 2) % n], cell.faces[f][(i + n - 1) % n]};
      (from == a ? wedge.after : wedge.before) = others;
      faces[from == a] = f;
    }
  }
  return {wedge, faces};
}

/// The ends of an edge and a place beside it.
struct Arm {
  Vec3 t;        ///< unit direction of the edge
  Vec3 across;   ///< from the edge to the place, perpendicular to it
  double along;  ///< where its foot lies: 0 at a, 1 at b

  Arm(const Vec3& a, const Vec3& b, const Vec3& place) {
    const double length = std::max((b - a).norm(), kLeastArm);
    t = (b - a) / length;
    const double foot = t.dot(place - a);
    along = foot / length;
    across = place - a - foot * t;
  }
};

}  // namespace

BoundaryFolds::BoundaryFolds(const VolumeMesh& mesh, double least_limit) : least_limit_(least_limit) {
  const MeshTopology topology(mesh);
  struct At {
    Wedge wedge;
    bool is_first, is_last;
  };
  std::vector<std::vector<At>> at(topology.num_edges());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const CellTopology& cell = cell_topology(mesh.kinds[c]);
    const auto vertices = mesh.cell(c);
    const auto edges = topology.cell_edges(c), faces = topology.cell_faces(c);
    for (int e = 0; e < cell.num_edges; ++e) {
      if (!topology.is_boundary_edge(edges[e])) continue;
      auto [a, b] = cell.edges[e];
      if (vertices[a] > vertices[b]) std::swap(a, b);
      auto [wedge, sides] = wedge_of(cell, a, b);
      wedge.cell = static_cast<Index>(c);
      at[edges[e]].push_back(
          {wedge, topology.is_boundary_face(faces[sides[0]]), topology.is_boundary_face(faces[sides[1]])});
    }
  }
  for (std::vector<At>& wedges : at) {
    if (std::ranges::count_if(wedges, &At::is_first) != 1 || std::ranges::count_if(wedges, &At::is_last) != 1) continue;
    std::ranges::stable_sort(wedges, {}, [](const At& w) { return (w.is_last ? 2 : 0) - (w.is_first ? 1 : 0); });
    for (const At& w : wedges) wedges_.push_back(w.wedge);
    offsets_.push_back(wedges_.size());
    limits_.push_back(least_limit_);
  }
  sort_by_first_cell();
}

BoundaryFolds::BoundaryFolds(const BoundaryFolds& whole, std::span<const Index> cells)
    : least_limit_(whole.least_limit_) {
  const auto first_cell = [&](Index e) { return whole.wedges(e).front().cell; };
  const std::vector<Index>& all = whole.by_first_cell_;
  std::vector<Index> near;
  for (const Index c : cells)
    for (auto at = std::ranges::lower_bound(all, c, {}, first_cell); at != all.end() && first_cell(*at) == c; ++at)
      near.push_back(*at);
  std::sort(near.begin(), near.end());
  for (const Index e : near) {
    std::vector<Wedge> wedges(whole.wedges(e).begin(), whole.wedges(e).end());
    const bool is_inside = std::ranges::all_of(wedges, [&](Wedge& wedge) {
      const auto place = std::ranges::lower_bound(cells, wedge.cell);
      if (place == cells.end() || *place != wedge.cell) return false;
      wedge.cell = static_cast<Index>(place - cells.begin());
      return true;
    });
    if (!is_inside) continue;
    wedges_.insert(wedges_.end(), wedges.begin(), wedges.end());
    offsets_.push_back(wedges_.size());
    limits_.push_back(whole.limits_[e]);
  }
  sort_by_first_cell();
}

void BoundaryFolds::sort_by_first_cell() {
  by_first_cell_.resize(size());
  std::iota(by_first_cell_.begin(), by_first_cell_.end(), 0);
  std::ranges::stable_sort(by_first_cell_, {}, [&](Index e) { return wedges(e).front().cell; });
}

void BoundaryFolds::want(std::span<const EdgeCap> edges, const VolumeMesh& mesh) {
  for (std::size_t e = 0; e < size(); ++e) {
    const Wedge& first = wedges(e).front();
    const auto cell = mesh.cell(first.cell);
    const std::array<Index, 2> ends{cell[first.a], cell[first.b]};
    const auto at = std::ranges::lower_bound(edges, ends, {}, &EdgeCap::ends);
    if (at != edges.end() && at->ends == ends) limits_[e] = std::max(least_limit_, (at->angle + kFullTurn) / 2);
  }
}

std::array<Index, 2> BoundaryFolds::cells_of(std::size_t edge) const {
  return {wedges(edge).front().cell, wedges(edge).back().cell};
}

double BoundaryFolds::angle(std::size_t edge, const VolumeMesh& mesh, std::span<const Vec3> nodes) const {
  double sum = 0;
  for (const Wedge& wedge : wedges(edge)) {
    const auto cell = mesh.cell(wedge.cell);
    const auto x = [&](std::int8_t corner) -> const Vec3& { return nodes[cell[corner]]; };
    const Arm before(x(wedge.a), x(wedge.b), 0.5 * (x(wedge.before[0]) + x(wedge.before[1])));
    const Arm after(x(wedge.a), x(wedge.b), 0.5 * (x(wedge.after[0]) + x(wedge.after[1])));
    sum += std::atan2(before.t.dot(before.across.cross(after.across)), before.across.dot(after.across));
  }
  return sum / kRadiansPerDegree;
}

double BoundaryFolds::residual(std::size_t edge, const VolumeMesh& mesh, std::span<const Vec3> nodes) const {
  return std::max(0.0, angle(edge, mesh, nodes) - limits_[edge]) / (kFullTurn - limits_[edge]);
}

std::vector<double> BoundaryFolds::residuals(const VolumeMesh& mesh, std::span<const Vec3> nodes) const {
  std::vector<double> result(size());
#pragma omp parallel for schedule(static)
  for (std::size_t e = 0; e < result.size(); ++e) result[e] = residual(e, mesh, nodes);
  return result;
}

BoundaryFolds::Residual BoundaryFolds::linearized(std::size_t edge, const VolumeMesh& mesh,
                                                  std::span<const Vec3> nodes) const {
  Residual result{residual(edge, mesh, nodes), {}};
  if (!(result.value > 0)) return result;
  const double scale = 1 / (kRadiansPerDegree * (kFullTurn - limits_[edge]));
  const auto side = [&](const Wedge& wedge, const std::array<std::int8_t, 2>& others, double sign) {
    const auto cell = mesh.cell(wedge.cell);
    const auto x = [&](std::int8_t corner) -> const Vec3& { return nodes[cell[corner]]; };
    const Arm arm(x(wedge.a), x(wedge.b), 0.5 * (x(others[0]) + x(others[1])));
    const double square = std::max(arm.across.squaredNorm(), kLeastArm * kLeastArm);
    const Vec3 turn = (sign * scale / square) * arm.t.cross(arm.across);
    return Side{wedge.cell,
                {wedge.a, wedge.b, others[0], others[1]},
                {-(1 - arm.along) * turn, -arm.along * turn, 0.5 * turn, 0.5 * turn}};
  };
  const Wedge &first = wedges(edge).front(), &last = wedges(edge).back();
  result.sides = {side(first, first.before, -1), side(last, last.after, 1)};
  return result;
}

}  // namespace subvol::internal
