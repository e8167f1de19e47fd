// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/writing.h"

#include "cli/runs/exit_status.h"
#include "cli/runs/loading.h"
#include "cli/runs/viewing.h"
#include "subvol/base/atomic_file.h"
#include "subvol/base/error.h"
#include "subvol/base/format.h"
#include "subvol/base/text_scanner.h"
#include "subvol/export/animation.h"
#include "subvol/export/boundary_file.h"
#include "subvol/export/cell_text.h"
#include "subvol/export/export.h"
#include "subvol/export/gltf_writer.h"
#include "subvol/export/obj_writer.h"
#include "subvol/export/read_back.h"
#include "subvol/export/surface_writer.h"
#include "subvol/export/usd_writer.h"
#include "subvol/export/viewer_page.h"
#include "subvol/export/volume_writer.h"
#include "subvol/fit/quality/high_order_quality.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/nodal_writers.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/subdivision/repeated_subdivision.h"
#include "subvol/surface/boundary.h"
#include "subvol/templates/template_edit.h"

#include <algorithm>
#include <array>
#include <map>

namespace subvol::cli {

using namespace internal;
namespace {

SceneValue scene_value(const Json& value) {
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_number()) return value.get<double>();
  return as_utf8(value.is_string() ? value.get<std::string>() : value.dump());
}

void write_cells(const Output& output, const VolumeMesh& mesh, const WritingOptions& options) {
  if (holds_polynomial_cells(output)) {
    write_volume(output.path, mesh, measure_quality(mesh).cell_minima, {}, options.msh_version);
  } else {
    write_volume_mesh(output.path, mesh);
  }
  require_written(output.path, mesh, options.msh_version);
}

/// tets  the cells inside, if all are tets: .usda holds them as well; null: there are none, or others.
void write_polygons(const Output& output, const PolygonMesh& surface, const FeatureTags& tags,
                    const WritingOptions& options, const VolumeMesh* tets = nullptr) {
  if (output.extension == ".obj") {
    write_obj(output.path, surface);
  } else if (is_surface_output(output.extension)) {
    write_surface(output.path, surface);
  } else {
    const SurfaceSceneOptions scene = scene_options(output, options);
    write_usd(output.path, surface, tags,
              {.meters_per_unit = scene.meters_per_unit, .up_axis = scene.up_axis, .tets = tets});
  }
  require_written(output.path, surface);
}

/// Joins every two consecutive triangles to a quad. groups: of the boundary faces.
PolygonMesh polygons_of(const CurvedBoundary& boundary, const FaceGroups& groups) {
  PolygonMesh mesh{boundary.triangles.positions, {0}, {}};
  mesh.face_groups.groups = groups.groups;
  const auto& triangles = boundary.triangles.triangles;
  for (std::size_t t = 0; t < triangles.size(); t += 2) {
    mesh.face_vertices.insert(mesh.face_vertices.end(), triangles[t].begin(), triangles[t].end());
    mesh.face_vertices.push_back(triangles[t + 1][2]);
    mesh.face_offsets.push_back(mesh.face_vertices.size());
    if (!groups.empty()) mesh.face_groups.of_face.push_back(groups.of_face[boundary.faces[t]]);
  }
  return mesh;
}

/// Merges the points that were doubled at creases for the sake of their normals.
PolygonMesh polygons_of(const TessellatedSurface& surface) {
  PolygonMesh mesh{{}, {0}, {}};
  std::map<std::array<double, 3>, Index> places;
  for (const auto& quad : surface.quads) {
    for (const Index corner : quad) {
      const Vec3& p = surface.positions[corner];
      const auto [place, added] = places.try_emplace({p[0], p[1], p[2]}, static_cast<Index>(mesh.positions.size()));
      if (added) mesh.positions.push_back(p);
      mesh.face_vertices.push_back(place->second);
    }
    mesh.face_offsets.push_back(mesh.face_vertices.size());
  }
  return mesh;
}

/// Writes a boundary and compares the bytes of the file with what they should be: IoError.
void write_boundary_file(const Output& output, const PolygonMesh& boundary, const BoundaryOrigin& origin = {}) {
  write_boundary(output.path, boundary, origin);
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(output.path, ignored)) return;
  if (read_file(output.path.string()) !=
      (output.extension == ".vtu" ? boundary_vtu_text(boundary, origin) : boundary_vtk_text(boundary, origin)))
    throw IoError(output.path.string() + ": was written, but does not hold what it should");
}

