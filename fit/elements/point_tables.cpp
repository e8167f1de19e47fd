// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/point_tables.h"

#include "subvol/base/error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

namespace subvol::internal {

namespace {

constexpr std::size_t kMostRowsPerBlock = 256;
constexpr std::size_t kMostWide = kMostRowsPerBlock / kWide;
/// Numbers of groups of eight points, and of modes, that are summed at once: enough that sums do not wait for one
/// another.
constexpr int kWideAtOnce = 4, kModesAtOnce = 4;

/// Returns the sides that a point lies on, as bits. Side s is: l_s = 0 for a tet; l_0 .. l_2 = 0, w = 0, w = 1 for a
/// prism; u = 0, u = 1, v = 0, .. for a hex.
unsigned sides_at(CellKind kind, const Vec3& p) {
  constexpr double kOnSideTolerance = 1e-15;  // canonical coordinates; rounding of a quadrature point on a side
  unsigned sides = 0;
  int side = 0;
  const auto add = [&](double distance) {
    sides |= static_cast<unsigned>(std::abs(distance) <= kOnSideTolerance) << side++;
  };
  if (kind != CellKind::hex) {
    add(kind == CellKind::tet ? 1 - p[0] - p[1] - p[2] : 1 - p[0] - p[1]);
    for (int d = 0; d < (kind == CellKind::tet ? 3 : 2); ++d) add(p[d]);
  }
  for (int d = kind == CellKind::hex ? 0 : kind == CellKind::prism ? 2 : 3; d < 3; ++d) {
    add(p[d]);
    add(1 - p[d]);
  }
  return sides;
}

/// True if N_i is zero at the lower (upper) end of its axis.
bool vanishes_at_end(int i, bool upper) { return i != (upper ? 1 : 0); }

/// True if E_edge,i V_vertex,j (V_3,k) has the factor l_c.
bool has_factor(CellKind kind, const LocalMode& mode, int c) {
  if (mode.vertex == c || (kind == CellKind::tet && c == 3 && mode.k > 0)) return true;
  if (mode.edge < 0) return false;
  const auto& ends = cell_topology(kind).edges[mode.edge];
  return ends[0] == c || ends[1] == c;
}

bool vanishes_on(CellKind kind, const LocalMode& mode, int side) {
  if (kind == CellKind::hex) return vanishes_at_end(side < 2 ? mode.i : side < 4 ? mode.j : mode.k, side % 2 == 1);
  if (kind == CellKind::prism && side > 2) return vanishes_at_end(mode.k, side == 4);
  return has_factor(kind, mode, side);
}

bool vanishes(CellKind kind, const LocalMode& mode, unsigned sides) {
  for (int side = 0; sides >> side; ++side)
    if ((sides >> side & 1u) && vanishes_on(kind, mode, side)) return true;
  return false;
}

/// Key of a table: blocks with the same key share one.
using TableKey = std::tuple<CellKind, std::vector<LocalMode>, std::vector<std::array<double, 3>>>;

std::vector<Wide> table_values(const TableKey& key, Basis basis, int order) {
  const auto& [kind, modes, points] = key;
  ShapeFunctions at(kind, basis, order);
  std::vector<Wide> values((points.size() + kWide - 1) / kWide * modes.size(), Wide{});
  for (std::size_t q = 0; q < points.size(); ++q) {
    at.set_point({points[q][0], points[q][1], points[q][2]});
    for (std::size_t a = 0; a < modes.size(); ++a) values[q / kWide * modes.size() + a][q % kWide] = at.value(modes[a]);
  }
  return values;
}

/// Computes the positions at kCount groups of eight points, of which `active` exist, from their rows of the table.
template <int kCount>
void evaluate(const Wide* table, std::span<const Vec3> coefficients, std::size_t active, Vec3* out) {
  const std::size_t num_modes = coefficients.size();
  Wide sum[kCount][3] = {};
  for (std::size_t a = 0; a < num_modes; ++a)
    for (int n = 0; n < kCount; ++n)
      for (int d = 0; d < 3; ++d) sum[n][d] += table[n * num_modes + a] * coefficients[a][d];
  for (int n = 0; n < kCount; ++n)
    for (std::size_t l = 0; l < kWide && n * kWide + l < active; ++l)
      out[n * kWide + l] = Vec3(sum[n][0][l], sum[n][1][l], sum[n][2][l]);
}

/// Sums over the points, for kCount modes: parts[3 r + d] is coordinate d of the r-th group of eight points.
template <int kCount>
void gather_modes(const Wide* table, std::size_t num_modes, const Wide* parts, std::size_t num_wide, Vec3* out) {
  Wide sum[kCount][3] = {};
  for (std::size_t r = 0; r < num_wide; ++r)
    for (int n = 0; n < kCount; ++n)
      for (int d = 0; d < 3; ++d) sum[n][d] += table[r * num_modes + n] * parts[3 * r + d];
  for (int n = 0; n < kCount; ++n)
    for (int d = 0; d < 3; ++d) out[n][d] = sum_of_lanes(sum[n][d]);
}

}  // namespace

PointTables::PointTables(const ElementSpace& space, std::span<const CellPoint> points) : num_rows_(points.size()) {
  require_inside("PointTables", space, points);
  std::map<TableKey, std::vector<Block>> blocks;
  std::map<TableKey, int> orders;
  for (std::size_t first = 0, end; first < points.size(); first = end) {
    const Index c = points[first].cell;
    const CellKind kind = space.kind(c);
    const unsigned sides = sides_at(kind, points[first].point);
    for (end = first + 1; end < points.size() && end - first < kMostRowsPerBlock; ++end)
      if (points[end].cell != c || sides_at(kind, points[end].point) != sides) break;
    TableKey key{kind, {}, {}};
    auto& [key_kind, key_modes, key_points] = key;
    const std::size_t first_place = signed_nodes_.size();
    const auto modes = space.modes(c);
    for (std::size_t a = 0; a < modes.size(); ++a) {
      if (vanishes(kind, modes[a], sides)) continue;
      key_modes.push_back(modes[a]);
      signed_nodes_.push_back(space.signs(c)[a] > 0 ? space.nodes(c)[a] : ~space.nodes(c)[a]);
    }
    for (std::size_t i = first; i < end; ++i) {
      const Vec3& p = points[i].point;
      key_points.push_back({p[0], p[1], p[2]});
    }
    orders.try_emplace(key, space.pattern_order(space.pattern(c)));
    blocks[std::move(key)].push_back({0, first, end - first, first_place});
  }
  for (const auto& [key, same] : blocks) {
    for (Block block : same) {
      block.table = tables_.size();
      blocks_.push_back(block);
    }
    tables_.push_back({std::get<1>(key).size(), table_values(key, space.basis(), orders.at(key))});
  }
  local_.resize(signed_nodes_.size());
  find_incidences(space.num_nodes());
}

void PointTables::find_incidences(std::size_t num_nodes) {
  const auto node_of = [](Index signed_node) { return signed_node < 0 ? ~signed_node : signed_node; };
  incidence_offsets_.assign(num_nodes + 1, 0);
  for (Index node : signed_nodes_) ++incidence_offsets_[node_of(node) + 1];
  for (std::size_t i = 0; i < num_nodes; ++i) incidence_offsets_[i + 1] += incidence_offsets_[i];
  incidences_.resize(signed_nodes_.size());
  std::vector<std::size_t> next(incidence_offsets_.begin(), incidence_offsets_.end() - 1);
  for (std::size_t place = 0; place < signed_nodes_.size(); ++place)
    incidences_[next[node_of(signed_nodes_[place])]++] = place;
}

void PointTables::apply(std::span<const Vec3> in, std::span<Vec3> out) const {
  if (in.size() != num_cols() || out.size() != num_rows())
    throw InputError("PointTables::apply: sizes do not match the map");
#pragma omp parallel for schedule(dynamic, 8)
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Block& block = blocks_[b];
    const std::size_t modes = num_modes(block);
    const std::span<Vec3> coefficients(local_.data() + block.first_place, modes);
    for (std::size_t a = 0; a < modes; ++a) {
      const Index node = signed_nodes_[block.first_place + a];
      coefficients[a] = node < 0 ? Vec3(-in[~node]) : in[node];
    }
    const Wide* table = tables_[block.table].values.data();
    Vec3* rows = out.data() + block.first_row;
    std::size_t left = block.num_rows;
    for (; left > (kWideAtOnce - 1) * kWide; table += kWideAtOnce * modes) {
      const std::size_t active = std::min<std::size_t>(left, kWideAtOnce * kWide);
      evaluate<kWideAtOnce>(table, coefficients, active, rows);
      rows += active;
      left -= active;
    }
    for (; left > 0; table += modes) {
      const std::size_t active = std::min<std::size_t>(left, kWide);
      evaluate<1>(table, coefficients, active, rows);
      rows += active;
      left -= active;
    }
  }
}

