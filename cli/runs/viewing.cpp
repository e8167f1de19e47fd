// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/viewing.h"

#include "subvol/base/error.h"
#include "subvol/export/export.h"
#include "subvol/fit/geometry/closest_point.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/io/cell_values.h"
#include "subvol/surface/boundary.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

namespace subvol::cli {

using namespace internal;
namespace {

constexpr float kMissingFieldValue = std::numeric_limits<float>::quiet_NaN();

const VolumeMesh* linear_cells_of(const ShownMesh& mesh) { return std::get_if<VolumeMesh>(&mesh); }

/// The measures of the cells of one mesh, as fields.
class Measurer {
 public:
  Measurer(const ShownMesh& mesh, const ViewingOptions& options, const WorkProgress& progress)
      : mesh_(mesh), options_(options), progress_(progress) {}

  ViewerMesh run(std::string name) {
    if (const auto* surface = std::get_if<PolygonMesh>(&mesh_)) return viewer_mesh(std::move(name), *surface);
    goes_on(progress_, "quality", 0);
    if (const auto* cells = linear_cells_of(mesh_)) {
      result_ = viewer_mesh(std::move(name), *cells);
      add_quality(measure_quality(*cells));
      add_references(cells->references, cells->regions);
      goes_on(progress_, "distance", 0.5);
      if (options_.target) {
        require_boundary(*cells);
        add_distance(MeshTopology(*cells));
      }
      return std::move(result_);
    }
    const auto& file = std::get<HighOrderFile>(mesh_);
    result_ = viewer_mesh(std::move(name), file.mesh, viewer_intervals(file.mesh));
    add_quality(measure_quality(file.mesh));
    add_references(file.references, file.regions);
    add_orders(file.mesh.space);
    goes_on(progress_, "distance", 0.5);
    if (options_.target) add_distance(file.mesh.space.topology());
    return std::move(result_);
  }

 private:
  void add_quality(const QualityReport& quality) {
    ViewerField field{.name = "scaled_jacobian", .label = "Scaled Jacobian", .colors = ViewerField::Colors::quality};
    field.values.assign(quality.cell_minima.begin(), quality.cell_minima.end());
    const auto& invalid = quality.certificate.invalid_cells;
    for (std::size_t c = 0; c < quality.cell_minima.size(); ++c)
      if (!(quality.cell_minima[c] > 0) || std::binary_search(invalid.begin(), invalid.end(), static_cast<Index>(c)))
        result_.inverted.push_back(static_cast<Index>(c));
    std::set_difference(quality.certificate.not_certified.begin(), quality.certificate.not_certified.end(),
                        result_.inverted.begin(), result_.inverted.end(), std::back_inserter(result_.undecided));
    result_.fields.push_back(std::move(field));
  }

  void add_references(const std::vector<int>& references, const std::vector<Group>& regions) {
    if (std::adjacent_find(references.begin(), references.end(), std::not_equal_to<>()) == references.end()) return;
    constexpr int kMostExact = 1 << 24;  // of whole numbers in single precision
    if (std::any_of(references.begin(), references.end(), [](int r) { return std::abs(r) > kMostExact; })) return;
    ViewerField field{.name = "region", .label = "Region", .colors = ViewerField::Colors::regions};
    field.values.assign(references.begin(), references.end());
    for (const Group& region : regions)
      if (!region.name.empty()) field.region_names.emplace_back(region.number, region.name);
    result_.fields.push_back(std::move(field));
  }

  /// The largest order of each cell's edges, faces and interior.
  void add_orders(const ElementSpace& space) {
    ViewerField field{.name = "order", .label = "Order", .colors = ViewerField::Colors::regions};
    for (std::size_t c = 0; c < space.num_cells(); ++c) {
      int order = space.orders().cells[c];
      for (const Index e : space.topology().cell_edges(c)) order = std::max(order, space.orders().edges[e]);
      for (const Index f : space.topology().cell_faces(c)) order = std::max(order, space.orders().faces[f]);
      field.values.push_back(static_cast<float>(order));
    }
    result_.fields.push_back(std::move(field));
  }

  /// Distances of the points of the boundary from the target.
  void add_distance(const MeshTopology& topology) {
    std::vector<std::size_t> places;
    const std::size_t n = static_cast<std::size_t>(result_.intervals - 1);
    for (std::size_t v = 0; v < result_.num_vertices; ++v)
      if (topology.is_boundary_vertex(static_cast<Index>(v))) places.push_back(v);
    std::size_t next = result_.num_vertices;
    const auto add = [&](std::size_t count, bool is_boundary) {
      for (std::size_t k = 0; is_boundary && k < count; ++k) places.push_back(next + k);
      next += count;
    };
    if (n > 0) {
      for (std::size_t e = 0; e < topology.num_edges(); ++e) add(n, topology.is_boundary_edge(static_cast<Index>(e)));
      for (std::size_t f = 0; f < topology.num_faces(); ++f)
        add(topology.face(static_cast<Index>(f)).size() == 4 ? n * n : n * (n - 1) / 2,
            topology.is_boundary_face(static_cast<Index>(f)));
    }
    std::vector<Vec3> points;
    for (const std::size_t place : places) points.push_back(result_.points[place]);
    std::vector<ClosestPoint::Hit> hits(points.size());
    ClosestPoint(*options_.target).closest(points, hits);
    ViewerField field{.name = "distance",
                      .label = "Distance from the target",
                      .is_on_points = true,
                      .is_high_worst = true,
                      .values = std::vector<float>(result_.points.size(), kMissingFieldValue)};
    for (std::size_t k = 0; k < places.size(); ++k) field.values[places[k]] = static_cast<float>(hits[k].distance);
    result_.fields.push_back(std::move(field));
  }

