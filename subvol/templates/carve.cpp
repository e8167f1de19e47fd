// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/templates/carve.h"

#include "subvol/base/error.h"
#include "subvol/mesh/validate.h"
#include "subvol/surface/winding_number.h"
#include "subvol/templates/template_edit.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <string>

namespace subvol {

using namespace internal;

namespace {

constexpr std::array<double, 3> kCentersOfThirds{1.0 / 6, 0.5, 5.0 / 6};  // of an edge

/// Appends 27 points spread over a cell in its canonical coordinates; for prisms and tets, the points of the cube are
/// folded into the cell, and for pyramids its upper side is collapsed.
void append_points(const VolumeMesh& mesh, std::size_t c, std::vector<Vec3>& points) {
  const auto corner = [&](std::size_t i) -> const Vec3& { return mesh.positions[mesh.cell(c)[i]]; };
  const auto between = [](const Vec3& a, const Vec3& b, double t) -> Vec3 { return a + t * (b - a); };
  for (double w : kCentersOfThirds)
    for (double v : kCentersOfThirds)
      for (double u : kCentersOfThirds) {
        switch (mesh.kinds[c]) {
          case CellKind::hex:
            points.push_back(between(between(between(corner(0), corner(1), u), between(corner(3), corner(2), u), v),
                                     between(between(corner(4), corner(5), u), between(corner(7), corner(6), u), v),
                                     w));
            break;
          case CellKind::prism: {
            const double s = u + v > 1 ? 1 - u : u, t = u + v > 1 ? 1 - v : v;
            const auto at = [&](std::size_t base) -> Vec3 {
              return (1 - s - t) * corner(base) + s * corner(base + 1) + t * corner(base + 2);
            };
            points.push_back(between(at(0), at(3), w));
            break;
          }
          case CellKind::pyramid:
            points.push_back(between(between(between(corner(0), corner(1), u), between(corner(3), corner(2), u), v),
                                     corner(4), 1 - std::cbrt(1 - w)));
            break;
          case CellKind::tet: {
            std::array<double, 3> cut{u, v, w};  // sorted, they cut [0, 1] into the four barycentric weights of a point
            std::sort(cut.begin(), cut.end());
            points.push_back(cut[0] * corner(0) + (cut[1] - cut[0]) * corner(1) + (cut[2] - cut[1]) * corner(2) +
                             (1 - cut[2]) * corner(3));
            break;
          }
        }
      }
}

/// Returns the first message about a kind of defect of the kept cells, with the mesh's own numbers of vertices.
std::string message_of(MeshDefect::Kind kind, const VolumeMesh& mesh, std::span<const char> kept) {
  VolumeMesh part;
  part.positions = mesh.positions;
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    if (kept[c]) part.add_cell(mesh.kinds[c], mesh.cell(c));
  const std::vector<MeshDefect> defects = validate(part);
  const auto found = std::ranges::find(defects, kind, &MeshDefect::kind);
  return found == defects.end() ? std::string() : found->message;
}

}  // namespace

VolumeMesh carve(const VolumeMesh& mesh, const std::function<bool(std::size_t cell)>& keep) {
  std::vector<char> kept(mesh.num_cells(), 0);
  for (std::size_t c = 0; c < kept.size(); ++c) kept[c] = keep(c);
  if (std::find(kept.begin(), kept.end(), 1) == kept.end()) throw InputError("carve: no cell is kept");
  VolumeMesh result = kept_cells(mesh, kept);
  for (const MeshDefect& defect : validate(result))
    if (defect.kind == MeshDefect::Kind::nonmanifold_edge || defect.kind == MeshDefect::Kind::nonmanifold_vertex)
      throw InputError("carve: what is kept touches itself: " + message_of(defect.kind, mesh, kept));
  return result;
}

std::vector<char> cells_inside(const VolumeMesh& mesh, const TriangleMesh& surface, double least_share) {
  if (!(least_share > 0) || !(least_share <= 1)) throw InputError("carve: the least share must be in (0, 1]");
  constexpr std::size_t kCarvePointsPerCell =
      kCentersOfThirds.size() * kCentersOfThirds.size() * kCentersOfThirds.size();
  std::vector<Vec3> points;
  points.reserve(kCarvePointsPerCell * mesh.num_cells());
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) append_points(mesh, c, points);
  const std::vector<double> winding = WindingNumber(surface).at(points);
  std::vector<char> inside(mesh.num_cells());
  for (std::size_t c = 0; c < inside.size(); ++c) {
    const auto first = winding.begin() + static_cast<std::ptrdiff_t>(kCarvePointsPerCell * c);
    const auto count = std::count_if(first, first + kCarvePointsPerCell, [](double w) { return w > 0.5; });
    inside[c] = static_cast<double>(count) >= least_share * static_cast<double>(kCarvePointsPerCell);
  }
  return inside;
}

std::vector<char> cells_in_box(const VolumeMesh& mesh, const Vec3& low, const Vec3& high) {
  std::vector<char> inside(mesh.num_cells());
  for (std::size_t c = 0; c < inside.size(); ++c) {
    Vec3 center = Vec3::Zero();
    for (Index v : mesh.cell(c)) center += mesh.positions[v] / static_cast<double>(mesh.cell(c).size());
    inside[c] = (center.array() >= low.array()).all() && (center.array() <= high.array()).all();
  }
  return inside;
}

std::vector<char> cells_listed(const VolumeMesh& mesh, std::span<const Index> cells) {
  std::vector<char> listed(mesh.num_cells(), 0);
  for (Index c : cells) {
    if (c < 0 || static_cast<std::size_t>(c) >= mesh.num_cells())
      throw InputError("there is no cell " + std::to_string(c) + " of " + std::to_string(mesh.num_cells()));
    listed[c] = 1;
  }
  return listed;
}

}  // namespace subvol
