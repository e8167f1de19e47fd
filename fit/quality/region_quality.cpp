// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/quality/region_quality.h"

#include "subvol/base/error.h"
#include "subvol/base/parallel_errors.h"
#include "subvol/base/sort_unique.h"
#include "subvol/fit/elements/pattern_table.h"
#include "subvol/fit/elements/quadrature.h"
#include "subvol/fit/elements/shape_functions.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/triangle_geometry.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <map>
#include <span>
#include <string>
#include <utility>

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
  return sum_over_fan(mesh, face,
                      [](const Vec3& a, const Vec3& b, const Vec3& c) { return 0.5 * (b - a).cross(c - a).norm(); });
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

/// The regions of a mesh: which there are, and which one each cell belongs to.
class Regions {
 public:
  Regions(const CellLabels& labels, std::size_t num_cells) : labels_(labels) {
    if (labels.references.empty() && num_cells > 0) numbers_ = {0};
    numbers_.insert(numbers_.end(), labels.references.begin(), labels.references.end());
    sort_unique(numbers_);
  }

  std::size_t size() const { return numbers_.size(); }
  int reference(std::size_t c) const { return labels_.references.empty() ? 0 : labels_.references[c]; }
  /// Place of a cell's region, ascending by reference.
  std::size_t of(std::size_t c) const {
    return static_cast<std::size_t>(std::ranges::lower_bound(numbers_, reference(c)) - numbers_.begin());
  }

  /// Names, numbers of cells and qualities; volumes and areas are 0.
  RegionReport report(std::size_t num_cells, const QualityReport* quality) const {
    RegionReport report;
    for (const int number : numbers_) {
      RegionQuality region{number, {}};
      for (const Group& group : labels_.regions)
        if (group.number == number) region.name = group.name;
      report.regions.push_back(std::move(region));
    }
    for (std::size_t c = 0; c < num_cells; ++c) {
      RegionQuality& region = report.regions[of(c)];
      ++region.num_cells;
      if (quality) region.min_scaled_jacobian = std::min(region.min_scaled_jacobian, quality->cell_minima[c]);
    }
    if (quality)
      for (const Index c : quality->certificate.not_certified)
        ++report.regions[of(static_cast<std::size_t>(c))].num_uncertified;
    return report;
  }

 private:
  CellLabels labels_;
  std::vector<int> numbers_;
};

CellLabels labels_of(const VolumeMesh& mesh) { return {mesh.references, mesh.regions}; }

/// Volume below a curved face, seen from a point, and its area.
struct FaceIntegrals {
  double volume = 0, area = 0;
};

/// Points of a local face of a cell, with the two tangents of its map in canonical coordinates. The face turns outward.
struct FaceRule {
  std::vector<Vec3> points;
  std::vector<double> weights;  ///< their sum is the area of the face's parameters
  Vec3 first, second;
};

FaceRule face_rule(CellKind kind, int local_face, int order, Basis basis) {
  // x . (x_u x x_v) has the degree 3 p - 1 in each direction of a quad and 3 p - 2 on a triangle. Fourier modes are no
  // polynomials: more points integrate them to about rounding.
  const int most_degree = 3 * order - 1, num_points = (most_degree + 2) / 2 + (basis == Basis::fourier ? order + 4 : 0);
  const CellTopology& topology = cell_topology(kind);
  const auto vertices = canonical_vertices(kind);
  const auto corner = [&](int i) -> Vec3 { return vertices[topology.faces[local_face][i]]; };
  const bool is_quad = topology.face_sizes[local_face] == 4;
  FaceRule rule{{}, {}, corner(1) - corner(0), corner(is_quad ? 3 : 2) - corner(0)};
  if (is_quad) {
    const LineRule line = gauss_rule(num_points);
    for (std::size_t j = 0; j < line.points.size(); ++j)
      for (std::size_t i = 0; i < line.points.size(); ++i) {
        rule.points.push_back(corner(0) + line.points[i] * rule.first + line.points[j] * rule.second);
        rule.weights.push_back(line.weights[i] * line.weights[j]);
      }
    return rule;
  }
  const Quadrature triangle = make_triangle_quadrature(QuadratureRule::gauss_lobatto, num_points + 1);
  for (std::size_t q = 0; q < triangle.points.size(); ++q) {
    rule.points.push_back(corner(0) + triangle.points[q][0] * rule.first + triangle.points[q][1] * rule.second);
    rule.weights.push_back(triangle.weights[q] / 2);
  }
  return rule;
}

