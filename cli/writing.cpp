// SPDX-License-Identifier: GPL-3.0-or-later
#include "cli/writing.h"

#include "cli/exit_status.h"
#include "cli/loading.h"
#include "export/export.h"
#include "export/gltf_writer.h"
#include "export/obj_writer.h"
#include "export/usd_writer.h"
#include "export/volume_writer.h"
#include "fit/quality.h"
#include "subvol/mesh_io.h"

namespace subvol::cli {
namespace {

SceneValue scene_value(const Json& value) {
  if (value.is_boolean()) return value.get<bool>();
  if (value.is_number()) return value.get<double>();
  return value.get<std::string>();
}

void write_cells(const Output& output, const VolumeMesh& mesh) {
  if (output.extension == ".vtu" || output.extension == ".msh") {
    write_volume(output.path, mesh, measure_quality(mesh).cell_minima);
  } else {
    write_volume_mesh(output.path, mesh);
  }
}

void write_polygons(const Output& output, const PolygonMesh& surface, const FeatureTags& tags,
                    const WritingOptions& options) {
  if (output.extension == ".obj") return write_obj(output.path, surface);
  const SurfaceSceneOptions scene = scene_options(output, options);
  write_usd(output.path, surface, tags, {.metres_per_unit = scene.metres_per_unit, .up_axis = scene.up_axis});
}

}  // namespace

SurfaceSceneOptions scene_options(const Output& output, const WritingOptions& options) {
  SurfaceSceneOptions scene{.name = output.path.stem().string(),
                            .max_chord_percent = options.chord_percent,
                            .metres_per_unit = options.metres_per_unit,
                            .up_axis = options.up_axis == "z" ? UpAxis::z : UpAxis::y,
                            .source = options.source.filename().string()};
  for (const auto& [key, value] : options.options.items()) scene.options.emplace_back(key, scene_value(value));
  return scene;
}

bool is_scene(const Output& output) { return output.extension == ".glb" || output.extension == ".gltf"; }

void add_writing_options(CLI::App& verb, WritingOptions& options) {
  const auto group = "Surfaces for DCC tools";
  verb.add_option("--chord", options.chord_percent,
                  "Largest distance between a limit surface and its triangles, in per cent of its box's diagonal")
      ->check(number_in(1e-4, 100.0))
      ->type_name("PERCENT")
      ->capture_default_str()
      ->group(group);
  verb.add_option("--unit", options.metres_per_unit, "Length of the mesh's unit")
      ->check(number_in(1e-12, 1e12))
      ->type_name("METRES")
      ->capture_default_str()
      ->group(group);
  verb.add_option("--up", options.up_axis, "Axis of the mesh that points up")
      ->check(CLI::IsMember({"y", "z"}))
      ->type_name("y|z")
      ->capture_default_str()
      ->group(group);
}

bool needs_limit(const Output& output) { return !output.cage && is_scene(output); }

void write_output(const Output& output, const VolumeMesh& cage, const VolumeMesh& mesh, const TessellatedSurface* limit,
                  const WritingOptions& options) {
  if (output.cage) return write_output(output, cage, options);
  if (!is_scene(output)) return write_output(output, mesh, options);
  const std::vector<double> quality = patch_quality(cage, *limit, measure_quality(mesh).cell_minima);
  write_gltf(output.path, surface_scene(*limit, quality, scene_options(output, options)));
}

void write_output(const Output& output, const VolumeMesh& mesh, const WritingOptions& options) {
  if (output.is_volume()) return write_cells(output, mesh);
  if (is_scene(output)) return write_gltf(output.path, boundary_scene(mesh, scene_options(output, options)));
  const TaggedPolygons boundary = tagged_polygons(mesh);
  write_polygons(output, boundary.polygons, boundary.tags, options);
}

void write_output(const Output& output, const PolygonMesh& surface, const WritingOptions& options) {
  if (output.is_volume()) throw UsageError(output.path.string() + ": this format holds cells, not surfaces");
  if (is_scene(output)) return write_gltf(output.path, polygon_scene(surface, {}, scene_options(output, options)));
  write_polygons(output, surface, {}, options);
}

TessellatedSurface tessellated_limit(const VolumeMesh& cage, const WritingOptions& options) {
  return tessellate(cage, chord_length(cage, {.max_chord_percent = options.chord_percent}));
}

TriangleMesh triangles_of(const TessellatedSurface& surface) {
  TriangleMesh mesh{surface.positions, {}};
  for (const auto& quad : surface.quads) {
    mesh.triangles.push_back({quad[0], quad[1], quad[2]});
    mesh.triangles.push_back({quad[0], quad[2], quad[3]});
  }
  return mesh;
}

}  // namespace subvol::cli