/// Writes the faces of a mesh as XDMF and compares the file with the text: IoError.
void write_xdmf_faces(const Output& output, const NodalMesh& mesh) {
  const std::string text = xdmf_faces_text(mesh);
  write_file_atomically(output.path, text);
  std::error_code ignored;
  if (std::filesystem::is_regular_file(output.path, ignored) && read_file(output.path.string()) != text)
    throw IoError(output.path.string() + ": was written, but does not hold what it should");
}

/// Writes the faces of the boundary with the numbers of their vertices and cells in the mesh.
void write_boundary_faces(const Output& output, const VolumeMesh& mesh) {
  if (output.extension == ".xdmf") return write_xdmf_faces(output, nodal_mesh(mesh));
  const MeshTopology topology(mesh);
  std::vector<Index> vertices, cells;
  const PolygonMesh boundary = boundary_surface(mesh, topology, &vertices);
  for (const Index f : topology.boundary_faces()) cells.push_back(topology.face_cells(f)[0]);
  write_boundary_file(output, boundary, {vertices, cells});
}

/// The groups of the boundary faces of a mesh.
FaceGroups boundary_groups(const VolumeFaceGroups& groups, const MeshTopology& topology) {
  return {groups.groups, groups_of_boundary(groups, topology)};
}

/// Options of the scene of a surface that shows the groups of a mesh's faces.
SurfaceSceneOptions grouped_scene_options(const Output& output, const WritingOptions& options,
                                          const VolumeFaceGroups& groups, const MeshTopology& topology) {
  SurfaceSceneOptions scene = scene_options(output, options);
  scene.face_groups = boundary_groups(groups, topology);
  return scene;
}

HighOrderFileOptions file_options(const HighOrderFile& file, std::span<const double> minima,
                                  const WritingOptions& options) {
  return {.cell_minima = minima,
          .references = file.references,
          .face_groups = &file.face_groups,
          .regions = file.regions,
          .msh_version = options.msh_version,
          .vtu_cells = options.vtu_cells,
          .linear_intervals = options.linear_intervals,
          .map_tolerance_percent = options.map_tolerance_percent};
}

void write_timeline(const Output& output, std::span<const Moment> moments) {
  write_file_atomically(output.path, viewer_page(timeline_content(output.path.stem().string(), moments, {})));
}

}  // namespace

std::string parse_cut(const std::string& text, CutPlane& cut) {
  std::string error = "must be x, y or z, or with a share between 0 and 1 as x:0.3, not " + text;
  if (text.empty() || text[0] < 'x' || text[0] > 'z' || (text.size() > 1 && text[1] != ':')) return error;
  cut.axis = text[0] - 'x';
  if (text.size() == 1) return {};
  if (!is_number_in(text.substr(2), 1e-9, 1 - 1e-9)) return error;
  cut.share = *parse_number(text.substr(2));
  return {};
}

SurfaceSceneOptions scene_options(const Output& output, const WritingOptions& options) {
  SurfaceSceneOptions scene{.name = as_utf8(output.path.stem().string()),
                            .max_chord_percent = options.chord_percent,
                            .wireframe = !options.no_wireframe,
                            .quantize = options.quantize,
                            .meters_per_unit = options.meters_per_unit,
                            .up_axis = options.up_axis == "z" ? UpAxis::z : UpAxis::y,
                            .source = as_utf8(options.source.filename().string())};
  for (const auto& [key, value] : options.options.items()) scene.options.emplace_back(key, scene_value(value));
  return scene;
}

void write_scene(const std::filesystem::path& path, const Scene& scene) {
  write_gltf(path, scene);
  require_written(path, scene);
}

void write_curved_cells(const Output& output, const HighOrderMesh& mesh, const HighOrderFileOptions& options) {
  write_volume(output.path, mesh, options);
  require_written(output.path, mesh, options);
}

KindOrders kind_orders(std::span<const CellKind> kinds, int order) {
  KindOrders orders{};
  for (const CellKind kind : kinds) orders[static_cast<std::size_t>(kind)] = order;
  return orders;
}

