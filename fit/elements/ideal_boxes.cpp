// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/elements/ideal_boxes.h"

#include "subvol/fit/elements/element_rule.h"
#include "subvol/fit/elements/shape_functions.h"
#include "subvol/mesh/mesh_topology.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace subvol::internal {

namespace {

constexpr int kMaxSweeps = 200;  // sweeps end earlier if no log(size) changes by more than kSmallChange
constexpr double kSmallChange = 1e-3;

/// Logarithm of the mean length of a face's edges.
double log_size(std::span<const Index> face, std::span<const Vec3> nodes) {
  double sum = 0;
  for (std::size_t i = 0; i < face.size(); ++i) sum += (nodes[face[(i + 1) % face.size()]] - nodes[face[i]]).norm();
  return std::log(sum / static_cast<double>(face.size()));
}

}  // namespace

Vec3 box_lengths(CellKind kind, std::span<const Index> cell, std::span<const Vec3> nodes) {
  const CellTopology& topology = cell_topology(kind);
  Vec3 sums = Vec3::Zero(), counts = Vec3::Zero();
  for (int e = 0; e < topology.num_edges; ++e) {
    const int a = topology.edges[e][0], b = topology.edges[e][1];
    const double length = (nodes[cell[b]] - nodes[cell[a]]).norm();
    const Vec3 along = (canonical_vertices(kind)[b] - canonical_vertices(kind)[a]).cwiseAbs();
    for (int i = 0; i < 3; ++i) {
      const bool counts_here =
          kind == CellKind::tet || (kind == CellKind::prism && i < 2 ? along[2] == 0 : along[i] > 0);
      if (!counts_here) continue;
      sums[i] += length;
      counts[i] += 1;
    }
  }
  return sums.cwiseQuotient(counts);
}

std::vector<Vec3> ideal_boxes(const VolumeMesh& mesh, std::span<const Vec3> nodes, double volume, double own_share) {
  constexpr double kLeastBoxLengthShare = 1e-3;  // of the common length: a collapsed edge must not make a box flat
  double ideal_volumes = 0;
  for (CellKind kind : mesh.kinds) ideal_volumes += ideal_volume(kind);
  const double common = std::cbrt(volume / std::max(ideal_volumes, std::numeric_limits<double>::min()));
  std::vector<Vec3> boxes(mesh.num_cells());
  double total = 0;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    const Vec3 lengths = box_lengths(mesh.kinds[c], mesh.cell(c), nodes);
    for (int i = 0; i < 3; ++i)
      boxes[c][i] = common * std::pow(std::max(lengths[i] / common, kLeastBoxLengthShare), own_share);
    total += ideal_volume(mesh.kinds[c]) * boxes[c].prod();
  }
  const double scale = std::cbrt(volume / total);
  for (Vec3& h : boxes) h *= scale;
  return boxes;
}

std::vector<Vec3> interpolated_boxes(const VolumeMesh& mesh, std::span<const Vec3> nodes, double volume,
                                     std::span<const std::uint8_t> trusted) {
  const MeshTopology topology(mesh);
  std::vector<Vec3> boxes = ideal_boxes(mesh, nodes, volume, 1);
  const double common = std::log(ideal_boxes(mesh, nodes, volume, 0)[0][0]);
  std::vector<double> size(mesh.num_cells(), common);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (trusted[c]) size[c] = std::log(boxes[c].prod()) / 3;
  // Gauss-Seidel: one forward and one backward sweep carry sizes through the whole mesh.
  for (int sweep = 0; sweep < kMaxSweeps; ++sweep) {
    double change = 0;
    for (std::size_t k = 0; k < mesh.num_cells(); ++k) {
      const std::size_t c = sweep % 2 == 0 ? k : mesh.num_cells() - 1 - k;
      if (trusted[c]) continue;
      double sum = 0;
      for (const Index f : topology.cell_faces(c)) {
        const auto& cells = topology.face_cells(f);
        sum += topology.is_boundary_face(f) ? log_size(topology.face(f), nodes)
                                            : size[cells[0] == static_cast<Index>(c) ? cells[1] : cells[0]];
      }
      const double mean = sum / static_cast<double>(topology.cell_faces(c).size());
      if (!std::isfinite(mean)) continue;
      change = std::max(change, std::abs(mean - size[c]));
      size[c] = mean;
    }
    if (change < kSmallChange) break;
  }
  double total = 0;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    if (!trusted[c]) boxes[c] = Vec3::Constant(std::exp(size[c]));
    total += ideal_volume(mesh.kinds[c]) * boxes[c].prod();
  }
  const double scale = std::cbrt(volume / total);
  for (Vec3& h : boxes) h *= scale;
  return boxes;
}

}  // namespace subvol::internal