  const ShownMesh& mesh_;
  const ViewingOptions& options_;
  const WorkProgress& progress_;
  ViewerMesh result_;
};

/// Adds the fields of a file whose names are not taken; those of curved cells only if they are one number per cell.
void add_file_fields(const std::filesystem::path& path, ViewerMesh& mesh) {
  for (CellValues& values : read_cell_values(path)) {
    const std::size_t size = values.is_on_points ? mesh.num_vertices : mesh.kinds.size();
    const bool is_taken = std::any_of(mesh.fields.begin(), mesh.fields.end(),
                                      [&](const ViewerField& field) { return field.name == values.name; });
    if (is_taken || values.values.size() != size || (values.is_on_points && mesh.intervals > 1)) continue;
    ViewerField field{.name = values.name, .label = values.name, .is_on_points = values.is_on_points};
    for (const double x : values.values)
      field.values.push_back(std::isfinite(x) ? static_cast<float>(x) : kMissingFieldValue);
    mesh.fields.push_back(std::move(field));
  }
}

ViewerSurface limit_of(const VolumeMesh& cage, std::span<const double> finest_minima, double chord_percent) {
  SurfaceSceneOptions options;
  options.max_chord_percent = chord_percent;
  return viewer_limit(cage, finest_minima, chord_length(cage, options));
}

std::vector<double> quality_of(const ViewerMesh& mesh) {
  const std::vector<float>& values = mesh.fields.front().values;
  return {values.begin(), values.end()};
}

}  // namespace

ViewerMesh measured_viewer_mesh(std::string name, const ShownMesh& mesh, const ViewingOptions& options,
                                const std::filesystem::path& path, const WorkProgress& progress) {
  ViewerMesh result = Measurer(mesh, options, progress).run(std::move(name));
  if (!path.empty() && !std::holds_alternative<PolygonMesh>(mesh)) add_file_fields(path, result);
  return result;
}

ViewerContent mesh_content(const std::string& title, const ShownMesh& mesh, const ViewingOptions& options,
                           std::vector<std::string>& warnings, const std::filesystem::path& path,
                           const WorkProgress& progress) {
  ViewerContent content{.title = as_utf8(title)};
  if (options.limit && !linear_cells_of(mesh)) throw InputError(title + ": only linear cells can be a control cage");
  try {
    content.meshes.push_back(
        measured_viewer_mesh(options.limit ? "Cage" : content.title, mesh, options, path, progress));
  } catch (const InputError& error) {
    // A mesh whose faces do not fit together has no boundary to measure; it can still be looked at.
    if (!options.target || options.limit) throw;
    warnings.push_back(title + ": distances are not shown: " + error.what());
    content.meshes.push_back(measured_viewer_mesh(content.title, mesh, {}, path, progress));
  }
  if (options.limit) {
    require_boundary(*linear_cells_of(mesh));
    content.cage = viewer_wires(*linear_cells_of(mesh));
    content.limit = limit_of(*linear_cells_of(mesh), quality_of(content.meshes.front()), options.chord_percent);
    content.shows_limit = true;
  }
  if (options.target) content.target = viewer_surface(*options.target);
  return content;
}

ViewerContent timeline_content(const std::string& title, std::span<const Moment> moments,
                               const ViewingOptions& options) {
  ViewerContent content{.title = as_utf8(title), .is_timeline = moments.size() > 1, .shown = moments.size() - 1};
  for (const Moment& moment : moments)
    content.meshes.push_back(measured_viewer_mesh(moment.name, moment.mesh, options));
  if (options.target) content.target = viewer_surface(*options.target);
  return content;
}

std::optional<ViewerContent> report_content(const Json& report, const ReportMeshes& meshes,
                                            std::vector<std::string>& notes, const WorkProgress& progress) {
  ViewerContent content{.title = "subvol " + report.value("command", std::string())};
  TriangleMesh target;
  ViewingOptions options;
  if (meshes.target) {
    target = triangulate(*meshes.target);
    options.target = &target;
    content.target = viewer_surface(target);
  }
  const auto add = [&](const char* name, const ShownMesh& mesh, const ViewingOptions& how) {
    try {
      content.meshes.push_back(measured_viewer_mesh(name, mesh, how, {}, progress));
      return true;
    } catch (const InputError& error) {
      notes.push_back(std::string(name) + ": " + error.what());
      return false;
    }
  };
  if (meshes.before) add("Before", *meshes.before, options);
  if (meshes.result && add(meshes.before ? "After" : "Result", *meshes.result, options)) {
    content.shown = content.meshes.size() - 1;
    if (meshes.cage) {
      try {
        content.cage = viewer_wires(*meshes.cage);
        content.limit = limit_of(*meshes.cage, quality_of(content.meshes.back()), options.chord_percent);
        content.limit_of = content.shown;
      } catch (const InputError& error) {
        notes.push_back(std::string("the limit surface is not shown: ") + error.what());
      }
    }
  }
  if (content.meshes.empty() && meshes.target) add("Surface", *meshes.target, {});
  if (content.meshes.empty()) return std::nullopt;
  if (content.meshes.front().kinds.empty()) return std::nullopt;
  return content;
}

}  // namespace subvol::cli
