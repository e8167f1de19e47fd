// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/quality/region_quality.h"

#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <map>

namespace subvol {

using namespace internal;

namespace {

Vec3 center_of(const VolumeMesh& mesh, std::span<const Index> vertices) {
  Vec3 sum = Vec3::Zero();
  for (const Index v : vertices) sum += mesh.positions[v];
  return sum / static_cast<double>(vertices.size());
}

/// Returns the sum over the triangles between a face's center and its edges, with `of(a, b, c)` for each.
template <class Of>
double sum_over_fan(const VolumeMesh& mesh, std::span<const Index> face, const Of& of) {
  const Vec3 center = center_of(mesh, face);
  double sum = 0;
  for (std::size_t i = 0; i < face.size(); ++i)
    sum += of(center, mesh.positions[face[i]], mesh.positions[face[(i + 1) % face.size()]]);
  return sum;
}

double face_area(const VolumeMesh& mesh, std::span<const Index> face) {
  return sum_over_fan(mesh, face, [](const Vec3& a, const Vec3& b, const Vec3& c) {
    return 0.5 * (b - a).cross(c - a).norm();
  });
}

/// A bilinear patch encloses the volume of the fan around its center.
double cell_volume(const VolumeMesh& mesh, std::size_t c) {
  const CellTopology& topology = cell_topology(mesh.kinds[c]);
  const auto cell = mesh.cell(c);
  const Vec3 origin = mesh.positions[cell[0]];
  double volume = 0;
  for (int f = 0; f < topology.num_faces; ++f) {
    std::array<Index, 4> face{};
    for (int i = 0; i < topology.face_sizes[f]; ++i) face[i] = cell[topology.faces[f][i]];
    volume += sum_over_fan(mesh, std::span(face).first(topology.face_sizes[f]),
                           [&](const Vec3& p, const Vec3& q, const Vec3& r) {
                             return (p - origin).dot((q - origin).cross(r - origin)) / 6;
                           });
  }
  return volume;
}

std::size_t place_of(const std::vector<int>& references, const VolumeMesh& mesh, std::size_t c) {
  const int reference = mesh.references.empty() ? 0 : mesh.references[c];
  return static_cast<std::size_t>(std::ranges::lower_bound(references, reference) - references.begin());
}

}  // namespace

std::vector<double> region_volumes(const VolumeMesh& mesh) {
  const std::vector<int> references = region_references(mesh);
  std::vector<double> volumes(references.size(), 0.0);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) volumes[place_of(references, mesh, c)] += cell_volume(mesh, c);
  return volumes;
}

RegionReport measure_regions(const VolumeMesh& mesh, const QualityReport* quality) {
  RegionReport report;
  const MeshTopology topology(mesh);
  const std::vector<int> references = region_references(mesh);
  const std::vector<double> volumes = region_volumes(mesh);
  for (std::size_t r = 0; r < references.size(); ++r) {
    RegionQuality region{references[r], {}};
    for (const Group& group : mesh.regions)
      if (group.number == references[r]) region.name = group.name;
    region.volume = volumes[r];
    report.regions.push_back(std::move(region));
  }
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) {
    RegionQuality& region = report.regions[place_of(references, mesh, c)];
    ++region.num_cells;
    if (quality) region.min_scaled_jacobian = std::min(region.min_scaled_jacobian, quality->cell_minima[c]);
  }
  if (quality)
    for (const Index c : quality->certificate.not_certified)
      ++report.regions[place_of(references, mesh, static_cast<std::size_t>(c))].num_uncertified;
  for (const Index f : topology.boundary_faces())
    report.regions[place_of(references, mesh, static_cast<std::size_t>(topology.face_cells(f)[0]))].area +=
        face_area(mesh, topology.face(f));
  const Interfaces interfaces = find_interfaces(mesh, topology);
  for (const auto& pair : interfaces.pairs) report.interfaces.push_back({pair});
  for (std::size_t i = 0; i < interfaces.faces.size(); ++i) {
    InterfaceArea& interface = report.interfaces[interfaces.pair_of_face[i]];
    ++interface.num_faces;
    interface.area += face_area(mesh, topology.face(interfaces.faces[i]));
  }
  return report;
}

RegionReport measure_regions(const RegionSurface& surface) {
  RegionReport report;
  std::map<std::array<int, 2>, InterfaceArea> areas;
  for (std::size_t t = 0; t < surface.sides.size(); ++t) {
    const auto& [a, b, c] = surface.mesh.triangles[t];
    const std::vector<Vec3>& x = surface.mesh.positions;
    InterfaceArea& one = areas[surface.pair(t)];
    ++one.num_faces;
    one.area += 0.5 * (x[b] - x[a]).cross(x[c] - x[a]).norm();
  }
  for (std::size_t r = 0; r < surface.regions.size(); ++r) {
    RegionQuality region{surface.regions[r].number, surface.regions[r].name};
    region.volume = surface.volumes[r];
    if (const auto at = areas.find({kOutside, region.reference}); at != areas.end()) region.area = at->second.area;
    report.regions.push_back(std::move(region));
  }
  for (auto& [pair, area] : areas) {
    if (pair[0] == kOutside) continue;
    area.references = pair;
    report.interfaces.push_back(area);
  }
  return report;
}

}  // namespace subvol
