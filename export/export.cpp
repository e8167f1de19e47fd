// SPDX-License-Identifier: GPL-3.0-or-later
#include "subvol/export/export.h"

#include "subvol/base/error.h"
#include "subvol/export/color_map.h"
#include "subvol/export/polygon_shading.h"
#include "subvol/fit/quality/quality.h"
#include "subvol/mesh/mesh_topology.h"
#include "subvol/subdivision/limit_surface.h"
#include "subvol/surface/boundary.h"

#include <Eigen/Geometry>

#include <algorithm>
#include <set>
#include <utility>

namespace subvol {

using namespace internal;
namespace {

constexpr LinearColor kWireColor{0.01, 0.01, 0.01, 1};
constexpr LinearColor kPlainColor{0.6, 0.6, 0.6, 1};

using Segments = std::vector<std::array<Index, 2>>;

Eigen::AlignedBox3d bounding_box(std::span<const Vec3> positions) {
  Eigen::AlignedBox3d box;
  for (const Vec3& p : positions) box.extend(p);
  return box;
}

/// Line segments with their own vertices.
ScenePrimitive wire_primitive(const std::vector<Vec3>& positions, const Segments& segments) {
  ScenePrimitive wire;
  wire.topology = ScenePrimitive::Topology::lines;
  wire.material_color = kWireColor;
  std::vector<Index> number(positions.size(), kNoIndex);
  for (const auto& segment : segments)
    for (const Index v : segment) {
      if (number[v] == kNoIndex) {
        number[v] = static_cast<Index>(wire.positions.size());
        wire.positions.push_back(positions[v]);
      }
      wire.indices.push_back(number[v]);
    }
  return wire;
}

/// Sorts the triangles by group, those without a group last, and makes each group a part. The two triangles of a quad
/// must be consecutive and of one group.
void part_by_group(ScenePrimitive& primitive, const std::vector<Group>& groups, const std::vector<Index>& of_triangle) {
  if (groups.empty()) return;
  std::vector<std::vector<Index>> sorted(groups.size() + 1);
  for (std::size_t t = 0; t < of_triangle.size(); ++t) {
    const Index group = of_triangle[t];
    std::vector<Index>& indices = sorted[group == kNoIndex ? groups.size() : static_cast<std::size_t>(group)];
    indices.insert(indices.end(), primitive.indices.begin() + static_cast<std::ptrdiff_t>(3 * t),
                   primitive.indices.begin() + static_cast<std::ptrdiff_t>(3 * t + 3));
  }
  primitive.indices.clear();
  for (std::size_t g = 0; g < sorted.size(); ++g) {
    if (sorted[g].empty()) continue;
    const bool is_group = g < groups.size();
    primitive.parts.push_back({is_group ? label_of(groups[g]) : "surface", is_group ? groups[g].number : 0,
                               primitive.indices.size(), sorted[g].size()});
    primitive.indices.insert(primitive.indices.end(), sorted[g].begin(), sorted[g].end());
  }
}

/// Triangles over shaded vertices.
ScenePrimitive shaded_primitive(const PolygonMesh& mesh, const ShadedPolygons& shaded) {
  // Triangulates the polygons with shaded vertices, so that the triangles refer to those.
  const PolygonMesh split{shaded.positions, mesh.face_offsets, shaded.corner_vertices, mesh.face_groups};
  ScenePrimitive primitive;
  primitive.positions = shaded.positions;
  primitive.normals = shaded.normals;
  const TriangleMesh triangles = triangulate(split);
  for (const auto& triangle : triangles.triangles)
    primitive.indices.insert(primitive.indices.end(), triangle.begin(), triangle.end());
  part_by_group(primitive, triangles.face_groups.groups, triangles.face_groups.of_face);
  return primitive;
}

/// The edges of polygons, once each, as pairs of shaded vertices.
Segments edges_of(const PolygonMesh& mesh, const ShadedPolygons& shaded) {
  Segments edges;
  std::set<std::pair<Index, Index>> drawn;
  for (std::size_t f = 0; f < mesh.num_faces(); ++f)
    for (std::size_t begin = mesh.face_offsets[f], end = mesh.face_offsets[f + 1], k = begin; k < end; ++k) {
      const std::size_t next = k + 1 < end ? k + 1 : begin;
      if (drawn.insert(std::minmax(mesh.face_vertices[k], mesh.face_vertices[next])).second)
        edges.push_back({shaded.corner_vertices[k], shaded.corner_vertices[next]});
    }
  return edges;
}

void color_by_quality(ScenePrimitive& surface, std::vector<double> vertex_quality) {
  surface.colors.reserve(vertex_quality.size());
  for (const double quality : vertex_quality) surface.colors.push_back(quality_color(quality));
  surface.attributes.push_back({"_SCALED_JACOBIAN", std::move(vertex_quality)});
}

Scene make_scene(ScenePrimitive surface, const Segments& wires, const SurfaceSceneOptions& options) {
  Scene scene{.name = options.name,
              .meters_per_unit = options.meters_per_unit,
              .up_axis = options.up_axis,
              .options = options.options,
              .quantize = options.quantize};
  const Eigen::AlignedBox3d box = bounding_box(surface.positions);
  if (!box.isEmpty()) scene.origin = box.center();
  if (!options.source.empty()) scene.extras.emplace_back("source", options.source);
  if (surface.colors.empty())
    surface.material_color = kPlainColor;
  else
    scene.extras.emplace_back("color_map", kQualityColorMap);
  ScenePrimitive wire = options.wireframe ? wire_primitive(surface.positions, wires) : ScenePrimitive{};
  scene.nodes.push_back({"surface", std::move(surface)});
  if (options.wireframe) scene.nodes.push_back({"wireframe", std::move(wire)});
  return scene;
}

/// The cell of a boundary face and the local numbers of the face's corners in it.
struct BoundaryFaceCell {
  Index cell;
  std::array<int, 4> corners;
};

std::vector<BoundaryFaceCell> boundary_face_cells(const VolumeMesh& mesh) {
  const MeshTopology topology(mesh);
  std::vector<BoundaryFaceCell> found;
  for (const Index f : topology.boundary_faces()) {
    BoundaryFaceCell entry{topology.face_cells(f)[0], {}};
    const auto cell = mesh.cell(entry.cell);
    const auto face = topology.face(f);
    for (std::size_t k = 0; k < face.size(); ++k)
      entry.corners[k] = static_cast<int>(std::find(cell.begin(), cell.end(), face[k]) - cell.begin());
    found.push_back(entry);
  }
  return found;
}

}  // namespace

double chord_length(const HighOrderPatches& patches, const SurfaceSceneOptions& options) {
  if (!(options.max_chord_percent > 0)) throw InputError("max_chord_percent: expected a positive number");
  return options.max_chord_percent / 100 * patches.bounding_box_diagonal();
}

double chord_length(const VolumeMesh& cage, const SurfaceSceneOptions& options) {
  if (!(options.max_chord_percent > 0)) throw InputError("max_chord_percent: expected a positive number");
  const BoundaryRefinement boundary = refine_boundary(cage, 0);
  return options.max_chord_percent / 100 * bounding_box(boundary.positions.apply(cage.positions)).diagonal().norm();
}

std::vector<double> patch_quality(const VolumeMesh& cage, const TessellatedSurface& surface,
                                  std::span<const double> finest_cell_minima) {
  const std::size_t num_cells = finest_cell_minima.size(), num_children = cage.cell_vertices.size();
  std::size_t per_child = 1;  // cells of the finest mesh below one child of the cage; 0: the finest mesh is the cage
                              // itself
  if (num_cells == cage.num_cells()) per_child = 0;
  while (per_child > 0 && num_children * per_child < num_cells) per_child *= 8;
  if (per_child > 0 && num_children * per_child != num_cells)
    throw InputError("finest: expected " + std::to_string(cage.num_cells()) + " cells, or " +
                     std::to_string(num_children) + " times a power of 8, got " + std::to_string(num_cells));
  const std::vector<BoundaryFaceCell> face_cells = boundary_face_cells(cage);
  std::vector<double> quality;
  for (const SurfacePatch& patch : surface.patches) {
    const BoundaryFaceCell& face = face_cells.at(patch.face);
    const std::size_t child = cage.cell_offsets[face.cell] + face.corners[patch.corner];
    const auto below = per_child > 0 ? finest_cell_minima.subspan(child * per_child, per_child)
                                     : finest_cell_minima.subspan(face.cell, 1);
    quality.push_back(*std::min_element(below.begin(), below.end()));
  }
  return quality;
}

Scene surface_scene(const TessellatedSurface& surface, std::span<const double> patch_quality,
                    const SurfaceSceneOptions& options) {
  if (!patch_quality.empty() && patch_quality.size() != surface.patches.size())
    throw InputError("patch_quality: expected one value per patch");
  ScenePrimitive primitive;
  primitive.positions = surface.positions;
  primitive.normals = surface.normals;
  for (const auto& [a, b, c, d] : surface.quads) primitive.indices.insert(primitive.indices.end(), {a, b, c, a, c, d});
  if (!options.face_groups.empty()) {
    std::vector<Index> of_triangle;
    for (const Index patch : surface.quad_patches)
      of_triangle.insert(of_triangle.end(), 2, options.face_groups.of_face.at(surface.patches[patch].face));
    part_by_group(primitive, options.face_groups.groups, of_triangle);
  }
  if (!patch_quality.empty()) {
    std::vector<double> quality(surface.positions.size(), 1);
    for (std::size_t q = 0; q < surface.quads.size(); ++q)
      for (const Index v : surface.quads[q]) quality[v] = std::min(quality[v], patch_quality[surface.quad_patches[q]]);
    color_by_quality(primitive, std::move(quality));
  }
  Scene scene = make_scene(std::move(primitive), surface.wireframe, options);
  scene.extras.emplace_back("chord_error", surface.chord_error);
  return scene;
}

Scene surface_scene(const VolumeMesh& cage, const VolumeMesh* finest, const SurfaceSceneOptions& options) {
  const TessellatedSurface surface = tessellate(cage, chord_length(cage, options));
  const QualityReport quality = measure_quality(finest ? *finest : cage);
  return surface_scene(surface, patch_quality(cage, surface, quality.cell_minima), options);
}

Scene surface_scene(const HighOrderMesh& mesh, std::span<const double> cell_minima,
                    const SurfaceSceneOptions& options) {
  if (!cell_minima.empty() && cell_minima.size() != mesh.space.num_cells())
    throw InputError("cell_minima: expected one value per cell");
  HighOrderPatches patches(mesh, options.crease_angle_degrees);
  const TessellatedSurface surface = tessellate(patches, chord_length(patches, options));
  std::vector<double> quality;
  const MeshTopology& topology = mesh.space.topology();
  if (!cell_minima.empty())
    for (const SurfacePatch& patch : surface.patches)
      quality.push_back(cell_minima[topology.face_cells(topology.boundary_faces()[patch.face])[0]]);
  return surface_scene(surface, quality, options);
}

CurvedBoundary curved_boundary(const HighOrderMesh& mesh, double max_chord_percent) {
  HighOrderPatches patches(mesh, 180);
  const double chord = chord_length(patches, {.max_chord_percent = max_chord_percent});
  const TessellatedSurface surface = tessellate(patches, chord);
  CurvedBoundary boundary{triangles_of(surface), {}, surface.chord_error};
  for (const Index patch : surface.quad_patches)
    boundary.faces.insert(boundary.faces.end(), 2, surface.patches[patch].face);
  return boundary;
}

Scene polygon_scene(const PolygonMesh& mesh, std::span<const double> face_quality, const SurfaceSceneOptions& options) {
  const ShadedPolygons shaded = shade_polygons(mesh, options.crease_angle_degrees);
  if (!face_quality.empty() && face_quality.size() != mesh.num_faces())
    throw InputError("face_quality: expected one value per face");
  ScenePrimitive primitive = shaded_primitive(mesh, shaded);
  std::vector<double> quality(shaded.positions.size(), 1);
  if (!face_quality.empty()) {
    for (std::size_t f = 0; f < mesh.num_faces(); ++f)
      for (std::size_t k = mesh.face_offsets[f]; k < mesh.face_offsets[f + 1]; ++k) {
        double& value = quality[shaded.corner_vertices[k]];
        value = std::min(value, face_quality[f]);
      }
    color_by_quality(primitive, std::move(quality));
  }
  return make_scene(std::move(primitive), edges_of(mesh, shaded), options);
}

Scene sheet_scene(std::span<const SceneSheet> sheets, const std::string& color_map,
                  const SurfaceSceneOptions& options) {
  if (sheets.empty()) throw InputError("sheet_scene: expected at least one sheet");
  Scene scene{.name = options.name,
              .meters_per_unit = options.meters_per_unit,
              .up_axis = options.up_axis,
              .options = options.options,
              .quantize = options.quantize};
  Eigen::AlignedBox3d box;
  ScenePrimitive wires = wire_primitive({}, {});
  for (const SceneSheet& sheet : sheets) {
    const ShadedPolygons shaded = shade_polygons(sheet.mesh, options.crease_angle_degrees);
    const auto by_shaded = [&](const std::vector<double>& values) {
      if (values.size() != sheet.mesh.positions.size())
        throw InputError(sheet.name + ": expected one value per vertex");
      std::vector<double> result(shaded.positions.size());
      for (std::size_t k = 0; k < shaded.corner_vertices.size(); ++k)
        result[shaded.corner_vertices[k]] = values[sheet.mesh.face_vertices[k]];
      return result;
    };
    ScenePrimitive primitive = shaded_primitive(sheet.mesh, shaded);
    if (sheet.shades.empty())
      primitive.material_color = kPlainColor;
    else
      for (const double shade : by_shaded(sheet.shades)) primitive.colors.push_back(quality_color(shade));
    if (!sheet.attribute.name.empty())
      primitive.attributes.push_back({sheet.attribute.name, by_shaded(sheet.attribute.values)});
    for (const Vec3& p : primitive.positions) box.extend(p);
    const ScenePrimitive wire = sheet.wires.empty() ? wire_primitive(shaded.positions, edges_of(sheet.mesh, shaded))
                                                    : wire_primitive(sheet.mesh.positions, sheet.wires);
    for (const Index v : wire.indices) wires.indices.push_back(static_cast<Index>(wires.positions.size()) + v);
    wires.positions.insert(wires.positions.end(), wire.positions.begin(), wire.positions.end());
    scene.nodes.push_back({sheet.name, std::move(primitive)});
  }
  scene.origin = box.center();
  if (!options.source.empty()) scene.extras.emplace_back("source", options.source);
  if (!color_map.empty()) scene.extras.emplace_back("color_map", color_map);
  if (options.wireframe) scene.nodes.push_back({"wireframe", std::move(wires)});
  return scene;
}

Scene boundary_scene(const VolumeMesh& mesh, const SurfaceSceneOptions& options) {
  const MeshTopology topology(mesh);
  const QualityReport quality = measure_quality(mesh);
  std::vector<double> face_quality;
  for (const Index f : topology.boundary_faces())
    face_quality.push_back(quality.cell_minima[topology.face_cells(f)[0]]);
  return polygon_scene(boundary_surface(mesh, topology, nullptr), face_quality, options);
}

}  // namespace subvol
