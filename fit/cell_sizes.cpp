// SPDX-License-Identifier: GPL-3.0-or-later
#include "fit/cell_sizes.h"

#include "fit/element_rule.h"
#include "fit/fit_level.h"
#include "subvol/mesh_topology.h"

#include <cmath>

namespace subvol {

namespace {

constexpr int kMaxSweeps = 200;
constexpr double kSmallChange = 1e-3;

/// ln of the mean length of a face's edges.
double log_size(std::span<const Index> face, std::span<const Vec3> nodes) {
  double sum = 0;
  for (std::size_t i = 0; i < face.size(); ++i) sum += (nodes[face[(i + 1) % face.size()]] - nodes[face[i]]).norm();
  return std::log(sum / static_cast<double>(face.size()));
}

}  // namespace

std::vector<Vec3> interpolated_boxes(const VolumeMesh& mesh, std::span<const Vec3> nodes, double volume,
                                     std::span<const std::uint8_t> trusted) {
  const MeshTopology topology(mesh);
  std::vector<Vec3> boxes = ideal_boxes(mesh, nodes, volume, 1);
  const double common = std::log(ideal_boxes(mesh, nodes, volume, 0)[0][0]);
  std::vector<double> size(mesh.num_cells(), common);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (trusted[c]) size[c] = std::log(boxes[c].prod()) / 3;
  // Gauss-Seidel: a sweep there and back carries sizes through the whole mesh.
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

}  // namespace subvol