/// Integrals over the faces that are wanted, by `MeshTopology`: seen from the first of their cells.
std::vector<FaceIntegrals> face_integrals(const HighOrderMesh& mesh, const std::vector<char>& is_wanted) {
  const MeshTopology& topology = mesh.space.topology();
  std::vector<FaceIntegrals> integrals(topology.num_faces());
  if (mesh.coefficients.empty()) return integrals;
  const Vec3 origin = mesh.coefficients[0];
  const auto by_pattern = cells_by_pattern(mesh.space);
  for (std::size_t pattern = 0; pattern < by_pattern.size(); ++pattern) {
    const std::vector<Index>& cells = by_pattern[pattern];
    if (cells.empty()) continue;
    const CellKind kind = mesh.space.pattern_kind(pattern);
    for (int f = 0; f < cell_topology(kind).num_faces; ++f) {
      const FaceRule rule = face_rule(kind, f, mesh.space.pattern_order(pattern), mesh.space.basis());
      const PatternTable table(mesh.space, pattern, rule.points, PatternTable::Derivatives::first);
      const auto integrate = [&](Index c, std::vector<Vec3>& positions, std::vector<Mat3>& jacobians) {
        const Index face = topology.cell_faces(c)[f];
        if (!is_wanted[face] || topology.face_cells(face)[0] != c) return;
        table.positions(mesh, c, positions);
        table.jacobians(mesh, c, jacobians);
        for (std::size_t q = 0; q < rule.points.size(); ++q) {
          const Vec3 normal = (jacobians[q] * rule.first).cross(jacobians[q] * rule.second);
          integrals[face].volume += rule.weights[q] * (positions[q] - origin).dot(normal) / 3;
          integrals[face].area += rule.weights[q] * normal.norm();
        }
      };
      ParallelErrors errors;
#pragma omp parallel
      {
        std::vector<Vec3> positions(rule.points.size());
        std::vector<Mat3> jacobians(rule.points.size());
#pragma omp for schedule(static)
        for (std::size_t i = 0; i < cells.size(); ++i) errors.guard([&] { integrate(cells[i], positions, jacobians); });
      }
      errors.rethrow();
    }
  }
  return integrals;
}

}  // namespace

std::vector<double> region_volumes(const VolumeMesh& mesh) {
  const Regions regions(labels_of(mesh), mesh.num_cells());
  std::vector<double> volumes(regions.size(), 0.0);
  for (std::size_t c = 0; c < mesh.num_cells(); ++c) volumes[regions.of(c)] += cell_volume(mesh, c);
  return volumes;
}

RegionReport measure_regions(const VolumeMesh& mesh, const QualityReport* quality) {
  const MeshTopology topology(mesh);
  const Regions regions(labels_of(mesh), mesh.num_cells());
  RegionReport report = regions.report(mesh.num_cells(), quality);
  const std::vector<double> volumes = region_volumes(mesh);
  for (std::size_t r = 0; r < volumes.size(); ++r) report.regions[r].volume = volumes[r];
  for (const Index f : topology.boundary_faces())
    report.regions[regions.of(static_cast<std::size_t>(topology.face_cells(f)[0]))].area +=
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

RegionReport measure_regions(const HighOrderMesh& mesh, const CellLabels& labels, const QualityReport* quality) {
  const std::size_t num_cells = mesh.space.num_cells();
  if (!labels.references.empty() && labels.references.size() != num_cells)
    throw InputError("measure_regions: " + std::to_string(labels.references.size()) + " references for " +
                     std::to_string(num_cells) + " cells");
  const MeshTopology& topology = mesh.space.topology();
  const Regions regions(labels, num_cells);
  RegionReport report = regions.report(num_cells, quality);
  const auto sides = [&](std::size_t f) {
    const auto [first, second] = topology.face_cells(static_cast<Index>(f));
    return std::pair(static_cast<std::size_t>(first), static_cast<std::size_t>(second));
  };
  const auto is_border = [&](std::size_t f) {
    const auto [first, second] = sides(f);
    return topology.is_boundary_face(static_cast<Index>(f)) || regions.of(first) != regions.of(second);
  };
  std::vector<char> is_wanted(topology.num_faces());
  for (std::size_t f = 0; f < is_wanted.size(); ++f) is_wanted[f] = is_border(f);
  const std::vector<FaceIntegrals> integrals = face_integrals(mesh, is_wanted);
  std::map<std::array<int, 2>, InterfaceArea> interfaces;
  for (std::size_t f = 0; f < is_wanted.size(); ++f) {
    if (!is_wanted[f]) continue;
    const auto [first, second] = sides(f);
    report.regions[regions.of(first)].volume += integrals[f].volume;
    if (topology.is_boundary_face(static_cast<Index>(f))) {
      report.regions[regions.of(first)].area += integrals[f].area;
      continue;
    }
    report.regions[regions.of(second)].volume -= integrals[f].volume;
    const auto [low, high] = std::minmax({regions.reference(first), regions.reference(second)});
    InterfaceArea& interface = interfaces.try_emplace({low, high}, InterfaceArea{{low, high}}).first->second;
    ++interface.num_faces;
    interface.area += integrals[f].area;
  }
  for (const auto& [pair, interface] : interfaces) report.interfaces.push_back(interface);
  return report;
}

RegionReport measure_regions(const RegionSurface& surface) {
  RegionReport report;
  std::map<std::array<int, 2>, InterfaceArea> areas;
  for (std::size_t t = 0; t < surface.sides.size(); ++t) {
    InterfaceArea& one = areas[surface.pair(t)];
    ++one.num_faces;
    one.area += triangle_area(surface.mesh, surface.mesh.triangles[t]);
  }
  for (std::size_t r = 0; r < surface.regions.size(); ++r) {
    RegionQuality region{surface.regions[r].number, surface.regions[r].name};
    region.volume = surface.volumes[r];
    if (const auto at = areas.find({kOutsideRegion, region.reference}); at != areas.end())
      region.area = at->second.area;
    report.regions.push_back(std::move(region));
  }
  for (auto& [pair, area] : areas) {
    if (pair[0] == kOutsideRegion) continue;
    area.references = pair;
    report.interfaces.push_back(area);
  }
  return report;
}

}  // namespace subvol