KindOrders kind_orders(const ElementSpace& space) {
  KindOrders orders{};
  for (std::size_t c = 0; c < space.num_cells(); ++c) {
    int& largest = orders[static_cast<std::size_t>(space.kind(c))];
    largest = std::max(largest, space.pattern_order(space.pattern(c)));
  }
  return orders;
}

void require_for_curved_cells(const Output& output, const KindOrders& orders) {
  const std::string file = output.path.string();
  if (output.extension == ".usda")
    throw UsageError(file + ": .usda holds subdivision cages, not curved cells; take .glb or .obj");
  const int most = *std::ranges::max_element(orders);
  if (output.format().holds_cells && output.format().has_quadratic_cells_at_most() && most > 2)
    throw UsageError(formatted("%s: cells of this format have order 2 at most, not %d; take .vtu, .msh or .mfem",
                               file.c_str(), most));
  if (output.extension != ".msh") return;
  for (std::size_t kind = 0; kind < orders.size(); ++kind)
    if (const int limit = max_gmsh_order(static_cast<CellKind>(kind)); orders[kind] > limit)
      throw UsageError(formatted("%s: Gmsh evaluates a %s up to order %d, not %d; take .vtu or .mfem", file.c_str(),
                                 cell_topology(static_cast<CellKind>(kind)).name, limit, orders[kind]));
}

bool shows_surface(const Output& output) { return output.part == Part::result && output.is_scene(); }

void write_output(const Output& output, const VolumeMesh& cage, const VolumeMesh& mesh, const TessellatedSurface* limit,
                  const WritingOptions& options) {
  if (output.part == Part::cage) return write_output(output, cage, options);
  if (!shows_surface(output)) return write_output(output, mesh, options);
  const std::vector<double> quality = patch_quality(cage, *limit, measure_quality(mesh).cell_minima);
  // The faces of the cage are those of the limit surface.
  write_scene(output.path, surface_scene(*limit, quality,
                                         grouped_scene_options(output, options, cage.face_groups, MeshTopology(cage))));
}

namespace {

/// Writes the cells of one region, linear or curved, as a whole mesh.
template <class Mesh>
void write_region(const Output& output, const Mesh& mesh, const WritingOptions& options) {
  Output whole = output;
  whole.part = Part::result;
  write_output(whole, cells_of_region(mesh, output.region), options);
}

/// Returns the regions of a mesh's cells.
CellRegions cell_regions(const VolumeMesh& mesh) {
  CellRegions result{regions_of(mesh), {}};
  for (std::size_t c = 0; c < mesh.num_cells(); ++c)
    result.of_cell.push_back(static_cast<Index>(
        std::ranges::lower_bound(result.regions, reference_of(mesh, c), {}, &Group::number) - result.regions.begin()));
  return result;
}

}  // namespace

void write_output(const Output& output, const VolumeMesh& mesh, const WritingOptions& options) {
  if (output.part == Part::region) return write_region(output, mesh, options);
  if (output.part == Part::boundary) return write_boundary_faces(output, mesh);
  if (output.is_volume()) return write_cells(output, mesh, options);
  if (output.part == Part::cutaway)
    return write_scene(output.path, cutaway_scene(mesh, measure_quality(mesh).cell_minima, options.cut,
                                                  scene_options(output, options), cell_regions(mesh)));
  if (output.is_scene()) return write_scene(output.path, boundary_scene(mesh, scene_options(output, options)));
  const TaggedPolygons boundary = tagged_polygons(mesh);
  write_polygons(output, boundary.polygons, boundary.tags, options, consists_of_tets(mesh) ? &mesh : nullptr);
}

