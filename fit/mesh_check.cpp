// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/fit/mesh_check.h"

#include "subvol/base/disjoint_sets.h"
#include "subvol/base/error.h"
#include "subvol/base/length_range.h"
#include "subvol/base/sort_unique.h"
#include "subvol/fit/certificate/high_order_certificate.h"
#include "subvol/fit/geometry/boundary_triangles.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/self_intersection.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/part_nesting.h"
#include "subvol/surface/surface_parts.h"
#include "subvol/surface/triangle_geometry.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <functional>
#include <limits>
#include <memory>
#include <numeric>

namespace subvol {

using namespace internal;

namespace {

using Kind = MeshDefect::Kind;

bool has_any(const std::vector<MeshDefect>& defects, std::initializer_list<Kind> kinds) {
  return std::any_of(defects.begin(), defects.end(), [&](const MeshDefect& defect) {
    return std::find(kinds.begin(), kinds.end(), defect.kind) != kinds.end();
  });
}

void check_topology(const VolumeMesh& mesh, const MeshTopology& topology, MeshCheck& check) {
  check.has_topology = true;
  check.num_edges = topology.num_edges();
  check.num_faces = topology.num_faces();
  DisjointSets cells(mesh.num_cells()), vertices(mesh.num_vertices());
  for (std::size_t f = 0; f < topology.num_faces(); ++f) {
    const Index face = static_cast<Index>(f);
    const auto [first, second] = topology.face_cells(face);
    if (second != kNoIndex) cells.join(first, second);
    if (topology.is_boundary_face(face))
      for (const Index v : topology.face(face)) vertices.join(v, topology.face(face)[0]);
  }
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    check.num_components += cells.of(static_cast<Index>(c)) == static_cast<Index>(c);
  std::vector<char> used(mesh.num_vertices(), 0);
  for (const Index v : mesh.cell_vertices) used[v] = 1;
  for (std::size_t i = 0; i < mesh.num_vertices(); ++i) {
    const Index v = static_cast<Index>(i);
    if (!topology.is_boundary_vertex(v)) continue;
    ++check.num_boundary_vertices;
    check.num_boundary_components += vertices.of(v) == v;
  }
  for (std::size_t e = 0; e < topology.num_edges(); ++e)
    check.num_boundary_edges += topology.is_boundary_edge(static_cast<Index>(e));
  check.num_boundary_faces = topology.boundary_faces().size();
  const auto alternate = [](std::size_t v, std::size_t e, std::size_t f, std::size_t c) {
    return static_cast<long>(v) - static_cast<long>(e) + static_cast<long>(f) - static_cast<long>(c);
  };
  check.boundary_euler_number =
      alternate(check.num_boundary_vertices, check.num_boundary_edges, check.num_boundary_faces, 0);
  check.euler_number = alternate(static_cast<std::size_t>(std::count(used.begin(), used.end(), 1)), check.num_edges,
                                 check.num_faces, mesh.num_cells());
}

double enclosed_volume(const TriangleMesh& surface) {
  const Vec3 origin = surface.triangles.empty() ? Vec3::Zero() : surface.positions[surface.triangles[0][0]];
  double sum = 0;
  for (const auto& t : surface.triangles) sum += sixfold_volume(surface.positions, t, origin);
  return sum / 6;
}

/// Compares the boundary's triangles with a target; empty if there is none.
using Compare = std::function<void(const TriangleMesh& boundary, MeshCheck& check)>;

Compare comparison(const TriangleMesh* target, const MeshCheckOptions& options) {
  if (options.distance_samples < 1)
    throw InputError("mesh check: distance_samples is " + std::to_string(options.distance_samples) +
                     ", expected 1 or more");
  if (!target) return {};
  require_extent(target->positions, "mesh check: target");
  const auto tree = std::make_shared<const ClosestPoint>(*target);
  return [target, tree, samples = options.distance_samples](const TriangleMesh& boundary, MeshCheck& check) {
    check.target_diagonal = bounding_box_diagonal(*target);
    const ClosestPoint boundary_tree(boundary);
    check.distance = surface_distance(boundary, boundary_tree, *target, *tree, {.num_samples = samples});
    check.normals = normal_deviation(boundary, boundary_tree, *target, *tree, samples);
  };
}

Compare comparison(const PointCloud* target) {
  if (!target) return {};
  if (target->points.empty()) throw InputError("mesh check: the cloud has no points");
  for (std::size_t j = 0; j < target->points.size(); ++j)
    if (!target->points[j].allFinite())
      throw InputError("mesh check: point " + std::to_string(j) + " of the cloud is not finite");
  require_extent(target->points, "mesh check: cloud");
  return [target](const TriangleMesh& boundary, MeshCheck& check) {
    check.target_diagonal = bounding_box_diagonal(*target);
    check.distance = surface_distance(boundary, *target);
  };
}

/// Announces the next part to the progress callback; returns false if the check must stop.
bool begins(const char* part, double fraction, const WorkProgress& progress, MeshCheck& check) {
  check.ended_early = !goes_on(progress, part, fraction);
  return !check.ended_early;
}

/// Returns a vertex of each part of a surface whose normals point into the solid that all parts bound together; none if
/// a part is not closed, or if cancelled.
std::vector<Vec3> parts_facing_inward(const TriangleMesh& surface, const WorkProgress& progress, MeshCheck& check) {
  const SurfaceParts parts = surface_parts(surface);
  const TriangleMesh& mesh = parts.surface.mesh;  // without triangles that have two corners in one place
  if (parts.num_parts() < 2 || std::ranges::find(parts.is_closed, 0) != parts.is_closed.end()) return {};
  const PartNesting nesting = part_nesting(mesh, parts.part, static_cast<int>(parts.num_parts()),
                                           [&] { return !begins("nesting", 0.5, progress, check); });
  if (check.ended_early) return {};
  std::vector<Vec3> places;
  for (std::size_t p = 0; p < parts.num_parts(); ++p) {
    if (nesting.faces_out(p)) continue;
    const auto first = std::ranges::find(parts.part, static_cast<int>(p)) - parts.part.begin();
    places.push_back(mesh.positions[mesh.triangles[static_cast<std::size_t>(first)][0]]);
  }
  return places;
}

void check_boundary(const TriangleMesh& triangles, std::span<const Index> face_of_triangle, const Compare& compare,
                    const WorkProgress& progress, MeshCheck& check) {
  if (!begins("self-intersections", 0.3, progress, check)) return;
  const SelfIntersections found =
      self_intersections(triangles, [&] { return !begins("self-intersections", 0.3, progress, check); });
  if (check.ended_early) return;
  check.has_boundary_geometry = true;
  check.volume = enclosed_volume(triangles);
  check.num_intersecting_triangle_pairs = found.pairs.size();
  check.num_degenerate_boundary_triangles = found.degenerate.size();
  auto& faces = check.intersecting_faces;
  for (const auto& [t, s] : found.pairs) faces.push_back({face_of_triangle[t], face_of_triangle[s]});
  sort_unique(faces);
  if (check.num_boundary_components > 1 && faces.empty())
    check.parts_inside_solids = parts_facing_inward(triangles, progress, check);
  if (check.ended_early) return;
  const bool to_compare = compare && !triangles.triangles.empty();
  if (to_compare && begins("distance", 0.6, progress, check)) compare(triangles, check);
}

MeshCheck count_cells(const VolumeMesh& mesh) {
  MeshCheck check;
  check.defects = validate(mesh);
  check.num_vertices = mesh.num_vertices();
  check.num_cells = mesh.num_cells();
  for (const CellKind kind : mesh.kinds) ++check.num_cells_of_kind[static_cast<std::size_t>(kind)];
  return check;
}

/// Returns witnesses for the first refuted cells: certify(cell) finds each, position(cell, canonical) maps it to space.
template <class Certify, class Position>
std::vector<InversionWitness> witnesses(const QualityReport& quality, const Certify& certify,
                                        const Position& position) {
  constexpr std::size_t kMostWitnesses = 10;  // of inverted cells in a report
  std::vector<InversionWitness> result;
  for (const Index c : quality.certificate.invalid_cells) {
    if (result.size() == kMostWitnesses) break;
    const CellCertificate found = certify(c);
    result.push_back({c, found.witness, position(c, found.witness), found.witness_determinant});
  }
  return result;
}

/// Returns one cell of a mesh as a mesh of its own.
HighOrderMesh single_cell(const VolumeMesh& mesh, std::size_t c) {
  VolumeMesh single;
  std::vector<Index> corners;
  for (const Index v : mesh.cell(c)) {
    corners.push_back(static_cast<Index>(corners.size()));
    single.positions.push_back(mesh.positions[v]);
  }
  single.add_cell(mesh.kinds[c], corners);
  return {ElementSpace(single, Basis::legendre, 1), single};
}

/// Appends printf output to a string.
template <class... Values>
void append(std::string& text, const char* format, Values... values) {
  const int size = std::snprintf(nullptr, 0, format, values...);
  std::string line(static_cast<std::size_t>(size) + 1, '\0');
  std::snprintf(line.data(), line.size(), format, values...);
  line.pop_back();
  text += line;
}

/// Unused vertices do no harm; they are listed separately from the defects.
void append_defects(std::string& text, std::vector<MeshDefect> defects) {
  constexpr std::size_t kMaxLines = 20;
  const std::size_t num_unused =
      std::erase_if(defects, [](const MeshDefect& defect) { return defect.kind == Kind::unused_vertex; });
  append(text, "defects             %zu\n", defects.size());
  for (std::size_t i = 0; i < std::min(defects.size(), kMaxLines); ++i)
    append(text, "  %s: %s\n", to_string(defects[i].kind), defects[i].message.c_str());
  if (defects.size() > kMaxLines) append(text, "  ... and %zu more\n", defects.size() - kMaxLines);
  if (num_unused > 0) append(text, "unused vertices     %zu, which does not matter\n", num_unused);
}

void append_orders(std::string& text, const OrderSummary& orders) {
  append(text, "orders              %d to %d, %s basis; %zu nodes, %.1f %% of the %zu of full order\n",
         orders.min_order, orders.max_order, to_string(orders.basis), orders.num_nodes,
         100.0 * static_cast<double>(orders.num_nodes) / static_cast<double>(orders.num_full_order_nodes),
         orders.num_full_order_nodes);
}

void append_topology(std::string& text, const MeshCheck& check) {
  append(text, "boundary            %zu faces, %zu edges, %zu vertices\n", check.num_boundary_faces,
         check.num_boundary_edges, check.num_boundary_vertices);
  append(text, "topology            %zu component(s), Euler number %ld; boundary %zu component(s), Euler number %ld\n",
         check.num_components, check.euler_number, check.num_boundary_components, check.boundary_euler_number);
}

void append_quality(std::string& text, const QualityReport& quality) {
  const CertificateSummary& certificate = quality.certificate;
  append(text, "scaled Jacobian     min %.4f, mean %.4f (%zu samples)\n", quality.min_scaled_jacobian,
         quality.mean_scaled_jacobian, quality.num_samples);
  append(text, "inverted cells      %zu\n", quality.inverted_cells);
  append(text, "certified cells     %zu of %zu (%zu invalid, %zu undecided)\n", certificate.certified,
         quality.num_cells, certificate.invalid, certificate.undecided);
  append(text, "histogram          ");
  for (int bin = 0; bin < kNumHistogramBins; ++bin)
    if (quality.histogram[bin] > 0)
      append(text, " %.1f..%.1f: %zu", 2.0 * bin / kNumHistogramBins - 1, 2.0 * (bin + 1) / kNumHistogramBins - 1,
             quality.histogram[bin]);
  append(text, "\nworst cells\n");
  for (std::size_t i = 0; i < std::min<std::size_t>(5, quality.worst_cells.size()); ++i) {
    const auto& [cell, center, value] = quality.worst_cells[i];
    append(text, "  %-8d %.4f at (%.6g, %.6g, %.6g)\n", static_cast<int>(cell), value, center[0], center[1], center[2]);
  }
}

void append_witnesses(std::string& text, std::span<const InversionWitness> witnesses) {
  if (witnesses.empty()) return;
  append(text, "inverted at\n");
  for (const auto& [cell, canonical, position, determinant] : witnesses)
    append(text, "  %-8d det J %.3g at (%.6g, %.6g, %.6g)\n", static_cast<int>(cell), determinant, position[0],
           position[1], position[2]);
}

void append_distance(std::string& text, const MeshCheck& check) {
  const auto& extreme = check.distance->extreme();
  append(text, "distance%s mean %.6g (%.4f %%), max %.6g (%.4f %%) at (%.6g, %.6g, %.6g)\n",
         check.distance->one_sided ? " (of points)" : "           ", check.distance->mean(),
         check.mean_distance_percent(), check.distance->max(), check.max_distance_percent(), extreme.from[0],
         extreme.from[1], extreme.from[2]);
  if (check.normals)
    append(text, "normals             mean %.2f degrees, 95 %% of the area below %.1f\n", check.normals->mean_degrees,
           check.normals->percentile_95_degrees);
}

void require_samples(int per_direction) {
  if (per_direction < 2)
    throw InputError("mesh check: samples_per_direction is " + std::to_string(per_direction) + ", expected 2 or more");
}

MeshCheck check_linear(const VolumeMesh& mesh, const Compare& compare, const MeshCheckOptions& options) {
  require_samples(options.samples_per_direction);
  require_extent(mesh.positions, "mesh check: mesh");
  MeshCheck check = count_cells(mesh);
  if (has_any(check.defects, {Kind::no_cells, Kind::size_mismatch, Kind::index_out_of_range})) return check;
  if (!begins("quality", 0, options.progress, check)) return check;
  check.quality = measure_quality(mesh, options.samples_per_direction);
  check.witnesses = witnesses(
      *check.quality,
      [&](Index c) {
        const HighOrderMesh cell = single_cell(mesh, c);
        return certify_cell(mesh.kinds[c], cell.coefficients);
      },
      [&](Index c, const Vec3& point) { return single_cell(mesh, c).position(0, point); });
  if (has_any(check.defects, {Kind::repeated_vertex, Kind::face_of_many_cells})) return check;
  if (!begins("topology", 0.2, options.progress, check)) return check;
  const MeshTopology topology(mesh);
  check_topology(mesh, topology, check);
  const bool can_be_subdivided = check.num_cells_of_kind[static_cast<std::size_t>(CellKind::pyramid)] == 0;
  if (options.audits_subdivision && can_be_subdivided &&
      !has_any(check.defects, {Kind::bad_tag, Kind::inconsistent_orientation, Kind::nonconforming_face}))
    check.subdivision_audit = audit(mesh);
  if (std::ranges::adjacent_find(mesh.references, std::not_equal_to{}) != mesh.references.end())
    check.regions = measure_regions(mesh, &*check.quality);
  if (has_any(check.defects, {Kind::not_finite})) return check;
  std::vector<Index> face_of_triangle;
  const PolygonMesh boundary = boundary_surface(mesh, topology);
  const TriangleMesh triangles = options.quad_triangles == QuadTriangles::bilinear
                                     ? refined_triangles(boundary, &face_of_triangle)
                                     : triangulate(boundary, &face_of_triangle);
  check_boundary(triangles, face_of_triangle, compare, options.progress, check);
  return check;
}

/// Adds a defect for each coefficient behind those of the vertices, which `validate` looks at, that is not finite.
void add_modes_not_finite(const HighOrderMesh& mesh, std::vector<MeshDefect>& defects) {
  for (std::size_t n = mesh.space.num_vertices(); n < mesh.coefficients.size(); ++n)
    if (!mesh.coefficients[n].allFinite())
      defects.push_back(
          {Kind::not_finite, static_cast<Index>(n), "the coefficient of node " + std::to_string(n) + " is not finite"});
}

MeshCheck check_curved(const HighOrderMesh& mesh, const CurvedBoundary& boundary, const Compare& compare,
                       const MeshCheckOptions& options, int samples_per_direction) {
  const WorkProgress& progress = options.progress;
  if (const auto& references = options.labels.references;
      !references.empty() && references.size() != mesh.space.num_cells())
    throw InputError("mesh check: " + std::to_string(references.size()) + " references for " +
                     std::to_string(mesh.space.num_cells()) + " cells");
  if (samples_per_direction != 0) require_samples(samples_per_direction);
  const VolumeMesh straight = mesh.straight_sided();
  require_extent(mesh.coefficients, "mesh check: mesh");
  MeshCheck check = count_cells(straight);
  std::erase_if(check.defects, [](const MeshDefect& defect) { return defect.kind == Kind::inverted_cell; });
  add_modes_not_finite(mesh, check.defects);
  check.orders = order_summary(mesh.space);
  if (!begins("quality", 0, progress, check)) return check;
  check.quality = measure_quality(mesh, samples_per_direction);
  HighOrderCertifier certifier(mesh.space);
  check.witnesses = witnesses(
      *check.quality, [&](Index c) { return certifier.certify(mesh.coefficients, c); },
      [&](Index c, const Vec3& point) { return mesh.position(c, point); });
  if (!begins("topology", 0.2, progress, check)) return check;
  check_topology(straight, mesh.space.topology(), check);
  if (std::ranges::adjacent_find(options.labels.references, std::not_equal_to{}) != options.labels.references.end())
    check.regions = measure_regions(mesh, options.labels, &*check.quality);
  if (!has_any(check.defects, {Kind::not_finite}))
    check_boundary(boundary.triangles, boundary.faces, compare, progress, check);
  if (check.has_boundary_geometry) check.chord_error = boundary.chord_error;
  return check;
}

std::string label_of(int reference, const RegionReport& report) {
  for (const RegionQuality& region : report.regions)
    if (region.reference == reference && !region.name.empty()) return region.name;
  return std::to_string(reference);
}

/// Lists the regions and interfaces: the first ones, if there are many. The report in JSON has all of them.
void append_regions(std::string& text, const RegionReport& report) {
  static constexpr std::size_t kMostListedRegions = 20;
  const auto listed = [](const auto& all) { return std::span(all).first(std::min(all.size(), kMostListedRegions)); };
  const auto append_rest = [&](std::size_t all, const char* what) {
    if (all > kMostListedRegions) append(text, "%-19s and %zu more %s\n", "", all - kMostListedRegions, what);
  };
  for (const RegionQuality& region : listed(report.regions))
    append(text, "region %-12s %zu cells, volume %.6g, scaled Jacobian min %.4f\n",
           label_of(region.reference, report).c_str(), region.num_cells, region.volume, region.min_scaled_jacobian);
  append_rest(report.regions.size(), "regions");
  for (const InterfaceArea& interface : listed(report.interfaces)) {
    const std::string sides =
        label_of(interface.references[0], report) + " and " + label_of(interface.references[1], report);
    append(text, "interface           between %s: %zu faces, area %.6g\n", sides.c_str(), interface.num_faces,
           interface.area);
  }
  append_rest(report.interfaces.size(), "interfaces");
}

}  // namespace

bool MeshCheck::valid() const {
  const bool sound = std::all_of(defects.begin(), defects.end(),
                                 [](const MeshDefect& defect) { return defect.kind == Kind::unused_vertex; });
  const bool certified = quality && quality->certificate.all_certified();
  return sound && certified && has_boundary_geometry && intersecting_faces.empty() && parts_inside_solids.empty();
}

OrderSummary order_summary(const ElementSpace& space) {
  const EntityOrders& orders = space.orders();
  OrderSummary summary{space.basis(), kMaxOrder, 1, space.num_nodes(), space.num_vertices()};
  for (const auto* list : {&orders.edges, &orders.faces, &orders.cells})
    for (const int order : *list) {
      summary.min_order = std::min(summary.min_order, order);
      summary.max_order = std::max(summary.max_order, order);
    }
  const int order = summary.max_order;
  std::size_t& nodes = summary.num_full_order_nodes;
  nodes += orders.edges.size() * static_cast<std::size_t>(num_modes(EntityShape::edge, order));
  for (std::size_t f = 0; f < orders.faces.size(); ++f)
    nodes += static_cast<std::size_t>(num_modes(space.face_shape(f), order));
  for (std::size_t c = 0; c < space.num_cells(); ++c)
    nodes += static_cast<std::size_t>(num_modes(entity_shape(space.kind(c)), order));
  return summary;
}

// With such extents, volumes and distances neither overflow nor underflow.
void require_extent(std::span<const Vec3> points, const char* what) {
  Vec3 low = Vec3::Constant(std::numeric_limits<double>::infinity()), high = -low;
  for (const Vec3& p : points) {
    if (!p.allFinite()) continue;
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  if (const double extent = (high - low).maxCoeff(); extent > 0) require_length(extent, what);
}

MeshCheck check_mesh(const VolumeMesh& mesh, const TriangleMesh* target, const MeshCheckOptions& options) {
  return check_linear(mesh, comparison(target, options), options);
}

MeshCheck check_mesh(const VolumeMesh& mesh, const PointCloud* target, const MeshCheckOptions& options) {
  return check_linear(mesh, comparison(target), options);
}

MeshCheck check_mesh(const HighOrderMesh& mesh, const CurvedBoundary& boundary, const TriangleMesh* target,
                     const MeshCheckOptions& options, int samples_per_direction) {
  return check_curved(mesh, boundary, comparison(target, options), options, samples_per_direction);
}

MeshCheck check_mesh(const HighOrderMesh& mesh, const CurvedBoundary& boundary, const PointCloud* target,
                     const MeshCheckOptions& options, int samples_per_direction) {
  return check_curved(mesh, boundary, comparison(target), options, samples_per_direction);
}

std::string to_text(const MeshCheck& check) {
  std::string text;
  append(text, "cells               %zu (", check.num_cells);
  const char* separator = "";
  for (int kind = kNumCellKinds - 1; kind >= 0; --kind) {
    if (check.num_cells_of_kind[kind] == 0) continue;
    append(text, "%s%zu %s", separator, check.num_cells_of_kind[kind], cell_topology(static_cast<CellKind>(kind)).name);
    separator = ", ";
  }
  append(text, "), %zu vertices\n", check.num_vertices);
  if (check.orders) append_orders(text, *check.orders);
  append_defects(text, check.defects);
  if (check.has_topology) append_topology(text, check);
  if (check.subdivision_audit)
    for (const std::string& warning : check.subdivision_audit->warnings)
      append(text, "warning             %s\n", warning.c_str());
  if (check.quality) append_quality(text, *check.quality);
  append_witnesses(text, check.witnesses);
  if (check.regions) append_regions(text, *check.regions);
  if (check.has_boundary_geometry) {
    append(text, "volume              %.6g\n", check.volume);
    if (check.chord_error > 0)
      append(text, "curved boundary     looked at as triangles within %.3g of it\n", check.chord_error);
    const bool all = check.num_intersecting_triangle_pairs < kMostIntersectingPairs;
    append(text, "self-intersections  %zu pairs of boundary faces (%zu of triangles)%s\n",
           check.intersecting_faces.size(), check.num_intersecting_triangle_pairs,
           all ? "" : ", where the search ended");
    for (const Vec3& place : check.parts_inside_solids)
      append(text, "solid in a solid    the part of the boundary at (%.6g, %.6g, %.6g)\n", place[0], place[1],
             place[2]);
    if (check.num_degenerate_boundary_triangles > 0)
      append(text, "without area        %zu boundary triangles\n", check.num_degenerate_boundary_triangles);
  }
  if (check.distance) append_distance(text, check);
  if (check.ended_early) append(text, "ended early         not everything was looked at\n");
  append(text, "%s\n", check.valid() ? "valid" : "NOT VALID");
  return text;
}

}  // namespace subvol