void PointTables::apply_transposed(std::span<const Vec3> in, std::span<Vec3> out) const {
  if (in.size() != num_rows() || out.size() != num_cols())
    throw InputError("PointTables::apply_transposed: sizes do not match the map");
#pragma omp parallel for schedule(dynamic, 8)
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Block& block = blocks_[b];
    const std::size_t modes = num_modes(block), num_wide = (block.num_rows + kWide - 1) / kWide;
    Wide parts[3 * kMostWide];
    std::fill_n(parts + 3 * (num_wide - 1), 3, Wide{});
    for (std::size_t i = 0; i < block.num_rows; ++i)
      for (std::size_t d = 0; d < 3; ++d) parts[3 * (i / kWide) + d][i % kWide] = in[block.first_row + i][d];
    const Wide* table = tables_[block.table].values.data();
    Vec3* sums = local_.data() + block.first_place;
    std::size_t a = 0;
    for (; a + kModesAtOnce <= modes; a += kModesAtOnce)
      gather_modes<kModesAtOnce>(table + a, modes, parts, num_wide, sums + a);
    for (; a < modes; ++a) gather_modes<1>(table + a, modes, parts, num_wide, sums + a);
  }
#pragma omp parallel for schedule(static)
  for (std::size_t node = 0; node < out.size(); ++node) {
    Vec3 sum = Vec3::Zero();
    for (std::size_t i = incidence_offsets_[node]; i < incidence_offsets_[node + 1]; ++i) {
      const std::size_t place = incidences_[i];
      if (signed_nodes_[place] < 0)
        sum -= local_[place];
      else
        sum += local_[place];
    }
    out[node] = sum;
  }
}

}  // namespace subvol::internal