void write_output(const Output& output, const HighOrderFile& file, const WritingOptions& options) {
  if (output.part == Part::region) return write_region(output, file, options);
  const HighOrderMesh& mesh = file.mesh;
  require_for_curved_cells(output, kind_orders(mesh.space));
  if (output.part == Part::boundary && output.extension == ".xdmf")
    return write_xdmf_faces(output, written_nodes(mesh, output.extension, file_options(file, {}, options)));
  if (output.part == Part::boundary || (!output.is_volume() && !output.is_scene())) {
    const FaceGroups groups = boundary_groups(file.face_groups, mesh.space.topology());
    const PolygonMesh polygons = polygons_of(curved_boundary(mesh, options.chord_percent), groups);
    return output.part == Part::boundary ? write_boundary_file(output, polygons)
                                         : write_polygons(output, polygons, {}, options);
  }
  const bool is_linear = output.extension == ".mesh" || output.extension == ".vtk";
  const std::vector<double> minima = is_linear ? std::vector<double>{} : measure_quality(mesh).cell_minima;
  if (output.part == Part::cutaway)
    return write_scene(output.path, cutaway_scene(mesh, minima, options.cut, scene_options(output, options),
                                                  cell_regions(labels_of(file))));
  if (output.is_scene())
    return write_scene(
        output.path,
        surface_scene(mesh, minima, grouped_scene_options(output, options, file.face_groups, mesh.space.topology())));
  write_curved_cells(output, mesh, file_options(file, minima, options));
}

void write_output(const Output& output, const PolygonMesh& surface, const WritingOptions& options) {
  if (output.part == Part::boundary && output.extension == ".xdmf")
    throw UsageError(output.path.string() +
                     ": faces with the numbers of cells' nodes, but there is only a surface; take "
                     ".vtu or .vtk");
  if (output.part == Part::boundary) return write_boundary_file(output, surface);
  if (output.is_volume()) throw UsageError(output.path.string() + ": this format holds cells, not surfaces");
  if (output.is_scene()) return write_scene(output.path, polygon_scene(surface, {}, scene_options(output, options)));
  write_polygons(output, surface, {}, options);
}

void write_polygons(const Output& output, const TessellatedSurface& limit, const WritingOptions& options) {
  write_polygons(output, polygons_of(limit), {}, options);
}

void write_animation(const Output& output, const VolumeMesh& cage, const VolumeMesh& result,
                     std::span<const FitState> states, const WritingOptions& options) {
  if (!output.is_page()) return write_scene(output.path, animation_scene(cage, states, scene_options(output, options)));
  constexpr std::size_t kMostAnimatedCells = 500'000;  // of all moments together: a page of 15 MB
  const std::size_t most = std::min(result.num_cells(), kMostAnimatedCells / (states.size() + 1));
  int levels = 0;
  for (std::size_t cells = cage.cell_vertices.size(); cells <= most && cage.num_cells() < result.num_cells();
       cells *= 8)
    ++levels;
  const auto moment = [&](const std::string& name, const std::vector<Vec3>& positions) {
    VolumeMesh mesh = cage;
    mesh.positions = positions;
    return Moment{name, subdivide_repeatedly(mesh, levels)};
  };
  std::vector<Moment> moments;
  for (const FitState& state : states) moments.push_back(moment(state.name, state.positions));
  moments.push_back(moment("result", cage.positions));
  write_timeline(output, moments);
}

void write_animation(const Output& output, const HighOrderMesh& mesh, std::span<const FitState> states,
                     const WritingOptions& options) {
  if (!output.is_page()) return write_scene(output.path, animation_scene(mesh, states, scene_options(output, options)));
  std::vector<Moment> moments;
  const auto add = [&](const std::string& name, const std::vector<Vec3>& coefficients) {
    HighOrderMesh moved = mesh;
    moved.coefficients = coefficients;
    moments.push_back({name, HighOrderFile{.mesh = std::move(moved)}});
  };
  for (const FitState& state : states) add(state.name, state.positions);
  add("result", mesh.coefficients);
  write_timeline(output, moments);
}

bool has_animation(std::span<const Output> outputs) {
  return std::any_of(outputs.begin(), outputs.end(), [](const Output& o) { return o.part == Part::animation; });
}

double measured_chord_percent(const WritingOptions& options) {
  return std::min(options.chord_percent, WritingOptions{}.chord_percent);
}

TessellatedSurface tessellated_limit(const VolumeMesh& cage, const WritingOptions& options,
                                     const WorkProgress& progress) {
  return tessellate(cage, chord_length(cage, {.max_chord_percent = options.chord_percent}), kMostQuads, progress);
}

}  // namespace subvol::cli
