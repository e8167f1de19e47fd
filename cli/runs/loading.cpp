// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/runs/loading.h"

#include "cli/runs/exit_status.h"
#include "subvol/base/error.h"
#include "subvol/base/text_scanner.h"
#include "subvol/export/curved_file.h"
#include "subvol/fit/geometry/surface_distance.h"
#include "subvol/fit/high_order_patch.h"
#include "subvol/fit/mesh_check.h"
#include "subvol/fit/target/region_matching.h"
#include "subvol/io/label_grid_io.h"
#include "subvol/io/mesh_io.h"
#include "subvol/io/nodal_mesh.h"
#include "subvol/io/surface_io.h"
#include "subvol/mesh/interfaces.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/surface/boundary.h"
#include "subvol/surface/sheets.h"
#include "subvol/templates/template_edit.h"

#include <algorithm>
#include <array>

namespace subvol::cli {

using namespace internal;

namespace {

/// A .vtu with an exact map beside its cells, which has not been read yet.
struct ExactMap {};

using Content = std::variant<VolumeMesh, NodalMesh, ExactMap, PolygonMesh>;

bool is_surface_or_points(const std::filesystem::path& path) {
  const std::string extension = lower_case(path.extension().string());
  return is_surface_extension(extension) || extension == ".xyz";
}

/// Reads a file of cells or of a surface, once.
Content content_of(const std::filesystem::path& path, std::vector<std::string>& warnings, bool check,
                   const std::string& references) {
  require_known_file(path);
  if (is_surface_or_points(path)) {
    if (is_point_cloud_file(path))
      throw InputError(path.string() +
                       ": it holds points without faces, which serve only as the target of `fit --template` and "
                       "`check --target`; expected a mesh or a surface");
    return read_polygon_mesh(path, &warnings);
  }
  if (holds_exact_map(path)) return ExactMap{};
  FileCells cells = read_cells(path, {.check = check, .warnings = &warnings, .references = references});
  return std::visit([](auto& mesh) -> Content { return std::move(mesh); }, cells);
}

[[noreturn]] void refuse_curved(const std::filesystem::path& path, const std::string& wanted) {
  throw InputError(path.string() + ": curved cells, which `check`, `convert`, `optimize` and `fit --order` read, but " +
                   wanted);
}

/// InputError: all of the mesh is in one place.
HighOrderFile extended(const std::filesystem::path& path, HighOrderFile file) {
  const auto& x = file.mesh.coefficients;  // positions of vertices, then displacements
  const auto vertices_end = x.begin() + static_cast<std::ptrdiff_t>(file.mesh.space.num_vertices());
  if (std::all_of(x.begin(), vertices_end, [&](const Vec3& p) { return p == x.front(); }) &&
      std::all_of(vertices_end, x.end(), [](const Vec3& d) { return d.isZero(0); }))
    throw InputError(path.string() + ": all of the mesh is in one place");
  return file;
}

/// Returns the name of the array that an option --references asks for; empty: the usual ones.
std::string array_of(const std::string& references) { return references == kNoReferences ? "" : references; }

/// Returns cells as they were read or, if none are wanted, without their references.
template <class Cells>
Cells as_chosen(Cells cells, const std::string& references) {
  if (references != kNoReferences) return cells;
  cells.references.clear();
  cells.regions.clear();
  return cells;
}

/// Returns what a file holds as a surface: of cells, their boundary.  path: of the file, for messages.
TriangleMesh surface_of(Content content, const std::filesystem::path& path, std::vector<std::string>& warnings) {
  if (auto* mesh = std::get_if<VolumeMesh>(&content)) return triangulate(tagged_polygons(*mesh).polygons);
  if (auto* surface = std::get_if<PolygonMesh>(&content)) return sound_triangles(*surface, path.string(), &warnings);
  refuse_curved(path, "a surface is wanted");
}

/// Returns the curved cells of a file whose content was found to be neither linear cells nor a surface.
HighOrderFile curved_cells(const std::filesystem::path& path, Content content, std::vector<std::string>& warnings,
                           const std::string& references) {
  HighOrderFile file = std::holds_alternative<ExactMap>(content)
                           ? read_high_order(path)
                           : curved_mesh(path.string(), std::get<NodalMesh>(std::move(content)), &warnings);
  return as_chosen(extended(path, std::move(file)), references);
}

/// Reads a file of cells, linear or curved. InputError: it holds a surface or points.
Content cells_in(const std::filesystem::path& path, std::vector<std::string>& warnings, bool check,
                 const std::string& references) {
  const auto refuse_surface = [&] {
    throw InputError(path.string() + ": a surface or points, but cells are wanted: " + volume_mesh_formats());
  };
  require_known_file(path);
  if (is_surface_or_points(path)) refuse_surface();
  Content content = content_of(path, warnings, check, array_of(references));
  if (std::holds_alternative<PolygonMesh>(content)) refuse_surface();
  return content;
}

constexpr int kCellDimension = 3;

}  // namespace

bool is_surface_file(const std::filesystem::path& path) {
  return is_surface_extension(lower_case(path.extension().string())) && !is_point_cloud_file(path);
}

void require_known_file(const std::filesystem::path& path) {
  if (is_nodal_extension(path) || is_surface_or_points(path)) return;
  if (is_label_grid_file(path))
    throw InputError(path.string() +
                     ": a segmentation, which only `fit` and `template auto` can use, and only as what "
                     "they fill");
  throw InputError(path.string() + ": " + unknown_extension(path) + "; expected cells: " + volume_mesh_formats() +
                   "; a surface: " + surface_formats() + "; points: " + point_cloud_formats() +
                   " (`subvol formats` says more)");
}

LoadedMesh load_mesh(const std::filesystem::path& path, std::vector<std::string>& warnings, bool check,
                     const std::string& references) {
  Content content = content_of(path, warnings, check, array_of(references));
  if (auto* mesh = std::get_if<VolumeMesh>(&content)) return as_chosen(std::move(*mesh), references);
  if (auto* surface = std::get_if<PolygonMesh>(&content)) return std::move(*surface);
  return curved_cells(path, std::move(content), warnings, references);
}

Target load_target(const std::filesystem::path& path, std::vector<std::string>& warnings) {
  require_known_file(path);
  if (is_surface_or_points(path) && is_point_cloud_file(path)) return read_point_cloud(path, &warnings);
  return load_surface(path, warnings);
}

Target load_target_with_regions(const std::filesystem::path& path, std::vector<std::string>& warnings) {
  if (!is_nodal_extension(path)) return load_target(path, warnings);
  Content content = content_of(path, warnings, true, {});
  if (const auto* mesh = std::get_if<VolumeMesh>(&content)) return surface_with_interfaces(*mesh);
  return surface_of(std::move(content), path, warnings);
}

TriangleMesh surface_with_interfaces(const VolumeMesh& mesh) {
  if (region_references(mesh).size() > 1) return surface_of_regions(mesh).mesh;
  return triangulate(tagged_polygons(mesh).polygons);
}

FittedTarget fitted_target(const Target& target, const VolumeMesh& mesh) {
  const auto* surface = std::get_if<TriangleMesh>(&target);
  if (!surface) return {{}, target};
  MatchedTarget matched = matched_target(*surface, mesh);
  return {std::move(matched.regions), matched.outer ? Target(*std::move(matched.outer)) : target};
}

Target outer_target(const Target& target, const VolumeMesh& mesh) {
  FittedTarget fitted = fitted_target(target, mesh);
  return fitted.regions ? Target(outer_surface(*fitted.regions)) : std::move(fitted.outer);
}

TriangleMesh load_surface(const std::filesystem::path& path, std::vector<std::string>& warnings) {
  return surface_of(content_of(path, warnings, true, {}), path, warnings);
}

PolygonMesh load_polygons(const std::filesystem::path& path, std::vector<std::string>& warnings) {
  return load_tagged_polygons(path, warnings).polygons;
}

TaggedPolygons load_tagged_polygons(const std::filesystem::path& path, std::vector<std::string>& warnings) {
  Content content = content_of(path, warnings, true, {});
  if (auto* mesh = std::get_if<VolumeMesh>(&content)) return tagged_polygons(*mesh);
  if (auto* surface = std::get_if<PolygonMesh>(&content)) return {std::move(*surface), {}};
  refuse_curved(path, "a surface is wanted");
}

TaggedPolygons load_shell_surface(const std::filesystem::path& path, std::string& region,
                                  std::vector<std::string>& warnings) {
  if (region.empty() || is_surface_file(path)) return load_tagged_polygons(path, warnings);
  return tagged_polygons(cells_of_region(load_volume(path, warnings), std::exchange(region, {})));
}

TaggedPolygons tagged_polygons(const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  std::vector<Index> volume_vertex;
  TaggedPolygons boundary{boundary_surface(mesh, topology, &volume_vertex), {}};
  // volume_vertex ascends, so the order of tags is kept.
  const auto number = [&](Index v) {
    return static_cast<Index>(std::lower_bound(volume_vertex.begin(), volume_vertex.end(), v) - volume_vertex.begin());
  };
  // Where interfaces reach the boundary, the cage is sharp without a tag.
  const bool has_regions = !find_interfaces(mesh, topology).empty();
  const FeatureTags tags = has_regions ? boundary_tags(mesh, topology) : mesh.tags;
  for (const CreaseEdge& crease : tags.creases)
    if (const Index e = topology.find_edge(crease.v0, crease.v1); e != kNoIndex && topology.is_boundary_edge(e))
      boundary.tags.creases.push_back({number(crease.v0), number(crease.v1), crease.sharpness});
  for (const CornerVertex& corner : tags.corners)
    if (topology.is_boundary_vertex(corner.vertex))
      boundary.tags.corners.push_back({number(corner.vertex), corner.sharpness});
  return boundary;
}

LoadedCells load_cells(const std::filesystem::path& path, std::vector<std::string>& warnings, bool check,
                       const std::string& references) {
  Content content = cells_in(path, warnings, check, references);
  if (auto* linear = std::get_if<VolumeMesh>(&content)) return as_chosen(std::move(*linear), references);
  return curved_cells(path, std::move(content), warnings, references);
}

VolumeMesh labels_of(const HighOrderFile& file) {
  VolumeMesh labels = file.mesh.straight_sided();
  labels.references = file.references;
  labels.face_groups = file.face_groups;
  labels.regions = file.regions;
  return labels;
}

VolumeMesh load_volume(const std::filesystem::path& path, std::vector<std::string>& warnings, bool check,
                       const std::string& references) {
  Content content = cells_in(path, warnings, check, references);
  if (!std::holds_alternative<VolumeMesh>(content)) refuse_curved(path, "linear cells are wanted");
  return as_chosen(std::get<VolumeMesh>(std::move(content)), references);
}

std::vector<Group> regions_of(const VolumeMesh& mesh) {
  std::vector<Group> regions;
  for (const int reference : region_references(mesh))
    regions.push_back({region_label(mesh, reference), reference, kCellDimension});
  return regions;
}

int number_of_region(std::span<const Group> regions, const std::string& name, const std::string& option) {
  std::string known, same;
  std::vector<int> found;
  for (const Group& region : regions) {
    const std::string number = std::to_string(region.number);
    if (name == number) return region.number;
    if (name == region.name) {
      found.push_back(region.number);
      same += (same.empty() ? "" : ", ") + number;
    }
    known += (known.empty() ? "" : ", ") + number;
    if (!region.name.empty()) known += " (" + region.name + ")";
  }
  if (found.size() == 1) return found.front();
  if (!found.empty())
    throw UsageError(option + ": several regions are named " + in_quotes(name) + ": " + same + "; give the number");
  throw UsageError(option + ": there is no region " + in_quotes(name) + "; there " +
                   (regions.empty() ? "is only one" : "are " + known));
}

void require_regions(std::span<const Output> outputs, std::span<const Group> regions) {
  for (const Output& output : outputs)
    if (output.part == Part::region) (void)number_of_region(regions, output.region, "-o region:" + output.region);
}

VolumeMesh cells_of_region(const VolumeMesh& mesh, const std::string& region) {
  const int wanted = number_of_region(regions_of(mesh), region, "--region");
  std::vector<char> kept(mesh.num_cells());
  for (std::size_t c = 0; c < kept.size(); ++c) kept[c] = reference_of(mesh, c) == wanted;
  return kept_cells(mesh, kept);
}

HighOrderFile cells_of_region(const HighOrderFile& file, const std::string& region) {
  const VolumeMesh all = labels_of(file);
  const int wanted = number_of_region(regions_of(all), region, "--region");
  std::vector<Index> cells;
  for (std::size_t c = 0; c < all.num_cells(); ++c)
    if (reference_of(all, c) == wanted) cells.push_back(static_cast<Index>(c));
  VolumeMesh labels = cells_of_region(all, region);  // of the same cells, with their vertices in the same order
  return {internal::cells_of(file.mesh, cells), std::move(labels.references), std::move(labels.face_groups),
          std::move(labels.regions)};
}

HighOrderFile load_high_order(const std::filesystem::path& path, std::vector<std::string>* warnings,
                              const std::string& references) {
  return as_chosen(extended(path, read_curved(path, warnings, array_of(references))), references);
}

void require_choice_of_references(const std::filesystem::path& path, const std::string& references) {
  if (references.empty() || references == kNoReferences || (is_nodal_extension(path) && !holds_exact_map(path))) return;
  throw UsageError("--references: " + path.string() + " has no cell data to choose from");
}

std::vector<double> load_thicknesses(const std::filesystem::path& path) {
  constexpr std::string_view kThicknessFileBlanks = " \t";
  const std::string bytes = read_file(path);
  TextScanner lines(path.string(), bytes, TextScanner::Comments::none);
  std::vector<double> thicknesses;
  while (const auto line = lines.line()) {
    const std::size_t begin = line->find_first_not_of(kThicknessFileBlanks);
    if (begin == line->npos) continue;
    const std::string_view word = line->substr(begin, line->find_last_not_of(kThicknessFileBlanks) + 1 - begin);
    const auto value = parse_number(word);
    if (!value || !(*value > 0)) lines.fail("expected a positive thickness, found " + in_quotes(word));
    thicknesses.push_back(*value);
  }
  return thicknesses;
}

Json describe(const std::string& path, const TriangleMesh& mesh) {
  return {{"path", path},
          {"vertices", mesh.positions.size()},
          {"triangles", mesh.triangles.size()},
          {"bounding_box_diagonal", bounding_box_diagonal(mesh)}};
}

Json describe(const std::string& path, const PointCloud& cloud) {
  return {{"path", path}, {"points", cloud.points.size()}, {"bounding_box_diagonal", bounding_box_diagonal(cloud)}};
}

Json describe(const std::string& path, const Target& target) {
  return std::visit([&](const auto& geometry) { return describe(path, geometry); }, target);
}

Json describe(const std::string& path, const PolygonMesh& mesh) {
  return {{"path", path},
          {"vertices", mesh.positions.size()},
          {"faces", mesh.num_faces()},
          {"bounding_box_diagonal", bounding_box_diagonal(triangulate(mesh))}};
}

Json describe(const std::string& path, const VolumeMesh& mesh) {
  std::array<std::size_t, kNumCellKinds> counts{};
  for (CellKind kind : mesh.kinds) ++counts[static_cast<std::size_t>(kind)];
  return {{"path", path},
          {"vertices", mesh.num_vertices()},
          {"cells", mesh.num_cells()},
          {"hexes", counts[static_cast<std::size_t>(CellKind::hex)]},
          {"prisms", counts[static_cast<std::size_t>(CellKind::prism)]},
          {"tets", counts[static_cast<std::size_t>(CellKind::tet)]},
          {"pyramids", counts[static_cast<std::size_t>(CellKind::pyramid)]},
          {"creases", mesh.tags.creases.size()},
          {"corners", mesh.tags.corners.size()}};
}

Json describe(const std::string& path, const HighOrderMesh& mesh) {
  Json json = describe(path, mesh.straight_sided());
  const OrderSummary orders = order_summary(mesh.space);
  json["basis"] = to_string(orders.basis);
  json["min_order"] = orders.min_order;
  json["max_order"] = orders.max_order;
  json["nodes"] = orders.num_nodes;
  json["full_order_nodes"] = orders.num_full_order_nodes;
  return json;
}

std::string target_formats() { return surface_formats() + "; points: " + point_cloud_formats(); }

std::string cell_formats() { return volume_mesh_formats() + "; with linear or, but for Medit, curved cells"; }

}  // namespace subvol::cli
